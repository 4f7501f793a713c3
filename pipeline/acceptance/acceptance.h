#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "pipeline/acceptance/find_planes.h"
#include "pipeline/acceptance/find_sphere.h"
#include "pipeline/acceptance/measured_surface.h"

/// Acceptance and reverification of a scanner by calibrated artefacts [VDI/VDE 2634 parts 2 and 3].
namespace scanrig::acceptance {

enum class Kind { sphere, ball_bar, plane, step_gauge };
std::string_view to_string(Kind kind);  ///< "sphere", "ball-bar", "plane", "step-gauge"

/// An artefact as its certificate states it. mm.
struct Artefact {
  Kind kind = Kind::sphere;
  double diameter_mm = 0.0;              ///< of the sphere, or of both balls of the bar
  double length_mm = 0.0;                ///< ball bar: between the balls' centres
  std::vector<double> heights_mm{};      ///< step gauge: of the steps over the lowest one, ascending
  double expanded_uncertainty_mm = 0.0;  ///< of these, k = 2
};

/// Limits of the results, mm, by name: "form", "size", "spacing", "flatness", "step".
using Limits = std::map<std::string, double>;

/// The names of results that an artefact has.
std::vector<std::string> result_names(Kind kind);

enum class Verdict { none, pass, fail };  ///< none: no limit is given

struct AcceptanceResult {
  std::string name{};     ///< of a limit
  std::string feature{};  ///< what it is of: "sphere", "ball 1", "step 2"; empty: of all
  double value_mm = 0.0;
  /// k = 2: the points' errors, alike where they are neighbours, and the artefact's calibration.
  double expanded_uncertainty_mm = 0.0;
  std::optional<double> limit_mm{};

  [[nodiscard]] Verdict verdict() const;  ///< of the value alone
  [[nodiscard]] bool is_close() const;    ///< the limit is within the uncertainty
};

/// A ball or face that was measured.
struct Feature {
  std::string name;
  double area_mm2 = 0.0;
  std::optional<double> seen_share{};                ///< of a ball's surface
  std::optional<double> diameter_mm{};               ///< of a ball, fitted
  std::size_t at_rim = 0;                            ///< points beside other surface, not evaluated
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of a ball; a point of a face
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< of a face
  std::vector<Eigen::Vector3d> points{};             ///< evaluated, those left out too
  std::vector<double> residuals_mm{};                ///< of these
  Fit fit{};
};

struct Acceptance {
  std::vector<AcceptanceResult> results;
  std::vector<Feature> features;

  [[nodiscard]] bool passes() const;  ///< no result misses its limit
};

/// The results of one model, most of the standard's names beside them in docs/reference/acceptance.md. Same input, same
/// bits. Fails with `invalid_input` (sizes of the artefact, a limit that it has no result for), `not_found` and
/// `degenerate` as find_spheres(), find_plane(), find_steps() and measured_surface().
Result<Acceptance> measure(const Mesh& model, const Artefact& artefact, const Limits& limits = {});

/// The check of the artefact and the limits alone, before models are read.
Result<void> check_artefact(const Artefact& artefact, const Limits& limits);

/// Of several measurements, each result's largest value, in the order of the first one.
std::vector<AcceptanceResult> worst_results(const std::vector<Acceptance>& all);

}  // namespace scanrig::acceptance
