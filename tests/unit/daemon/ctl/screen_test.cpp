#include "daemon/ctl/watch.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <memory>

namespace scanrig::ctl {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(Screen, LinesGoOnBelowWhereTheWindowIsNarrow) {
  EXPECT_THAT(fitted({"next: close the guard", "ab", ""}, {.width = 12, .height = 9}),
              ElementsAre("next: close", "  the guard", "ab", ""));
  EXPECT_THAT(fitted({"  model /a/very/long"}, {.width = 10, .height = 9}),
              ElementsAre("  model", "    /a/ver", "    y/long"));
  EXPECT_THAT(fitted({"abcdef"}, {.width = 4, .height = 2}), ElementsAre("abcd", "  ef"));
  EXPECT_THAT(fitted({"\xc3\xa4\xc3\xb6\xc3\xbc"}, {.width = 2, .height = 3}),
              ElementsAre("\xc3\xa4\xc3\xb6", " \xc3\xbc"))
      << "letters are not torn";
  for (int width = 1; width < 20; ++width) {
    for (const auto& line : fitted({"      much further in than that", "x y z"}, {.width = width, .height = 99})) {
      EXPECT_LE(line.size(), static_cast<std::size_t>(width)) << line;
    }
  }
}

TEST(Screen, SaysHowManyLinesAreMissing) {
  EXPECT_THAT(fitted({"1", "2", "3", "4"}, {.width = 80, .height = 3}), ElementsAre("1", "2", "(2 more lines)"));
}

/// A terminal whose other end the test reads.
class Terminal : public testing::Test {
 protected:
  void SetUp() override {
    master = ::posix_openpt(O_RDWR | O_NOCTTY);
    ASSERT_GE(master, 0);
    ASSERT_EQ(::grantpt(master), 0);
    ASSERT_EQ(::unlockpt(master), 0);
    out.reset(std::fopen(::ptsname(master), "w"));
    ASSERT_TRUE(out);
    const winsize size{.ws_row = 3, .ws_col = 10, .ws_xpixel = 0, .ws_ypixel = 0};
    ::ioctl(master, TIOCSWINSZ, &size);
    termios raw{};
    ::tcgetattr(::fileno(out.get()), &raw);
    ::cfmakeraw(&raw);
    ::tcsetattr(::fileno(out.get()), TCSANOW, &raw);
  }
  void TearDown() override { ::close(master); }
  /// New output since the last read; the kernel hands it over soon after it was written.
  std::string seen() const {
    std::string text;
    std::array<char, 4096> room{};
    for (pollfd watched{master, POLLIN, 0}; ::poll(&watched, 1, 100) == 1 && (watched.revents & POLLIN) != 0;) {
      const auto got = ::read(master, room.data(), room.size());
      if (got <= 0) break;
      text.append(room.data(), static_cast<std::size_t>(got));
    }
    return text;
  }
  int master = -1;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> out{nullptr, std::fclose};
};

TEST_F(Terminal, IsDrawnOverWithoutBeingErasedFirst) {
  ::setenv("TERM", "xterm", 1);
  Screen screen(out.get());
  EXPECT_THAT(seen(), HasSubstr("\x1b[?1049h"));
  screen.show({"one", "two"});
  const auto first = seen();
  EXPECT_EQ(first, "\x1b[Hone\x1b[K\r\ntwo\x1b[K\x1b[J");
  EXPECT_THAT(first, Not(HasSubstr("\x1b[2J")));
  screen.show({"one", "two"});
  EXPECT_EQ(seen(), "") << "nothing is different";
  screen.show({"one", "three"});
  EXPECT_THAT(seen(), StartsWith("\x1b[Hone"));
}

TEST_F(Terminal, ALineThatFillsTheWindowKeepsItsLastLetter) {
  ::setenv("TERM", "xterm", 1);
  Screen screen(out.get());
  seen();
  screen.show({"0123456789", "ab"});
  EXPECT_EQ(seen(), "\x1b[H0123456789\r\nab\x1b[K\x1b[J");
}

TEST_F(Terminal, IsLeftAsItWas) {
  ::setenv("TERM", "xterm", 1);
  { const Screen screen(out.get()); }
  EXPECT_THAT(seen(), testing::EndsWith("\x1b[?25h\x1b[?1049l"));
}

TEST_F(Terminal, ADumbOneGetsTheLinesThatChange) {
  ::setenv("TERM", "dumb", 1);
  {
    Screen screen(out.get());
    screen.show({"one", "two"});
    screen.show({"one", "two"});
    screen.show({"one", "three"});
  }
  EXPECT_EQ(seen(), "one\ntwo\nthree\n");
}

}  // namespace
}  // namespace scanrig::ctl
