#include "sim/wire/gige_outputs.h"

#include <array>
#include <utility>

namespace scanrig::sim::wire {
namespace {

constexpr std::array<std::pair<std::string_view, GigeOutputs>, 4> kNames{
    {{"full", GigeOutputs::full},
     {"none", GigeOutputs::none},
     {"no-exposure-active", GigeOutputs::no_exposure_active},
     {"user-output", GigeOutputs::user_output}}};

}  // namespace

std::optional<GigeOutputs> parse_gige_outputs(std::string_view word) {
  for (const auto& [name, outputs] : kNames) {
    if (name == word) return outputs;
  }
  return std::nullopt;
}

}  // namespace scanrig::sim::wire
