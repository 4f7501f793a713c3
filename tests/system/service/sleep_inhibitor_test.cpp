// The lock against sleep, with a bus of the test's own and a logind that is a thread of the test.
#include "daemon/service/systemd.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <systemd/sd-bus.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <mutex>
#include <optional>
#include <thread>

#include "core/clock.h"
#include "tests/own_folder.h"
#include "tests/slowness.h"
#include "tests/system/daemon/process.h"

namespace scanrig {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

const char* const kBusProgram = "/usr/bin/dbus-daemon";

/// Whether a bus listens at a socket: its file is there a moment before.
bool accepts(const std::filesystem::path& path) {
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  path.string().copy(address.sun_path, sizeof(address.sun_path) - 1);
  const int socket = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const bool is_connected = ::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  ::close(socket);
  return is_connected;
}

/// org.freedesktop.login1 as far as Inhibit: each lock is the write end of a pipe.
class Logind {
 public:
  explicit Logind(const std::string& address) {
    ::sd_bus_new(&bus_);
    ::sd_bus_set_address(bus_, address.c_str());
    ::sd_bus_set_bus_client(bus_, 1);
    EXPECT_GE(::sd_bus_start(bus_), 0);
    EXPECT_GE(::sd_bus_add_object(bus_, nullptr, "/org/freedesktop/login1", &Logind::handle, this), 0);
    EXPECT_GE(::sd_bus_request_name(bus_, "org.freedesktop.login1", 0), 0);
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        if (::sd_bus_process(bus_, nullptr) > 0) continue;
        ::sd_bus_wait(bus_, 20'000);
      }
    });
  }
  ~Logind() {
    thread_.request_stop();
    thread_.join();
    if (watched_ >= 0) ::close(watched_.load());
    ::sd_bus_close_unref(bus_);
  }

  std::atomic<bool> refuses = false, is_silent = false;
  std::atomic<int> taken = 0;
  /// "WHAT MODE" of the last lock.
  [[nodiscard]] std::string asked() const {
    const std::scoped_lock lock(mutex_);
    return asked_;
  }
  /// True while the lock that was given last is held.
  [[nodiscard]] bool is_held() const {
    pollfd end{watched_.load(), POLLIN, 0};
    return watched_ >= 0 && ::poll(&end, 1, 0) == 0;
  }

 private:
  static int handle(sd_bus_message* call, void* self, sd_bus_error* error) {
    if (::sd_bus_message_is_method_call(call, "org.freedesktop.login1.Manager", "Inhibit") <= 0) return 0;
    auto& logind = *static_cast<Logind*>(self);
    const char *what = nullptr, *who = nullptr, *why = nullptr, *mode = nullptr;
    ::sd_bus_message_read(call, "ssss", &what, &who, &why, &mode);
    if (logind.refuses) return ::sd_bus_error_set(error, SD_BUS_ERROR_ACCESS_DENIED, "Permission denied");
    if (logind.is_silent) return 1;
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return -errno;
    {
      const std::scoped_lock lock(logind.mutex_);
      logind.asked_ = fmt::format("{} {}", what, mode);
    }
    if (const int before = logind.watched_.exchange(ends[0]); before >= 0) ::close(before);
    ++logind.taken;
    const int replied = ::sd_bus_reply_method_return(call, "h", ends[1]);
    ::close(ends[1]);
    return replied;
  }

  sd_bus* bus_ = nullptr;
  std::atomic<int> watched_ = -1;
  mutable std::mutex mutex_;
  std::string asked_;  // guarded by mutex_
  std::jthread thread_;
};

