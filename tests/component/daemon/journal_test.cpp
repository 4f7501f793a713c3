// The log's entries about the station; no thread waits for them.
#include "daemon/journal/journal.h"

#include <gmock/gmock.h>

#include <future>

#include "daemon/journal/log_entries.h"
#include "tests/component/daemon/daemon_under_test.h"

namespace scanrig {

/// For messages of failed expectations.
void PrintTo(const JournalEntry& entry, std::ostream* out) { *out << text_line(entry, {}); }

namespace {

using std::chrono::seconds;
using testing::AllOf;
using testing::Contains;
using testing::Each;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::Optional;

auto says(const std::string& words) { return Field(&JournalEntry::message, HasSubstr(words)); }
auto has(Priority priority) { return Field(&JournalEntry::priority, priority); }

class LoggedDaemon : public Daemon {
 protected:
  void SetUp() override {
    Daemon::SetUp();
    options.journal = [this](JournalEntry entry) {
      const std::lock_guard guard(mutex);
      lines.push_back(std::move(entry));
    };
  }
  /// Entries of one view, in order.
  std::vector<std::string> of_view(int pose, int view) const {
    std::vector<std::string> messages;
    for (const auto& line : lines) {
      if (line.pose == pose && line.view == view) messages.push_back(line.message);
    }
    return messages;
  }
  /// Reported states of the job, in order.
  std::vector<std::string> states(const std::string& id) const {
    std::vector<std::string> words;
    for (const auto& line : lines) {
      const auto word = line.message.substr(0, line.message.find_first_of(" .:"));
      if (line.job == id && !line.pose && parse_job_state(word)) words.push_back(word);
    }
    return words;
  }
  std::mutex mutex;
  std::vector<JournalEntry> lines;
};

TEST_F(LoggedDaemon, TellsAWholeJobOfTwoPoses) {
  rig.line.lose = 1;
  boot();
  get_ready();
  scan_both_poses();
  ASSERT_TRUE(wait_pass());
  shut_down();
  const auto id = job_folders().at(0).filename().string();
  EXPECT_THAT(states(id), ElementsAre("queued", "scanning", "waiting_for_flip", "scanning", "reconstructing", "done"));
  EXPECT_THAT(of_view(0, 0), ElementsAre(HasSubstr("Exposed again: camera: no frame"), HasSubstr("Stored"),
                                         HasSubstr("Movement check")));
  for (const int pose : {0, 1}) {
    for (const int view : {0, 1, 2}) EXPECT_THAT(of_view(pose, view), Contains(HasSubstr("Stored, taken at"))) << view;
    EXPECT_THAT(lines,
                Contains(AllOf(says("Movement check: nothing has moved"), Field(&JournalEntry::pose, Optional(pose)))));
  }
  for (const auto* stage : {"Stage range begins", "Stage registration pose 1 begins",
                            "Stage registration pose 2 ends after", "Stage texture ends after"}) {
    EXPECT_THAT(lines, Contains(AllOf(says(stage), Field(&JournalEntry::job, id)))) << stage;
  }
  for (const auto* machine : {"Halted: ", "Operational.Initialized: Reset was pressed.",
                              "Operational.Ready: ", "Operational.SingleExecution: Start was pressed."}) {
    EXPECT_THAT(lines, Contains(AllOf(says(machine), has(Priority::notice)))) << machine;
  }
  EXPECT_THAT(lines, Contains(says("Halted: The service is shutting down.")));
  EXPECT_THAT(lines, Each(testing::Not(has(Priority::error))));
}

TEST_F(LoggedDaemon, TellsAFaultWithItsCauseItsJobAndWhatToDo) {
  boot();
  get_ready();
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_busy());
  rig.panel.set(&PanelInputs::estop_ok, false);
  ASSERT_TRUE(wait_fault());
  rig.panel.set(&PanelInputs::estop_ok, true);
  clock.sleep_for(seconds(1));
  shut_down();
  const auto id = job_folders().at(0).filename().string();
  EXPECT_THAT(lines, Contains(AllOf(says("Error: The e-stop was pressed."), has(Priority::error),
                                    Field(&JournalEntry::job, id))));
  EXPECT_THAT(lines, Contains(says("Next: Release the e-stop, then press Reset at the panel.")));
  EXPECT_THAT(lines, Contains(says("Next: Fix the cause, then press Reset at the panel.")));
  EXPECT_THAT(lines, Contains(AllOf(says("interrupted (stopped): The e-stop was pressed."), has(Priority::error),
                                    Field(&JournalEntry::job, id))));
}

TEST_F(LoggedDaemon, NamesTheDeviceInItsFaultAndNobodyInAnEstop) {
  const auto of_fault = [this](const std::string& words) {
    const auto at = std::ranges::find_if(lines, [&](const auto& line) {
      return line.priority == Priority::error && line.message.find("Error: " + words) == 0;
    });
    return at == lines.end() ? "no such line" : at->device;
  };
  boot();
  get_ready();
  {
    const std::lock_guard guard(rig.turntable.mutex);
    rig.turntable.stalled = true;
  }
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_fault());
  clock.sleep_for(seconds(1));
  {
    const std::lock_guard guard(rig.turntable.mutex);
    rig.turntable.stalled = false;
  }
  rig.panel.press(&PanelInputs::reset);
  ASSERT_TRUE(wait_ready());
  {
    const std::lock_guard guard(rig.line.mutex);
    rig.line.lose = 100;
  }
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_fault());
  clock.sleep_for(seconds(1));
  rig.panel.press(&PanelInputs::reset);
  ASSERT_TRUE(wait_ready());
  rig.panel.set(&PanelInputs::estop_ok, false);
  ASSERT_TRUE(wait_fault());
  rig.panel.set(&PanelInputs::estop_ok, true);
  rig.panel.press(&PanelInputs::reset);
  ASSERT_TRUE(wait_ready());
  rig.panel.break_down(true);
  clock.sleep_for(seconds(2));
  rig.panel.break_down(false);
  shut_down();
  EXPECT_EQ(of_fault("turntable: no progress"), "turntable");
  EXPECT_EQ(of_fault("camera: no frame"), "camera");
  EXPECT_EQ(of_fault("The e-stop was pressed"), "") << "a person's doing";
  EXPECT_EQ(of_fault("panel: unplugged"), "panel");
}

