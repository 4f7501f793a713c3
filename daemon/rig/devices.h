#pragma once

#include "drivers/camera/stereo_camera.h"
#include "drivers/panel/panel.h"
#include "drivers/projector/projector.h"
#include "drivers/turntable/turntable.h"

namespace scanrig {

/// The devices of the rig, opened by main(); they outlive the daemon.
struct Devices {
  Turntable& turntable;
  Projector& projector;
  StereoCamera& camera;
  Panel& panel;
};

}  // namespace scanrig