class Sleep : public testing::Test {
 protected:
  void SetUp() override {
    if (::access(kBusProgram, X_OK) != 0) GTEST_SKIP() << kBusProgram << " is not installed here";
    std::filesystem::create_directories(folder_);
    ::setenv("DBUS_SYSTEM_BUS_ADDRESS", address_.c_str(), 1);
  }
  void TearDown() override {
    ::unsetenv("DBUS_SYSTEM_BUS_ADDRESS");
    bus_.reset();
    std::filesystem::remove_all(folder_);
  }
  void start_bus() {
    bus_.emplace(std::vector<std::string>{kBusProgram, "--session", "--nofork", "--nopidfile", "--address=" + address_},
                 folder_ / "bus.log");
    ASSERT_TRUE(soon([&] { return accepts(folder_ / "bus"); }));
  }
  template <class Ready>
  bool soon(const Ready& ready) {
    for (const auto by = Deadline::after(clock_, kSlowness * std::chrono::seconds(20)); !by.expired(clock_);
         clock_.sleep_for(milliseconds(5))) {
      if (ready()) return true;
    }
    return false;
  }
  auto note() {
    return [this](const std::string& problem) {
      const std::scoped_lock lock(mutex_);
      problems_.push_back(problem);
    };
  }
  std::vector<std::string> problems() {
    const std::scoped_lock lock(mutex_);
    return problems_;
  }

  RealClock clock_;
  const std::filesystem::path folder_ = own_folder("sleep_");
  const std::string address_ = "unix:path=" + (folder_ / "bus").string();
  std::optional<Process> bus_;
  std::mutex mutex_;
  std::vector<std::string> problems_;
};

TEST_F(Sleep, IsBlockedFromTheBeginOfAJobToItsEnd) {
  start_bus();
  Logind logind(address_);
  SleepInhibitor inhibitor(note());
  EXPECT_FALSE(logind.is_held());
  for (int job = 1; job <= 2; ++job) {
    inhibitor.keep_awake(true);
    inhibitor.keep_awake(true);
    ASSERT_TRUE(soon([&] { return inhibitor.is_settled(); }));
    EXPECT_TRUE(logind.is_held());
    EXPECT_EQ(logind.taken, job);
    EXPECT_EQ(logind.asked(), "sleep:idle block");
    inhibitor.keep_awake(false);
    EXPECT_TRUE(soon([&] { return !logind.is_held(); }));
  }
  EXPECT_TRUE(problems().empty());
}

TEST_F(Sleep, IsFreeAgainWhenTheServiceEnds) {
  start_bus();
  Logind logind(address_);
  {
    SleepInhibitor inhibitor(note());
    inhibitor.keep_awake(true);
    ASSERT_TRUE(soon([&] { return logind.is_held(); }));
  }
  EXPECT_FALSE(logind.is_held());
}

TEST_F(Sleep, WithoutABusIsReportedOnce) {
  SleepInhibitor inhibitor(note());
  for (int i = 0; i < 2; ++i) {
    inhibitor.keep_awake(true);
    ASSERT_TRUE(soon([&] { return inhibitor.is_settled(); }));
    inhibitor.keep_awake(false);
    ASSERT_TRUE(soon([&] { return inhibitor.is_settled(); }));
  }
  ASSERT_EQ(problems().size(), 1u);
  EXPECT_THAT(problems()[0], HasSubstr("Sleep is not blocked during jobs"));
}

TEST_F(Sleep, ThatLogindRefusesToBlockIsReportedInItsWords) {
  start_bus();
  Logind logind(address_);
  logind.refuses = true;
  SleepInhibitor inhibitor(note());
  inhibitor.keep_awake(true);
  ASSERT_TRUE(soon([&] { return problems().size() == 1; }));
  EXPECT_THAT(problems()[0], HasSubstr("Permission denied"));
}

TEST_F(Sleep, ALogindThatDoesNotReplyHoldsNobodyUpForLong) {
  start_bus();
  Logind logind(address_);
  logind.is_silent = true;
  const auto begin = clock_.now();
  {
    SleepInhibitor inhibitor(note(), {.reply_timeout = milliseconds(100)});
    inhibitor.keep_awake(true);
    ASSERT_TRUE(soon([&] { return problems().size() == 1; }));
  }
  EXPECT_LT(clock_.now() - begin, kSlowness * std::chrono::seconds(5));
}

}  // namespace
}  // namespace scanrig
