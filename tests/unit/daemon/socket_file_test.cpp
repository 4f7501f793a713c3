#include "daemon/api/socket_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include "tests/unit/daemon/passed_socket.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

class SocketFile : public scan_samples::FolderTest {
 protected:
  fs::path path() const { return folder_ / "api.sock"; }
};

TEST_F(SocketFile, HasMode0660AndAnswers) {
  const auto listening = listen_on_socket(path());
  ASSERT_TRUE(listening) << listening.error().message;
  struct stat status {};
  ASSERT_EQ(::stat(path().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0660u);
  const auto connected = connect_to_socket(path());
  ASSERT_TRUE(connected);
  ::close(*connected);
  ::close(*listening);
}

TEST_F(SocketFile, APassedOneIsSharedAndGetsTheMode) {
  const int passed = make_passed_socket(path());
  ASSERT_GE(passed, 0);
  EXPECT_EQ(socket_path(passed), path());
  const auto own = take_over_socket(passed, 0660);
  ASSERT_TRUE(own) << own.error().message;
  struct stat status {};
  ASSERT_EQ(::stat(path().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0660u);
  ::close(*own);
  const auto connected = connect_to_socket(path());
  EXPECT_TRUE(connected) << "the passed one still listens";
  if (connected) ::close(*connected);
  fs::remove(path());
  EXPECT_EQ(take_over_socket(passed, 0660).error().code, ErrorCode::io) << "its file has gone";
  ::close(passed);
}

TEST_F(SocketFile, AStaleSocketIsReplaced) {
  ::close(*listen_on_socket(path()));
  ASSERT_TRUE(fs::exists(path()));
  EXPECT_EQ(connect_to_socket(path()).error().code, ErrorCode::not_found);
  const auto listening = listen_on_socket(path());
  ASSERT_TRUE(listening) << listening.error().message;
  ::close(*listening);
}

TEST_F(SocketFile, ADaemonThatAnswersKeepsItsSocket) {
  const auto first = listen_on_socket(path());
  ASSERT_TRUE(first);
  const auto second = listen_on_socket(path());
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::refused);
  const auto connected = connect_to_socket(path());
  EXPECT_TRUE(connected) << "the first is still there";
  ::close(*connected);
  ::close(*first);
}

TEST_F(SocketFile, AFileThatIsNoSocketIsLeftAlone) {
  scan_samples::write_text(path(), "precious");
  const auto listening = listen_on_socket(path());
  ASSERT_FALSE(listening);
  EXPECT_EQ(listening.error().code, ErrorCode::exists);
  EXPECT_EQ(*read_file(path()), "precious");
}

TEST_F(SocketFile, APathTooLongForASocketIsRefused) {
  const auto listening = listen_on_socket(folder_ / std::string(120, 'x'));
  ASSERT_FALSE(listening);
  EXPECT_EQ(listening.error().code, ErrorCode::invalid_input);
}

TEST_F(SocketFile, NobodyThereIsNotFound) { EXPECT_EQ(connect_to_socket(path()).error().code, ErrorCode::not_found); }

TEST_F(SocketFile, AFolderThatCannotBeMadeIsAnIoError) {
  scan_samples::write_text(folder_ / "file", "");
  EXPECT_EQ(listen_on_socket(folder_ / "file/api.sock").error().code, ErrorCode::io);
}

}  // namespace
}  // namespace scanrig
