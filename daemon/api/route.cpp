#include "daemon/api/route.h"

#include <unistd.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/api/json_replies.h"
#include "daemon/api/request.h"

namespace scanrig {
namespace {

std::vector<std::string_view> split(std::string_view path) {
  std::vector<std::string_view> segments;
  while (path.size() > 1) {
    path.remove_prefix(1);
    const auto slash = path.find('/');
    segments.push_back(path.substr(0, slash));
    path.remove_prefix(slash == std::string_view::npos ? path.size() : slash);
  }
  return segments;
}

bool is_parameter(std::string_view segment) { return segment.starts_with('{'); }

bool fits(const std::vector<std::string_view>& path, const std::vector<std::string>& asked) {
  return std::ranges::equal(path, asked, [](std::string_view segment, const std::string& is) {
    return is_parameter(segment) || segment == is;
  });
}

/// Fixed words before parameters: /jobs/queue is not the job "queue".
bool more_exact(const std::vector<std::string_view>& one, const std::vector<std::string_view>& other) {
  return std::ranges::count_if(one, is_parameter) < std::ranges::count_if(other, is_parameter);
}

Result<void> read_parameter(const std::vector<RequestField>& fields, std::string_view name, const std::string& text,
                            Values& values) {
  const auto field = std::ranges::find(fields, name, &RequestField::name);
  if (field == fields.end()) {
    return fail(ErrorCode::invalid_input, "this request takes no parameter of that name after the question mark");
  }
  auto value = parse_value(*field, text);
  if (!value) return pass_on(value);
  values.set(name, std::move(*value));
  return {};
}

Result<Values> read_parameters(const Route& route, const std::vector<std::string_view>& path,
                               const RequestTarget& target) {
  Values values;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (!is_parameter(path[i])) continue;
    const auto name = path[i].substr(1, path[i].size() - 2);
    if (auto read = read_parameter(route.in_path, name, target.segments[i], values); !read) return pass_on(read);
  }
  for (const auto& [key, text] : target.query) {
    if (auto read = read_parameter(route.in_query, key, text, values); !read) return pass_on(read);
  }
  for (const auto& field : route.in_query) {
    if (field.required && !values.has(field.name)) {
      return fail(ErrorCode::invalid_input, "{}: is missing after the question mark", field.name);
    }
  }
  return values;
}

}  // namespace

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

std::vector<Route> all_routes() {
  std::vector<Route> all;
  for (auto part : {station_routes(), job_routes(), model_routes(), order_routes(), calibration_routes(),
                    setup_routes(), service_routes(), page_routes()}) {
    std::ranges::move(part, std::back_inserter(all));
  }
  return all;
}

Router::Router(std::vector<Route> routes) : routes_(std::move(routes)) {
  for (const auto& route : routes_) paths_.push_back(split(route.path));
}

tl::expected<Router::Match, ApiResponse> Router::find(std::string_view method, std::string_view target,
                                                      std::optional<Role> role) const {
  const auto no = [](unsigned status, ErrorCode code, std::string why) {
    return tl::unexpected(error_response(status, Error{code, std::move(why)}));
  };
  const auto not_authenticated = [&] {
    return no(401, ErrorCode::refused, "not authenticated: send a token or join an API group");
  };
  const auto parsed = parse_target(target);
  if (!parsed) return role ? tl::unexpected(error_response(parsed.error())) : not_authenticated();
  std::optional<std::size_t> found;
  bool path_known = false;
  for (std::size_t i = 0; i < routes_.size(); ++i) {
    if (!fits(paths_[i], parsed->segments)) continue;
    path_known = true;
    if (to_string(routes_[i].method) == method && (!found || more_exact(paths_[i], paths_[*found]))) found = i;
  }
  if (!role && !(found && routes_[*found].open)) return not_authenticated();
  if (!path_known) return no(404, ErrorCode::not_found, "the API has nothing of that name; see /api/v1/openapi.json");
  if (!found) return no(405, ErrorCode::unsupported, fmt::format("this path does not take {}", method));
  const auto& route = routes_[*found];
  if (!route.open && *role < route.role) {
    return no(403, ErrorCode::refused,
              fmt::format("this needs the role {}; yours is {}", to_string(route.role), to_string(*role)));
  }
  auto values = read_parameters(route, paths_[*found], *parsed);
  if (!values) return tl::unexpected(error_response(values.error()));
  return Match{&route, std::move(*values)};
}

void Router::call(Match match, std::string_view body, const ApiStation& station, Send send) {
  if (auto read = read_body(body, match.route->in_body, match.values); !read) return send(error_response(read.error()));
  match.route->handle(station, match.values, std::move(send));
}

}  // namespace scanrig
