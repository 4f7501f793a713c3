#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "sim/apps/view_cache.h"
#include "sim/scene/truth_writer.h"
#include "sim/wire/gige_camera.h"

namespace scanrig::sim {

struct RigTruth;

struct RigCamerasOptions {
  SceneOptions scene;
  std::vector<Place> expected;  ///< rendered before it is requested
  bool numbered = false;        ///< write the number of the edge into every frame, see faint_number()
  int max_exposure_us = 0;      ///< see GigeModel
  /// Seed of the registers of both cameras at power-on, half of which have no user sets; empty: a sound state.
  std::optional<std::uint64_t> state{};
};

/// State of the lights, as shares of a sound rig's.
struct RigLights {
  double pattern = 1.0;       ///< of the pattern's lamp, while its line is active
  double plain = 1.0;         ///< of the plain light, likewise
  double room = 0.0;          ///< plain light that is always on
  bool is_slide_in = true;    ///< see LightLevels
  double change_per_s = 0.0;  ///< of both lamps, as a share

  bool operator==(const RigLights&) const = default;
};

/// One edge of the light, and its exposure.
struct RigExposure {
  std::uint64_t number = 0;  ///< counts the edges
  bool pattern = false;
  bool lit = true;  ///< the light was on for the whole exposure
  Place place{};    ///< in the middle of the exposure
  Clock::TimePoint at{}, ended{};
  Clock::TimePoint read{};  ///< both frames were read out and their sending started
};

/// The edge that a frame with `numbered` belongs to: the lowest bits of its first 32 pixels. For tests only, not used
/// by drivers.
std::uint32_t faint_number(const cv::Mat& frame);

/// Two GigE cameras that look at the rendered scene: every edge of the light exposes both. A frame shows the object and
/// the table angle in the middle of the exposure. It is sent 37 ms after the edge, or once rendered; an unexpected view
/// takes as long as its rendering. An exposure whose light went out early is dark, and so is one by software, but for
/// the room's light. Threads: every function may be called from any thread, edge() and light_out() from one at a time.
class RigCameras {
 public:
  static constexpr const char* kLeftAddress = "127.0.0.1";
  static constexpr const char* kRightAddress = "127.0.0.2";

  /// `truth` is called from a thread of the cameras. Fails as Scene::create and GigeCameras::start.
  static Result<std::unique_ptr<RigCameras>> start(const RigCamerasOptions& options, std::function<RigTruth()> truth,
                                                   Clock& clock);
  ~RigCameras();

  void edge(bool pattern);
  void light_out();
  void turned_over();
  void set_lights(const RigLights& lights);
  /// Waits until all expected views are rendered; false when `stop` came first.
  bool wait_until_ready(const std::stop_token& stop) { return views_.wait_until_ready(stop); }

  [[nodiscard]] std::vector<RigExposure> exposures() const;
  /// Calibration, and truth.json and truth.ply of the last poses taken. Fail with `degenerate` (nothing taken), `io`.
  Result<void> write_calibration(const std::filesystem::path& file) const;
  Result<void> write_truth(const std::filesystem::path& folder) const;
  [[nodiscard]] wire::GigeCameras& wire() { return *wire_; }

 private:
  RigCameras(std::unique_ptr<Scene> scene, const RigCamerasOptions& options, std::function<RigTruth()> truth,
             Clock& clock);
  void develop(const std::stop_token& stop);
  StereoImages image(const RigExposure& exposure);
  StereoImages image_by_software(std::uint64_t number);
  [[nodiscard]] StereoImages expose(const View& view, const RigExposure& exposure) const;
  bool ready(const wire::GigeExposure& exposure) const;
  void read_out(wire::Side side, const wire::GigeExposure& exposure, cv::Mat& image);

  const std::function<RigTruth()> truth_;
  Clock& clock_;
  const bool numbered_;
  const std::unique_ptr<Scene> scene_;

  mutable std::mutex mutex_;
  std::condition_variable_any exposed_;
  ExposureHistory history_;
  RigLights lights_;
  Clock::TimePoint lights_set_{};
  std::vector<RigExposure> exposures_;            // by number, from 1
  std::size_t developed_ = 0;                     // of them
  std::map<std::uint64_t, StereoImages> images_;  // the last few, by number

  ViewCache views_;
  std::unique_ptr<wire::GigeCameras> wire_;
  std::jthread developer_;
};

}  // namespace scanrig::sim
