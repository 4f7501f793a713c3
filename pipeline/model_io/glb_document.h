#pragma once

#include <nlohmann/json.hpp>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "pipeline/model_io/bytes.h"

namespace scanrig {

// Numbers of the glTF 2.0 specification.
inline constexpr double kMetresPerMm = 0.001;
inline constexpr int kGltfByte = 5120;
inline constexpr int kGltfUbyte = 5121;
inline constexpr int kGltfShort = 5122;
inline constexpr int kGltfUshort = 5123;
inline constexpr int kGltfUint = 5125;
inline constexpr int kGltfFloat = 5126;
inline constexpr int kGltfArrayBuffer = 34962;
inline constexpr int kGltfElementArrayBuffer = 34963;

/// A glTF 2.0 binary file of one mesh with one matte material, as it is put together.
class GlbDocument {
 public:
  GlbDocument();

  /// Appended bytes as a buffer view; returns its number. `stride` in bytes: of interleaved attributes.
  int add_view(std::string_view bytes, std::optional<int> target = {}, std::optional<int> stride = {});
  /// Of a buffer view; returns its number.
  int add_accessor(int view, std::size_t offset, int component, std::size_t count, const char* type);
  /// A view and an accessor of values of `per_value` components' groups each, in the file as in memory.
  template <class T>
  int add(const std::vector<T>& values, int component, const char* type, int per_value, int target) {
    const std::string_view bytes(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    return add_accessor(add_view(bytes, target), 0, component, values.size() * static_cast<std::size_t>(per_value),
                        type);
  }
  nlohmann::json& accessor(int number) { return accessors_[static_cast<std::size_t>(number)]; }
  /// Texture of the material, as JPEG of that quality. Fails with `internal`.
  Result<void> add_texture(const cv::Mat3b& image, int quality);

  /// The whole file.
  [[nodiscard]] std::string file();

  nlohmann::json gltf;  ///< nodes and meshes are the user's

 private:
  std::string bytes_;
  nlohmann::json views_ = nlohmann::json::array();
  nlohmann::json accessors_ = nlohmann::json::array();
};

}  // namespace scanrig
