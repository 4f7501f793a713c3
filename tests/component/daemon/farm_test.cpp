#include <gmock/gmock.h>

#include <atomic>
#include <future>

#include "daemon/ctl/farm.h"
#include "tests/component/daemon/fake_slurm.h"

namespace scanrig::ctl {
namespace {

namespace fs = std::filesystem;
using fakes::comes_true;
using testing::HasSubstr;

/// Many scans by one array of a cluster, through commands that a test holds.
class FarmOfFakes : public scan_samples::FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    slurm.emplace(folder_ / "commands");
    options.commands = slurm->commands();
    options.program = folder_ / "scanrig";
    options.with = {"--voxel-mm", "0.5"};
    for (const char* name : {"one", "two", "three"}) {
      const auto scan = folder_ / "scans of a day" / name;
      fs::create_directories(scan);
      scan_samples::write_text(scan / "scan.json", "{}");
      options.scans.push_back(scan);
    }
    program("make \"$@\"");
  }
  void TearDown() override {
    slurm.reset();
    FolderTest::TearDown();
  }
  void program(const std::string& script) const {
    scan_samples::write_text(
        options.program,
        "#!/bin/sh\nscan=$2; out=$5; make() { mkdir \"$out\"; echo \"$@\" > \"$out/model.glb\"; }\n" + script);
    ::chmod(options.program.c_str(), 0755);
  }
  Result<FarmCount> run() {
    ended.clear();
    return run_farm(options, stop.get_token(), [this](const FarmEnd& end) { ended.push_back(end); });
  }
  [[nodiscard]] std::string model(int scan) const {
    return read_file(options.scans[static_cast<std::size_t>(scan)] / "model" / "model.glb").value_or("none");
  }
  void expect_counts(const Result<FarmCount>& count, int done, int failed, int skipped) const {
    ASSERT_TRUE(count) << count.error().message;
    EXPECT_EQ(count->failed, failed) << count->first.value_or(Error{}).message;
    EXPECT_EQ(count->done, done);
    EXPECT_EQ(count->skipped, skipped);
    EXPECT_EQ(static_cast<int>(ended.size()), done + failed);
    for (const auto& scan : options.scans) EXPECT_FALSE(fs::exists(scan / "slurm"));
  }

  std::optional<fakes::FakeSlurm> slurm;
  FarmOptions options;
  std::stop_source stop;
  std::vector<FarmEnd> ended;
};

TEST_F(FarmOfFakes, MakesEveryModelOnce) {
  expect_counts(run(), 3, 0, 0);
  EXPECT_EQ(slurm->jobs(), 1);
  for (const int scan : {0, 1, 2}) EXPECT_THAT(model(scan), HasSubstr("--voxel-mm 0.5"));
  expect_counts(run(), 0, 0, 3);
  EXPECT_EQ(slurm->jobs(), 1);
  options.with = {"--voxel-mm", "0.7"};
  expect_counts(run(), 3, 0, 0);
  EXPECT_THAT(model(1), HasSubstr("--voxel-mm 0.7"));
}

TEST_F(FarmOfFakes, NamesWhatFailsAndTriesItAgainTheNextTime) {
  program("case \"$scan\" in */two) printf 'failed\\tno_overlap\\tnothing in common\\n'; exit 7;; esac; make");
  const auto count = run();
  expect_counts(count, 2, 1, 0);
  EXPECT_EQ(count->first->code, ErrorCode::no_overlap);
  program("make");
  expect_counts(run(), 1, 0, 2);
}

TEST_F(FarmOfFakes, PutsModelsElsewhere) {
  options.out = folder_ / "models";
  ASSERT_TRUE(run());
  EXPECT_TRUE(fs::exists(options.out / "two" / "model.glb"));
  EXPECT_EQ(model(1), "none");
  options.scans.push_back(folder_ / "other" / "two");
  fs::create_directories(options.scans.back());
  scan_samples::write_text(options.scans.back() / "scan.json", "{}");
  EXPECT_THAT(run().error().message, HasSubstr("two scans would have the model"));
}

TEST_F(FarmOfFakes, TakesUpWhatAStoppedRunLeftAtTheCluster) {
  program(fmt::format("touch '{0}/begun'; while [ ! -e '{0}/go' ]; do sleep 0.02; done; make", folder_.string()));
  auto first = std::async(std::launch::async, [this] { return run(); });
  ASSERT_TRUE(comes_true([&] { return fs::exists(folder_ / "begun"); }));
  stop.request_stop();
  EXPECT_EQ(first.get().error().code, ErrorCode::stopped);
  stop = std::stop_source();
  scan_samples::write_text(folder_ / "go", "");
  expect_counts(run(), 3, 0, 0);
  EXPECT_EQ(slurm->jobs(), 1) << "nothing is submitted twice";
}

TEST_F(FarmOfFakes, RefusesBeforeAnythingIsSubmitted) {
  auto none = options;
  none.scans.clear();
  EXPECT_EQ(run_farm(none, {}, [](const auto&) {}).error().code, ErrorCode::invalid_input);
  slurm->set("away");
  EXPECT_EQ(run().error().code, ErrorCode::timeout);
  options.commands = folder_ / "nowhere";
  EXPECT_EQ(run().error().code, ErrorCode::not_found);
  options.scans.push_back(folder_ / "nowhere");
  EXPECT_THAT(run().error().message, HasSubstr("no scan folder"));
}

}  // namespace
}  // namespace scanrig::ctl
