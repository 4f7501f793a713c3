#include "daemon/station/operator_message.h"

#include <gtest/gtest.h>

namespace scanrig {
namespace {

PanelOutputs of(MachineState machine, Activity activity, const JobTable& jobs = {},
                const std::string& last_started_job = {}) {
  StationState state;
  state.machine = machine;
  state.activity = activity;
  state.last_started_job = last_started_job;
  return lamps(state, jobs);
}

TEST(Lamps, TellIdleWorkingActNowAndFaultApart) {
  const auto halted = of(MachineState::halted, Activity::none);
  const auto warning = of(MachineState::single_execution, Activity::warning);
  const auto working = of(MachineState::single_execution, Activity::scanning);
  const auto ready = of(MachineState::ready, Activity::none);
  const auto flip = of(MachineState::single_execution, Activity::waiting_for_flip);
  const auto fault = of(MachineState::error, Activity::none);
  EXPECT_EQ(halted, (PanelOutputs{.amber = true}));
  EXPECT_EQ(warning, (PanelOutputs{.amber = true, .busy = true}));
  EXPECT_EQ(working, (PanelOutputs{.green = true, .busy = true}));
  EXPECT_EQ(ready, (PanelOutputs{.green = true, .start_lamp = true}));
  EXPECT_EQ(flip, (PanelOutputs{.amber = true, .start_lamp = true, .flip_request = true}));
  EXPECT_EQ(fault, (PanelOutputs{.red = true}));
  EXPECT_EQ(of(MachineState::continuous_execution, Activity::waiting_for_part),
            (PanelOutputs{.green = true, .start_lamp = true}));
}

TEST(Lamps, StartIsDarkWhileTheCalibrationRefusesTheNextScan) {
  StationState state;
  state.machine = MachineState::ready;
  EXPECT_TRUE(lamps(state, {}).start_lamp);
  state.calibration.problem = Error{ErrorCode::not_found, "there is no calibration"};
  EXPECT_FALSE(lamps(state, {}).start_lamp);
  EXPECT_TRUE(lamps(state, {}).green);
}

TEST(Lamps, AFaultIsRedOnlyEvenWhileStopping) {
  EXPECT_EQ(of(MachineState::error, Activity::stopping), (PanelOutputs{.red = true, .busy = true}));
}

TEST(Lamps, PassAndFailTellHowTheJobOfThePartPutOnLastEnded) {
  const auto job = [](JobState state) { return std::make_shared<const JobInfo>(JobInfo{.state = state}); };
  JobTable jobs{{"1", job(JobState::failed)}, {"2", job(JobState::done)}, {"3", job(JobState::scanning)}};
  const auto ready = [&](const char* last) { return of(MachineState::ready, Activity::none, jobs, last); };
  EXPECT_TRUE(ready("2").pass);
  EXPECT_FALSE(ready("2").fail);
  EXPECT_TRUE(ready("1").fail);
  EXPECT_FALSE(ready("1").pass);
  for (const auto* unknown : {"3", "gone", ""}) {
    EXPECT_FALSE(ready(unknown).pass) << unknown;
    EXPECT_FALSE(ready(unknown).fail) << unknown;
  }
  jobs["5"] = std::make_shared<const JobInfo>(JobInfo{.state = JobState::done, .passed = false});
  EXPECT_TRUE(ready("5").fail) << "a model beyond the limits";
}

}  // namespace
}  // namespace scanrig
