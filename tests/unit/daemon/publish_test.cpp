#include "daemon/jobs/publish.h"

#include "tests/unit/pipeline/scan/scan_samples.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

class Publish : public scan_samples::FolderTest {
 protected:
  static Result<void> write_model(const fs::path& folder) {
    scan_samples::write_text(folder / "model.glb", "glTF");
    return {};
  }
  bool is_alone(const std::string& name) {
    int entries = 0;
    for (const auto& entry : fs::directory_iterator(folder_)) entries += entry.path().filename() == name ? 1 : 100;
    return entries == 1;
  }
};

TEST_F(Publish, TheFolderAppearsWithItsFilesAndNothingElse) {
  ASSERT_TRUE(publish_folder(folder_ / "model", write_model));
  EXPECT_EQ(*read_file(folder_ / "model/model.glb"), "glTF");
  EXPECT_TRUE(is_alone("model"));
}

TEST_F(Publish, AFailureLeavesNothingAndIsPassedOn) {
  const auto done = publish_folder(folder_ / "model", [](const fs::path& folder) -> Result<void> {
    scan_samples::write_text(folder / "half", "written");
    return fail(ErrorCode::same_rest, "not turned over");
  });
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, ErrorCode::same_rest);
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(Publish, WhatIsThereIsNotOverwritten) {
  ASSERT_TRUE(publish_folder(folder_ / "model", write_model));
  const auto again = publish_folder(folder_ / "model", [](const fs::path&) -> Result<void> {
    ADD_FAILURE() << "no work is done for a folder that is taken";
    return {};
  });
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::exists);
}

TEST_F(Publish, AFolderThatCannotBeMadeIsAnIoError) {
  scan_samples::write_text(folder_ / "file", "");
  const auto done = publish_folder(folder_ / "file/model", write_model);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, ErrorCode::io);
}

}  // namespace
}  // namespace scanrig
