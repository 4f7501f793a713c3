#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

namespace scanrig {

/// A path that is unique among tests, and among builds that run the same test at once. Nothing is made.
inline std::filesystem::path own_folder(const std::string& prefix = "scanrig_") {
  const std::string test = ::testing::UnitTest::GetInstance()->current_test_info()->name();
  return std::filesystem::path(::testing::TempDir()) / (prefix + test + "_" + std::to_string(::getpid()));
}

}  // namespace scanrig
