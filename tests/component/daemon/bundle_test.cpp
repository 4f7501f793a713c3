#include "daemon/jobs/bundle.h"

#include <gmock/gmock.h>

#include <limits>
#include <set>

#include "core/files.h"
#include "daemon/jobs/child_process.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using scan_samples::write_text;
using testing::ElementsAre;
using testing::HasSubstr;

class Bundle : public scan_samples::FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    fs::create_directories(folder_ / "jobs/job-1/pose1");
    fs::create_directories(folder_ / "crash");
    fs::create_directories(folder_ / "out");
    write_text(folder_ / "jobs/job-1/scan.json", "{}");
    write_text(folder_ / "jobs/job-1/log.jsonl", "{\"message\": \"Stored.\"}\n");
    write_text(folder_ / "jobs/job-1/pose1/left.png", std::string(100'000, 'x'));
    write_text(folder_ / "calibration.json", "the rig's");
    options.calibration_file = folder_ / "calibration.json";
    options.crash_folder = folder_ / "crash";
  }
  [[nodiscard]] Result<void> pack() const { return bundle(folder_ / "jobs/job-1", target(), options, {}); }
  [[nodiscard]] fs::path target() const { return folder_ / "out/job.tar.gz"; }
  /// Every file of the bundle, by its path.
  std::set<std::string> unpack() {
    fs::create_directories(folder_ / "unpacked");
    const auto done = run_child(
        {.words = {"/bin/tar", "-xzf", target().string(), "--directory", (folder_ / "unpacked").string()}}, {});
    EXPECT_TRUE(done && done->code == 0);
    std::set<std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder_ / "unpacked")) {
      if (entry.is_regular_file()) files.insert(entry.path().lexically_relative(folder_ / "unpacked").string());
    }
    return files;
  }
  [[nodiscard]] std::string unpacked(const std::string& file) const {
    return read_file(folder_ / "unpacked/job-1" / file).value_or("missing");
  }
  [[nodiscard]] std::set<std::string> left_over() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_ / "out")) names.insert(entry.path().filename());
    return names;
  }

  BundleOptions options;
};

TEST_F(Bundle, HoldsJobRigAndCrashes) {
  options.rig_texts = {{"rig.toml", "schema = 1\n"}, {"drive.toml", "registers"}};
  write_text(folder_ / "crash/1.txt", "frame 0");
  write_text(folder_ / "crash/core.bin", "memory");
  ASSERT_TRUE(pack());
  EXPECT_THAT(unpack(),
              ElementsAre("job-1/crash/1.txt", "job-1/log.jsonl", "job-1/pose1/left.png", "job-1/rig/calibration.json",
                          "job-1/rig/drive.toml", "job-1/rig/rig.toml", "job-1/scan.json"));
  EXPECT_EQ(unpacked("crash/1.txt"), "frame 0");
  EXPECT_EQ(unpacked("rig/calibration.json"), "the rig's");
  EXPECT_EQ(unpacked("rig/drive.toml"), "registers");
  EXPECT_THAT(left_over(), ElementsAre("job.tar.gz"));
}

TEST_F(Bundle, HoldsNoSecrets) {
  options.rig_texts["rig.toml"] = "# scanrig_0123456789abcdef\n[webhook]\nurl = \"http://user:pass@host/key\"\n";
  write_text(folder_ / "crash/1.txt", "Bearer scanrig_0123456789abcdef");
  ASSERT_TRUE(pack());
  unpack();
  EXPECT_EQ(unpacked("rig/rig.toml"), "# scanrig_(removed)\n[webhook]\nurl = \"http://(removed)\"\n");
  EXPECT_EQ(unpacked("crash/1.txt"), "Bearer scanrig_(removed)");
}

TEST_F(Bundle, TakesTheNewestCrashesOfABoundedSizeAndFollowsNoLink) {
  for (int i = 10; i < 40; ++i) {
    const auto file = folder_ / "crash" / (std::to_string(i) + ".txt");
    write_text(file, "x");
    fs::last_write_time(file, fs::file_time_type::clock::now() - std::chrono::hours(i));
  }
  write_text(folder_ / "crash/10.txt", std::string((1u << 20) + 1, 'x'));
  fs::create_symlink(folder_ / "calibration.json", folder_ / "crash/00.txt");
  ASSERT_TRUE(pack());
  const auto files = unpack();
  EXPECT_TRUE(files.contains("job-1/crash/11.txt") && files.contains("job-1/crash/29.txt"));
  for (const char* const left_out : {"00", "10", "30"}) {
    EXPECT_FALSE(files.contains("job-1/crash/" + std::string(left_out) + ".txt")) << left_out;
  }
}

TEST_F(Bundle, WithNothingBesideTheJobItIsTheJobAlone) {
  options = {.crash_folder = folder_ / "none"};
  ASSERT_TRUE(pack());
  EXPECT_THAT(unpack(), ElementsAre("job-1/log.jsonl", "job-1/pose1/left.png", "job-1/scan.json"));
}

TEST_F(Bundle, IsRefusedWhereItDoesNotFitBesideTheReserve) {
  const auto space = fs::space(folder_);
  options.reserve_bytes = space.capacity;
  const auto packed = pack();
  ASSERT_FALSE(packed);
  EXPECT_EQ(packed.error().code, ErrorCode::io);
  EXPECT_THAT(packed.error().message, HasSubstr("delete or export jobs"));
  EXPECT_THAT(left_over(), testing::IsEmpty());
}

TEST_F(Bundle, AStoppedOrFailedOneLeavesNothing) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(bundle(folder_ / "jobs/job-1", target(), options, {stop.get_token(), {}}).error().code, ErrorCode::stopped);
  EXPECT_EQ(bundle(folder_ / "jobs/none", target(), options, {}).error().code, ErrorCode::io);
  EXPECT_THAT(left_over(), testing::IsEmpty());
}

}  // namespace
}  // namespace scanrig
