// Files left by a crash: the crash is that of a child of the test.
#include "daemon/service/crash_report.h"

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <thread>

#include "core/files.h"
#include "tests/own_folder.h"

namespace scanrig {
namespace {

using testing::AllOf;
using testing::HasSubstr;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

class CrashReport : public testing::Test {
 protected:
  void SetUp() override {
    if (kSanitized) GTEST_SKIP() << "a sanitizer has reports of its own";
    std::filesystem::remove_all(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  /// Signal that ended a child which does this after the folder for reports was set.
  template <class Crash>
  int crash(const Crash& crash) const {
    const pid_t child = ::fork();
    if (child == 0) {
      const rlimit none{0, 0};
      ::setrlimit(RLIMIT_CORE, &none);
      report_crashes_to(reports_);
      crash();
      ::_exit(0);
    }
    int status = 0;
    EXPECT_EQ(::waitpid(child, &status, 0), child);
    return WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  }
  [[nodiscard]] std::vector<std::filesystem::path> reports() const {
    std::vector<std::filesystem::path> all;
    for (const auto& entry : std::filesystem::directory_iterator(reports_)) all.push_back(entry.path());
    std::ranges::sort(all);
    return all;
  }

  const std::filesystem::path folder_ = own_folder("crash_");
  const std::filesystem::path reports_ = folder_ / "crash";
};

TEST_F(CrashReport, NamesTheSignalAndTheWayToIt) {
  EXPECT_EQ(crash([] { ::raise(SIGSEGV); }), SIGSEGV) << "ended as it would have been without a report";
  ASSERT_EQ(reports().size(), 1u);
  const auto text = *read_file(reports()[0]);
  EXPECT_THAT(text, AllOf(HasSubstr("SIGSEGV"), HasSubstr("version "), HasSubstr("service_test("))) << text;
  EXPECT_EQ(reports()[0].extension(), ".txt");
}

TEST_F(CrashReport, IsWrittenForABadReadAnAbortAndAnotherThread) {
  EXPECT_EQ(crash([] {
              volatile int* nowhere = nullptr;
              *nowhere = 1;
            }),
            SIGSEGV);
  EXPECT_EQ(crash([] { std::abort(); }), SIGABRT);
  EXPECT_EQ(crash([] { std::thread([] { std::terminate(); }).join(); }), SIGABRT);
  EXPECT_EQ(reports().size(), 3u);
}

TEST_F(CrashReport, OnlyTheNewestFiveAreKept) {
  std::filesystem::create_directories(reports_);
  for (int i = 0; i < 8; ++i) std::ofstream(reports_ / fmt::format("100000000{}-1.txt", i)) << i;
  std::ofstream(reports_ / "notes.md") << "not a report";
  EXPECT_EQ(crash([] { std::abort(); }), SIGABRT);
  const auto left = reports();
  ASSERT_EQ(left.size(), 6u);
  EXPECT_EQ(left[0].filename(), "1000000004-1.txt");
  EXPECT_EQ(left[5].filename(), "notes.md");
}

TEST_F(CrashReport, WithoutAFolderTheCrashIsWhatItWas) {
  std::filesystem::create_directories(folder_);
  std::ofstream(reports_) << "a file where the folder should be";
  EXPECT_EQ(crash([] { std::abort(); }), SIGABRT);
}

TEST(CrashFolder, IsThatOfTheServicesStateOrBesideTheJobs) {
  ::setenv("STATE_DIRECTORY", "/var/lib/scanrig:/var/lib/other", 1);
  EXPECT_EQ(crash_folder("/data/jobs"), "/var/lib/scanrig/crash");
  ::unsetenv("STATE_DIRECTORY");
  EXPECT_EQ(crash_folder("/data/jobs"), "/data/jobs/.state/crash");
  EXPECT_EQ(crash_folder("/data/jobs/"), "/data/jobs/.state/crash");
}

}  // namespace
}  // namespace scanrig
