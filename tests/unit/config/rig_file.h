#pragma once

#include "config/rig_config.h"
#include "tests/unit/config/file_under_test.h"

namespace scanrig::config {

/// The shipped example of a rig, changed.
class RigFile : public FileUnderTest {
 protected:
  const std::filesystem::path drives_ = std::filesystem::path(SCANRIG_SOURCE_DIR) / "config" / "drives";
  const std::string example_ = shipped("rigs/example.toml");

  Result<RigConfig> read(const std::string& text) const {
    write(text);
    return read_rig_config(file_, drives_);
  }
  /// `text` with one text replaced has exactly one problem, on `line_with`'s line.
  void expect_problem_in(const std::string& text, const std::string& from, const std::string& to,
                         const std::string& problem, const std::string& line_with = "") const {
    SCOPED_TRACE(to);
    const std::string changed = replaced(text, from, to);
    const auto rig = read(changed);
    ASSERT_FALSE(rig);
    EXPECT_EQ(rig.error().code, ErrorCode::invalid_input);
    const int line = line_of(changed, line_with.empty() ? to : line_with);
    EXPECT_EQ(rig.error().message, fmt::format("{}:{}: {}", file_.string(), line, problem));
  }
  void expect_problem(const std::string& from, const std::string& to, const std::string& problem,
                      const std::string& line_with = "") const {
    expect_problem_in(example_, from, to, problem, line_with);
  }
  /// The example with another text in place of everything from the heading `begin` to the heading `end`.
  [[nodiscard]] std::string with_section(const std::string& begin, const std::string& end,
                                         const std::string& text) const {
    return example_.substr(0, example_.find("\n" + begin) + 1) + text + "\n" +
           example_.substr(example_.find("\n" + end) + 1);
  }
};

}  // namespace scanrig::config
