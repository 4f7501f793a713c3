#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace scanrig {

/// Eight numbers side by side, in whatever registers a processor has: GCC's and Clang's vector types, no instruction
/// set of their own. Each lane is computed by itself and sums run in one order, so every processor gives the same bits
/// (-ffp-contract=off). Inlined always, so that a caller compiled for more instructions gets them here too.
using Lanes = float __attribute__((vector_size(32)));
using LaneInts = std::int32_t __attribute__((vector_size(32)));
using LaneDoubles = double __attribute__((vector_size(64)));
using LaneBytes = std::uint8_t __attribute__((vector_size(8)));
using FourLanes = float __attribute__((vector_size(16)));
constexpr int kLanes = 8;

#define SCANRIG_LANES [[gnu::always_inline]] inline

template <class Vector, class Value>
SCANRIG_LANES void load(Vector& into, const Value* from) {
  std::memcpy(&into, from, sizeof(Vector));
}

/// Sum of the lanes in double precision, always in the same order.
SCANRIG_LANES double sum_of(const LaneDoubles& v) {
  return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
}

SCANRIG_LANES double sum_of(const Lanes& v) { return sum_of(__builtin_convertvector(v, LaneDoubles)); }

/// One cubic for each lane, c0 + t (c1 + t (c2 + t c3)), at fractions t: the cubics at columns of a row, four
/// coefficients each.
SCANRIG_LANES void cubics_at(Lanes& into, const float* row, const LaneInts& column, const Lanes& t) {
  FourLanes c[kLanes];
  for (int k = 0; k < kLanes; ++k) load(c[k], row + std::ptrdiff_t{4} * column[k]);
  Lanes pair[4];  // lane k beside lane k + 4
  for (int k = 0; k < 4; ++k) pair[k] = __builtin_shufflevector(c[k], c[k + 4], 0, 1, 2, 3, 4, 5, 6, 7);
  // Transposed, four by four.
  const Lanes a = __builtin_shufflevector(pair[0], pair[1], 0, 8, 1, 9, 4, 12, 5, 13);
  const Lanes b = __builtin_shufflevector(pair[2], pair[3], 0, 8, 1, 9, 4, 12, 5, 13);
  const Lanes d = __builtin_shufflevector(pair[0], pair[1], 2, 10, 3, 11, 6, 14, 7, 15);
  const Lanes e = __builtin_shufflevector(pair[2], pair[3], 2, 10, 3, 11, 6, 14, 7, 15);
  const Lanes c0 = __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13);
  const Lanes c1 = __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15);
  const Lanes c2 = __builtin_shufflevector(d, e, 0, 1, 8, 9, 4, 5, 12, 13);
  const Lanes c3 = __builtin_shufflevector(d, e, 2, 3, 10, 11, 6, 7, 14, 15);
  into = c0 + t * (c1 + t * (c2 + t * c3));
}

}  // namespace scanrig
