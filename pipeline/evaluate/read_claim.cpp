#include <fmt/format.h>

#include <charconv>
#include <nlohmann/json.hpp>
#include <string_view>

#include "core/files.h"
#include "core/image_codec.h"
#include "core/max_poses.h"
#include "core/strict_json.h"
#include "pipeline/evaluate/evaluate.h"
#include "pipeline/model_io/mesh_reader.h"

namespace scanrig {
namespace {

bool take_number(std::string_view& text, auto& value) {
  text.remove_prefix(std::min(text.find_first_not_of(" /"), text.size()));
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return error == std::errc();
}

/// The texture coordinates that an OBJ written beside the PLY gives the corners of the same faces: its "vt u v" and
/// "f v/t v/t v/t" lines.
Result<void> read_corner_uv(const std::filesystem::path& file, TexturedMesh& model) {
  const auto text = read_file(file);
  if (!text) return pass_on(text);
  const auto bad = [&file](std::string_view line) {
    return fail(ErrorCode::invalid_input, "{}: not the faces of the PLY beside it: {}", file.string(), line);
  };
  std::vector<Eigen::Vector2f> uv;
  std::string_view rest = *text;
  while (!rest.empty()) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    if (line.starts_with("vt ")) {
      std::string_view words = line.substr(3);
      Eigen::Vector2f& at = uv.emplace_back();
      if (!take_number(words, at.x()) || !take_number(words, at.y()) || !at.allFinite()) return bad(line);
      at.y() = 1.0F - at.y();
    } else if (line.starts_with("f ")) {
      std::string_view words = line.substr(2);
      const std::size_t face = model.corner_uv.size();
      if (face == model.mesh.faces.size()) return bad(line);
      auto& corners = model.corner_uv.emplace_back();
      for (int k = 0; k < 3; ++k) {
        std::size_t v = 0, t = 0;
        if (!take_number(words, v) || !take_number(words, t)) return bad(line);
        if (v != model.mesh.faces[face][k] + std::size_t{1} || t == 0 || t > uv.size()) return bad(line);
        corners[k] = uv[t - 1];
      }
    }
  }
  return model.corner_uv.size() == model.mesh.faces.size() ? Result<void>() : bad("faces are missing");
}

constexpr int kLastPose = static_cast<int>(kMaxPoses) - 1;

/// Nothing, with `fault` set, where it is no uncertainty.
std::optional<PoseUncertainty> read_uncertainty(JsonObject holder) {
  JsonObject known = holder.object("uncertainty");
  const auto centre = known.numbers("centre_mm"), covariance = known.numbers("covariance");
  if (centre.size() != 3 || covariance.size() != 36) {
    known.reject("covariance", "and centre_mm must be 36 and 3 numbers");
    return std::nullopt;
  }
  return PoseUncertainty{Eigen::Map<const Eigen::Vector3d>(centre.data()),
                         Eigen::Map<const Eigen::Matrix<double, 6, 6>>(covariance.data())};
}

/// Of a report of three poses or more.
void read_further_poses(JsonObject& root, Claim& claim) {
  claim.frame_of_pose = static_cast<std::size_t>(root.object("pose_graph").integer("frame_of_pose", 0, kLastPose));
  for (JsonObject& placed : root.object("pose_refinement").objects("poses")) {
    ClaimedPose found{.pose = static_cast<std::size_t>(placed.integer("pose", 0, kLastPose))};
    found.frame_from_pose = root.transform(fmt::format("pose{}_from_pose{}", claim.frame_of_pose + 1, found.pose + 1));
    found.uncertainty = read_uncertainty(placed);
    if (claim.frame_of_pose == 0 && found.pose == 1) {
      claim.pose_uncertainty = found.uncertainty;
    } else {
      claim.further_poses.push_back(std::move(found));
    }
  }
}

/// The motions between poses and their uncertainty, where the report has them.
Result<void> read_poses(const std::filesystem::path& file, Claim& claim) {
  const auto text = read_file(file);
  if (!text) return pass_on(text);
  const auto report = nlohmann::json::parse(*text, nullptr, false);
  if (report.is_discarded()) return fail(ErrorCode::invalid_input, "{}: not valid JSON", file.string());
  if (!report.is_object()) return {};
  std::optional<Error> fault;
  JsonObject root(&report, "", &fault);
  if (report.contains("pose1_from_pose2")) claim.pose1_from_pose2 = root.transform("pose1_from_pose2");
  if (report.contains("pose_graph")) {
    read_further_poses(root, claim);
  } else if (report.contains(nlohmann::json::json_pointer("/pose_refinement/uncertainty"))) {
    claim.pose_uncertainty = read_uncertainty(root.object("pose_refinement"));
  }
  if (fault) return tl::unexpected<Error>(fault->in(file.string()));
  return {};
}

}  // namespace

Result<Claim> read_claim(const std::filesystem::path& folder) {
  Claim claim;
  auto mesh = read_ply(folder / "model.ply");
  if (!mesh) return pass_on(mesh);
  claim.model.mesh = std::move(*mesh);
  std::error_code error;
  if (std::filesystem::exists(folder / "model.obj", error)) {
    if (const auto read = read_corner_uv(folder / "model.obj", claim.model); !read) return pass_on(read);
    const auto bytes = read_file(folder / "model.png");
    if (!bytes) return pass_on(bytes);
    auto atlas = decode_png(*bytes);
    if (!atlas) return pass_on(atlas, (folder / "model.png").string());
    if (atlas->type() != CV_8UC3) {
      return fail(ErrorCode::invalid_input, "{}: not an 8-bit colour image", (folder / "model.png").string());
    }
    claim.model.atlas = *atlas;
  }
  if (std::filesystem::exists(folder / "report.json", error)) {
    if (auto read = read_poses(folder / "report.json", claim); !read) return pass_on(read);
  }
  return claim;
}

}  // namespace scanrig
