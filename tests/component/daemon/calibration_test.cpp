// The rig is calibrated: a whole service over fake devices, real images of a board, and a solver of the test's own.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "core/hash.h"
#include "daemon/ctl/client.h"
#include "daemon/ctl/verbs.h"
#include "daemon/jobs/job_files.h"
#include "daemon/station/operator_message.h"
#include "tests/component/daemon/calibration_under_test.h"

namespace scanrig {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class CalibrationJob : public CalibratedRig {
 protected:
  int looks() {
    const std::lock_guard guard(rig.line.mutex);
    return rig.line.looks;
  }
  std::string sentence() { return loop->snapshot()->sentence; }
  /// The e-stop ends the view after `exposures` more; then it is released, and the rig is ready again.
  void estop_after(int exposures) {
    start_until_estop(exposures);
    rig.panel.press(&PanelInputs::reset);
    ASSERT_TRUE(wait_ready());
  }
};

TEST_F(CalibrationJob, EndsWithAFileThatAPersonAccepts) {
  const auto old = rig_file();
  boot();
  get_ready();
  const auto id = begin();
  EXPECT_THAT(loop->snapshot()->next_action, StartsWith("Put the board at mark 0: landscape"));
  clock.sleep_for(std::chrono::minutes(5));
  EXPECT_EQ(rig.line.exposures, 0) << "it waits for the board";
  take_placements(0, 6);
  ASSERT_TRUE(wait_state(id, JobState::done));
  const auto& boards = views_.boards;
  EXPECT_EQ(boards.pairs.size(), 50u);
  EXPECT_EQ(boards.width, 320);
  EXPECT_EQ(boards.pairs.front().left.corners.size(), 24u);
  EXPECT_NEAR(boards.pairs.front().angle_rad, -56.0 * M_PI / 180, 1e-3);
  EXPECT_TRUE(boards.pairs.front().in_a && !boards.pairs.front().in_b);
  EXPECT_EQ(boards.outlines.front()[1].size(), 4u);
  EXPECT_EQ(views_.images.serials[1], "40012346");
  ASSERT_EQ(views_.images.pairs.size(), 50u);
  const auto image = load_calibration_image(views_.images.pairs.back(), 1);
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->cols, 320);
  const auto as_folder = read_calibration_images(only_job().path());
  ASSERT_TRUE(as_folder) << as_folder.error().message;
  EXPECT_EQ(as_folder->pairs.size(), 50u);
  EXPECT_EQ(as_folder->pairs.back().files, views_.images.pairs.back().files);
  EXPECT_EQ(as_folder->pairs.back().name, boards.pairs.back().name);
  EXPECT_EQ(rig_file(), old) << "not accepted yet";
  EXPECT_EQ(job(id)->calibration->grade, "A");

  ASSERT_TRUE(ask(event::JobRequested{.what = What::accept, .job = id}));
  EXPECT_EQ(rig_file(), new_calibration());
  EXPECT_EQ(read_file(folder_ / "calibration-20261121T090000Z.json").value_or(""), old);
  ASSERT_TRUE(clock_waits_for([&] { return job(id)->calibration->is_accepted; }));
  shut_down();
  boot();
  EXPECT_TRUE(job(id)->calibration->is_accepted) << "after a restart too";
}

TEST_F(CalibrationJob, ACheckTakesOnePlacementAndOffersTheNewPoses) {
  answer_ = {.grade = "B", .verdict = "moved", .sentences = {"Moved by 18 um."}, .file = new_calibration()};
  const auto old = rig_file();
  boot();
  get_ready();
  const auto id = begin(RecipeKind::check);
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_state(id, JobState::done));
  EXPECT_TRUE(views_.is_check);
  EXPECT_EQ(views_.boards.pairs.size(), 6u);
  EXPECT_EQ(rig_file(), old);
  EXPECT_EQ(describe(*job(id)).sentence, "Moved by 18 um.");
  EXPECT_THAT(describe(*job(id)).next_action, HasSubstr("scanrig calibrate --accept"));
  shut_down();
  boot();
  EXPECT_EQ(job(id)->calibration->verdict, "moved") << "after a restart too";
  EXPECT_TRUE(job(id)->recipe.is_check());
  ASSERT_TRUE(ask(event::JobRequested{.what = What::accept, .job = id}));
  EXPECT_EQ(rig_file(), new_calibration());
}

