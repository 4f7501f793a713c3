#include <csignal>

#include "tests/system/rig/rig_on_wires.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

/// The doctor at a rig whose cameras are on the wire, and a machine that is set up for them.
class DoctorOnWires : public RigOnWires {
 protected:
  void SetUp() override {
    RigOnWires::SetUp();
    views_ = 3;
    start_rig({"--cameras", "gige", "--scale", "0.25", "--poses", "1"});
    put("machine/proc/sys/net/core/rmem_max", "33554432");
    put("jobs/this folder", "is there");
    // Older than any machine's clock.
    auto calibration = json::parse(*read_file(folder_ / "calibration.json"));
    calibration["date"] = "2000-01-01T00:00:00Z";
    put("calibration.json", calibration.dump());
  }
  void put(const std::string& file, const std::string& text) {
    ASSERT_TRUE(create_directories_synced((folder_ / file).parent_path()));
    ASSERT_TRUE(write_file_atomically(folder_ / file, text));
  }
  std::vector<std::string> command() const {
    return {SCANRIG_PROGRAM,      "doctor",         "--json",           "--config",
            folder_ / "rig.toml", "--machine-root", folder_ / "machine"};
  }
  std::size_t exposures() { return say({{"get", "exposures"}})["next"].get<std::size_t>(); }
  bool is_lit() { return say({{"get", "truth"}})["projector_on"].get<bool>(); }
};

TEST_F(DoctorOnWires, FindsNothingAtASoundRigAndLeavesItsReport) {
  Process doctor(command(), folder_ / "output");
  ASSERT_EQ(doctor.wait(), 0) << read_file(folder_ / "output").value_or("");
  const auto report = json::parse(read_file(folder_ / "output").value_or(""));
  EXPECT_TRUE(report["findings"].empty()) << report["findings"];
  EXPECT_THAT(report.dump(), HasSubstr("50 exposures: 50 pairs, 0 lost"));
  EXPECT_EQ(json::parse(read_file(folder_ / "jobs/doctor.json").value_or("")), report);
  EXPECT_FALSE(is_lit());
  EXPECT_EQ(say({{"get", "truth"}})["counter"], 0) << "the table was not to be turned";
}

TEST_F(DoctorOnWires, EndsWithTheLightOffWhenItIsInterrupted) {
  Process doctor(command(), folder_ / "output");
  ASSERT_TRUE(soon([&] { return exposures() >= 3; }));
  doctor.signal(SIGINT);
  EXPECT_EQ(doctor.wait(), static_cast<int>(ExitCode::stopped));
  const auto before = exposures();
  EXPECT_FALSE(is_lit());
  EXPECT_LT(before, 45U);
  EXPECT_FALSE(soon([&] { return exposures() > before; }, std::chrono::seconds(2)));
}

}  // namespace
}  // namespace scanrig
