#include "daemon/jobs/job_files.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "core/files.h"
#include "daemon/jobs/bundle.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class JobLog : public scan_samples::FolderTest {
 protected:
  Result<void> append(const JournalEntry& entry) const {
    return append_job_log(folder_, entry, std::chrono::sys_days(std::chrono::days(20'000)));
  }
  [[nodiscard]] std::vector<nlohmann::json> lines() const {
    std::vector<nlohmann::json> all;
    std::istringstream text(*read_file(job_log_file(folder_)));
    for (std::string line; std::getline(text, line);) all.push_back(nlohmann::json::parse(line));
    return all;
  }
};

TEST_F(JobLog, HoldsOneObjectPerEntry) {
  ASSERT_TRUE(append({.priority = Priority::info, .message = "Stored.", .job = "job", .pose = 0, .view = 3}));
  ASSERT_TRUE(append({.priority = Priority::error, .message = "\xff lost\n", .job = "job", .device = "camera"}));
  const auto all = lines();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0],
            nlohmann::json::parse(
                R"({"time": "2024-10-04T00:00:00Z", "priority": 6, "message": "Stored.", "pose": 0, "view": 3})"));
  EXPECT_EQ(all[1]["device"], "camera");
  EXPECT_THAT(all[1]["message"].get<std::string>(), HasSubstr("lost"));
}

TEST_F(JobLog, IsBoundedAndItsLastLineTellsSo) {
  scan_samples::write_text(job_log_file(folder_), std::string(kMaxJobLogBytes - 10, ' ') + "\n");
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(append({.message = "one more"}));
  EXPECT_LT(fs::file_size(job_log_file(folder_)), kMaxJobLogBytes + 1000);
  const auto text = *read_file(job_log_file(folder_));
  EXPECT_THAT(text.substr(text.size() - 100), HasSubstr("This log is full."));
}

TEST_F(JobLog, MakesNoFolderAndFollowsNoLink) {
  EXPECT_EQ(append_job_log(folder_ / "gone", {.message = "late"}, {}).error().code, ErrorCode::not_found);
  EXPECT_FALSE(fs::exists(folder_ / "gone"));
  fs::create_symlink(folder_ / "elsewhere", job_log_file(folder_));
  EXPECT_EQ(append({.message = "astray"}).error().code, ErrorCode::io);
  EXPECT_FALSE(fs::exists(folder_ / "elsewhere"));
}

TEST_F(JobLog, HoldsNoToken) {
  ASSERT_TRUE(append({.message = "GET /api/v1/jobs/scanrig_AbC-0_9x, requested"}));
  EXPECT_EQ(lines()[0]["message"], "GET /api/v1/jobs/scanrig_(removed), requested");
}

TEST(Secrets, AreTokensAndWhatFollowsAScheme) {
  EXPECT_EQ(without_secrets("url = \"http://user:pass@host/hook/key\"\nviews = 8"),
            "url = \"http://(removed)\"\nviews = 8");
  EXPECT_EQ(without_secrets("scanrig_a scanrig_"), "scanrig_(removed) scanrig_(removed)");
  EXPECT_EQ(without_secrets("socket = \"/run/scanrig/api.sock\""), "socket = \"/run/scanrig/api.sock\"");
  EXPECT_EQ(without_secrets("ends with http://x"), "ends with http://(removed)");
  EXPECT_EQ(without_secrets(""), "");
}

}  // namespace
}  // namespace scanrig
