#pragma once

#include <functional>
#include <string>

#include "daemon/rig/preview.h"
#include "daemon/station/control_loop.h"

namespace scanrig {

struct ApiRequest {
  std::string method;  ///< "GET"
  std::string target;  ///< "/api/v1/status"
};

struct ApiResponse {
  unsigned status = 200;
  std::string body;
  std::string content_type = "application/json";
};

/// Version 1 of the API:
///   GET /api/v1/status, /api/v1/io, /api/v1/jobs, /api/v1/jobs/ID
///   GET /api/v1/preview/left, /api/v1/preview/right: a JPEG of what the camera sees
///   POST /api/v1/start, /api/v1/stop, /api/v1/reset
///   POST /api/v1/maintenance/on, off, home, pulse, lamp_test, jog?to_deg=90, jog?by_deg=-5&speed_deg_s=2
/// Reads the latest snapshot or posts to the control loop; never waits. `send` is called once, from this thread or
/// from the control loop's. An error is {"error": {"code", "message"}} with status 400, 404, 405, 409 or 503.
void answer(const ApiRequest& request, ControlLoop& loop, Preview& preview, std::function<void(ApiResponse)> send);

}  // namespace scanrig
