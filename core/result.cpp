#include "core/result.h"

#include <cctype>

namespace scanrig {

std::string_view to_string(ErrorCode code) {
  switch (code) {
    case ErrorCode::invalid_input: return "invalid_input";
    case ErrorCode::not_found: return "not_found";
    case ErrorCode::exists: return "exists";
    case ErrorCode::io: return "io";
    case ErrorCode::timeout: return "timeout";
    case ErrorCode::protocol: return "protocol";
    case ErrorCode::out_of_range: return "out_of_range";
    case ErrorCode::device_alarm: return "device_alarm";
    case ErrorCode::stalled: return "stalled";
    case ErrorCode::not_homed: return "not_homed";
    case ErrorCode::stopped: return "stopped";
    case ErrorCode::busy: return "busy";
    case ErrorCode::refused: return "refused";
    case ErrorCode::unsupported: return "unsupported";
    case ErrorCode::not_closed: return "not_closed";
    case ErrorCode::degenerate: return "degenerate";
    case ErrorCode::no_overlap: return "no_overlap";
    case ErrorCode::ambiguous: return "ambiguous";
    case ErrorCode::same_rest: return "same_rest";
    case ErrorCode::moved: return "moved";
    case ErrorCode::below_limits: return "below_limits";
    case ErrorCode::internal: return "internal";
  }
  return "unknown";
}

std::optional<ErrorCode> parse_error_code(std::string_view name) {
  for (int i = 0; i <= static_cast<int>(ErrorCode::internal); ++i) {
    if (to_string(static_cast<ErrorCode>(i)) == name) return static_cast<ErrorCode>(i);
  }
  return std::nullopt;
}

std::string as_sentence(std::string_view message) {
  std::string sentence(message);
  if (sentence.empty()) return sentence;
  sentence.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(sentence.front())));
  if (std::string_view(".!?").find(sentence.back()) == std::string_view::npos) sentence += '.';
  return sentence;
}

Error Error::in(std::string_view who) const { return Error{code, fmt::format("{}: {}", who, message)}; }

ExitCode exit_code(ErrorCode code) {
  switch (code) {
    case ErrorCode::invalid_input:
    case ErrorCode::not_found:
    case ErrorCode::exists:
    case ErrorCode::unsupported: return ExitCode::bad_input;
    case ErrorCode::io: return ExitCode::disk;
    case ErrorCode::timeout:
    case ErrorCode::protocol:
    case ErrorCode::out_of_range:
    case ErrorCode::device_alarm:
    case ErrorCode::stalled:
    case ErrorCode::not_homed: return ExitCode::device;
    case ErrorCode::busy:
    case ErrorCode::refused: return ExitCode::refused;
    case ErrorCode::not_closed:
    case ErrorCode::degenerate:
    case ErrorCode::no_overlap:
    case ErrorCode::ambiguous:
    case ErrorCode::same_rest:
    case ErrorCode::moved: return ExitCode::no_model;
    case ErrorCode::below_limits: return ExitCode::below_limits;
    case ErrorCode::stopped: return ExitCode::stopped;
    case ErrorCode::internal: return ExitCode::internal;
  }
  return ExitCode::internal;
}

}  // namespace scanrig