TEST_F(CalibrationJob, ACheckThatHoldsReplacesNothingAndIsRemembered) {
  answer_ = {.grade = "B", .verdict = "holds", .sentences = {"The calibration holds."}, .file = rig_file()};
  boot();
  get_ready();
  const auto id = begin(RecipeKind::check);
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_state(id, JobState::done));
  EXPECT_FALSE(ask(event::JobRequested{.what = What::accept, .job = id}));
  const auto known = read_calibration(options.jobs.calibration_file);
  EXPECT_NE(last_check(options.jobs.root, known->sha256), "");
  EXPECT_EQ(last_check(options.jobs.root, sha256(std::string_view("another"))), "");
}

TEST_F(CalibrationJob, TakesTwoImagesAViewAndTurnsEachMarkToTheFront) {
  boot();
  get_ready();
  begin();
  take_placements(0, 0);
  EXPECT_EQ(rig.line.exposures, 8) << "seven views and the movement check";
  const auto scan = only_job();
  EXPECT_EQ(scan.manifest().source, "calibration");
  EXPECT_EQ(scan.manifest().poses[0].views.size(), 7u);
  const std::lock_guard guard(rig.turntable.mutex);
  EXPECT_NEAR(rig.turntable.targets.back(), -120.0, 1e-9);
}

TEST_F(CalibrationJob, ABadImageIsNamedAndNoFaultOfTheRig) {
  boot();
  get_ready();
  begin();
  rig.line.dark = 5;  // more than an exposure of a scan is taken again
  take_placements(0, 0);
  EXPECT_EQ(rig.line.exposures, 8);
}

TEST_F(CalibrationJob, OneThatDoesNotGradeReplacesNothing) {
  answer_ = {.grade = "refused", .sentences = {"Volume 80 um."}};
  const auto old = rig_file();
  boot();
  get_ready();
  const auto id = begin();
  take_placements(0, 6);
  ASSERT_TRUE(wait_state(id, JobState::failed));
  EXPECT_THAT(job(id)->error->message, HasSubstr("Volume 80 um."));
  EXPECT_FALSE(ask(event::JobRequested{.what = What::accept, .job = id}));
  EXPECT_EQ(rig_file(), old);
}

TEST_F(CalibrationJob, IsAcceptedByItselfWhereConfigured) {
  options.accepts_calibrations = true;
  boot();
  get_ready();
  const auto id = begin();
  take_placements(0, 6);
  ASSERT_TRUE(wait_state(id, JobState::done));
  EXPECT_TRUE(clock_waits_for([this] { return rig_file() == new_calibration(); }));
}

TEST_F(CalibrationJob, ARigWithoutACalibrationIsCalibrated) {
  std::filesystem::remove(options.jobs.calibration_file);
  boot();
  get_ready();
  const auto id = begin();
  take_placements(0, 6);
  ASSERT_TRUE(wait_state(id, JobState::done));
  ASSERT_TRUE(ask(event::JobRequested{.what = What::accept, .job = id}));
  EXPECT_EQ(rig_file(), new_calibration());
}

TEST_F(CalibrationJob, APlacementWithoutABoardIsTakenAgain) {
  boot();
  get_ready();
  const auto id = begin();
  take_placements(0, 0);
  show(cv::Mat(240, 320, CV_8UC1, cv::Scalar(120)));
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(clock_waits_for([this] { return sentence().find("View 1, left: ") != std::string::npos; }));
  ASSERT_TRUE(wait_for_placement(1));
  EXPECT_EQ(sentence(), "Placement 2 of 7 again: 0 good views, 5 are needed.");
  EXPECT_EQ(job(id)->stored.size(), 7u) << "of placement 1";
  show(board_at(4));
  take_placements(1, 1);
  ASSERT_TRUE(clock_waits_for([&] { return job(id)->stored.size() == 14; }));
  EXPECT_EQ(only_job().manifest().poses[1].views.size(), 7u);
}

TEST_F(CalibrationJob, ABoardThatSlipsIsPutAgain) {
  boot();
  get_ready();
  begin();
  rig.line.fires_before = 5;
  rig.line.at_fire = [this] { show(board_at(9)); };
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_for_placement(0));
  EXPECT_EQ(sentence(), "Placement 1 of 7 again: the board slipped in placement 1.");
  take_placements(0, 0);
}

