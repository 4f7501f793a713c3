#pragma once

#include <string>

#include "core/clock.h"
#include "core/result.h"

namespace scanrig {

/// Outputs of a camera that are active while it exposes [GenICam SFNC 2.7, 8: LineSource ExposureActive], and the
/// trigger of that exposure. An output lights a projector and triggers the other camera of the pair.
/// Belongs to a camera, which outlives it and connects. Exposures made by the camera's own driver leave all outputs
/// off. Threads: the camera's owner.
class CameraStrobe {
 public:
  virtual ~CameraStrobe() = default;

  /// Makes `output`, by its SFNC name ("Line1"), follow the exposures, and switches the others off. An empty name
  /// switches all off, also during an exposure.
  /// Fails with `io` (not connected, refused), `timeout`, `invalid_input` (a value that the camera rejects). After a
  /// failure the camera has to be prepared again: it is connected anew, with all outputs off.
  virtual Result<void> select_output(const std::string& output, Deadline deadline) = 0;

  /// Starts one exposure by software; does not wait for its end. Fails as select_output().
  virtual Result<void> start_exposure(Deadline deadline) = 0;
};

}  // namespace scanrig
