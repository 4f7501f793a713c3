#pragma once

#include <gtest/gtest.h>

#include "core/hash.h"
#include "pipeline/storage/scan_folder.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {

using namespace scan_samples;

class ScanFolderTest : public FolderTest {
 protected:
  std::filesystem::path scan_ = folder_ / "scan";

  ScanFolder create() {
    write_text(folder_ / "calibration.json", calibration_json());
    Manifest manifest;
    manifest.id = "20261121-093000-1";
    manifest.created = "2026-11-21T09:30:00Z";
    auto scan = ScanFolder::create(scan_, manifest, folder_ / "calibration.json");
    EXPECT_TRUE(scan) << scan.error().message;
    return std::move(*scan);
  }
  ScanFolder with_one_view() {
    ScanFolder scan = create();
    EXPECT_TRUE(scan.add_view(0, record(0), raw_view(0)));
    return scan;
  }
  static ViewRecord record(int index) {
    ViewRecord view;
    view.index = index;
    view.commanded_deg = 45.0 * index;
    view.measured_deg = 45.0 * index + 0.0031;
    view.settling_ms = 210;
    view.taken = "2026-11-21T09:30:04Z";
    return view;
  }
  void edit_manifest(const std::string& what, const std::string& with) {
    write_text(scan_ / "scan.json", replaced(read_file(scan_ / "scan.json").value(), what, with));
  }
  /// Checks that opening fails with this code and names these.
  void expect_refused(ErrorCode code, const std::vector<std::string>& names) {
    const auto scan = ScanFolder::open(scan_);
    ASSERT_FALSE(scan);
    EXPECT_EQ(scan.error().code, code) << scan.error().message;
    for (const auto& name : names)
      EXPECT_NE(scan.error().message.find(name), std::string::npos) << scan.error().message;
  }
  void expect_unloadable(ErrorCode code, const std::string& name) {
    const auto scan = ScanFolder::open(scan_);
    ASSERT_TRUE(scan) << scan.error().message;
    const auto raw = scan->load_raw(0, 0);
    ASSERT_FALSE(raw);
    EXPECT_EQ(raw.error().code, code) << raw.error().message;
    EXPECT_NE(raw.error().message.find(name), std::string::npos) << raw.error().message;
  }
  /// Replaces a stored image and its hash in the manifest, so that only the content can be at fault.
  void replace_image(const std::string& name, const std::string& bytes) {
    const std::string old = sha256(read_file(scan_ / name).value());
    write_text(scan_ / name, bytes);
    edit_manifest(old, sha256(bytes));
  }
};

}  // namespace scanrig
