#pragma once

#include <vector>

#include "daemon/api/route.h"

namespace scanrig {

std::vector<Route> station_routes();  ///< status, events, buttons, maintenance, inputs and outputs
std::vector<Route> job_routes();      ///< jobs as they are, their files and models
std::vector<Route> order_routes();    ///< actions on jobs: queued, cancelled, bundled, deleted, ...
std::vector<Route> service_routes();  ///< health, metrics, the OpenAPI document

}  // namespace scanrig
