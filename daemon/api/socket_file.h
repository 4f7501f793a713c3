#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>

#include "core/result.h"

namespace scanrig {

/// A listening Unix socket at `path` with `mode` from its first moment there. A stale socket file is replaced.
/// Returns its descriptor. Fails with `refused` (another daemon listens there), `exists` (a file that is no socket),
/// `invalid_input` (the path is too long for a socket), `io`.
Result<int> listen_on_socket(const std::filesystem::path& path, mode_t mode = 0660);

/// A descriptor of its own for the listening socket `passed`, whose file gets `mode`. Fails with `io`.
Result<int> take_over_socket(int passed, mode_t mode);

/// Where a listening Unix socket is; empty where it has no path.
std::filesystem::path socket_path(int listening);

/// A connection to the daemon at `path`. Fails with `not_found` (no such file, or nobody listens there), `timeout` (a
/// daemon is there, but so many wait for it that there was no place within `limit`), `io`, `invalid_input`.
Result<int> connect_to_socket(const std::filesystem::path& path,
                              std::chrono::microseconds limit = std::chrono::seconds(2));

}  // namespace scanrig
