#pragma once

#include <Eigen/Core>
#include <bit>
#include <cstring>
#include <string>
#include <type_traits>

namespace scanrig {

// glTF, PLY and STL are little-endian, and so is every supported machine.
static_assert(std::endian::native == std::endian::little);

template <class T>
void append_bytes(std::string& bytes, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  const std::size_t at = bytes.size();
  bytes.resize(at + sizeof(T));
  std::memcpy(bytes.data() + at, &value, sizeof(T));
}

template <int N>
void append_bytes(std::string& bytes, const Eigen::Matrix<float, N, 1>& vector) {
  for (int k = 0; k < N; ++k) append_bytes(bytes, vector[k]);
}

}  // namespace scanrig
