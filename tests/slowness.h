#pragma once

namespace scanrig {

/// Factor by which work may take longer in this build, for tests whose subject is not the time limit.
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
inline constexpr int kSlowness = 8;
#else
inline constexpr int kSlowness = 1;
#endif

}  // namespace scanrig
