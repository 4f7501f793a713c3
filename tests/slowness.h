#pragma once

namespace scanrig {

/// How many times longer work may take in this build, for tests with a limit that is not their subject.
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
inline constexpr int kSlowness = 8;
#else
inline constexpr int kSlowness = 1;
#endif

}  // namespace scanrig
