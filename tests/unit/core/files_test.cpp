#include "core/files.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "core/hash.h"
#include "tests/own_folder.h"

namespace scanrig {
namespace {

class FilesTest : public testing::Test {
 protected:
  std::filesystem::path folder_ = own_folder();
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }
};

TEST_F(FilesTest, WhatIsWrittenIsReadBack) {
  ASSERT_TRUE(write_file_atomically(folder_ / "a.txt", "one"));
  ASSERT_TRUE(write_file_atomically(folder_ / "a.txt", "two"));
  EXPECT_EQ(read_file(folder_ / "a.txt").value(), "two");
}

TEST_F(FilesTest, NoTemporaryFileIsLeftWhenTheTargetCannotBeReplaced) {
  std::filesystem::create_directories(folder_ / "taken" / "inside");
  const auto written = write_file_atomically(folder_ / "taken", "x");
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::io);
  EXPECT_NE(written.error().message.find("taken"), std::string::npos);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
}

TEST_F(FilesTest, AMissingFileIsNamed) {
  const auto text = read_file(folder_ / "absent");
  ASSERT_FALSE(text);
  EXPECT_EQ(text.error().code, ErrorCode::not_found);
  EXPECT_NE(text.error().message.find("absent"), std::string::npos);
}

TEST_F(FilesTest, NestedFoldersAreCreatedOnceAndAgain) {
  EXPECT_TRUE(create_directories_synced(folder_ / "a" / "b" / "c"));
  EXPECT_TRUE(create_directories_synced(folder_ / "a" / "b" / "c"));
  EXPECT_TRUE(std::filesystem::is_directory(folder_ / "a" / "b" / "c"));
}

// FIPS 180-4, example B.1.
TEST(Sha256, AgreesWithTheStandardsExample) {
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

}  // namespace
}  // namespace scanrig
