#pragma once

#include <filesystem>
#include <string>

#include "core/result.h"

namespace scanrig::sim {

/// Where the table really is, as the far end of the wire knows it.
struct TableTruth {
  double angle_deg = 0.0;  ///< counter-clockwise seen from above, from home
  double speed_deg_s = 0.0;
  bool standing = false;
  bool projector_on = false;
};

/// Client of the wire simulator's control socket: a line of JSON asks, `{"get":"truth"}`, a line of JSON answers.
/// Threads: one user at a time.
class TruthSocket {
 public:
  explicit TruthSocket(std::filesystem::path path) : path_(std::move(path)) {}
  ~TruthSocket();
  TruthSocket(const TruthSocket&) = delete;
  TruthSocket& operator=(const TruthSocket&) = delete;

  /// Connects where it is not connected. Fails with `io` (nobody there, or gone), `timeout`, `protocol`.
  Result<TableTruth> get();

 private:
  Result<void> connect();
  Result<std::string> ask();
  tl::unexpected<Error> lost(ErrorCode code, const std::string& why);

  const std::filesystem::path path_;
  int descriptor_ = -1;
  std::string pending_;
};

}  // namespace scanrig::sim
