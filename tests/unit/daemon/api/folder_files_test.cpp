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

TEST(FilePart, IsTheRangeThatWasAskedForOrTheWhole) {
  const FilePart whole{0, 1000};
  EXPECT_EQ(part_of_file("", 1000), whole);
  EXPECT_EQ(part_of_file("bytes=0-99", 1000), (FilePart{0, 100}));
  EXPECT_EQ(part_of_file("bytes=999-999", 1000), (FilePart{999, 1000}));
  EXPECT_EQ(part_of_file("bytes=900-", 1000), (FilePart{900, 1000}));
  EXPECT_EQ(part_of_file("bytes=900-5000", 1000), (FilePart{900, 1000}));
  EXPECT_EQ(part_of_file("bytes=-100", 1000), (FilePart{900, 1000}));
  EXPECT_EQ(part_of_file("bytes=-5000", 1000), whole);
  EXPECT_EQ(part_of_file("bytes=0-18446744073709551615", 1000), whole) << "no overflow";
  for (const auto* odd : {"bytes=", "bytes=-", "bytes=a-b", "bytes=5-1", "bytes=0-1,5-6", "lines=0-1", "bytes=0x1-2",
                          "bytes=+1-2", "bytes=99999999999999999999-"}) {
    EXPECT_EQ(part_of_file(odd, 1000), whole) << odd;
  }
  for (const auto* behind : {"bytes=1000-", "bytes=2000-3000", "bytes=-0"}) {
    EXPECT_EQ(part_of_file(behind, 1000), std::nullopt) << behind;
  }
  EXPECT_EQ(part_of_file("bytes=0-", 0), std::nullopt);
}

TEST_F(FolderFiles, HaveATagThatChangesWithTheirContent) {
  const auto tag = [&] { return (*open_below(job(), "scan.json"))->tag(); };
  const auto before = tag();
  EXPECT_EQ(tag(), before);
  scan_samples::write_text(job() / "scan.json", "{ }");
  EXPECT_NE(tag(), before);
}

TEST_F(FolderFiles, HaveTheMediaTypeOfTheirEnding) {
  EXPECT_EQ(media_type("model/model.glb"), "model/gltf-binary");
  EXPECT_EQ(media_type("left.png"), "image/png");
  EXPECT_EQ(media_type("README"), "application/octet-stream");
}

}  // namespace
}  // namespace scanrig
