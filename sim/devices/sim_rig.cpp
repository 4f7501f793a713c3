#include "sim/devices/sim_rig.h"

#include "sim/devices/simulated_devices.h"
#include "sim/scene/profile.h"

namespace scanrig::sim {
namespace {

class Rig final : public SimRig {
 public:
  Rig(std::unique_ptr<Scene> scene, Clock& clock) : state_(std::move(scene), clock) {}

  Turntable& turntable() override { return turntable_; }
  Projector& projector() override { return projector_; }
  StereoCamera& camera() override { return camera_; }
  Panel& panel() override { return panel_; }

  void press_start() override { set(state_.start, Button::pressed); }
  void press_stop() override { set(state_.stop, Button::pressed); }
  void press_reset() override { set(state_.reset, Button::pressed); }
  void set_estop(bool ok) override { set(state_.estop_ok, ok); }
  void set_guard(bool closed) override { set(state_.guard_closed, closed); }
  void stall_turntable(bool stalled) override { set(state_.stalled, stalled); }
  void lose_frames(int count) override { set(state_.frames_to_lose, count); }

  void turn_over() override {
    const std::scoped_lock lock(state_.mutex);
    state_.history.turned_over(*state_.scene);
  }

  void put_board(int number) override {
    const std::scoped_lock lock(state_.mutex);
    state_.board_placement = number;
  }

  PanelOutputs lamps() const override {
    const std::scoped_lock lock(state_.mutex);
    return state_.lamps;
  }

  Result<void> write_calibration(const std::filesystem::path& file) const override {
    return sim::write_calibration(*state_.scene, file);
  }

  Result<void> write_truth(const std::filesystem::path& folder) const override {
    std::vector<PoseTruth> taken;
    {
      const std::scoped_lock lock(state_.mutex);
      taken = state_.history.latest(*state_.scene);
    }
    return sim::write_truth(*state_.scene, taken, folder);
  }

  std::string profile_sha256() const override { return state_.scene->options().profile.sha256(); }
  std::array<double, 2> measured_board_length() const override {
    return {state_.board.measured_length_mm(), BoardOnTable::kLengthSigmaMm};
  }
  std::array<std::string, 2> camera_serials() const override {
    return {state_.scene->rig().left.serial, state_.scene->rig().right.serial};
  }

 private:
  template <class T>
  void set(T& what, T value) {
    const std::scoped_lock lock(state_.mutex);
    what = value;
    state_.clock.notify_all(state_.changed);
  }

  mutable SharedState state_;
  SimTurntable turntable_{state_};
  SimProjector projector_{state_};
  SimStereoCamera camera_{state_};
  SimPanel panel_{state_};
};

}  // namespace

Result<std::unique_ptr<SimRig>> SimRig::create(const SimRigOptions& options, Clock& clock) {
  auto scene = Scene::create({.object = options.object,
                              .height_mm = options.height_mm,
                              .seed = options.seed,
                              .poses = options.poses,
                              .image_scale = options.image_scale,
                              .same_rest_twice = options.same_rest_twice,
                              .noise = options.noise,
                              .rig = options.rig,
                              .profile = options.profile,
                              .views = options.views});
  if (!scene) return pass_on(scene, "simulated rig");
  return std::make_unique<Rig>(std::move(*scene), clock);
}

}  // namespace scanrig::sim
