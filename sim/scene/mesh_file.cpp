#include "sim/scene/mesh_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <numeric>
#include <sstream>

#include "core/files.h"
#include "sim/scene/texture_image.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3f;
using Eigen::Vector3i;
namespace fs = std::filesystem;

/// The words of one line, numbers parsed on demand.
struct Words {
  std::vector<std::string_view> all;

  explicit Words(std::string_view line) {
    std::size_t at = 0;
    while ((at = line.find_first_not_of(" \t\r", at)) != std::string_view::npos) {
      const std::size_t end = std::min(line.find_first_of(" \t\r", at), line.size());
      all.push_back(line.substr(at, end - at));
      at = end;
    }
  }
  [[nodiscard]] double number(std::size_t i) const {
    double value = std::nan("");
    if (i >= all.size()) return value;
    const std::string_view word = all[i].substr(all[i].starts_with('+') ? 1 : 0);
    std::from_chars(word.data(), word.data() + word.size(), value);
    return value;
  }
};

template <class Body>
void for_each_line(std::string_view text, const Body& body) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    body(text.substr(at, end - at));
    at = end + 1;
  }
}

/// "7", "7/3", "7/3/2", "7//2", "-1/-1": position and texture index from 0, -1 where there is none.
std::array<int, 2> obj_corner(std::string_view word, std::size_t positions, std::size_t coordinates) {
  std::array<int, 2> index = {0, 0};
  const char* at = word.data();
  const char* end = at + word.size();
  at = std::from_chars(at, end, index[0]).ptr;
  if (at < end && *at == '/') std::from_chars(at + 1, end, index[1]);
  const auto from_zero = [](int i, std::size_t count) { return i < 0 ? static_cast<int>(count) + i : i - 1; };
  return {from_zero(index[0], positions), from_zero(index[1], coordinates)};
}

/// The image of an OBJ's material, or the one beside it with the name <name>_texture.png (and <stem>_texture.png for a
/// name with a suffix after an underscore).
Result<cv::Mat> obj_image(const fs::path& file, const std::string& library) {
  std::string name;
  if (!library.empty()) {
    if (const auto text = read_file(file.parent_path() / library)) {
      for_each_line(*text, [&](std::string_view line) {
        const Words words(line);
        if (words.all.size() > 1 && words.all[0] == "map_Kd") name = words.all.back();
      });
    }
  }
  const std::string stem = file.stem().string();
  for (const std::string& candidate : {name, stem + "_texture.png", stem.substr(0, stem.find('_')) + "_texture.png"}) {
    if (candidate.empty() || !fs::exists(file.parent_path() / candidate)) continue;
    const auto bytes = read_file(file.parent_path() / candidate);
    if (!bytes) return pass_on(bytes);
    auto image = decode_texture(*bytes);
    if (image) return image;
    return fail(ErrorCode::invalid_input, "object {}: its texture {}: {}", file.string(), candidate,
                image.error().message);
  }
  return cv::Mat();
}

struct PlyProperty {
  std::string type, name, count_type;  // count_type only of lists
};
struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;
};

std::size_t ply_size(const std::string& type) {
  if (type == "char" || type == "uchar" || type == "int8" || type == "uint8") return 1;
  if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") return 2;
  if (type == "double" || type == "float64") return 8;
  return 4;
}

/// Reads the values of a PLY body one after the other, text or little-endian; NaN past its end.
class PlyBody {
 public:
  PlyBody(std::string_view bytes, bool text) : bytes_(bytes), text_(text) {}

  double next(const std::string& type) { return text_ ? next_word() : next_binary(type); }
  [[nodiscard]] bool at_end() const { return at_ >= bytes_.size(); }

 private:
  double next_word() {
    at_ = std::min(bytes_.find_first_not_of(" \t\r\n", at_), bytes_.size());
    double value = std::nan("");
    const auto [end, error] = std::from_chars(bytes_.data() + at_, bytes_.data() + bytes_.size(), value);
    at_ = error == std::errc() ? static_cast<std::size_t>(end - bytes_.data()) : bytes_.size();
    return value;
  }
  template <class T>
  double raw() {
    T value;
    if (at_ + sizeof value > bytes_.size()) {
      at_ = bytes_.size();
      return std::nan("");
    }
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return static_cast<double>(value);
  }
  double next_binary(const std::string& type) {
    const bool is_unsigned = type[0] == 'u';
    switch (ply_size(type)) {
      case 1: return is_unsigned ? raw<std::uint8_t>() : raw<std::int8_t>();
      case 2: return is_unsigned ? raw<std::uint16_t>() : raw<std::int16_t>();
      case 8: return raw<double>();
      default: return type[0] == 'f' ? raw<float>() : is_unsigned ? raw<std::uint32_t>() : raw<std::int32_t>();
    }
  }

  std::string_view bytes_;
  bool text_;
  std::size_t at_ = 0;
};

struct PlyHeader {
  std::string format;
  std::vector<PlyElement> elements;
  std::size_t end = 0;  ///< start of the body; 0: the header is incomplete
};

PlyHeader ply_header(std::string_view text) {
  PlyHeader header;
  const std::size_t stop = text.find("end_header");
  if (!text.starts_with("ply") || stop == std::string_view::npos) return header;
  for_each_line(text.substr(0, stop), [&](std::string_view line) {
    const Words words(line);
    const auto word = [&](std::size_t i) { return std::string(i < words.all.size() ? words.all[i] : ""); };
    if (word(0) == "format") header.format = word(1);
    if (word(0) == "element") {
      header.elements.push_back({word(1), static_cast<std::size_t>(std::max(0.0, words.number(2))), {}});
    }
    if (word(0) == "property" && !header.elements.empty()) {
      const bool list = word(1) == "list";
      header.elements.back().properties.push_back(list ? PlyProperty{word(3), word(4), word(2)}
                                                       : PlyProperty{word(1), word(2), ""});
    }
  });
  header.end = std::min(text.find('\n', stop), text.size() - 1) + 1;
  return header;
}

