// The daemon under a changing configuration, and with sockets opened by another process, as systemd sees it.
#include <algorithm>
#include <atomic>
#include <fstream>
#include <thread>

#include "daemon/api/socket_file.h"
#include "tests/system/rig/rig_on_wires.h"
#include "tests/system/service/notify_listener.h"
#include "tests/unit/daemon/passed_socket.h"

namespace scanrig {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class Reload : public RigOnWires {
 protected:
  void start() { start(quick_daemon()); }
  void start(const std::vector<std::string>& program) {
    start_rig({"--scale", "0.1"});
    systemd_ = std::jthread([this](const std::stop_token& end) { listen(end); });
    ASSERT_TRUE(soon([&] { return listening_to_daemon_.load(); }));
    start_daemon(program);
  }
  /// Uses a scene that is made at once, at every start of the daemon: the built-in figurine takes seconds.
  std::vector<std::string> quick_daemon() const {
    const auto box = folder_ / "box.obj";
    std::ofstream(box) << "v 0 0 0\nv 0 0 60\nv 0 30 0\nv 0 30 60\nv 40 0 0\nv 40 0 60\nv 40 30 0\nv 40 30 60\n"
                          "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n";
    return {SCANRIGD_SIM_PROGRAM, "--scale", "0.1", "--object", box};
  }
  void configure(const std::string& more) const { std::ofstream(config(), std::ios::app) << more; }
  std::string config() const { return folder_ / "rig.toml"; }
  /// Messages to systemd since RELOADING=1, once they contain `words`.
  bool hears(const std::string& words) {
    return soon([&] {
      const std::lock_guard guard(mutex_);
      for (auto& message : std::exchange(heard_, {})) {
        if (message.starts_with("RELOADING=1")) since_.clear();
        since_.push_back(std::move(message));
      }
      return std::ranges::any_of(since_, [&](const auto& message) { return message.find(words) != message.npos; });
    });
  }
  /// Waits until the daemon is ready, or ready again.
  bool reload() {
    if (!hears("READY=1")) return false;
    since_.clear();
    daemon_->signal(SIGHUP);
    return hears("READY=1");
  }
  /// Message with READY=1.
  std::string ready() const {
    const auto found = std::ranges::find_if(since_, [](const auto& one) { return one.find("READY=1") != one.npos; });
    return found == since_.end() ? std::string() : *found;
  }
  int queue(const std::string& recipe) {
    return Process({SCANRIG_PROGRAM, "queue", "--recipe", recipe, "--socket", socket()}, folder_ / "output").wait();
  }
  int ask_for_reload() {
    const int code = Process({SCANRIG_PROGRAM, "reload", "--socket", socket()}, folder_ / "output").wait();
    output_ = *read_file(folder_ / "output");
    return code;
  }
  std::string socket() const { return folder_ / "api.sock"; }
  /// Configuration that make-safe would use.
  std::string kept() const { return read_file(folder_ / "rig.running/rig.toml").value_or(""); }

  /// Listens all the time; otherwise the daemon would have to wait for a listener.
  void listen(const std::stop_token& end) {
    Listener listener;
    listening_to_daemon_ = true;
    while (!end.stop_requested()) {
      for (auto& message : listener.heard()) {
        const std::lock_guard guard(mutex_);
        heard_.push_back(std::move(message));
      }
      clock_.sleep_for(std::chrono::milliseconds(2));
    }
  }

