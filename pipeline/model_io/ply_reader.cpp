#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <string>

#include "pipeline/model_io/mesh_limits.h"
#include "pipeline/model_io/mesh_reader.h"

namespace scanrig {
namespace {

enum class Format { ascii, little, big };

struct Type {
  char kind = 'f';  ///< i(nteger), u(nsigned), f(loat)
  std::size_t size = 0;
};

std::optional<Type> type_named(std::string_view name) {
  struct Named {
    std::string_view name;
    Type type;
  };
  static constexpr std::array<Named, 16> kTypes = {
      Named{"char", {'i', 1}}, {"int8", {'i', 1}},    {"uchar", {'u', 1}},  {"uint8", {'u', 1}},
      {"short", {'i', 2}},     {"int16", {'i', 2}},   {"ushort", {'u', 2}}, {"uint16", {'u', 2}},
      {"int", {'i', 4}},       {"int32", {'i', 4}},   {"uint", {'u', 4}},   {"uint32", {'u', 4}},
      {"float", {'f', 4}},     {"float32", {'f', 4}}, {"double", {'f', 8}}, {"float64", {'f', 8}}};
  for (const Named& named : kTypes) {
    if (named.name == name) return named.type;
  }
  return std::nullopt;
}

struct Property {
  std::string name;
  Type type;
  std::optional<Type> count;  ///< present: a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  Format format = Format::ascii;
  std::vector<Element> elements;
};

Result<Header> parse_header(std::string_view& bytes, std::string_view name) {
  if (const auto magic = next_line(bytes); magic != "ply" && magic != "ply\r") {
    return fail(ErrorCode::invalid_input, "{}: not a PLY file", name);
  }
  Header header;
  bool format_known = false;
  while (!bytes.empty()) {
    const std::string_view line = next_line(bytes);
    std::string_view rest = line;
    const auto keyword = next_word(rest);
    bool good = true;
    if (keyword == "end_header") {
      if (format_known) return header;
      break;
    }
    if (keyword == "format") {
      const auto format = next_word(rest);
      good = format_known = format == "ascii" || format == "binary_little_endian" || format == "binary_big_endian";
      header.format = format == "ascii" ? Format::ascii : format == "binary_big_endian" ? Format::big : Format::little;
    } else if (keyword == "element") {
      Element element{std::string(next_word(rest)), 0, {}};
      const auto count = number<std::uint64_t>(next_word(rest));
      good = count.has_value();
      element.count = count.value_or(0);
      header.elements.push_back(std::move(element));
    } else if (keyword == "property") {
      Property property;
      auto word = next_word(rest);
      if (word == "list") {
        property.count = type_named(next_word(rest));
        good = property.count.has_value() && property.count->kind != 'f';
        word = next_word(rest);
      }
      const auto type = type_named(word);
      good = good && type && !header.elements.empty();
      if (good) {
        property.type = *type;
        property.name = next_word(rest);
        header.elements.back().properties.push_back(std::move(property));
      }
    } else {
      good = keyword == "comment" || keyword == "obj_info" || keyword.empty();
    }
    if (!good)
      return fail(ErrorCode::invalid_input, "{}: PLY header line \"{}\" cannot be used", name, line.substr(0, 80));
  }
  return fail(ErrorCode::invalid_input, "{}: the PLY header has no end or no format", name);
}

/// Reads values from the body one after the other.
struct Body {
  std::string_view bytes;
  Format format;

  bool next(Type type, double& value) {
    if (format == Format::ascii) {
      const auto found = number<double>(next_word(bytes, " \t\r\n"));
      value = found.value_or(0.0);
      return found.has_value();
    }
    if (bytes.size() < type.size) return false;
    std::array<char, 8> raw{};
    std::memcpy(raw.data(), bytes.data(), type.size);
    bytes.remove_prefix(type.size);
    if (format == Format::big) std::reverse(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(type.size));
    value = as_number(type, raw);
    return true;
  }
  /// The minimum number of bytes of an entry of `element`.
  [[nodiscard]] std::size_t min_bytes(const Element& element) const {
    std::size_t sum = 0;
    for (const auto& p : element.properties) sum += format == Format::ascii ? 1 : p.count ? p.count->size : p.type.size;
    return sum;
  }

