#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace scanrig::config::setup {

/// A question to the person at the rig, as data: a terminal prints it, the page shows it.
struct Question {
  enum class Kind {
    yes_or_no,  ///< "y" or "n"
    number,     ///< `min` to `max`
    choice,     ///< one of `options`, told by its number from 1
    done        ///< any line: what was asked for is done
  };
  Kind kind = Kind::done;
  std::string text{};
  double min = 0.0, max = 0.0;
  std::vector<std::string> options{};
  std::vector<std::string> images{};  ///< JPEG files of the options, in their order; empty: there are none

  /// Whether `reply` is one.
  [[nodiscard]] bool is_answered_by(const std::string& reply) const;
  /// Lines of text, with what may be replied.
  [[nodiscard]] std::string printed() const;

  bool operator==(const Question&) const = default;
};

std::string_view to_string(Question::Kind kind);  ///< "yes_or_no"

/// What a person at the rig is told and asked. Every question is repeated until its reply is valid.
class Dialogue {
 public:
  virtual ~Dialogue() = default;
  virtual void tell(const std::string& text) const = 0;
  /// One line. Fails with `refused` when the replies end.
  [[nodiscard]] virtual Result<std::string> prompt(const Question& question) const = 0;

  // Fail as prompt().
  [[nodiscard]] Result<void> wait_until_done(const std::string& what) const;
  [[nodiscard]] Result<bool> prompt_yes_or_no(const std::string& question) const;
  [[nodiscard]] Result<double> prompt_number(const std::string& question, double min, double max) const;
  /// Index of the chosen one. Not asked where there is one only.
  [[nodiscard]] Result<std::size_t> choose(const std::string& question, const std::vector<std::string>& options,
                                           const std::vector<std::string>& images = {}) const;
};

/// What a program tells or asks whose person is at the other end of a pipe.
struct Message {
  std::string told{};  ///< empty: a question
  std::optional<Question> question{};
};

/// One line of JSON, without its end.
std::string to_line(const Message& message);
/// Nothing where the line is not such a message.
std::optional<Message> read_line(std::string_view line);

}  // namespace scanrig::config::setup
