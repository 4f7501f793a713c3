// Setup for a person at the page, over small programs instead of scanrig: who may answer, what becomes of rig.toml, and
// that no program is left with the devices.
#include "config/setup/session.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <thread>

#include "core/files.h"

namespace scanrig::config::setup {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;

/// Asks for a number, and writes it as the draft.
constexpr const char* kAsks =
    R"(echo '{"tell": "Looking."}'; echo '{"ask": {"kind": "number", "text": "Turns?", "min": 1, "max": 100, )"
    R"("options": [], "images": []}}'; read turns || exit 6; echo "turns = $turns" > "$0")";

class SetupSession : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / fmt::format("scanrig-session-{}", ::getpid());
    std::filesystem::create_directories(folder_);
    file_ = folder_ / "rig.toml";
    draft_ = folder_ / "rig.toml.found";
    ASSERT_TRUE(write_file_atomically(file_, "old"));
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  SessionOptions options(const std::string& script) const {
    return {.setup = {"/bin/sh", "-c", script, draft_.string()},
            .doctor = {"/bin/sh", "-c", R"(echo '{"tell": "All well."}')"},
            .file = file_,
            .draft = draft_,
            .check = [](const auto&) { return Result<void>(); },
            .grace = milliseconds(300)};
  }
  static SessionState wait_for(Session& session, const std::string& key,
                               const std::function<bool(const SessionState&)>& what) {
    const auto limit = std::chrono::steady_clock::now() + seconds(10);
    auto state = session.state(key);
    while (!what(state) && std::chrono::steady_clock::now() < limit) {
      std::this_thread::sleep_for(milliseconds(10));
      state = session.state(key);
    }
    EXPECT_TRUE(what(state)) << to_string(state.phase) << ": " << state.problem;
    return state;
  }
  static bool is_asking(const SessionState& state) { return state.question.has_value(); }
  static auto in(Phase phase) {
    return [phase](const SessionState& state) { return state.phase == phase; };
  }

  std::filesystem::path folder_, file_, draft_;
};

TEST_F(SetupSession, AnswersBecomeAFileThatIsReplacedOnlyWhenAccepted) {
  Session session(options(kAsks));
  const auto key = session.claim("anna").value();
  EXPECT_EQ(session.state(key).phase, Phase::lending);
  ASSERT_TRUE(session.begin());
  const auto asking = wait_for(session, key, is_asking);
  EXPECT_THAT(asking.told, ElementsAre("Looking."));
  EXPECT_EQ(asking.question->max, 100);
  EXPECT_EQ(session.reply(key, asking.number, "1000").error().code, ErrorCode::invalid_input);
  EXPECT_EQ(session.reply(key, asking.number, "9\n9").error().code, ErrorCode::invalid_input);
  EXPECT_EQ(session.reply(key, asking.number + 1, "90").error().code, ErrorCode::refused);
  EXPECT_EQ(session.accept(key).error().code, ErrorCode::refused);
  ASSERT_TRUE(session.reply(key, asking.number, "90"));
  EXPECT_EQ(session.reply(key, asking.number, "90").error().code, ErrorCode::refused) << "asked once";
  EXPECT_EQ(wait_for(session, key, in(Phase::found)).draft, "turns = 90\n");
  EXPECT_EQ(read_file(file_).value(), "old");
  ASSERT_TRUE(session.accept(key));
  EXPECT_EQ(read_file(file_).value(), "turns = 90\n");
  EXPECT_EQ(read_file(session.kept()).value(), "old");
  ASSERT_TRUE(session.examine(key));
  EXPECT_THAT(wait_for(session, key, in(Phase::examined)).told, ElementsAre("All well."));
  EXPECT_TRUE(session.end());
  EXPECT_EQ(session.state(key).phase, Phase::none);
  EXPECT_FALSE(std::filesystem::exists(draft_));
}

TEST_F(SetupSession, WhatWasShownIsWrittenWhateverBecameOfTheDraft) {
  auto with = options("echo found > \"$0\"");
  with.check = [](const auto& file) {
    return read_file(file).value_or("") == "found\n" ? Result<void>() : fail(ErrorCode::invalid_input, "another text");
  };
  Session session(with);
  const auto key = session.claim("anna").value();
  ASSERT_TRUE(session.begin());
  wait_for(session, key, in(Phase::found));
  ASSERT_TRUE(write_file_atomically(draft_, "forged"));
  ASSERT_TRUE(session.accept(key));
  EXPECT_EQ(read_file(file_).value(), "found\n");
}

