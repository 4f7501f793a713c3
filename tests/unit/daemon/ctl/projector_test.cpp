// `scanrig projector`: what it refuses before a device is touched.
#include <gmock/gmock.h>

#include <fstream>

#include "core/files.h"
#include "daemon/ctl/verbs.h"
#include "tests/own_folder.h"

namespace scanrig::ctl {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class ProjectorVerbTest : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    fs::copy(fs::path(SCANRIG_CONFIG) / "drives", folder_ / "drives");
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// The shipped example, with the projector `section`.
  fs::path rig_with(const std::string& section) {
    std::string text = *read_file(fs::path(SCANRIG_CONFIG) / "rigs/example.toml");
    const auto begin = text.find("[projector]"), end = text.find("\n[", begin);
    text.replace(begin, end - begin, section);
    const auto socket = text.find("/run/scanrig/api.sock");
    text.replace(socket, std::string("/run/scanrig/api.sock").size(), (folder_ / "api.sock").string());
    std::ofstream(folder_ / "rig.toml") << text;
    return folder_ / "rig.toml";
  }
  /// What is printed as an error; its exit code.
  std::string run(const std::string& what, const fs::path& rig, const fs::path& file, ExitCode& code) {
    ProjectorVerb verb;
    verb.what = what;
    verb.config = rig;
    verb.file = file;
    testing::internal::CaptureStderr();
    code = projector(verb);
    return testing::internal::GetCapturedStderr();
  }

  const fs::path folder_ = own_folder("projector_verb");
  const std::string lightcrafter_ =
      "[projector]\ndriver = \"lightcrafter4500\"\nserial = \"no such\"\nimage = 3\npattern = 5\ndepth_bits = 8\n"
      "led_current = { red = 100, green = 100, blue = 100 }\nexposure_us = 15000\nreply_timeout_ms = 2000\n"
      "warm_up_s = 600\n";
};

TEST_F(ProjectorVerbTest, AnotherProjectorHasNoFirmware) {
  ExitCode code{};
  const auto rig = rig_with("[projector]\ndriver = \"manual\"\nwarm_up_s = 600\n");
  EXPECT_THAT(run("info", rig, {}, code), HasSubstr("it has no firmware, only a LightCrafter 4500 has"));
  EXPECT_EQ(code, ExitCode::refused);
}

TEST_F(ProjectorVerbTest, AFileThatIsNoneIsNamedAndNothingIsAsked) {
  const auto rig = rig_with(lightcrafter_);
  ExitCode code{};
  EXPECT_THAT(run("load", rig, {}, code), HasSubstr("name the firmware's FILE"));
  EXPECT_EQ(code, ExitCode::usage);
  EXPECT_THAT(run("load", rig, folder_ / "absent.bin", code), HasSubstr("absent.bin"));
  EXPECT_EQ(code, ExitCode::bad_input);
  EXPECT_THAT(run("load", rig, rig, code), HasSubstr("no firmware of a LightCrafter 4500: it is too short"));
  EXPECT_EQ(code, ExitCode::bad_input);
}

TEST_F(ProjectorVerbTest, WithoutTheDeviceItIsADeviceThatIsMissing) {
  ExitCode code{};
  EXPECT_THAT(run("info", rig_with(lightcrafter_), {}, code), HasSubstr("LightCrafter"));
  EXPECT_EQ(code, ExitCode::device);
}

}  // namespace
}  // namespace scanrig::ctl