TEST_F(CalibrationJob, ContinuesInThePlacementInWhichTheEstopEndedIt) {
  boot();
  get_ready();
  const auto id = begin();
  take_placements(0, 0);
  estop_after(3);
  ASSERT_TRUE(wait_state(id, JobState::interrupted));
  EXPECT_EQ(job(id)->stored.size(), 10u);
  ASSERT_TRUE(ask(event::JobRequested{.what = What::resume, .job = id}));
  ASSERT_TRUE(clock_waits_for([this] { return loop->snapshot()->next_action.starts_with("Do not move the board"); }));
  const auto before = only_job().manifest().poses[1].views[0].taken;
  take_placements(1, 6);
  ASSERT_TRUE(wait_state(id, JobState::done));
  EXPECT_EQ(views_.boards.pairs.size(), 50u);
  EXPECT_EQ(only_job().manifest().poses[1].views[0].taken, before);
  EXPECT_EQ(only_job().manifest().poses[1].movement_checks.size(), 2u);
}

TEST_F(CalibrationJob, ContinuesAfterAPowerCutWithWhatWasStored) {
  const auto cut = folder_ / "cut";
  boot();
  get_ready();
  const auto id = begin();
  take_placements(0, 1);
  rig.line.fires_before = 4;
  rig.line.at_fire = [this, cut] {
    std::filesystem::copy(folder_ / "jobs", cut, std::filesystem::copy_options::recursive);
  };
  take_placements(2, 2);
  shut_down();
  options.jobs.root = cut;
  boot();
  get_ready();
  ASSERT_TRUE(wait_state(id, JobState::interrupted));
  EXPECT_EQ(job(id)->complete, 2);
  ASSERT_TRUE(ask(event::JobRequested{.what = What::resume, .job = id}));
  take_placements(2, 6);
  ASSERT_TRUE(wait_state(id, JobState::done));
  EXPECT_EQ(views_.boards.pairs.size(), 50u);
}

TEST_F(CalibrationJob, ShowsHowTheBoardStandsWhileItWaits) {
  boot();
  get_ready();
  begin();
  nlohmann::json seen;
  ASSERT_TRUE(clock_waits_for([&] {
    const auto reply = ctl::send_request(options.api.socket, "GET", "/api/v1/calibration");
    if (reply) seen = *reply;
    return reply && reply->at("board").is_object();
  }));
  EXPECT_EQ(seen.at("awaited_placement"), 1);
  EXPECT_EQ(seen.at("job").at("plan").size(), 7u);
  const auto& left = seen.at("board").at("left");
  EXPECT_TRUE(left.at("seen").get<bool>());
  EXPECT_EQ(left.at("outline").size(), 4u);
  EXPECT_EQ(left.at("expected").size(), 4u);
  EXPECT_TRUE(seen.at("board").at("off_mm").is_number());
  EXPECT_EQ(rig.line.exposures, 0);
}

TEST_F(CalibrationJob, TheCommandLineBeginsItFollowsItAndAccepts) {
  boot();
  get_ready();
  testing::internal::CaptureStdout();
  ExitCode end = ExitCode::internal;
  std::thread command([&] { end = ctl::calibrate({.socket = options.api.socket}, {.rig = true}); });
  {
    const Clock::Busy until_it_is_told(
        clock);  // each request looks at the board; the second comes after the first line
    while (looks() < 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  take_placements(0, 6);
  const auto id = newest()->id;
  EXPECT_TRUE(wait_state(id, JobState::done));
  const Clock::Busy replying(clock);
  command.join();
  EXPECT_EQ(end, ExitCode::ok);
  EXPECT_EQ(ctl::calibrate({.socket = options.api.socket}, {.accept = true}), ExitCode::ok);
  const auto said = testing::internal::GetCapturedStdout();
  EXPECT_THAT(said, HasSubstr("Put the board at mark 0: landscape"));
  EXPECT_THAT(said, HasSubstr("Calibration of grade A. Volume 3 um."));
  EXPECT_THAT(said, HasSubstr("is accepted."));
  EXPECT_EQ(rig_file(), new_calibration());
}

TEST_F(CalibrationJob, IsAbortedByTheApi) {
  boot();
  get_ready();
  const auto id = begin();
  take_placements(0, 0);
  {
    const Clock::Busy replying(clock);
    const auto reply = ctl::send_request(options.api.socket, "POST", "/api/v1/calibration/abort");
    EXPECT_TRUE(reply) << reply.error().message;
  }
  EXPECT_TRUE(wait_state(id, JobState::cancelled));
}

}  // namespace
}  // namespace scanrig
