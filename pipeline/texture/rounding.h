#pragma once

namespace scanrig {

/// As std::floor and std::ceil for what fits an int: without a call, where the processor may lack the instruction.
inline int rounded_down(float v) {
  const int whole = static_cast<int>(v);
  return whole - (static_cast<float>(whole) > v ? 1 : 0);
}
inline int rounded_up(float v) { return -rounded_down(-v); }

}  // namespace scanrig
