#include "daemon/ctl/client.h"

#include <sys/socket.h>
#include <unistd.h>

#include "tests/component/api/api_bench.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

class Client : public api_bench::ApiBench {
 protected:
  static void nobody(std::uint64_t, std::uint64_t) {}
  static constexpr const char* kModel = "/api/v1/jobs/old/model";
  fs::path out() const { return folder_ / "copy.glb"; }
  /// Files beside the server's own.
  bool left_something() const {
    for (const auto& entry : fs::directory_iterator(folder_)) {
      if (entry.path().filename().string().starts_with("copy")) return true;
    }
    return false;
  }
};

TEST_F(Client, DownloadsAFileWholeAndTellsHowFarItIs) {
  serve();
  std::uint64_t last = 0, whole = 0;
  const auto done = ctl::download(options.socket, kModel, out(), [&](std::uint64_t bytes, std::uint64_t of) {
    EXPECT_GE(bytes, last);
    last = bytes;
    whole = of;
  });
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(*read_file(out()), "glTF" + std::string(300'000, 'x'));
  EXPECT_EQ(last, 300'004u);
  EXPECT_EQ(whole, 300'004u);
}

TEST_F(Client, OverwritesNothing) {
  serve();
  scan_samples::write_text(out(), "precious");
  const auto done = ctl::download(options.socket, kModel, out(), nobody);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().exit, ExitCode::bad_input);
  EXPECT_EQ(*read_file(out()), "precious");
}

TEST_F(Client, LeavesNothingWhereThereIsNoFile) {
  serve();
  const auto done = ctl::download(options.socket, "/api/v1/jobs/other/model", out(), nobody);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().exit, ExitCode::bad_input);
  EXPECT_THAT(done.error().message, HasSubstr("no job"));
  EXPECT_FALSE(left_something());
  const auto unwritable = ctl::download(options.socket, kModel, folder_ / "nowhere" / "x", nobody);
  ASSERT_FALSE(unwritable);
  EXPECT_EQ(unwritable.error().exit, ExitCode::disk);
}

TEST_F(Client, SaysThatNobodyAnswers) {
  const auto done = ctl::download(options.socket, kModel, out(), nobody);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().exit, ExitCode::unreachable);
  EXPECT_EQ(ctl::send_request(options.socket, "GET", "/api/v1/status").error().exit, ExitCode::unreachable);
}

TEST_F(Client, SendsABodyAndHearsWhy) {
  serve();
  const auto answer = ctl::send_request(options.socket, "POST", "/api/v1/maintenance/jog", R"({"by_deg": 5})");
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().exit, ExitCode::refused);
}

/// A stopped or hanging daemon: it listens, and sends nothing unless the test does.
class HangingDaemon : public Client {
 protected:
  void SetUp() override {
    Client::SetUp();
    listening = listen_on_socket(options.socket).value_or(-1);
    ASSERT_GE(listening, 0);
  }
  void TearDown() override {
    for (const int fd : waiting) ::close(fd);
    ::close(listening);
    Client::TearDown();
  }
  /// Connects until the kernel keeps no more connections for the daemon.
  void fill_the_backlog() {
    ASSERT_EQ(::listen(listening, 0), 0);
    for (auto one = connect_to_socket(options.socket, kSoon); one; one = connect_to_socket(options.socket, kSoon)) {
      waiting.push_back(*one);
      ASSERT_LT(waiting.size(), 100u);
    }
  }
  void expect_given_up(const std::string& method, const std::string& body = "") const {
    const auto answer = ctl::send_request(options.socket, method, "/api/v1/status", body, kSoon);
    ASSERT_FALSE(answer);
    EXPECT_EQ(answer.error().exit, ExitCode::unreachable);
    EXPECT_THAT(answer.error().message,
                AllOf(HasSubstr(options.socket.string()), HasSubstr("not responded within 0.2 s"),
                      HasSubstr("systemctl status scanrigd")));
  }
  static constexpr std::chrono::milliseconds kSoon{200};
  int listening = -1;
  std::vector<int> waiting;
};

TEST_F(HangingDaemon, ThatTakesTheRequestIsGivenUp) { expect_given_up("GET"); }

TEST_F(HangingDaemon, ThatTakesNoBytesIsGivenUp) { expect_given_up("POST", std::string(std::size_t{8} << 20, 'x')); }

TEST_F(HangingDaemon, ThatTakesNoConnectionIsGivenUp) {
  fill_the_backlog();
  expect_given_up("GET");
  EXPECT_EQ(listen_on_socket(options.socket).error().code, ErrorCode::refused) << "it still has its socket";
}

TEST_F(HangingDaemon, ThatSendsNoFileIsGivenUpAndLeavesNothing) {
  const auto done = ctl::download(options.socket, kModel, out(), nobody, kSoon);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().exit, ExitCode::unreachable);
  EXPECT_THAT(done.error().message, HasSubstr("not responded within 0.2 s"));
  EXPECT_FALSE(left_something());
}

TEST(ClientSegment, EscapesWhatWouldBeMoreThanAName) {
  EXPECT_EQ(ctl::segment("pose1/view 0.png"), "pose1%2Fview%200.png");
  EXPECT_EQ(ctl::segment("20261121-093000-1"), "20261121-093000-1");
}

}  // namespace
}  // namespace scanrig
