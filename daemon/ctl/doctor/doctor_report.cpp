#include <unistd.h>

#include <fmt/format.h>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "core/timestamp.h"
#include "daemon/ctl/doctor/examine_rig.h"

namespace scanrig::ctl::doctor {

std::string Report::text() const {
  std::string text;
  for (const Section& section : sections_) {
    text += section.heading + "\n";
    for (const std::string& line : section.lines) text += "  " + line + "\n";
  }
  text += findings_.empty() ? "Nothing wrong was found.\n" : fmt::format("{} finding(s)\n", findings_.size());
  for (const Finding& finding : findings_) {
    text += fmt::format("  {}: {}\n    {}\n", finding.id, finding.problem, finding.remedy);
  }
  return text;
}

std::string Report::json() const {
  auto sections = nlohmann::ordered_json::array(), findings = nlohmann::ordered_json::array();
  for (const Section& section : sections_) sections.push_back({{"heading", section.heading}, {"lines", section.lines}});
  for (const Finding& finding : findings_) {
    findings.push_back({{"id", finding.id}, {"problem", finding.problem}, {"remedy", finding.remedy}});
  }
  const nlohmann::ordered_json all{
      {"time", iso_time(std::chrono::system_clock::now())}, {"sections", sections}, {"findings", findings}};
  return all.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

Operator::Operator(bool interactive, bool quiet_output, Face face)
    : there_(interactive || face == Face::page || ::isatty(STDIN_FILENO) == 1),
      quiet_output_(quiet_output),
      face_(face) {}

void Operator::print(const std::string& line) const {
  std::FILE* out = quiet_output_ ? stderr : stdout;
  fmt::print(out, "{}\n", line);
  std::fflush(out);
}

void Operator::tell(const std::string& text) const {
  print(face_ == Face::page ? config::setup::to_line({.told = text}) : text);
}

std::optional<std::string> Operator::reply() const {
  std::string line;
  if (!std::getline(std::cin, line)) return std::nullopt;
  return line;
}

std::optional<std::string> Operator::prompt(const std::string& question) const {
  if (!there_) return std::nullopt;
  if (face_ == Face::page) return prompt(config::setup::Question{.text = question});
  print(question);
  return reply();
}

std::optional<std::string> Operator::prompt(const config::setup::Question& question) const {
  if (!there_) return std::nullopt;
  print(face_ == Face::page ? config::setup::to_line({.question = question}) : question.printed());
  return reply();
}

}  // namespace scanrig::ctl::doctor
