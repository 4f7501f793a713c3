#pragma once

#include <filesystem>
#include <string>

#include "core/result.h"

namespace scanrig::sim {

/// True position of the table at the far end of the wire.
struct TableTruth {
  double angle_deg = 0.0;  ///< counter-clockwise seen from above, from home
  double speed_deg_s = 0.0;
  bool stopped = false;
  bool projector_on = false;
};

/// Client of the wire simulator's control socket: one line of JSON per request, `{"get":"truth"}`, one per reply.
/// Threads: one user at a time.
class TruthSocket {
 public:
  explicit TruthSocket(std::filesystem::path path) : path_(std::move(path)) {}
  ~TruthSocket();
  TruthSocket(const TruthSocket&) = delete;
  TruthSocket& operator=(const TruthSocket&) = delete;

  /// Connects if not connected. Fails with `io` (no simulator, or its end), `timeout`, `protocol`.
  Result<TableTruth> get();

 private:
  Result<void> connect();
  Result<std::string> request();
  tl::unexpected<Error> lost(ErrorCode code, const std::string& why);

  const std::filesystem::path path_;
  int descriptor_ = -1;
  std::string pending_;
};

}  // namespace scanrig::sim
