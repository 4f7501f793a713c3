#include "daemon/api/downloads.h"

#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

class JobBundles : public scan_samples::FolderTest {};

TEST_F(JobBundles, WhatADaemonThatDiedLeftGoesHalfPackedOrWhole) {
  fs::create_directories(folder_ / "20261121-093000-1");
  for (const auto* const file : {".bundle-1.tar.gz", ".bundle-2.tar.gz.part", "index.sqlite"}) {
    scan_samples::write_text(folder_ / file, "x");
  }
  fs::create_directories(folder_ / ".bundle-2.tar.gz.beside/job/rig");
  remove_old_bundles(folder_);
  EXPECT_FALSE(fs::exists(folder_ / ".bundle-2.tar.gz.beside"));
  EXPECT_FALSE(fs::exists(folder_ / ".bundle-1.tar.gz"));
  EXPECT_FALSE(fs::exists(folder_ / ".bundle-2.tar.gz.part"));
  EXPECT_TRUE(fs::exists(folder_ / "index.sqlite"));
  EXPECT_TRUE(fs::exists(folder_ / "20261121-093000-1"));
}

}  // namespace
}  // namespace scanrig
