#include <nlohmann/json.hpp>

#include "daemon/api/json_replies.h"
#include "daemon/api/route.h"

namespace scanrig {
namespace {

using nlohmann::ordered_json;
using Task = event::MaintenanceRequested::What;

constexpr Reply kPressed{.description = "obeyed", .schema = "Pressed"};
constexpr Reply kStopped{.description = "stop was sent", .schema = "Stopped"};
constexpr Reply kObeyed{.description = "obeyed; the status reports its progress", .schema = "Nothing"};

ApiResponse pressed(const Result<std::string>& job) {
  if (!job) return error_response(job.error());
  return {.body = to_text({{"job", job->empty() ? ordered_json(nullptr) : ordered_json(*job)}})};
}

Route press(std::string_view path, Button button, Role role, std::string_view description) {
  return {.method = Method::post,
          .path = path,
          .role = role,
          .description = description,
          .reply = kPressed,
          .errors = {409},
          .handle = [button](const ApiStation& station, const Values& values, Send send) {
            station.loop.press(
                button, Origin::remote,
                [send = std::move(send)](const Result<std::string>& job) { send(pressed(job)); }, {}, values.sender());
          }};
}

Route start_route() {
  constexpr double kOffer = 300.0;
  auto route = press("/api/v1/start", Button::start, Role::operating, "Starts a scan, or continues it after the flip.");
  route.in_body = {{.name = "offer",
                    .description =
                        "`actions.start.offer` of the status that was seen: where Start means something else "
                        "by now, it is refused. Repeated, it counts once",
                    .min = 1.0,
                    .max = kOffer}};
  route.handle = [](const ApiStation& station, const Values& values, Send send) {
    station.loop.press(
        Button::start, Origin::remote, [send = std::move(send)](const Result<std::string>& job) { send(pressed(job)); },
        values.text("offer").value_or(""), values.sender());
  };
  return route;
}

/// The snapshot of the stop, or a later one.
ApiResponse stopped(const Result<std::string>& job, const Snapshot& snapshot) {
  if (!job) return error_response(job.error());
  return {.body = to_text({{"job", job->empty() ? ordered_json(nullptr) : ordered_json(*job)},
                           {"sent", "Stop was sent to the drive; the light is switched off."},
                           {"standstill", to_string(standstill(snapshot))}})};
}

Route stop_route() {
  return {.method = Method::post,
          .path = "/api/v1/stop",
          .role = Role::viewer,
          .description =
              "Sends stop to the drive and switches the light off, in every state; an active job is "
              "interrupted and stays resumable. Any role may. `standstill` of the status follows.",
          .reply = kStopped,
          .reserved = true,
          .handle = [](const ApiStation& station, const Values& values, Send send) {
            station.loop.press(
                Button::stop, Origin::remote,
                [&loop = station.loop, send = std::move(send)](const Result<std::string>& job) {
                  send(stopped(job, *loop.snapshot()));
                },
                {}, values.sender());
          }};
}

void ask(const ApiStation& station, const event::MaintenanceRequested& asked, Send send) {
  station.loop.ask(asked, [send = std::move(send)](const Result<std::string>& done) {
    send(done ? ApiResponse{.body = to_text(ordered_json::object())} : error_response(done.error()));
  });
}

Route maintenance(std::string_view path, Task task, std::string_view description) {
  return {.method = Method::post,
          .path = path,
          .role = Role::engineer,
          .description = description,
          .reply = kObeyed,
          .errors = {409},
          .handle = [task](const ApiStation& station, const Values& values, Send send) {
            ask(station, {.what = task, .speed = kMaxJogSpeed, .requester = values.requester()}, std::move(send));
          }};
}

void jog(const ApiStation& station, const Values& values, Send send) {
  const auto to = values.number("to_deg"), by = values.number("by_deg");
  if (to.has_value() == by.has_value()) {
    return send(error_response({ErrorCode::invalid_input, "a jog takes to_deg or by_deg, one of them"}));
  }
  ask(station,
      {.what = Task::jog,
       .angle = {to ? *to : *by},
       .relative = by.has_value(),
       .speed = {values.number("speed_deg_s").value_or(kMaxJogSpeed.value)},
       .requester = values.requester()},
      std::move(send));
}

Route jog_route() {
  constexpr double kTurns = 3600.0;
  return {.method = Method::post,
          .path = "/api/v1/maintenance/jog",
          .role = Role::engineer,
          .description = "Turns the table while maintenance is on: to an angle, or by one.",
          .in_body = {{.name = "to_deg",
                       .type = RequestField::Type::number,
                       .description = "where to",
                       .min = -kTurns,
                       .max = kTurns},
                      {.name = "by_deg",
                       .type = RequestField::Type::number,
                       .description = "by how much",
                       .min = -kTurns,
                       .max = kTurns},
                      {.name = "speed_deg_s",
                       .type = RequestField::Type::number,
                       .description = "how fast; without it as fast as maintenance may",
                       .min = 0.0,
                       .max = 360.0}},
          .reply = kObeyed,
          .errors = {409},
          .handle = jog};
}

Route look(std::string_view path, std::string_view description, Reply reply, ordered_json (*what)(const Snapshot&),
           bool reserved = false) {
  return {.method = Method::get,
          .path = path,
          .role = Role::viewer,
          .description = description,
          .reply = reply,
          .reserved = reserved,
          .handle = [what](const ApiStation& station, const Values&, const Send& send) {
            send({.body = to_text(what(*station.loop.snapshot()))});
          }};
}

}  // namespace

std::vector<Route> station_routes() {
  return {
      look(
          "/api/v1/status", "What the rig does, why, and what to do next.",
          {.description = "the latest snapshot", .schema = "Status"}, [](const Snapshot& s) { return to_json(s); },
          true),
      look("/api/v1/io", "The panel's inputs and outputs.", {.description = "as last seen", .schema = "Io"}, io_table),
      {.method = Method::get,
       .path = "/api/v1/events",
       .role = Role::viewer,
       .description =
           "Server-sent events: `status` and `job` as they change, each with the shapes of Status and JobDetail, and "
           "`job_deleted` with {\"id\"}. A client that comes back with Last-Event-ID gets what it missed, or `lost` "
           "and the present status when that is too long ago. A comment every 10 s is the heartbeat. With `after`, the "
           "`life` and `seq` of a snapshot, what came after it, and an event `beat` {\"time\", \"seq\"} every half "
           "second.",
       .in_query = {{.name = "after", .description = "LIFE-SEQ", .min = 1, .max = 64}},
       .reply = {.description = "events without end", .type = "text/event-stream"},
       .handle =
           [](const ApiStation&, const Values& values, const Send& send) {
             const auto after = values.text("after");
             send({.body = EventStream{.after = after.value_or(""), .beats = after.has_value()}});
           }},
      start_route(),
      stop_route(),
      press("/api/v1/reset", Button::reset, Role::operating, "Clears a fault and homes the table."),
      maintenance("/api/v1/maintenance/on", Task::on, "Maintenance mode begins: no jobs."),
      maintenance("/api/v1/maintenance/off", Task::off, "Maintenance mode ends."),
      maintenance("/api/v1/maintenance/home", Task::home, "Homes the table while maintenance is on."),
      jog_route(),
      maintenance("/api/v1/maintenance/pulse", Task::pulse, "One flash of the projector."),
      maintenance("/api/v1/maintenance/lamp_test", Task::lamp_test, "All lamps on for three seconds."),
  };
}

}  // namespace scanrig
