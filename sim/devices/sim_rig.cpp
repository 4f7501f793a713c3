#include "sim/devices/sim_rig.h"

#include "sim/devices/simulated_devices.h"
#include "sim/scene/profile.h"

namespace scanrig::sim {
namespace {

class Rig final : public SimRig {
 public:
  Rig(std::unique_ptr<Scene> scene, Clock& clock) : bench_(std::move(scene), clock) {}

  Turntable& turntable() override { return turntable_; }
  Projector& projector() override { return projector_; }
  StereoCamera& camera() override { return camera_; }
  Panel& panel() override { return panel_; }

  void press_start() override { set(bench_.start, Button::pressed); }
  void press_stop() override { set(bench_.stop, Button::pressed); }
  void press_reset() override { set(bench_.reset, Button::pressed); }
  void set_estop(bool ok) override { set(bench_.estop_ok, ok); }
  void stall_turntable(bool stalled) override { set(bench_.stalled, stalled); }
  void lose_frames(int count) override { set(bench_.frames_to_lose, count); }

  void turn_over() override {
    const std::scoped_lock lock(bench_.mutex);
    bench_.history.turned_over(*bench_.scene);
  }

  PanelOutputs lamps() const override {
    const std::scoped_lock lock(bench_.mutex);
    return bench_.lamps;
  }

  Result<void> write_calibration(const std::filesystem::path& file) const override {
    return sim::write_calibration(*bench_.scene, file);
  }

  Result<void> write_truth(const std::filesystem::path& folder) const override {
    std::vector<PoseTruth> taken;
    {
      const std::scoped_lock lock(bench_.mutex);
      taken = bench_.history.latest(*bench_.scene);
    }
    return sim::write_truth(*bench_.scene, taken, folder);
  }

  std::string profile_sha256() const override { return sim::profile_sha256(); }
  std::array<std::string, 2> camera_serials() const override {
    return {bench_.scene->rig().left.serial, bench_.scene->rig().right.serial};
  }

 private:
  template <class T>
  void set(T& what, T value) {
    const std::scoped_lock lock(bench_.mutex);
    what = value;
    bench_.clock.notify_all(bench_.changed);
  }

  mutable Bench bench_;
  SimTurntable turntable_{bench_};
  SimProjector projector_{bench_};
  SimStereoCamera camera_{bench_};
  SimPanel panel_{bench_};
};

}  // namespace

Result<std::unique_ptr<SimRig>> SimRig::create(const SimRigOptions& options, Clock& clock) {
  auto scene = Scene::create({.object = options.object,
                              .height_mm = options.height_mm,
                              .seed = options.seed,
                              .poses = options.poses,
                              .image_scale = options.image_scale,
                              .same_rest_twice = options.same_rest_twice,
                              .noise = options.noise});
  if (!scene) return pass_on(scene, "simulated rig");
  return std::make_unique<Rig>(std::move(*scene), clock);
}

}  // namespace scanrig::sim