  std::atomic<bool> listening_to_daemon_ = false;
  std::mutex mutex_;
  std::vector<std::string> heard_;
  std::vector<std::string> since_;
  std::jthread systemd_;
};

constexpr const char* kQuick = "\n[recipe.quick]\nviews = 3\nposes = 1\nflip_timeout_min = 30\n";

TEST_F(Reload, WhileIdleTheNewConfigurationIsTakenAndTheStationWaitsForReset) {
  start();
  ASSERT_TRUE(press_until("reset", [&] { return machine() == "Operational.Ready"; })) << log();
  ASSERT_EQ(queue("quick"), 3) << "there is no such recipe yet";
  EXPECT_THAT(kept(), Not(HasSubstr(kQuick)));
  configure(kQuick);
  ASSERT_TRUE(reload()) << log();
  EXPECT_EQ(kept(), read_file(config()));
  EXPECT_THAT(since_.front(), testing::MatchesRegex("RELOADING=1\nMONOTONIC_USEC=[0-9]+\n.*"));
  EXPECT_THAT(ready(), StartsWith("WATCHDOG=1\nREADY=1"));
  for (const auto& message : since_) EXPECT_THAT(message, Not(HasSubstr("STOPPING=1")));
  EXPECT_TRUE(soon([&] { return machine() == "Halted" && next_action() == "Press Reset."; })) << log();
  EXPECT_EQ(queue("quick"), 0) << *read_file(folder_ / "output");
  EXPECT_THAT(log(), HasSubstr("The new configuration is valid"));
  daemon_->signal(SIGTERM);
  EXPECT_EQ(daemon_->wait(), 0) << log();
  EXPECT_TRUE(hears("STOPPING=1"));
}

TEST_F(Reload, OverTheApiItIsTheSame) {
  start();
  configure(kQuick);
  EXPECT_EQ(ask_for_reload(), 0) << output_;
  EXPECT_TRUE(soon([&] { return queue("quick") == 0; })) << log();
}

TEST_F(Reload, AFileThatIsNotValidChangesNothing) {
  start();
  configure("\n[recipe.quick]\nviews = 0\nno_such_key = 1\n");
  ASSERT_TRUE(reload()) << log();
  EXPECT_THAT(ready(), HasSubstr("STATUS=Reload refused, configuration unchanged: "));
  EXPECT_THAT(ready(), HasSubstr("no_such_key"));
  EXPECT_EQ(std::ranges::count(ready(), '\n'), 1) << "one sentence: " << ready();
  EXPECT_THAT(kept(), Not(HasSubstr("no_such_key")));
  EXPECT_EQ(ask_for_reload(), 3);
  EXPECT_THAT(output_, HasSubstr("no_such_key"));
  EXPECT_EQ(queue("quick"), 3);
  EXPECT_EQ(queue("default"), 0) << *read_file(folder_ / "output");
  EXPECT_THAT(log(), HasSubstr("warning: Reload refused"));
}

TEST_F(Reload, WhileItScansItIsRefusedAndTheJobGoesOn) {
  start();
  ASSERT_TRUE(press_until("reset", [&] { return machine() == "Operational.Ready"; })) << log();
  ASSERT_TRUE(press_until("start", [&] { return machine() == "Operational.SingleExecution"; })) << log();
  configure(kQuick);
  ASSERT_TRUE(reload()) << log();
  EXPECT_THAT(ready(), HasSubstr("STATUS=Reload refused, configuration unchanged: "));
  EXPECT_EQ(ask_for_reload(), 6);
  EXPECT_THAT(output_, HasSubstr("Operational.SingleExecution"));
  EXPECT_TRUE(soon([&] { return jobs().at(0)["stored"] == 4; })) << log();
}

TEST_F(Reload, AConfigurationThatTurnsOutToBeOfNoUseIsGivenUpForTheOneBefore) {
  start();
  auto text = *read_file(config());
  const std::string api = "[api]\n";
  ASSERT_NE(text.find(api), text.npos);
  std::ofstream(config()) << text.replace(text.find(api), api.size(), api + "operator_group = \"no-such-group\"\n")
                          << kQuick;
  ASSERT_TRUE(reload()) << log();
  EXPECT_TRUE(soon([&] { return machine() == "Halted" && next_action() == "Press Reset."; })) << log();
  EXPECT_THAT(log(), HasSubstr("New configuration failed, old one restored: "));
  EXPECT_THAT(log(), HasSubstr("no-such-group"));
  EXPECT_EQ(queue("quick"), 3) << "all of the old one";
  EXPECT_THAT(kept(), StartsWith("#"));
  EXPECT_THAT(kept(), Not(HasSubstr("no-such-group")));
}

/// The daemon, started like by systemd with scanrigd.socket.
class PassedSocket : public Reload {
 protected:
  void SetUp() override {
    Reload::SetUp();
    listening_ = make_passed_socket(socket());
    ASSERT_GE(listening_, 0);
  }
  void TearDown() override {
    Reload::TearDown();
    ::close(listening_);
  }
  /// The descriptor 3 is for the process that LISTEN_PID names [sd_listen_fds(3)].
  std::vector<std::string> with_socket(const std::string& name) const {
    std::vector<std::string> command{
        "/bin/sh", "-c",
        fmt::format("exec 3<&{}; LISTEN_PID=$$ LISTEN_FDS=1 LISTEN_FDNAMES={} exec \"$@\"", inherited_, name), "sh"};
    for (auto& word : quick_daemon()) command.push_back(std::move(word));
    return command;
  }
  std::uint64_t file() const {
    struct stat status {};
    return ::stat(socket().c_str(), &status) == 0 ? status.st_ino : 0;
  }
  int listening_ = -1;
  const int inherited_ = 9;
};

TEST_F(PassedSocket, IsServedOutlivesAReloadDuringWhichClientsWaitAndTheDaemon) {
  ASSERT_EQ(::dup2(listening_, inherited_), inherited_);  // without O_CLOEXEC
  const auto before = file();
  start(with_socket("api"));
  ::close(inherited_);
  EXPECT_EQ(file(), before) << "the daemon made no socket of its own";

  std::atomic<bool> over = false;
  int connected = 0, refused = 0;
  std::thread clients([&] {
    while (!over) {
      const auto client = connect_to_socket(socket());
      ++(client ? connected : refused);
      if (client) ::close(*client);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  configure(kQuick);
  const bool done = reload();
  over = true;
  clients.join();
  ASSERT_TRUE(done) << log();
  EXPECT_GT(connected, 0);
  EXPECT_EQ(refused, 0);
  EXPECT_EQ(queue("quick"), 0) << *read_file(folder_ / "output");

  daemon_->signal(SIGTERM);
  EXPECT_EQ(daemon_->wait(), 0) << log();
  EXPECT_EQ(file(), before);
  const auto waiting = connect_to_socket(socket());
  EXPECT_TRUE(waiting) << "for the daemon that comes next";
  if (waiting) ::close(*waiting);
}

}  // namespace
}  // namespace scanrig
