#pragma once

#include <string>
#include <vector>

#include "drivers/camera/genicam_call.h"

namespace scanrig {

/// Makes `outputs` of a camera outputs, and off [GenICam SFNC 2.7, 8].
/// Fails with `unsupported` (the camera has no such output, or the output no ExposureActive or no off), and as
/// GenicamCall.
Result<void> set_up_outputs(ArvCamera* camera, const std::vector<std::string>& outputs, const GenicamCall& attempt);

/// Makes `selected` of `outputs` follow the exposures and switches the others off; empty: all. Fails as GenicamCall.
Result<void> select_output(ArvCamera* camera, const std::vector<std::string>& outputs, const std::string& selected,
                           const GenicamCall& attempt);

}  // namespace scanrig
