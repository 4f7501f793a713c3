#include "pipeline/reconstruct/disagreements.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

namespace scanrig {
namespace {

const char* side(std::size_t camera) { return camera == 0 ? "left" : "right"; }

}  // namespace

Disagreement of_silhouette(std::size_t pose, const SilhouetteFinding& finding) {
  using Kind = SilhouetteFinding::Kind;
  Disagreement result{.pose = pose,
                      .view = finding.view,
                      .camera = side(finding.camera),
                      .what = "silhouette",
                      .amount = finding.share,
                      .unit = "share"};
  const std::string who =
      fmt::format("The silhouette of the {} camera in view {} of pose {}", result.camera, finding.view + 1, pose + 1);
  const std::string part = fmt::format("({:.1f} % of the object)", 100.0 * finding.share);
  switch (finding.kind) {
    case Kind::region:
      result.action = "part left out";
      result.sentence = fmt::format("{} cuts through surface that {} views measured {}: that part is not used.", who,
                                    finding.views, part);
      break;
    case Kind::whole:
      result.action = "left out";
      result.sentence =
          fmt::format("{} cuts through surface that {} views measured {}: it is not used.", who, finding.views, part);
      break;
    case Kind::surplus:
      result.action = "kept";
      result.sentence =
          fmt::format("{} takes for object what other silhouettes see empty {}: no harm to the model.", who, part);
      break;
  }
  return result;
}

Disagreement of_missing_screen(std::size_t pose, int view, std::size_t count, std::size_t all) {
  return {.pose = pose,
          .view = view,
          .what = "silhouette",
          .action = "left out",
          .amount = static_cast<double>(count) / static_cast<double>(all),
          .unit = "share",
          .sentence = fmt::format("In {} of {} views of pose {} no screen of one colour was recognised: their outline "
                                  "comes from the range images.",
                                  count, all, pose + 1)};
}

Disagreement of_screen_colour(std::size_t pose, double share) {
  return {
      .pose = pose,
      .what = "silhouette",
      .action = "left out",
      .amount = share,
      .unit = "share",
      .sentence = fmt::format("{:.0f} % of the surface measured in pose {} is outside of several silhouettes, as parts "
                              "in the screen's colour are: the outline comes from the range images.",
                              100.0 * share, pose + 1)};
}

Disagreement of_motion(std::size_t pose, const View& view, const ObjectMotion& motion) {
  Disagreement result{.pose = pose,
                      .view = view.index,
                      .camera = "",
                      .what = "object moved",
                      .action = "corrected",
                      .amount = motion.mm,
                      .unit = "mm"};
  result.sentence = motion.views == 1
                        ? fmt::format("The object was {:.3f} mm out of its place in view {} of pose {}: corrected.",
                                      motion.mm, view.index + 1, pose + 1)
                        : fmt::format(
                              "The object was {:.3f} mm out of its place in {} views of pose {}, from view {} "
                              "on: corrected.",
                              motion.mm, motion.views, pose + 1, view.index + 1);
  return result;
}

Disagreement of_misfit(std::size_t pose, const View& view, double residual_mm) {
  return {.pose = pose,
          .view = view.index,
          .camera = "",
          .what = "view",
          .action = "left out",
          .amount = residual_mm,
          .unit = "mm",
          .sentence = fmt::format("View {} of pose {} does not fit the others by {:.3f} mm: it is not used.",
                                  view.index + 1, pose + 1, residual_mm)};
}

Disagreement of_pose(std::size_t pose, std::string sentence) {
  return {.pose = pose,
          .what = "pose",
          .action = "left out",
          .amount = 1.0,
          .unit = "share",
          .sentence = std::move(sentence)};
}

Disagreement of_fixture(std::size_t pose, const Fixture& fixture, bool is_expected) {
  const char* advice = is_expected ? "" : " Write fixture = true into its recipe: then this is expected.";
  return {.pose = pose,
          .what = "fixture",
          .action = "left out",
          .amount = fixture.height_mm,
          .unit = "mm",
          .sentence = fmt::format("In pose {} the part stood on a fixture {:.1f} mm high, which is left out of the "
                                  "model.{}",
                                  pose + 1, fixture.height_mm, advice)};
}

Disagreement of_single_pose_on_fixture() {
  return {
      .what = "fixture",
      .action = "kept",
      .unit = "mm",
      .sentence = "The scan has one pose, so its fixture is part of the model: scan a second pose to leave it out."};
}

Disagreement of_photo(std::size_t pose, int view, std::size_t camera, const ContradictedPhoto& photo) {
  Disagreement result{.pose = pose,
                      .view = view,
                      .camera = side(camera),
                      .what = "photograph",
                      .action = photo.is_whole ? "left out" : "part left out",
                      .amount = photo.share,
                      .unit = "share"};
  result.sentence = fmt::format(
      "The photograph of the {} camera in view {} of pose {} is {:.1f} times as bright as the others on {:.1f} % of "
      "the "
      "object: {} is not used for the colours.",
      result.camera, view + 1, pose + 1, photo.brightness, 100.0 * photo.share, photo.is_whole ? "it" : "that part");
  return result;
}

nlohmann::json disagreements_json(std::span<const Disagreement> disagreements) {
  nlohmann::json list = nlohmann::json::array();
  for (const Disagreement& d : disagreements) {
    list.push_back({{"pose", d.pose},
                    {"view", d.view},
                    {"camera", d.camera.empty() ? nlohmann::json() : nlohmann::json(d.camera)},
                    {"what", d.what},
                    {"action", d.action},
                    {"amount", d.amount},
                    {"unit", d.unit},
                    {"sentence", d.sentence}});
  }
  return list;
}

}  // namespace scanrig
