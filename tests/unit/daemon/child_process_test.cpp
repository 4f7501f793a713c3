#include "daemon/jobs/child_process.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <csignal>
#include <string>
#include <thread>

#include "core/priority.h"

namespace scanrig {
namespace {

using testing::ElementsAre;

ChildCommand shell(const std::string& script) { return {.words = {"/bin/sh", "-c", script}}; }

TEST(Child, EndsWithItsCodeItsLinesAndItsLastWords) {
  std::vector<std::string> lines;
  auto command = shell("echo one; echo two; echo first >&2; echo why >&2; exit 7");
  command.on_line = [&](std::string_view line) { lines.emplace_back(line); };
  const auto end = run_child(command, {});
  ASSERT_TRUE(end) << end.error().message;
  EXPECT_EQ(end->code, 7);
  EXPECT_EQ(end->last_words, "why");
  EXPECT_THAT(lines, ElementsAre("one", "two"));
}

TEST(Child, IsTheFirstThatTheKernelEndsWhenMemoryRunsOut) {
  std::vector<std::string> lines;
  auto command = shell("cat /proc/self/oom_score_adj");
  command.on_line = [&](std::string_view line) { lines.emplace_back(line); };
  ASSERT_TRUE(run_child(command, {}));
  EXPECT_THAT(lines, ElementsAre("500"));
}

/// Also beside a parent that gives way already: its own value is not raised.
TEST(Child, GivesWayToWhatMovesTheRig) {
  std::vector<std::string> lines;
  auto command = shell("nice");
  command.on_line = [&](std::string_view line) { lines.emplace_back(line); };
  std::thread([&] {
    lower_priority_to(17);
    ASSERT_TRUE(run_child(command, {}));
  }).join();
  ASSERT_TRUE(run_child(command, {}));
  EXPECT_THAT(lines, ElementsAre(std::to_string(std::max(niceness(), 17)), std::to_string(std::max(niceness(), 15))));
}

TEST(Child, SaysWhichSignalEndedIt) {
  const auto end = run_child(shell("kill -SEGV $$"), {});
  ASSERT_TRUE(end) << end.error().message;
  EXPECT_EQ(end->signal, SIGSEGV);
  EXPECT_EQ(end->code, -1);
}

TEST(Child, IsKilledWhenItsTimeIsOver) {
  auto command = shell("sleep 60");
  command.limit = std::chrono::seconds(0);
  const auto end = run_child(command, {});
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().code, ErrorCode::timeout);
}

TEST(Child, IsKilledOnRequest) {
  std::stop_source stop;
  auto command = shell("echo here; sleep 60");
  command.on_line = [&](std::string_view) { stop.request_stop(); };
  const auto end = run_child(command, stop.get_token());
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().code, ErrorCode::stopped);
}

TEST(Child, CannotTakeMoreMemoryThanItMay) {
  auto command = shell("head -c 200000000 /dev/zero | tail -c 100000000 | wc -c");
  command.memory_bytes = 32u << 20;
  const auto end = run_child(command, {});
  ASSERT_TRUE(end) << end.error().message;
  EXPECT_THAT(end->last_words, testing::HasSubstr("memory"));
}

TEST(Child, AProgramThatIsNotThereIsAnIoError) {
  const auto end = run_child({.words = {"/nowhere/program"}}, {});
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().code, ErrorCode::io);
}

}  // namespace
}  // namespace scanrig
