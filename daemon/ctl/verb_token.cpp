#include <chrono>
#include <nlohmann/json.hpp>

#include "config/rig_config.h"
#include "daemon/api/tokens.h"
#include "daemon/ctl/verbs.h"
#include "daemon/station/timestamp.h"

namespace scanrig::ctl {
namespace {

using nlohmann::ordered_json;

Result<std::filesystem::path> file_of(const TokenVerb& verb) {
  if (!verb.file.empty()) return verb.file;
  const auto config = config::read_rig_config(verb.config, {}, config::Cameras::or_simulated);
  if (!config) return pass_on(config);
  if (config->api.tokens.empty()) {
    return fail(ErrorCode::invalid_input, "{}: [api] names no file of tokens: add `tokens`, or say --file",
                verb.config.string());
  }
  return config->api.tokens;
}

Result<void> add(const TokenVerb& verb, TokenFile tokens, const std::filesystem::path& file) {
  const auto token =
      tokens.add(verb.name, parse_role(verb.role).value_or(Role::viewer), iso_time(std::chrono::system_clock::now()));
  if (!token) return pass_on(token);
  if (auto written = tokens.write(file); !written) return written;
  if (verb.json) {
    fmt::print("{}\n", ordered_json{{"name", verb.name}, {"role", verb.role}, {"token", *token}}.dump());
  } else {
    fmt::print("{}\n", *token);
  }
  return {};
}

Result<void> revoke(const TokenVerb& verb, TokenFile tokens, const std::filesystem::path& file) {
  if (auto revoked = tokens.revoke(verb.name); !revoked) return revoked;
  if (auto written = tokens.write(file); !written) return written;
  if (verb.json) fmt::print("{}\n", ordered_json{{"revoked", verb.name}}.dump());
  return {};
}

void list(const TokenVerb& verb, const TokenFile& tokens) {
  auto all = ordered_json::array();
  for (const auto& token : tokens.records()) {
    if (!verb.json) fmt::print("{:<32}  {:<8}  {}\n", token.name, to_string(token.role), token.created);
    all.push_back({{"name", token.name}, {"role", to_string(token.role)}, {"created", token.created}});
  }
  if (verb.json) fmt::print("{}\n", ordered_json{{"tokens", all}}.dump(2));
}

}  // namespace

ExitCode token(const TokenVerb& verb) {
  const auto file = file_of(verb);
  if (!file) return report_error(file.error());
  auto tokens = TokenFile::read(*file);
  if (!tokens) return report_error(tokens.error());
  Result<void> done;
  if (verb.what == "add") {
    done = add(verb, std::move(*tokens), *file);
  } else if (verb.what == "revoke") {
    done = revoke(verb, std::move(*tokens), *file);
  } else {
    list(verb, *tokens);
  }
  return done ? ExitCode::ok : report_error(done.error());
}

}  // namespace scanrig::ctl
