#pragma once

#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "daemon/api/metrics.h"
#include "daemon/api/route.h"

namespace scanrig {

/// A control loop without devices: its rig stops at once, and nothing can be done with jobs.
class StationWithoutRig {
 public:
  explicit StationWithoutRig(
      JobTable jobs, std::function<void()> published = [] {}, bool has_guard = true)
      : loop(clock_, ControlLoopOptions{.rules = {.remote = true, .guard = has_guard}}, std::move(jobs)) {
    thread_ = std::thread([this, published = std::move(published)] {
      const auto perform = [this](const Action& action) {
        if (std::holds_alternative<action::StopRig>(action)) loop.post(event::Stopped{});
        if (const auto* task = std::get_if<action::CreateJobs>(&action)) answer(task->request_id);
        if (const auto* task = std::get_if<action::MoveJob>(&action)) answer(task->request_id);
        if (const auto* task = std::get_if<action::RunJobRequest>(&action)) answer(task->asked.request_id);
      };
      EXPECT_TRUE(loop.run({.perform = perform,
                            .show = [](const PanelOutputs&) {},
                            .new_job_id = [] { return std::string("fresh"); },
                            .published = [&published](const auto&) { published(); }}));
    });
  }
  ~StationWithoutRig() { end(); }
  void end() {
    if (!thread_.joinable()) return;
    loop.post(event::Shutdown{});
    thread_.join();
  }
  StationWithoutRig(const StationWithoutRig&) = delete;
  StationWithoutRig& operator=(const StationWithoutRig&) = delete;

  RealClock clock_;
  ControlLoop loop;

 private:
  /// No jobs are kept here.
  void answer(RequestId request_id) {
    loop.post(event::RequestDone{request_id, fail(ErrorCode::refused, "there is no rig")});
  }

  std::thread thread_;
};

/// A job that failed, in a folder.
inline JobTable one_job(const std::string& id, const std::string& folder) {
  auto job = std::make_shared<JobInfo>();
  job->id = id;
  job->state = JobState::failed;
  job->folder = folder;
  job->stored = {{0, 3, 135.01, {{ErrorCode::timeout, "left camera: no frame in time"}}, 135.0, 212.0}};
  job->movement_checks = {{0, 0.04, 0.0, true, {{ErrorCode::protocol, "right camera: torn"}}}};
  job->stages = {{"volume", 0.5}};
  job->error = Error{ErrorCode::same_rest, "not turned over"};
  return {{id, std::move(job)}};
}

}  // namespace scanrig
