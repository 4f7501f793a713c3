#pragma once

#include <fmt/format.h>

#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>

namespace scanrig {

/// Kind of failure, for programs. The message beside it is for the person at the rig.
enum class ErrorCode {
  invalid_input,  ///< a file, an option or a request that cannot be used as it is
  not_found,      ///< a named thing does not exist
  exists,         ///< the result would overwrite something
  io,             ///< the operating system refused: disk, port, socket
  timeout,        ///< no positive evidence before the deadline
  protocol,       ///< a malformed reply: checksum, length, wrong request
  out_of_range,   ///< a value outside what the device or the rig allows
  device_alarm,   ///< the device itself reports a fault
  stalled,        ///< commanded to move, does not move
  not_homed,      ///< home not found
  stopped,        ///< stopped on request
  busy,           ///< another operation is running
  refused,        ///< a rule of the station forbids it now
  unsupported,    ///< this version or this device cannot do it
  not_closed,     ///< a surface that should bound a solid does not
  degenerate,     ///< geometry without enough content to decide
  no_overlap,     ///< two data sets share no surface
  ambiguous,      ///< more than one solution fits the data
  same_rest,      ///< the object was not turned over
  moved,          ///< the object or a camera moved during a pose
  below_limits,   ///< a model outside its recipe's limits
  internal,       ///< a bug
};

std::string_view to_string(ErrorCode code);
std::optional<ErrorCode> parse_error_code(std::string_view name);  ///< of the names of to_string()

struct Error {
  ErrorCode code = ErrorCode::internal;
  std::string message;  ///< who, doing what, what happened, what to do

  /// The same error with its outer context in front: "who: message".
  [[nodiscard]] Error in(std::string_view who) const;
};

template <class T>
using Result = tl::expected<T, Error>;

/// For display: "turntable: no reply" becomes "Turntable: no reply."
std::string as_sentence(std::string_view message);

/// `return fail(ErrorCode::io, "cannot open {}: {}", path, reason);`
template <class... Args>
[[nodiscard]] tl::unexpected<Error> fail(ErrorCode code, fmt::format_string<Args...> text, Args&&... args) {
  return tl::unexpected<Error>(Error{code, fmt::format(text, std::forward<Args>(args)...)});
}

/// Passes an error on unchanged: `return pass_on(result);`
template <class T>
[[nodiscard]] tl::unexpected<Error> pass_on(const Result<T>& result) {
  return tl::unexpected<Error>(result.error());
}

/// Passes an error on with its context: `return pass_on(result, "turntable");`
template <class T>
[[nodiscard]] tl::unexpected<Error> pass_on(const Result<T>& result, std::string_view who) {
  return tl::unexpected<Error>(result.error().in(who));
}

/// Exit codes of every scanrig program, documented in docs/reference/exit-codes.md.
enum class ExitCode : int {
  ok = 0,
  internal = 1,
  usage = 2,
  bad_input = 3,
  disk = 4,
  device = 5,
  refused = 6,
  no_model = 7,
  below_limits = 8,
  unreachable = 9,
  stopped = 10,
  partly_safe = 11,
  standstill_unknown = 12,
};

ExitCode exit_code(ErrorCode code);

}  // namespace scanrig
