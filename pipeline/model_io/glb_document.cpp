#include "pipeline/model_io/glb_document.h"

#include "core/image_codec.h"

namespace scanrig {
namespace {

// Numbers of the glTF 2.0 specification.
constexpr std::uint32_t kMagic = 0x46546C67;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;
constexpr std::uint32_t kBinChunk = 0x004E4942;
constexpr int kLinear = 9729;
constexpr int kLinearMipmapLinear = 9987;
constexpr int kClampToEdge = 33071;

std::string container(std::string text, const std::string& binary) {
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string file;
  file.reserve(28 + text.size() + binary.size());
  append_bytes(file, kMagic);
  append_bytes(file, std::uint32_t{2});
  append_bytes(file, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + binary.size()));
  append_bytes(file, static_cast<std::uint32_t>(text.size()));
  append_bytes(file, kJsonChunk);
  file += text;
  append_bytes(file, static_cast<std::uint32_t>(binary.size()));
  append_bytes(file, kBinChunk);
  file += binary;
  return file;
}

}  // namespace

GlbDocument::GlbDocument() {
  gltf["asset"] = {{"version", "2.0"}, {"generator", "scanrig"}};
  gltf["scene"] = 0;
  gltf["scenes"] = {{{"nodes", {0}}}};
  gltf["nodes"] = {{{"mesh", 0}, {"name", "model"}}};
  gltf["materials"] = {
      {{"name", "scanned"}, {"pbrMetallicRoughness", {{"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}}}};
}

int GlbDocument::add_view(std::string_view bytes, std::optional<int> target, std::optional<int> stride) {
  nlohmann::json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes.size()}};
  if (target) view["target"] = *target;
  if (stride) view["byteStride"] = *stride;
  views_.push_back(std::move(view));
  bytes_.append(bytes);
  bytes_.resize((bytes_.size() + 3) / 4 * 4, '\0');
  return static_cast<int>(views_.size() - 1);
}

int GlbDocument::add_accessor(int view, std::size_t offset, int component, std::size_t count, const char* type) {
  accessors_.push_back({{"bufferView", view}, {"componentType", component}, {"count", count}, {"type", type}});
  if (offset != 0) accessors_.back()["byteOffset"] = offset;
  return static_cast<int>(accessors_.size() - 1);
}

Result<void> GlbDocument::add_texture(const cv::Mat3b& image, int quality) {
  const auto jpeg = encode_jpeg(image, quality);
  if (!jpeg) return pass_on(jpeg, "glTF");
  gltf["images"] = {{{"bufferView", add_view(as_text(*jpeg))}, {"mimeType", "image/jpeg"}}};
  gltf["samplers"] = {
      {{"magFilter", kLinear}, {"minFilter", kLinearMipmapLinear}, {"wrapS", kClampToEdge}, {"wrapT", kClampToEdge}}};
  gltf["textures"] = {{{"source", 0}, {"sampler", 0}}};
  gltf["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
  return {};
}

std::string GlbDocument::file() {
  gltf["buffers"] = {{{"byteLength", bytes_.size()}}};
  gltf["bufferViews"] = views_;
  gltf["accessors"] = accessors_;
  return container(gltf.dump(), bytes_);
}

}  // namespace scanrig
