#pragma once

#include <optional>
#include <string_view>

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

}  // namespace scanrig::sim::wire
