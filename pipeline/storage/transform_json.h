#pragma once

#include <nlohmann/json.hpp>

#include "core/transform.h"

namespace scanrig {

/// The counterpart of JsonObject::transform(): { "rotation": [[..],[..],[..]], "translation": [..] }.
inline nlohmann::ordered_json transform_json(const Transform& transform) {
  auto rows = nlohmann::ordered_json::array();
  for (int r = 0; r < 3; ++r) {
    rows.push_back({transform.linear()(r, 0), transform.linear()(r, 1), transform.linear()(r, 2)});
  }
  const Eigen::Vector3d& t = transform.translation();
  return {{"rotation", rows}, {"translation", {t.x(), t.y(), t.z()}}};
}

}  // namespace scanrig