TEST_F(LoggedDaemon, TellsAnExposureOfTheMovementCheckThatWasTakenAgain) {
  rig.line.fires_before = 6;  // of three views
  rig.line.at_fire = [this] {
    const std::lock_guard guard(rig.line.mutex);
    rig.line.lose = 1;
  };
  boot();
  get_ready();
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_flip());
  shut_down();
  const auto id = job_folders().at(0).filename().string();
  EXPECT_THAT(of_view(0, 0), ElementsAre(HasSubstr("Stored"), HasSubstr("Exposed again: camera: no frame"),
                                         HasSubstr("Movement check: nothing has moved")));
  EXPECT_THAT(lines, Contains(AllOf(says("Exposed again"), has(Priority::warning), Field(&JournalEntry::job, id))));
}

TEST_F(LoggedDaemon, TellsAPressAtThePanelThatIsRefused) {
  boot();
  ASSERT_TRUE(wait_halted());
  rig.panel.press(&PanelInputs::start);
  get_ready();
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_busy());
  rig.panel.press(&PanelInputs::reset);
  shut_down();
  const auto id = job_folders().at(0).filename().string();
  EXPECT_THAT(lines, Contains(AllOf(says("Pressed at the panel, start is refused: The rig is Halted"),
                                    has(Priority::notice), Field(&JournalEntry::device, "panel"))));
  EXPECT_THAT(lines,
              Contains(AllOf(says("Pressed at the panel, reset is refused: Nothing to reset: the rig is working."),
                             Field(&JournalEntry::job, id))));
}

