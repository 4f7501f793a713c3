#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "pipeline/mesh/mesh.h"

/// Procedural objects of a campaign, drawn at random. Millimetres.
namespace scanrig::campaign {

/// Draws whose values do not depend on the standard library.
class Chance {
 public:
  explicit Chance(std::uint64_t seed) : random_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
  }
  int among(int count) { return static_cast<int>(between(0.0, count)); }
  double normal();
  double sign() { return among(2) == 0 ? -1.0 : 1.0; }
  Eigen::Vector3d direction();

 private:
  std::mt19937_64 random_;
};

struct DrawnObject {
  std::string name;
  Mesh mesh;  ///< closed
};

/// Kinds of objects without a symmetry of their own: bent tubes, mugs, boxes with ribs, plates, wedges, ...
int object_kinds();
/// One of a kind; `size_mm`: diagonal of the box around it.
DrawnObject draw_object(int kind, double size_mm, Chance& chance);

/// `mesh` with this diagonal of the box around it.
void scale_to(Mesh& mesh, double size_mm);

}  // namespace scanrig::campaign
