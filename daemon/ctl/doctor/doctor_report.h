#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace scanrig::ctl::doctor {

/// A problem in one sentence, and its remedy in another.
struct Finding {
  std::string id;  ///< one word for programs: "gear_ratio"
  std::string problem;
  std::string remedy;
};

/// Results of the doctor, section by section, and its findings.
class Report {
 public:
  void section(std::string heading) { sections_.push_back({std::move(heading), {}}); }
  void note(std::string line) { sections_.back().lines.push_back(std::move(line)); }
  void find(std::string id, std::string problem, std::string remedy) {
    findings_.push_back({std::move(id), std::move(problem), std::move(remedy)});
  }
  [[nodiscard]] const std::vector<Finding>& findings() const { return findings_; }

  [[nodiscard]] std::string text() const;
  [[nodiscard]] std::string json() const;

 private:
  struct Section {
    std::string heading;
    std::vector<std::string> lines;
  };
  std::vector<Section> sections_;
  std::vector<Finding> findings_;
};

/// The person at the rig, at a terminal or at the other end of standard input.
class Operator {
 public:
  /// `interactive`: a person replies on standard input although it is no terminal. Prompts go to standard error with
  /// `quiet_output`, so that standard output stays JSON.
  Operator(bool interactive, bool quiet_output);

  [[nodiscard]] bool there() const { return there_; }
  void tell(const std::string& text) const;
  /// The line that was entered; nothing without a person there.
  [[nodiscard]] std::optional<std::string> prompt(const std::string& question) const;

 private:
  bool there_;
  bool quiet_output_;
};

}  // namespace scanrig::ctl::doctor
