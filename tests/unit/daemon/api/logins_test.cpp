#include "daemon/api/logins.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include "core/files.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

using std::chrono::hours;
using std::chrono::minutes;
using std::chrono::seconds;
using testing::HasSubstr;
using testing::Not;

class LoginsTest : public scan_samples::FolderTest {
 protected:
  std::filesystem::path path() const { return folder_ / "logins.json"; }
  const LoginSource tablet{.token = "tablet", .proof = "ab", .role = Role::operating};
  const Logins::Time now = std::chrono::system_clock::now();
};

TEST_F(LoginsTest, ACookieStandsForItsSourceAlsoAfterARestart) {
  std::string cookie;
  {
    Logins logins(path());
    cookie = *logins.begin(tablet, now);
    EXPECT_EQ(logins.find(cookie, now), tablet);
    EXPECT_FALSE(logins.find(cookie + "0", now));
    EXPECT_FALSE(logins.find("", now));
  }
  EXPECT_THAT(*read_file(path()), Not(HasSubstr(cookie)));
  struct stat status {};
  ASSERT_EQ(::stat(path().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600u);
  Logins restarted(path());
  EXPECT_EQ(restarted.find(cookie, now), tablet);
  ASSERT_TRUE(restarted.end(cookie));
  EXPECT_FALSE(Logins(path()).find(cookie, now));
}

TEST_F(LoginsTest, AFileThatOthersCanReadOrThatIsBrokenLogsNobodyIn) {
  const auto cookie = *Logins(path()).begin(tablet, now);
  ::chmod(path().c_str(), 0644);
  EXPECT_FALSE(Logins(path()).find(cookie, now));
  for (const auto* text : {"", "[]", "{\"format\":\"scanrig-logins\",\"version\":1,\"logins\":[1,{}]}"}) {
    scan_samples::write_text(path(), text);
    ::chmod(path().c_str(), 0600);
    EXPECT_FALSE(Logins(path()).find(cookie, now));
  }
}

TEST_F(LoginsTest, WhoDoesNothingForTwelveHoursOnlyLooks) {
  Logins logins("");
  const auto cookie = *logins.begin(tablet, now);
  EXPECT_EQ(logins.find(cookie, now + hours(11))->role, Role::operating);
  EXPECT_EQ(logins.find(cookie, now + hours(22))->role, Role::operating) << "counted from the last request";
  EXPECT_EQ(logins.find(cookie, now + hours(35))->role, Role::viewer);
  EXPECT_EQ(logins.find(cookie, now + hours(36))->role, Role::viewer) << "looking does not bring it back";
  auto kiosk = tablet;
  kiosk.kiosk = true;
  const auto screen = *logins.begin(kiosk, now);
  EXPECT_EQ(logins.find(screen, now + hours(100))->role, Role::operating);
}

TEST_F(LoginsTest, ALoginEndsAfterThirtyDaysAndIsVoidBeforeItsTime) {
  Logins logins("");
  auto kiosk = tablet;
  kiosk.kiosk = true;
  const auto cookie = *logins.begin(kiosk, now);
  EXPECT_TRUE(logins.find(cookie, now + hours(24 * 29)));
  EXPECT_FALSE(logins.find(cookie, now + hours(24 * 31)));
  EXPECT_FALSE(logins.find(cookie, now - hours(48))) << "the clock was set back";
}

TEST_F(LoginsTest, ACodeCountsOnceAndForTwoMinutes) {
  Logins logins("");
  const auto code = *logins.offer_code(tablet, now);
  EXPECT_EQ(code.size(), 8u);
  EXPECT_FALSE(logins.take_code("AAAAAAAA", now));
  EXPECT_EQ(logins.take_code(code, now + seconds(119)), tablet);
  EXPECT_FALSE(logins.take_code(code, now));
  const auto late = *logins.offer_code(tablet, now);
  EXPECT_FALSE(logins.take_code(late, now + seconds(121)));
}

TEST_F(LoginsTest, CodesAndLoginsAreLimitedInNumber) {
  Logins logins("");
  for (int i = 0; i < 32; ++i) ASSERT_TRUE(logins.offer_code(tablet, now));
  EXPECT_EQ(logins.offer_code(tablet, now).error().code, ErrorCode::busy);
  EXPECT_TRUE(logins.offer_code(tablet, now + minutes(3)));
  const auto oldest = *logins.begin(tablet, now);
  for (int i = 1; i <= 256; ++i) ASSERT_TRUE(logins.begin(tablet, now + seconds(i)));
  EXPECT_FALSE(logins.find(oldest, now + minutes(5)));
}

TEST_F(LoginsTest, TenTriesAMinuteFromOneAddress) {
  Logins logins("");
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(logins.may_try("192.0.2.1", now));
  EXPECT_FALSE(logins.may_try("192.0.2.1", now));
  EXPECT_TRUE(logins.may_try("192.0.2.2", now));
  EXPECT_TRUE(logins.may_try("192.0.2.1", now + seconds(61)));
}

}  // namespace
}  // namespace scanrig
