// What setup asks, as data: the same questions at a terminal and at the page.
#include <gmock/gmock.h>

#include <vector>

#include "config/setup/dialogue.h"

namespace scanrig::config::setup {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using Kind = Question::Kind;

/// Replies one line after the other.
class Script final : public Dialogue {
 public:
  explicit Script(std::vector<std::string> replies) : replies_(std::move(replies)) {}
  void tell(const std::string&) const override {}
  [[nodiscard]] Result<std::string> prompt(const Question& question) const override {
    asked.push_back(question);
    if (asked.size() > replies_.size()) return fail(ErrorCode::refused, "the replies have ended");
    return replies_[asked.size() - 1];
  }
  mutable std::vector<Question> asked;

 private:
  const std::vector<std::string> replies_;
};

TEST(SetupQuestions, AreAskedUntilTheReplyIsOne) {
  const Script number({"many", "0", "1e9", "90 ", "90"});
  EXPECT_EQ(number.prompt_number("How many turns?", 0.1, 1000).value(), 90.0);
  EXPECT_EQ(number.asked.size(), 5U);
  const Script yes({"", "maybe", "yes"});
  EXPECT_TRUE(yes.prompt_yes_or_no("Is there a guard?").value());
  const Script which({"0", "3", "-1", "2"});
  EXPECT_EQ(which.choose("Which one?", {"a", "b"}).value(), 1U);
}

TEST(SetupQuestions, OneCandidateIsNoQuestion) {
  const Script silent({});
  EXPECT_EQ(silent.choose("Which one?", {"the only one"}).value(), 0U);
  EXPECT_THAT(silent.asked, IsEmpty());
}

TEST(SetupQuestions, EndWhenTheRepliesEnd) {
  const Script silent({});
  EXPECT_EQ(silent.wait_until_done("Release it").error().code, ErrorCode::refused);
  EXPECT_EQ(silent.prompt_number("How many?", 1, 2).error().code, ErrorCode::refused);
}

TEST(SetupQuestions, CarryWhatCanBeChosenAndItsPictures) {
  const Script left({"1"});
  ASSERT_TRUE(left.choose("Which camera is on the left?", {"A", "B"}, {"a.jpg", "b.jpg"}));
  const auto& asked = left.asked.front();
  EXPECT_EQ(asked.kind, Kind::choice);
  EXPECT_THAT(asked.options, ElementsAre("A", "B"));
  EXPECT_THAT(asked.images, ElementsAre("a.jpg", "b.jpg"));
}

TEST(SetupQuestions, ArePrintedWithWhatMayBeReplied) {
  EXPECT_EQ((Question{.kind = Kind::yes_or_no, .text = "Guard?"}.printed()), "Guard? [y/n]");
  EXPECT_EQ((Question{.kind = Kind::number, .text = "Turns?", .min = 0.1, .max = 1000}.printed()),
            "Turns? [0.1 to 1000]");
  EXPECT_EQ((Question{.kind = Kind::choice, .text = "Which?", .options = {"a", "b"}}.printed()),
            "Which?\n  1  a\n  2  b");
  EXPECT_EQ((Question{.text = "Release it"}.printed()), "Release it, then press Enter.");
}

TEST(SetupQuestions, PassThroughALine) {
  const Question all{.kind = Kind::choice,
                     .text = "Which \"one\"?\nSay",
                     .min = 0.5,
                     .max = 7,
                     .options = {"a", "\xc3\xa4"},
                     .images = {"a.jpg", ""}};
  const auto line = to_line({.question = all});
  EXPECT_EQ(line.find('\n'), std::string::npos);
  EXPECT_EQ(read_line(line).value().question, all);
  EXPECT_EQ(read_line(to_line({.told = "Two\nlines"})).value().told, "Two\nlines");
}

TEST(SetupQuestions, NothingElseIsALine) {
  for (const auto* text :
       {"", "hello", "[]", "{}", R"({"ask": 1})", R"({"tell": 1})",
        R"({"ask": {"kind": "other", "text": "", "min": 0, "max": 0, "options": [], "images": []}})"})
    EXPECT_FALSE(read_line(text)) << text;
}

}  // namespace
}  // namespace scanrig::config::setup
