#pragma once

#include <optional>
#include <string>
#include <string_view>

struct _ArvFakeCamera;  // NOLINT: name of Aravis

namespace scanrig::sim::wire {

/// Output lines of a GigE camera.
enum class GigeOutputs {
  full,                ///< Line1 and Line2: LineMode, LineSource Off, ExposureActive [GenICam SFNC 2.7, 8]
  none,                ///< no LineSelector
  no_exposure_active,  ///< LineSource without ExposureActive
  user_output,         ///< LineSource UserOutput1 instead of Off, with UserOutputSelector and UserOutputValue
};

/// By the name of the enumerator, with dashes; nothing for other names.
std::optional<GigeOutputs> parse_gige_outputs(std::string_view word);

/// Nodes of a GenICam description. Line0 is an input.
std::string describe_outputs(GigeOutputs outputs);

/// Number of the output that is active while the camera exposes, by its registers.
std::optional<int> output_while_exposing(_ArvFakeCamera* camera);

}  // namespace scanrig::sim::wire
