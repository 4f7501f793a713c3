#include <nlohmann/json.hpp>

#include "core/timestamp.h"
#include "daemon/api/access.h"
#include "daemon/api/event_hub.h"
#include "daemon/api/json_replies.h"
#include "daemon/api/origins.h"
#include "daemon/api/route.h"
#include "web/embedded_files.h"

namespace scanrig {
namespace {

using nlohmann::ordered_json;
using std::chrono::system_clock;

constexpr std::string_view kJustThisPage =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self' blob:; "
    "frame-ancestors 'none'; base-uri 'none'; form-action 'none'";
constexpr int kCookieLife_s = 30 * 24 * 3600;
constexpr int kCodeLife_s = 120;
constexpr double kLongestToken = 200.0;

ApiResponse file_response(const web::EmbeddedFile& file, std::string cache) {
  return {.body = std::string(file.gzip),
          .type = file.type,
          .headers = {{"Content-Encoding", "gzip"},
                      {"ETag", fmt::format("\"{}\"", web::embedded_build())},
                      {"Cache-Control", std::move(cache)},
                      {"Content-Security-Policy", std::string(kJustThisPage)},
                      {"Referrer-Policy", "no-referrer"}}};
}

ApiResponse nothing_there() { return error_response({ErrorCode::not_found, "the page has no file of that name"}); }

void page(const ApiStation&, const Values&, const Send& send) {
  const auto* file = web::find_embedded_file("index.html");
  send(file != nullptr ? file_response(*file, "no-cache")
                       : error_response({ErrorCode::not_found, "this build has no page: use scanrig, or the API"}));
}

void asset(const ApiStation&, const Values& values, const Send& send) {
  const auto* file = web::find_embedded_file("assets/" + *values.text("name"));
  send(file != nullptr ? file_response(*file, "public, max-age=31536000, immutable") : nothing_there());
}

ordered_json login_json(const Identity& who) {
  return {{"role", to_string(who.role.value_or(Role::viewer))},
          {"name", who.token.empty() ? ordered_json(nullptr) : ordered_json(who.token)},
          {"cookie", !who.cookie.empty()}};
}

void snapshot(const ApiStation& station, const Values& values, const Send& send) {
  const auto present = station.hub->present();
  auto jobs = ordered_json::array();
  for (const auto& [id, job] : present.snapshot->jobs) jobs.push_back(to_detailed_json(*job));
  send({.body = to_text({{"life", present.life},
                         {"seq", present.last},
                         {"time", iso_time(system_clock::now())},
                         {"build", web::embedded_build()},
                         {"status", to_json(*present.snapshot)},
                         {"jobs", std::move(jobs)},
                         {"health", health_json(station)},
                         {"login", login_json(values.identity())},
                         {"insecure", station.insecure}})});
}

/// HttpOnly: no script reads it. SameSite: no other site's page sends it.
ApiResponse with_cookie(ApiResponse response, bool tls, std::string_view value, int life_s) {
  response.headers.emplace_back("Set-Cookie", fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict; Max-Age={}{}",
                                                          login_cookie(tls), value, life_s, tls ? "; Secure" : ""));
  return response;
}

void log_in(const ApiStation& station, const Values& values, const Send& send) {
  const auto token = values.text("token"), code = values.text("code");
  if (token.has_value() == code.has_value()) {
    return send(error_response({ErrorCode::invalid_input, "logging in takes a token or a code, one of them"}));
  }
  const auto now = system_clock::now();
  auto& access = *station.access;
  if (!access.may_try_to_log_in(values.requester(), now)) {
    return send(error_response(429, {ErrorCode::busy, "too many tries to log in: wait a minute"}));
  }
  const auto cookie = token ? access.log_in_by_token(*token, now) : access.log_in_by_code(*code, now);
  if (!cookie) return send(error_response(cookie.error()));
  if (!*cookie) {
    return send(error_response(
        401, {ErrorCode::refused, token ? "this token is not known: scanrig token list names those that are"
                                        : "this code is not valid any more: offer another one"}));
  }
  const auto who = access.identify(std::nullopt, "", **cookie, now);
  send(with_cookie({.body = to_text(login_json(who))}, station.tls, **cookie, kCookieLife_s));
}

void log_out(const ApiStation& station, const Values& values, const Send& send) {
  const auto& cookie = values.identity().cookie;
  if (!cookie.empty()) {
    if (const auto ended = station.access->log_out(cookie); !ended) return send(error_response(ended.error()));
  }
  send(with_cookie({.body = to_text(ordered_json::object())}, station.tls, "", 0));
}

void offer_code(const ApiStation& station, const Values& values, const Send& send) {
  const auto& who = values.identity();
  const auto role = values.text("role") ? parse_role(*values.text("role")) : who.role;
  const auto code =
      station.access->offer_code(who, role.value_or(Role::viewer), values.flag("kiosk"), system_clock::now());
  if (!code) return send(error_response(code.error()));
  const auto address = station.page_address();
  send({.body = to_text({{"code", *code},
                         {"valid_s", kCodeLife_s},
                         {"address", address.empty() ? ordered_json(nullptr) : ordered_json(address)}})});
}

Route open_file(std::string_view path, std::string_view description, std::vector<RequestField> in_path,
                std::string_view type, decltype(Route::handle) handle) {
  return {.method = Method::get,
          .path = path,
          .role = Role::viewer,
          .description = description,
          .in_path = std::move(in_path),
          .reply = {.description = "compressed by gzip", .type = type},
          .errors = {404},
          .open = true,
          .handle = std::move(handle)};
}

Route log_in_route() {
  return {.method = Method::post,
          .path = "/api/v1/login",
          .role = Role::viewer,
          .description =
              "Logs a browser in: sets a cookie that stands for the token, or for a code that was offered. At "
              "most ten tries a minute from one address.",
          .in_body = {{.name = "token", .description = "of the API", .min = 1, .max = kLongestToken},
                      {.name = "code", .description = "of POST login/code; counts once", .min = 1, .max = 16}},
          .reply = {.description = "the cookie is set", .schema = "Login"},
          .errors = {500},
          .slow = true,
          .open = true,
          .handle = log_in};
}

Route offer_code_route() {
  return {.method = Method::post,
          .path = "/api/v1/login/code",
          .role = Role::viewer,
          .description = "A code by which another browser may log in, once, within two minutes.",
          .in_body = {{.name = "role",
                       .description = "that it gives, at most one's own; one's own without it",
                       .words = {"viewer", "operator", "engineer"}},
                      {.name = "kiosk",
                       .type = RequestField::Type::flag,
                       .description = "a screen at the rig: keeps its role while it is idle"}},
          .reply = {.description = "to be opened as /#code=CODE", .schema = "LoginCode"},
          .errors = {409, 500},
          .handle = offer_code};
}

}  // namespace

