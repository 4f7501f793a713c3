#pragma once

#include <string>

#include "tests/bench/pose/campaign_objects.h"

/// Objects that turns carry onto themselves, and the same with a bump that is nearly lost in the noise. Millimetres.
namespace scanrig::campaign {

struct SymmetricObject {
  DrawnObject drawn;
  std::string group;  ///< as to_string(Symmetry::Group) has it: what the object was made with
  int fold = 1;       ///< of its main axis; 0: any turn
};

/// Kinds: balls, bottles, vases, spools, boxes, cubes, prisms, caps, wing screws, knobs, mugs, ...
int symmetric_kinds();
/// One of a kind. `size_mm`: diagonal of the box around it. `bump_mm`: height of a cap on one side; 0: none.
SymmetricObject draw_symmetric(int kind, double size_mm, double bump_mm, Chance& chance);
/// Kinds of objects that a bump on one side leaves without a symmetry.
int bumped_kind(int number);

}  // namespace scanrig::campaign
