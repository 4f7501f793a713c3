#pragma once

#include <exception>
#include <new>

#include "core/result.h"

namespace scanrig {

/// Runs a reconstruction. The libraries below may throw what nobody foresaw, or run out of memory: that is one job's
/// bad luck. Fails as `work`, with `out_of_range` (memory) and `internal`.
template <class Work>
Result<void> guarded(const Work& work) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::out_of_range, "the reconstruction ran out of memory: use larger voxels");
  } catch (const std::exception& e) {
    return fail(ErrorCode::internal, "the reconstruction failed: {}", e.what());
  }
}

}  // namespace scanrig