std::vector<Route> page_routes() {
  return {open_file("/", "The web page.", {}, "text/html; charset=utf-8", page),
          open_file("/assets/{name}", "A script or style of the page; its name changes with its content.",
                    {{.name = "name", .description = "of the file", .required = true, .min = 1, .max = 100}},
                    "application/octet-stream", asset),
          {.method = Method::get,
           .path = "/api/v1/snapshot",
           .role = Role::viewer,
           .description = "Everything a page shows, as of event `life`-`seq`: events?after=LIFE-SEQ continues it.",
           .reply = {.description = "one moment", .schema = "Page"},
           .handle = snapshot},
          log_in_route(),
          {.method = Method::get,
           .path = "/api/v1/login",
           .role = Role::viewer,
           .description = "Who one is.",
           .reply = {.description = "role, and name of the token", .schema = "Login"},
           .handle = [](const ApiStation&, const Values& values,
                        const Send& send) { send({.body = to_text(login_json(values.identity()))}); }},
          {.method = Method::del,
           .path = "/api/v1/login",
           .role = Role::viewer,
           .description = "Logs this browser out.",
           .reply = {.description = "the cookie is void", .schema = "Nothing"},
           .errors = {500},
           .slow = true,
           .handle = log_out},
          offer_code_route()};
}

}  // namespace scanrig
