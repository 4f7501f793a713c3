#pragma once

#include <exception>
#include <new>
#include <string_view>
#include <type_traits>

#include "core/result.h"

namespace scanrig {

/// Runs one job's work. Libraries may throw unforeseen exceptions or run out of memory: then only this job
/// fails. Fails as `work`, with `out_of_range` (memory) and `internal`, naming `what`.
template <class Work>
std::invoke_result_t<const Work&> catch_exceptions(std::string_view what, const Work& work) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::out_of_range, "{} ran out of memory: use larger voxels, or free some", what);
  } catch (const std::exception& e) {
    return fail(ErrorCode::internal, "{} failed: {}", what, e.what());
  }
}

}  // namespace scanrig
