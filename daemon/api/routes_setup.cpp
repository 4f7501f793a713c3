#include <nlohmann/json.hpp>

#include "daemon/api/json_replies.h"
#include "daemon/api/route.h"

namespace scanrig {
namespace {

using config::setup::Question;
using config::setup::Session;
using config::setup::SessionState;
using nlohmann::ordered_json;
using Type = RequestField::Type;

constexpr double kLongestReply = 200, kLargestNumber = 1e15;

const RequestField kKey{
    .name = "key", .description = "of the browser that began setup", .required = true, .min = 1, .max = 64};

Error no_devices() {
  return {ErrorCode::refused, "setup: this service has simulated devices; there is nothing to set up"};
}

ordered_json question_json(const SessionState& state) {
  if (!state.question) return nullptr;
  const Question& question = *state.question;
  ordered_json options = ordered_json::array();
  for (std::size_t i = 0; i < question.options.size(); ++i) {
    const bool has_image = i < question.images.size() && !question.images[i].empty();
    options.push_back({{"text", question.options[i]}, {"image", has_image}});
  }
  return {{"number", state.number}, {"kind", to_string(question.kind)}, {"text", question.text}, {"min", question.min},
          {"max", question.max},    {"options", std::move(options)}};
}

/// Only who may reply is shown the draft: another browser has nothing to accept.
ordered_json setup_json(const SessionState& state, const std::optional<Error>& refused) {
  const auto text_or_null = [](const std::string& text) { return text.empty() ? ordered_json() : ordered_json(text); };
  return {{"phase", to_string(state.phase)},
          {"who", text_or_null(state.who)},
          {"owner", state.is_owner},
          {"refused", refused ? ordered_json(refused->message) : ordered_json()},
          {"told", state.told},
          {"question", question_json(state)},
          {"draft", text_or_null(state.is_owner ? state.draft : "")},
          {"problem", text_or_null(state.problem)}};
}

void look_at_setup(const ApiStation& station, const Values& values, const Send& send) {
  if (!station.setup) return send({.body = to_text(setup_json({}, no_devices()))});
  const auto state = station.setup->state(values.text("key").value_or(""));
  send({.body = to_text(setup_json(state, station.loop.snapshot()->actions.setup_refused))});
}

void image(const ApiStation& station, const Values& values, const Send& send) {
  const auto option = static_cast<std::size_t>(values.integer("option").value_or(0));
  auto jpeg = station.setup ? station.setup->image(option) : tl::unexpected(no_devices());
  send(jpeg ? ApiResponse{.body = std::move(*jpeg), .type = "image/jpeg"} : error_response(jpeg.error()));
}

void begin_setup(const ApiStation& station, const Values& values, Send send) {
  if (!station.setup) return send(error_response(no_devices()));
  station.begin_setup(values.sender(), [send = std::move(send)](const Result<std::string>& key) {
    send(key ? ApiResponse{.body = to_text({{"key", *key}})} : error_response(key.error()));
  });
}

/// Anybody who may begin one may end it: the owner's browser can be anywhere.
void end(const ApiStation& station, const Values&, Send send) {
  if (!station.setup) return send(error_response(no_devices()));
  station.end_setup([send = std::move(send)](const Result<std::string>& ended) {
    send(ended ? ApiResponse{.body = to_text(ordered_json::object())} : error_response(ended.error()));
  });
}

/// A route that is `what` of the session, with the owner's key.
Route owners(std::string_view path, std::string_view description, Result<void> (Session::*what)(const std::string&)) {
  return {.method = Method::post,
          .path = path,
          .role = Role::engineer,
          .description = description,
          .in_body = {kKey},
          .reply = {.description = "done", .schema = "Nothing"},
          .errors = {409, 500},
          .slow = true,
          .handle = [what](const ApiStation& station, const Values& values, const Send& send) {
            if (!station.setup) return send(error_response(no_devices()));
            const auto done = ((*station.setup).*what)(*values.text("key"));
            send(done ? ApiResponse{.body = to_text(ordered_json::object())} : error_response(done.error()));
          }};
}

Route reply_route() {
  return {.method = Method::post,
          .path = "/api/v1/setup/reply",
          .role = Role::engineer,
          .description = "Replies to the present question of setup.",
          .in_body = {kKey,
                      {.name = "number",
                       .type = Type::integer,
                       .description = "of the question",
                       .required = true,
                       .min = 1,
                       .max = kLargestNumber},
                      {.name = "text",
                       .description = "y or n; a number; the number of an option from 1; anything where something was "
                                      "to be done",
                       .required = true,
                       .max = kLongestReply}},
          .reply = {.description = "handed on", .schema = "Nothing"},
          .errors = {409},
          .handle = [](const ApiStation& station, const Values& values, const Send& send) {
            if (!station.setup) return send(error_response(no_devices()));
            const auto number = static_cast<std::uint64_t>(*values.integer("number"));
            const auto done = station.setup->reply(*values.text("key"), number, *values.text("text"));
            send(done ? ApiResponse{.body = to_text(ordered_json::object())} : error_response(done.error()));
          }};
}

}  // namespace

std::vector<Route> setup_routes() {
  return {
      {.method = Method::get,
       .path = "/api/v1/setup",
       .role = Role::engineer,
       .description = "Where setup is: what it found, its question, the rig.toml that it would write.",
       .in_query = {{.name = "key", .description = "a sign of the browser that began it", .max = 64}},
       .reply = {.description = "`phase` is none while the service has its devices", .schema = "Setup"},
       .handle = look_at_setup},
      {.method = Method::get,
       .path = "/api/v1/setup/image/{option}",
       .role = Role::engineer,
       .description = "What the camera of an option of the present question sees.",
       .in_path = {{.name = "option", .type = Type::integer, .description = "from 0", .required = true, .max = 99}},
       .in_query = {{.name = "of",
                     .type = Type::integer,
                     .description = "number of the question: a browser keeps an image by its whole address",
                     .min = 1,
                     .max = kLargestNumber}},
       .reply = {.description = "an image", .type = "image/jpeg"},
       .errors = {409, 500},
       .slow = true,
       .once = true,
       .handle = image},
      {.method = Method::post,
       .path = "/api/v1/setup/begin",
       .role = Role::engineer,
       .description = "From maintenance: stops the rig, closes its devices and starts setup, which finds what is "
                      "connected. The service restarts without devices; connections are cut.",
       .reply = {.description = "only who has the key may reply", .schema = "SetupKey"},
       .errors = {409, 500},
       .slow = true,
       .handle = begin_setup},
      reply_route(),
      owners("/api/v1/setup/accept",
             "The rig.toml that was found replaces the present one, which is kept as rig.toml.old.", &Session::accept),
      owners("/api/v1/setup/repeat", "Looks for the devices once more.", &Session::repeat),
      owners("/api/v1/setup/doctor",
             "The doctor examines the rig with the accepted rig.toml. The projector flashes; nothing turns.",
             &Session::examine),
      {.method = Method::post,
       .path = "/api/v1/setup/end",
       .role = Role::engineer,
       .description = "Ends setup: the service opens its devices again, with the rig.toml that is there, and waits "
                      "for Reset. Connections are cut.",
       .reply = {.description = "the service restarts", .schema = "Nothing"},
       .errors = {409, 500},
       .slow = true,
       .handle = end}};
}

}  // namespace scanrig
