#include <array>
#include <charconv>

#include "pipeline/model_io/corner_vertices.h"
#include "pipeline/model_io/model_files.h"

namespace scanrig {
namespace {

/// Text put together number by number: 50 MB and more, for which formatting by strings takes three times as long.
class ObjText {
 public:
  ObjText(std::string start, std::size_t expected_bytes) : text_(std::move(start)) {
    text_.reserve(text_.size() + expected_bytes);
  }
  ObjText& word(std::string_view word) {
    text_ += word;
    return *this;
  }
  ObjText& number(float value, std::chars_format format) {
    constexpr int kDigits = 7;
    return append([&](char* first, char* last) { return std::to_chars(first, last, value, format, kDigits); });
  }
  ObjText& number(std::uint32_t value) {
    return append([&](char* first, char* last) { return std::to_chars(first, last, value); });
  }
  [[nodiscard]] std::string take() { return std::move(text_); }

 private:
  template <class Print>
  ObjText& append(const Print& print) {
    std::array<char, 64> digits;  // the largest float has 39 before its point
    const auto printed = print(digits.data(), digits.data() + digits.size());
    text_.append(digits.data(), printed.ptr);
    return *this;
  }

  std::string text_;
};

}  // namespace

std::string encode_obj(const TexturedMesh& model, std::string_view material_file) {
  const CornerVertices corners(model);
  constexpr auto general = std::chars_format::general, fixed = std::chars_format::fixed;
  constexpr std::size_t kVertexBytes = 36, kCornerBytes = 24, kFaceBytes = 46;
  ObjText text(
      fmt::format("# scanrig, units mm, up axis +Y\nmtllib {}\nusemtl scanned\n", material_file),
      kVertexBytes * model.mesh.vertices.size() + kCornerBytes * corners.uv.size() + kFaceBytes * corners.faces.size());
  for (const auto& v : model.mesh.vertices) {
    text.word("v ").number(v.x(), general).word(" ").number(v.y(), general).word(" ").number(v.z(), general).word("\n");
  }
  // Texture coordinates of OBJ start at the bottom.
  for (const auto& uv : corners.uv) {
    text.word("vt ").number(uv.x(), fixed).word(" ").number(1.0F - uv.y(), fixed).word("\n");
  }
  for (std::size_t f = 0; f < corners.faces.size(); ++f) {
    text.word("f");
    for (std::size_t k = 0; k < 3; ++k) {
      text.word(" ").number(model.mesh.faces[f][k] + 1).word("/").number(corners.faces[f][k] + 1);
    }
    text.word("\n");
  }
  return text.take();
}

std::string encode_mtl(std::string_view image_file) {
  return fmt::format("newmtl scanned\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd {}\n", image_file);
}

}  // namespace scanrig
