#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "core/files.h"

namespace scanrig {

/// A shipped file, changed, in a folder of its own.
class FileUnderTest : public testing::Test {
 protected:
  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("scanrig_config_" + std::to_string(::getpid()));
  const std::filesystem::path file_ = folder_ / "under_test.toml";

  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static std::string shipped(const std::string& name) {
    const auto text = read_file(std::filesystem::path(SCANRIG_SOURCE_DIR) / "config" / name);
    EXPECT_TRUE(text) << text.error().message;
    return *text;
  }
  static int line_of(const std::string& text, const std::string& part) {
    return 1 + static_cast<int>(std::count(text.begin(), text.begin() + static_cast<long>(text.find(part)), '\n'));
  }
  static std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  }
  void write(const std::string& text) const { std::ofstream(file_, std::ios::binary) << text; }
};

}  // namespace scanrig