 private:
  template <class T>
  static double from(const std::array<char, 8>& raw) {
    T value;
    std::memcpy(&value, raw.data(), sizeof(T));
    return static_cast<double>(value);
  }
  static double as_number(Type type, const std::array<char, 8>& raw) {
    if (type.kind == 'f') return type.size == 4 ? from<float>(raw) : from<double>(raw);
    if (type.kind == 'i') {
      return type.size == 1   ? from<std::int8_t>(raw)
             : type.size == 2 ? from<std::int16_t>(raw)
                              : from<std::int32_t>(raw);
    }
    return type.size == 1   ? from<std::uint8_t>(raw)
           : type.size == 2 ? from<std::uint16_t>(raw)
                            : from<std::uint32_t>(raw);
  }
};

constexpr std::array<std::string_view, 11> kVertexProperties = {"x",   "y",     "z",    "nx",    "ny",   "nz",
                                                                "red", "green", "blue", "views", "sigma"};
using VertexValues = std::array<double, kVertexProperties.size()>;

/// Index in kVertexProperties of each property, or none.
struct VertexLayout {
  std::vector<std::optional<std::size_t>> slot;
  std::array<bool, kVertexProperties.size()> present{};
  double colour_scale = 1.0;  ///< colours as numbers 0..1 become bytes

  explicit VertexLayout(const Element& element) {
    for (const auto& property : element.properties) {
      const auto* found = std::find(kVertexProperties.begin(), kVertexProperties.end(), property.name);
      slot.emplace_back();
      if (property.count || found == kVertexProperties.end()) continue;
      slot.back() = static_cast<std::size_t>(found - kVertexProperties.begin());
      present[*slot.back()] = true;
      if (property.name == "red" && property.type.kind == 'f') colour_scale = 255.0;
    }
  }
  [[nodiscard]] bool has(std::size_t first, std::size_t count) const {
    return std::all_of(present.begin() + static_cast<std::ptrdiff_t>(first),
                       present.begin() + static_cast<std::ptrdiff_t>(first + count), [](bool p) { return p; });
  }
};

bool add_vertex(const VertexLayout& layout, const VertexValues& v, Mesh& mesh) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(std::abs(v[k]) < kAbsurd)) return false;
  }
  const auto vector = [&](std::size_t k) -> Eigen::Vector3f {
    return Eigen::Vector3d(v[k], v[k + 1], v[k + 2]).cast<float>();
  };
  const auto byte = [](double value) { return static_cast<std::uint8_t>(value > 0.0 ? std::min(value, 255.0) : 0.0); };
  mesh.vertices.push_back(vector(0));
  if (layout.has(3, 3)) {
    const bool good = std::abs(v[3]) < kAbsurd && std::abs(v[4]) < kAbsurd && std::abs(v[5]) < kAbsurd;
    mesh.normals.push_back(good ? vector(3) : Eigen::Vector3f(0, 0, 0));
  }
  if (layout.has(6, 3)) {
    const double scale = layout.colour_scale;
    mesh.colour.push_back({byte(scale * v[6]), byte(scale * v[7]), byte(scale * v[8])});
  }
  if (layout.has(9, 1)) mesh.views.push_back(byte(v[9]));
  if (layout.has(10, 1)) {
    mesh.sigma.push_back(std::abs(v[10]) < kAbsurd ? static_cast<float>(v[10])
                                                   : std::numeric_limits<float>::quiet_NaN());
  }
  return true;
}

/// Reads one entry of `element`: numbers to `take(property, value)`, list lengths and their items to `item`.
template <class Take, class Length, class Item>
bool read_entry(const Element& element, Body& body, const Take& take, const Length& length, const Item& item) {
  for (std::size_t p = 0; p < element.properties.size(); ++p) {
    const Property& property = element.properties[p];
    double value = 0.0;
    if (!property.count) {
      if (!body.next(property.type, value)) return false;
      take(p, value);
      continue;
    }
    double count = 0.0;
    if (!body.next(*property.count, count) || !(count >= 0.0)) return false;
    length(p, count);
    for (double i = 0.0; i < count; i += 1.0) {
      if (!body.next(property.type, value)) return false;
      item(p, value);
    }
  }
  return true;
}

