#include "daemon/api/route.h"

#include <unistd.h>

#include <nlohmann/json.hpp>

#include "daemon/api/json_replies.h"

namespace scanrig {

OpenFile::~OpenFile() { ::close(fd_); }

std::string_view to_string(Method method) {
  switch (method) {
    case Method::get: return "GET";
    case Method::post: return "POST";
    case Method::del: break;
  }
  return "DELETE";
}

std::shared_ptr<const JobInfo> find_job(const ApiStation& station, const Values& values) {
  const auto snapshot = station.loop.snapshot();
  const auto found = snapshot->jobs.find(values.text("id").value_or(""));
  return found == snapshot->jobs.end() ? nullptr : found->second;
}

ApiResponse no_such_job() { return error_response({ErrorCode::not_found, "there is no job of that name"}); }

unsigned http_status(ErrorCode code) {
  switch (code) {
    case ErrorCode::invalid_input:
    case ErrorCode::out_of_range:
    case ErrorCode::unsupported: return 400;
    case ErrorCode::not_found: return 404;
    case ErrorCode::io:
    case ErrorCode::internal: return 500;
    default: return 409;  // a rule or the state of the rig forbids it
  }
}

ApiResponse error_response(const Error& error) { return error_response(http_status(error.code), error); }

ApiResponse error_response(unsigned status, const Error& error) {
  return {.status = status, .body = to_text({{"error", to_json(error)}}), .why = error.message};
}

}  // namespace scanrig
