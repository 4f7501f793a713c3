#pragma once

#include "drivers/camera/aravis_stereo_camera.h"
#include "drivers/camera/genicam_call.h"

namespace scanrig {

/// Sets up one camera from whatever state it is in: it is stopped, its user set Default is loaded where it has one, and
/// what the rig relies on is set and read back: image, outputs, trigger, packets, clock [GenICam SFNC 2.7]. Features
/// that the camera lacks are left out unless the rig needs them. Waits for PTP until `deadline` where it is configured.
/// See open_aravis() for errors.
Result<void> set_up(ArvCamera* camera, const AravisOptions& options, const std::string& address, Clock& clock,
                    Deadline deadline, const GenicamCall& attempt);

/// Pixels, region, exposure and tone. `is_standard`: the user set Default has been loaded, which gives gain and black
/// level where none is configured; otherwise these are the lowest.
Result<void> set_up_image(ArvCamera* camera, const AravisOptions& options, bool is_standard,
                          const GenicamCall& attempt);

/// Sets the exposure and reads it back. Fails with `invalid_input` (the camera takes another one), and as GenicamCall.
Result<void> set_exposure(ArvCamera* camera, std::chrono::microseconds exposure, const GenicamCall& attempt);

/// True if the camera's clock follows PTP or is about to.
bool has_ptp_on(ArvCamera* camera);

/// Switches PTP on where it is configured and waits until the clock follows it to 0.1 ms.
/// Fails with `unsupported` (no PTP), `timeout`, and as GenicamCall.
Result<void> set_up_clock(ArvCamera* camera, const AravisOptions& options, Clock& clock, Deadline deadline,
                          const GenicamCall& attempt);

/// Selects the line, or "Software", that starts an exposure. Many cameras reject it while they acquire.
Result<void> set_trigger_source(ArvCamera* camera, const std::string& source, const GenicamCall& attempt);

}  // namespace scanrig
