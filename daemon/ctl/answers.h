#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "daemon/ctl/client.h"

namespace scanrig::ctl {

/// What the verbs that talk to the daemon do with its answers.
ExitCode report_error(const RequestError& error);
void print(const nlohmann::json& answer);
/// The text behind `key`; empty where there is none.
std::string text(const nlohmann::json& object, const char* key);
/// "1.2 GiB"
std::string bytes_text(double bytes);

}  // namespace scanrig::ctl
