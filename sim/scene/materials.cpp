#include "sim/scene/materials.h"

#include <algorithm>
#include <string_view>

#include "sim/scene/solid_patches.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr unsigned kTwoToneSalt = 32, kMaterialSalt = 33;
constexpr double kPatchMm = 17.0;

// 1.5: refractive index of varnish, glass, most plastics; F0 = ((n - 1) / (n + 1))^2.
constexpr double kDielectric = 0.04;

Vector3f dark(const Vector3f& own, const Vector3d&) { return own * (0.03F / 0.45F); }  // 0.45: a mean albedo

Vector3f two_tone(const Vector3f& own, const Vector3d& in_object) {
  const bool is_dark = solid_patches(in_object, kPatchMm, kTwoToneSalt).first % 2 == 0;
  return own / std::max(own.maxCoeff(), 1e-3F) * (is_dark ? 0.05F : 0.8F);
}

/// As blue as the screen, in patches: the rest keeps its colour.
Vector3f screen_blue(const Vector3f& own, const Vector3d& in_object) {
  return solid_patches(in_object, kPatchMm, kTwoToneSalt).first % 2 == 0 ? rgb(profile().backdrop_albedo) : own;
}

/// What remains diffuse of a blasted metal: dirt and oxide.
Vector3f metal(const Vector3f& own, const Vector3d&) {
  return 0.12F * Vector3f::Constant(own.mean()) + Vector3f::Constant(0.02F);
}

class MaterialColour final : public SurfaceColour {
 public:
  MaterialColour(std::shared_ptr<const SurfaceColour> own, Materials materials)
      : own_(std::move(own)), materials_(std::move(materials)) {}

  Vector3f albedo(const SurfacePoint& point) const override {
    const Vector3f own = own_->albedo(point);
    const Material& m = materials_.at(point.position);
    return m.colour ? m.colour(own, point.position) : own;
  }

 private:
  std::shared_ptr<const SurfaceColour> own_;
  Materials materials_;
};

}  // namespace

const std::vector<Material>& all_materials() {
  // Roughness: assumed, by the looks of eggshell paint, varnish and blasted aluminium. Scattering: assumed, of the
  // order that Jensen et al. 2001 measured on marble and skin (0.4 to 2 mm); the depth is theirs for marble.
  static const std::vector<Material> all = {
      {.name = "matt", .roughness = 1.0, .normal_reflectance = kDielectric},
      {.name = "satin", .roughness = 0.45, .normal_reflectance = kDielectric},
      {.name = "gloss", .roughness = 0.2, .normal_reflectance = kDielectric},
      {.name = "dark", .roughness = 0.45, .normal_reflectance = kDielectric, .colour = dark},
      {.name = "two-tone", .roughness = 0.45, .normal_reflectance = kDielectric, .colour = two_tone},
      {.name = "translucent",
       .roughness = 0.45,
       .normal_reflectance = kDielectric,
       .scattered = 0.5,
       .scatter_mm = 0.4,
       .scatter_deep_mm = 0.1,
       .glow = 0.25},
      {.name = "screen-blue", .roughness = 0.45, .normal_reflectance = kDielectric, .colour = screen_blue},
      {.name = "metal", .roughness = 0.4, .normal_reflectance = 0.7, .colour = metal},
  };
  return all;
}

Result<Materials> Materials::named(const std::string& names, const Effects& effects) {
  Materials chosen;
  chosen.list_.clear();
  std::string_view left = names;
  do {
    const std::string_view name = left.substr(0, left.find('+'));
    left.remove_prefix(std::min(left.size(), name.size() + 1));
    const auto& all = all_materials();
    const auto found = std::ranges::find_if(all, [&](const Material& m) { return name == m.name; });
    if (found == all.end()) {
      std::string known;
      for (const Material& m : all) known += fmt::format(" {}", m.name);
      return fail(ErrorCode::not_found, "material {}: no such material; choose from{}, several joined by +", name,
                  known);
    }
    Material m = *found;
    m.normal_reflectance *= effects.gloss;
    m.scattered *= effects.translucency;
    m.glow *= effects.translucency;
    chosen.list_.push_back(m);
  } while (!left.empty());
  return chosen;
}

const Material& Materials::at(const Vector3d& in_object) const {
  if (list_.size() == 1) return list_.front();
  return list_[(solid_patches(in_object, kPatchMm, kMaterialSalt).first >> 24) % list_.size()];
}

std::shared_ptr<const SurfaceColour> Materials::coloured(std::shared_ptr<const SurfaceColour> own) const {
  const bool is_own = std::ranges::all_of(list_, [](const Material& m) { return m.colour == nullptr; });
  return is_own ? own : std::make_shared<MaterialColour>(std::move(own), *this);
}

}  // namespace scanrig::sim
