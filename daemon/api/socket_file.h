#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>

#include "core/result.h"

namespace scanrig {

/// Creates a listening Unix socket at `path`, with `mode` from its first moment there. A stale socket file is replaced.
/// Returns its descriptor. Fails with `refused` (another daemon listens there), `exists` (a file that is not a socket),
/// `invalid_input` (the path is too long for a socket), `io`.
Result<int> listen_on_socket(const std::filesystem::path& path, mode_t mode = 0660);

/// A separate descriptor for the listening socket `passed`, whose file gets `mode`. Fails with `io`.
Result<int> take_over_socket(int passed, mode_t mode);

/// Path of a listening Unix socket; empty without one.
std::filesystem::path socket_path(int listening);

/// A connection to the daemon at `path`. Fails with `not_found` (no such file, or no daemon listens), `timeout` (a
/// daemon listens, but its queue had no place within `limit`), `io`, `invalid_input`.
Result<int> connect_to_socket(const std::filesystem::path& path,
                              std::chrono::microseconds limit = std::chrono::seconds(2));

}  // namespace scanrig