TEST_F(SetupSession, AFileThatIsNotValidReplacesNothing) {
  auto with = options("echo found > \"$0\"");
  with.check = [](const auto&) { return Result<void>(fail(ErrorCode::invalid_input, "line 1: no")); };
  Session session(with);
  const auto key = session.claim("anna").value();
  ASSERT_TRUE(session.begin());
  wait_for(session, key, in(Phase::found));
  EXPECT_EQ(session.accept(key).error().message, "line 1: no");
  EXPECT_EQ(read_file(file_).value(), "old");
  EXPECT_FALSE(std::filesystem::exists(session.kept()));
}

TEST_F(SetupSession, OneBrowserHasIt) {
  Session session(options(kAsks));
  const auto key = session.claim("anna").value();
  const auto second = session.claim("bert");
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::busy);
  EXPECT_THAT(second.error().message, HasSubstr("anna"));
  ASSERT_TRUE(session.begin());
  const auto asking = wait_for(session, key, is_asking);
  for (const auto& other : {std::string(), std::string("0123"), key.substr(1)}) {
    EXPECT_EQ(session.reply(other, asking.number, "90").error().code, ErrorCode::refused);
    EXPECT_EQ(session.repeat(other).error().code, ErrorCode::refused);
    EXPECT_EQ(session.accept(other).error().code, ErrorCode::refused);
    EXPECT_EQ(session.examine(other).error().code, ErrorCode::refused);
    EXPECT_FALSE(session.state(other).is_owner);
  }
  session.end();
  EXPECT_EQ(session.reply("", 0, "").error().code, ErrorCode::refused) << "the empty key of no session is none";
  EXPECT_TRUE(session.claim("bert"));
}

TEST_F(SetupSession, AFailureIsSaidAndCanBeRepeated) {
  Session session(options(R"(test -e "$0.again" && { echo found > "$0"; exit 0; }; touch "$0.again"; )"
                          R"(echo 'scanrig: setup: no drive responds' >&2; exit 4)"));
  const auto key = session.claim("anna").value();
  ASSERT_TRUE(session.begin());
  EXPECT_EQ(wait_for(session, key, in(Phase::failed)).problem, "setup: no drive responds");
  ASSERT_TRUE(session.repeat(key));
  wait_for(session, key, in(Phase::found));
}

TEST_F(SetupSession, AnEndLetsTheProgramSwitchOffWhatItHasOn) {
  Session session(options(R"(echo '{"ask": {"kind": "done", "text": "On?", "min": 0, "max": 0, "options": [], )"
                          R"("images": []}}'; read line || { touch "$0.off"; exit 6; })"));
  const auto key = session.claim("anna").value();
  ASSERT_TRUE(session.begin());
  wait_for(session, key, is_asking);
  EXPECT_TRUE(session.end());
  EXPECT_TRUE(std::filesystem::exists(draft_.string() + ".off"));
}

TEST_F(SetupSession, NoProgramIsLeftBehind) {
  Session session(options(R"(trap '' TERM PIPE; echo "{\"tell\": \"$$\"}"; while true; do sleep 1; done)"));
  const auto key = session.claim("anna").value();
  ASSERT_TRUE(session.begin());
  const auto state = wait_for(session, key, [](const auto& now) { return !now.told.empty(); });
  const auto pid = std::stoi(state.told.front());
  EXPECT_EQ(::kill(pid, 0), 0);
  const auto before = std::chrono::steady_clock::now();
  session.end();
  EXPECT_LT(std::chrono::steady_clock::now() - before, seconds(2));
  EXPECT_NE(::kill(pid, 0), 0);
}

TEST_F(SetupSession, ABrowserThatIsGoneEndsIt) {
  auto with = options(kAsks);
  with.silence = milliseconds(300);
  std::atomic<int> over = 0;
  Session session(with);
  session.on_silence([&] { ++over; });
  const auto key = session.claim("anna").value();
  ASSERT_TRUE(session.begin());
  for (int i = 0; i < 20; ++i) {
    std::this_thread::sleep_for(milliseconds(50));
    std::ignore = session.state(key);
  }
  EXPECT_EQ(over, 0) << "its browser is there";
  for (int i = 0; i < 20; ++i) {
    std::this_thread::sleep_for(milliseconds(50));
    std::ignore = session.state("another");
  }
  EXPECT_EQ(over, 1) << "another browser is no sign of it";
}

TEST_F(SetupSession, IsRefusedWhereTheFileCouldNotBeWritten) {
  auto with = options(kAsks);
  with.file = folder_ / "missing" / "rig.toml";
  Session session(with);
  const auto claimed = session.claim("anna");
  ASSERT_FALSE(claimed);
  EXPECT_THAT(claimed.error().message, HasSubstr("run sudo scanrig setup at a terminal"));
}

}  // namespace
}  // namespace scanrig::config::setup
