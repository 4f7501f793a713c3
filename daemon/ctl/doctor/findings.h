#pragma once

#include <string>
#include <utility>
#include <vector>

namespace scanrig::ctl::doctor {

/// Something that is wrong, in one sentence, and what to do about it in another.
struct Finding {
  std::string id;  ///< one word for programs: "gear_ratio"
  std::string problem;
  std::string remedy;
};

/// What the doctor saw, section by section, and what is wrong.
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

}  // namespace scanrig::ctl::doctor
