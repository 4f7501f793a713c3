#include "daemon/api/downloads.h"

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::Field;

class FolderFiles : public scan_samples::FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    fs::create_directories(folder_ / "job/pose1/view00");
    scan_samples::write_text(folder_ / "secret", "secret");
    scan_samples::write_text(job() / "scan.json", "{}");
    scan_samples::write_text(job() / "pose1/view00/left.png", "image");
    fs::create_symlink(folder_ / "secret", job() / "link");
    fs::create_directory_symlink(folder_, job() / "up");
    ASSERT_EQ(::mkfifo((job() / "pipe").c_str(), 0600), 0);
  }
  fs::path job() const { return folder_ / "job"; }
};

TEST_F(FolderFiles, AreListedByNameWithoutLinks) {
  const auto files = list_files(job());
  ASSERT_TRUE(files) << files.error().message;
  EXPECT_THAT(*files,
              ElementsAre(Field(&FolderFile::path, "pose1/view00/left.png"), Field(&FolderFile::path, "scan.json")));
  EXPECT_EQ(files->front().bytes, 5u);
  EXPECT_EQ(list_files(folder_ / "nowhere").error().code, ErrorCode::io);
}

TEST_F(FolderFiles, AreOpenedBelowTheirFolder) {
  const auto file = open_below(job(), "pose1/view00/left.png");
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ((*file)->size(), 5u);
  std::string text(5, ' ');
  EXPECT_EQ(::read((*file)->fd(), text.data(), text.size()), 5);
  EXPECT_EQ(text, "image");
}

TEST_F(FolderFiles, NothingElseIsOpened) {
  for (const auto* path : {"", "..", "../secret", "link", "up/secret", "pose1/../../secret", "pose1", "pose1//view00",
                           "/etc/passwd", "pipe", "nothing", "scan.json/x", "./scan.json"}) {
    const auto file = open_below(job(), path);
    ASSERT_FALSE(file) << path;
    EXPECT_EQ(file.error().code, ErrorCode::not_found) << path;
  }
  EXPECT_EQ(open_below(folder_ / "gone", "a").error().code, ErrorCode::not_found);
}

TEST_F(FolderFiles, HaveTheMediaTypeOfTheirEnding) {
  EXPECT_EQ(media_type("model/model.glb"), "model/gltf-binary");
  EXPECT_EQ(media_type("left.png"), "image/png");
  EXPECT_EQ(media_type("README"), "application/octet-stream");
}

}  // namespace
}  // namespace scanrig