void add_polygon(TriangleMesh& mesh, const std::vector<int>& polygon) {
  for (std::size_t i = 2; i < polygon.size(); ++i) mesh.triangles.emplace_back(polygon[0], polygon[i - 1], polygon[i]);
}

void read_ply_element(const PlyElement& element, PlyBody& body, MeshFile& out) {
  std::vector<int> list;
  for (std::size_t i = 0; i < element.count && !body.at_end(); ++i) {
    Vector3d position = Vector3d::Zero();
    Vector3f colour(-1.0F, -1.0F, -1.0F);
    list.clear();
    for (const auto& property : element.properties) {
      if (!property.count_type.empty()) {
        const double count = body.next(property.count_type);
        const bool indices = property.name.starts_with("vertex_ind");
        for (int j = 0; j < count; ++j) {
          const double value = body.next(property.type);
          if (std::isnan(value)) return;
          if (indices) list.push_back(value >= 0.0 && value < 2e9 ? static_cast<int>(value) : -1);
        }
        continue;
      }
      const double value = body.next(property.type);
      const std::size_t axis = std::string_view("xyz").find(property.name);
      if (property.name.size() == 1 && axis < 3) position[static_cast<int>(axis)] = value;
      constexpr std::array<std::string_view, 3> kColours = {"red", "green", "blue"};
      for (int c = 0; c < 3; ++c) {
        if (property.name == kColours[c]) colour[c] = std::pow(static_cast<float>(value) / 255.0F, 2.2F);
      }
    }
    if (element.name == "vertex") out.mesh.vertices.push_back(position);
    if (element.name == "vertex" && colour.minCoeff() >= 0.0F) out.colours.push_back(colour);
    if (element.name == "face") add_polygon(out.mesh, list);
  }
}

}  // namespace

Result<MeshFile> read_obj(const fs::path& file) {
  const auto text = read_file(file);
  if (!text) return pass_on(text);
  MeshFile out;
  std::vector<Vector2f> coordinates;
  std::string library;
  bool textured = true;
  for_each_line(*text, [&](std::string_view line) {
    const Words words(line);
    if (words.all.empty()) return;
    if (words.all[0] == "v") out.mesh.vertices.emplace_back(words.number(1), words.number(2), words.number(3));
    if (words.all[0] == "vt") coordinates.push_back(Eigen::Vector2d(words.number(1), words.number(2)).cast<float>());
    if (words.all[0] == "mtllib" && words.all.size() > 1) library = words.all.back();
    if (words.all[0] != "f") return;
    std::vector<std::array<int, 2>> polygon;
    for (std::size_t i = 1; i < words.all.size(); ++i) {
      polygon.push_back(obj_corner(words.all[i], out.mesh.vertices.size(), coordinates.size()));
    }
    for (std::size_t i = 2; i < polygon.size(); ++i) {
      const std::array<std::array<int, 2>, 3> corner = {polygon[0], polygon[i - 1], polygon[i]};
      out.mesh.triangles.emplace_back(corner[0][0], corner[1][0], corner[2][0]);
      std::array<Vector2f, 3> at{};
      for (int c = 0; c < 3; ++c) {
        const int index = corner[c][1];
        textured = textured && index >= 0 && index < static_cast<int>(coordinates.size());
        if (textured) at[c] = coordinates[index];
      }
      out.corners.push_back(at);
    }
  });
  if (textured) {
    auto image = obj_image(file, library);
    if (!image) return pass_on(image);
    out.image = std::move(*image);
  }
  if (out.image.empty()) out.corners.clear();
  return out;
}

Result<MeshFile> read_ply(const fs::path& file) {
  const auto text = read_file(file);
  if (!text) return pass_on(text);
  const PlyHeader header = ply_header(*text);
  if (header.end == 0 || (header.format != "ascii" && header.format != "binary_little_endian")) {
    return fail(ErrorCode::invalid_input, "object {}: not a text or little-endian PLY file", file.string());
  }
  MeshFile out;
  PlyBody body(std::string_view(*text).substr(header.end), header.format == "ascii");
  for (const auto& element : header.elements) read_ply_element(element, body, out);
  if (out.colours.size() != out.mesh.vertices.size()) out.colours.clear();
  return out;
}

void weld(MeshFile& file) {
  auto& vertices = file.mesh.vertices;
  auto& triangles = file.mesh.triangles;
  const auto before = [&](int a, int b) {
    return std::lexicographical_compare(vertices[a].data(), vertices[a].data() + 3, vertices[b].data(),
                                        vertices[b].data() + 3);
  };
  std::vector<int> order(vertices.size()), merged(vertices.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), before);
  std::vector<Vector3d> kept;
  std::vector<Vector3f> kept_colours;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i == 0 || vertices[order[i]] != vertices[order[i - 1]]) {
      kept.push_back(vertices[order[i]]);
      if (!file.colours.empty()) kept_colours.push_back(file.colours[order[i]]);
    }
    merged[order[i]] = static_cast<int>(kept.size()) - 1;
  }
  std::size_t used = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const Vector3i t(merged[triangles[i][0]], merged[triangles[i][1]], merged[triangles[i][2]]);
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    triangles[used] = t;
    if (!file.corners.empty()) file.corners[used] = file.corners[i];
    ++used;
  }
  triangles.resize(used);
  if (!file.corners.empty()) file.corners.resize(used);
  vertices = std::move(kept);
  file.colours = std::move(kept_colours);
}

}  // namespace scanrig::sim