TEST_F(LoggedDaemon, TellsADeviceThatIsLostAndBackByItsName) {
  boot();
  get_ready();
  const auto set_absent = [&](int absent) {
    {
      const std::lock_guard guard(rig.line.mutex);
      rig.line.absent = absent;
    }
    clock.sleep_for(seconds(5));
  };
  set_absent(-1);
  set_absent(0);
  shut_down();
  const auto of_camera = Field(&JournalEntry::device, "camera");
  EXPECT_THAT(lines,
              Contains(AllOf(of_camera, says("Not responding: left camera 4711: no answer."), has(Priority::warning))));
  EXPECT_THAT(lines, Contains(AllOf(of_camera, says("It is back."))));
}

TEST_F(LoggedDaemon, TellsThatThreeFailuresStoppedTheQueueAndWhatAJobWasNotBegunFor) {
  Snapshot before, now;
  before.machine = MachineState::continuous_execution;
  now.machine = MachineState::ready;
  now.cause = "3 jobs in a row failed, so the queue stopped.";
  EXPECT_THAT(log_entries(before, now), ElementsAre(says("Operational.Ready: 3 jobs in a row failed")));
  before = now;
  now.cause = "Job 7 was not begun: the disk has no room.";
  EXPECT_THAT(log_entries(before, now), ElementsAre(says("Job 7 was not begun: the disk has no room.")));
}

TEST_F(LoggedDaemon, IsNotHeldUpByALogThatStalls) {
  std::promise<void> goes_on;
  const auto stalled = goes_on.get_future().share();
  std::atomic<int> written = 0;
  std::string last;
  {
    Journal journal(
        [&](const JournalEntry& entry) {
          stalled.wait();
          last = entry.message;
          ++written;
        },
        8);
    options.journal = [&journal](JournalEntry entry) { journal.write(std::move(entry)); };
    boot();
    get_ready();
    scan_both_poses();
    EXPECT_TRUE(wait_pass()) << "a whole job, and no line was read";
    shut_down();
    EXPECT_EQ(written, 0);
    goes_on.set_value();
  }
  EXPECT_THAT(last, testing::MatchesRegex("[0-9]+ lines of the log were dropped: it was stalled."));
  EXPECT_LE(written, 8 + 8 + 1);
}

TEST(LogOfADaemonThatEnds, IsLeftBehindWhenItStalls) {
  const auto goes_on = std::make_shared<std::promise<void>>();
  const auto gone = std::make_shared<std::promise<void>>();
  const auto begin = std::chrono::steady_clock::now();
  {
    Journal journal([stalled = goes_on->get_future().share(), gone](const JournalEntry&) {
      stalled.wait();
      gone->set_value();
    });
    journal.write({Priority::info, "one"});
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, Journal::kLastWords + seconds(5));
  goes_on->set_value();
  gone->get_future().wait();
}

TEST(LineOfTheLog, NamesWhatItIsAboutAndStaysOneLine) {
  std::vector<JournalEntry> written;
  {
    Journal journal([&](const JournalEntry& entry) { written.push_back(entry); });
    journal.write({Priority::warning, "two\nlines", "7", 0, 3, ""});
  }
  ASSERT_EQ(written.size(), 1u);
  EXPECT_EQ(text_line(written[0], std::chrono::system_clock::time_point(seconds(1795266000))),
            "2026-11-21T13:00:00Z warning job 7 pose 0 view 3: two lines");
  EXPECT_THAT(journal_fields(written[0]), ElementsAre("MESSAGE=two lines", "PRIORITY=4", "JOB=7", "POSE=0", "VIEW=3"));
  EXPECT_THAT(journal_fields({.priority = Priority::error, .message = "gone", .device = "camera"}),
              ElementsAre("MESSAGE=gone", "PRIORITY=3", "DEVICE=camera"));
}

}  // namespace
}  // namespace scanrig