Result<void> read_vertices(const Element& element, Body& body, std::string_view name, Mesh& mesh) {
  // A second list with other properties would leave attributes of some vertices only.
  if (!mesh.vertices.empty()) return fail(ErrorCode::invalid_input, "{}: vertices are listed twice", name);
  const VertexLayout layout(element);
  if (!layout.has(0, 3)) return fail(ErrorCode::invalid_input, "{}: the vertices have no x, y, z", name);
  const auto nothing = [](std::size_t, double) {};
  mesh.vertices.reserve(element.count);
  for (std::uint64_t i = 0; i < element.count; ++i) {
    VertexValues values{};
    const auto take = [&](std::size_t p, double value) {
      if (layout.slot[p]) values[*layout.slot[p]] = value;
    };
    if (!read_entry(element, body, take, nothing, nothing)) {
      return fail(ErrorCode::invalid_input, "{}: cut short in vertex {} of {}", name, i, element.count);
    }
    if (!add_vertex(layout, values, mesh)) {
      return fail(ErrorCode::invalid_input, "{}: vertex {} is not a number", name, i);
    }
  }
  return {};
}

Result<void> read_faces(const Element& element, Body& body, std::string_view name, Mesh& mesh) {
  const auto is_indices = [](const Property& p) {
    return p.count && (p.name == "vertex_indices" || p.name == "vertex_index");
  };
  const auto found = std::find_if(element.properties.begin(), element.properties.end(), is_indices);
  const auto indices = static_cast<std::size_t>(found - element.properties.begin());
  mesh.faces.reserve(element.count);
  for (std::uint64_t i = 0; i < element.count; ++i) {
    Fan fan;
    bool known = true;
    const auto nothing = [](std::size_t, double) {};
    const auto item = [&](std::size_t p, double value) { known = known && (p != indices || fan.add(value, mesh)); };
    if (!read_entry(element, body, nothing, nothing, item)) {
      return fail(ErrorCode::invalid_input, "{}: cut short in face {} of {}", name, i, element.count);
    }
    if (!known) return fail(ErrorCode::invalid_input, "{}: face {} names a missing vertex", name, i);
    if (indices < element.properties.size() && fan.corners < 3) {
      return fail(ErrorCode::invalid_input, "{}: face {} has {} corners", name, i, fan.corners);
    }
  }
  return {};
}

}  // namespace

Result<Mesh> parse_ply(std::string_view bytes, std::string_view name) {
  const auto header = parse_header(bytes, name);
  if (!header) return pass_on(header);
  Body body{bytes, header->format};
  Mesh mesh;
  for (const Element& element : header->elements) {
    const std::size_t min_bytes = body.min_bytes(element);
    // Before any allocation: the file must be large enough for what its header promises.
    if (element.count > 0 && (min_bytes == 0 || element.count > body.bytes.size() / min_bytes)) {
      return fail(ErrorCode::invalid_input, "{}: cut short: {} x \"{}\" promised, {} bytes left", name, element.count,
                  element.name, body.bytes.size());
    }
    Result<void> read;
    const auto nothing = [](std::size_t, double) {};
    if (element.name == "vertex") {
      read = read_vertices(element, body, name, mesh);
    } else if (element.name == "face") {
      read = read_faces(element, body, name, mesh);
    } else {
      for (std::uint64_t i = 0; i < element.count && read; ++i) {
        if (!read_entry(element, body, nothing, nothing, nothing)) {
          read = fail(ErrorCode::invalid_input, "{}: cut short in \"{}\" {}", name, element.name, i);
        }
      }
    }
    if (!read) return pass_on(read);
  }
  return checked(std::move(mesh), name);
}

}  // namespace scanrig
