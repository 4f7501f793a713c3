// Each kind of bad input to `scanrig calibrate` ends with one sentence and a code, and replaces nothing.
#include <gmock/gmock.h>

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "core/files.h"
#include "daemon/ctl/verbs.h"
#include "sim/apps/shoot_board.h"
#include "tests/unit/pipeline/storage/sample_files.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class BadCalibrationInput : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    sim::SeriesOptions options;
    options.rig = sim::RigVariation{.seed = 5};
    options.image_scale = 0.5;
    options.placements = {1, 2, 3};
    options.angles = 2;
    const auto shot = sim::shoot_board(options, folder() / "good");
    ASSERT_TRUE(shot) << shot.error().message;
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(folder()); }

  void SetUp() override {
    std::filesystem::remove_all(images_);
    std::filesystem::copy(folder() / "good", images_, std::filesystem::copy_options::recursive);
    ASSERT_TRUE(write_file_atomically(verb_.out, std::string_view("the one before")));
  }

  /// Changes the folder's list.
  void edit(const std::function<void(nlohmann::ordered_json&)>& change) {
    const auto list = images_ / "calibration_images.json";
    auto json = nlohmann::ordered_json::parse(read_file(list).value_or("null"));
    change(json);
    ASSERT_TRUE(write_file_atomically(list, json.dump()));
  }
  /// Runs the command; the sentence it ends with.
  std::string refused(ExitCode code) {
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const auto got = ctl::calibrate_folder(verb_);
    testing::internal::GetCapturedStdout();
    const std::string said = testing::internal::GetCapturedStderr();
    EXPECT_EQ(got, code) << said;
    EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
    EXPECT_THAT(said, testing::StartsWith("scanrig: "));
    EXPECT_EQ(read_file(verb_.out).value_or(""), "the one before");
    for (const auto& entry : std::filesystem::directory_iterator(verb_.out.parent_path())) {
      EXPECT_EQ(entry.path().string().find(".tmp"), std::string::npos) << entry.path();
    }
    return said;
  }

  static const std::filesystem::path& folder() {
    static const std::filesystem::path path =
        std::filesystem::path(testing::TempDir()) / ("bad_calibration_input_" + std::to_string(::getpid()));
    return path;
  }
  const std::filesystem::path images_ = folder() / "images";
  ctl::CalibrateFolderVerb verb_ = [this] {
    ctl::CalibrateFolderVerb verb;
    verb.images = images_;
    verb.out = folder() / "calibration.json";
    verb.with_report = false;
    return verb;
  }();
};

TEST_F(BadCalibrationInput, TooFewBoards) {
  edit([](auto& json) { json["pairs"].erase(json["pairs"].begin() + 2, json["pairs"].end()); });
  EXPECT_THAT(refused(ExitCode::no_model), HasSubstr("2 usable images; take at least 3"));
  edit([](auto& json) { json["pairs"].clear(); });
  refused(ExitCode::bad_input);
}

TEST_F(BadCalibrationInput, ImagesThatCannotMeasureTheRig) {
  edit([](auto& json) {  // one placement, never turned: nothing tells the axis
    auto one = json["pairs"][0];
    one["table_deg"] = 0.0;
    json["pairs"] = {one, one, one, one};
  });
  refused(ExitCode::no_model);
}

TEST_F(BadCalibrationInput, AnImageOfAnotherSize) {
  std::string name;
  edit([&](auto& json) {
    name = json["pairs"][1]["left"]["path"];
    json["pairs"][1]["left"].erase("sha256");
  });
  const auto image = cv::imread((images_ / name).string(), cv::IMREAD_UNCHANGED);
  ASSERT_FALSE(image.empty());
  cv::imwrite((images_ / name).string(), image(cv::Rect(0, 0, image.cols - 10, image.rows)));
  const auto said = refused(ExitCode::bad_input);
  EXPECT_THAT(said, HasSubstr(name));
  EXPECT_THAT(said, HasSubstr("use images of one size"));
}

TEST_F(BadCalibrationInput, LengthsThatAreNone) {
  for (const auto& length :
       std::vector<std::vector<double>>{{kNan, 0.01}, {100, kNan}, {-100, 0.01}, {100, 0}, {0, 1}, {100, HUGE_VAL}}) {
    verb_.length_mm = length;
    EXPECT_THAT(refused(ExitCode::bad_input), HasSubstr("length")) << length[0] << " " << length[1];
    verb_.length_mm.clear();
    verb_.second_length_mm = length;
    EXPECT_THAT(refused(ExitCode::bad_input), HasSubstr("length")) << length[0] << " " << length[1];
    verb_.second_length_mm.clear();
  }
}

TEST_F(BadCalibrationInput, BoardsThatAreNone) {
  verb_.has_board = true;
  for (const char* const squares : {"12", "12x", "axb", "1x9", "nanx9", "1e9x9", "-12x9", "12x9x3"}) {
    verb_.board.squares = squares;
    refused(ExitCode::bad_input);
  }
  verb_.board.squares = "12x9";
  for (const double size : {0.0, -10.0, kNan, 1e9}) {
    verb_.board.square_mm = size;
    refused(ExitCode::bad_input);
  }
}

TEST_F(BadCalibrationInput, AListThatCannotBeUsed) {
  edit([](auto& json) { json["pairs"][0]["table_deg"] = nullptr; });  // NaN is written so
  EXPECT_THAT(refused(ExitCode::bad_input), HasSubstr("calibration_images.json"));
  edit([](auto& json) { json["version"] = 99; });
  EXPECT_THAT(refused(ExitCode::bad_input), HasSubstr("calibration_images.json"));
  ASSERT_TRUE(write_file_atomically(images_ / "calibration_images.json", std::string_view("{\"images\": [")));
  EXPECT_THAT(refused(ExitCode::bad_input), HasSubstr("calibration_images.json"));
  verb_.images = folder() / "nowhere";
  EXPECT_THAT(refused(ExitCode::bad_input), HasSubstr("nowhere"));
}

TEST_F(BadCalibrationInput, ACheckAgainstAFileThatIsNoCalibrationOfThisRig) {
  const auto known = folder() / "known.json";
  verb_.check = known;
  EXPECT_THAT(refused(ExitCode::bad_input), HasSubstr("known.json"));
  for (const std::string_view text : {"", "not JSON", "{}", R"({"format": "scanrig-scan", "version": 1})",
                                      R"({"format": "scanrig-calibration", "version": 3})"}) {
    ASSERT_TRUE(write_file_atomically(known, text));
    EXPECT_THAT(refused(ExitCode::bad_input), HasSubstr("known.json")) << text;
  }
  ASSERT_TRUE(write_file_atomically(known, scan_samples::calibration_json()));
  EXPECT_THAT(refused(ExitCode::bad_input), HasSubstr("name the calibration of these cameras"));
}

}  // namespace
}  // namespace scanrig
