#include "daemon/jobs/retention.h"

#include <gmock/gmock.h>

#include <map>
#include <random>

#include "core/files.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

using std::chrono::days;
using std::chrono::hours;
using std::chrono::seconds;

constexpr auto kTenYears = days(3653);

/// A machine with a wall clock that may be wrong.
struct StepBuilder {
  seconds now = days(20'000);  ///< the true time
  seconds wrong_by{0};
  bool is_synchronized = true;
  seconds switched_on = now - hours(1);

  [[nodiscard]] TimeReading read() const {
    return {.wall = std::chrono::system_clock::time_point(now + wrong_by),
            .is_synchronized = is_synchronized,
            .running = now - switched_on};
  }
  void switch_off_for(seconds time) {
    now += time;
    switched_on = now - seconds(30);
  }
};

class Ledger : public scan_samples::FolderTest {
 protected:
  /// The steps of each sweep.
  seconds age_of(const std::string& id, const std::string& mark = "") {
    ledger.advance(machine.read());
    return ledger.age(ledger.note(id, mark));
  }
  void restart() {
    ASSERT_TRUE(ledger.write(file()));
    ledger = RetentionLedger::read(file());
  }
  [[nodiscard]] std::filesystem::path file() const { return folder_ / "retention.json"; }

  StepBuilder machine;
  RetentionLedger ledger;
};

TEST_F(Ledger, AnAgeCountsFromTheFirstTimeThatAJobIsSeenEnded) {
  EXPECT_EQ(age_of("a"), seconds(0));
  machine.now += days(3);
  EXPECT_EQ(age_of("a"), days(3));
  EXPECT_EQ(age_of("b"), seconds(0));
  machine.now += hours(1);
  EXPECT_EQ(age_of("a", "ended anew"), seconds(0));
  EXPECT_EQ(age_of("b"), hours(1));
}

TEST_F(Ledger, TimeSwitchedOffCountsBetweenSynchronizedReadings) {
  age_of("a");
  restart();
  machine.switch_off_for(days(20));
  EXPECT_EQ(age_of("a"), days(20));
}

TEST_F(Ledger, TimeSwitchedOffDoesNotCountWhereEitherClockIsNotSynchronized) {
  for (const bool before : {false, true}) {
    machine.is_synchronized = before;
    const auto was = age_of("a");
    restart();
    machine.switch_off_for(days(20));
    machine.is_synchronized = !before;
    EXPECT_LE(age_of("a") - was, hours(1));
  }
}

TEST_F(Ledger, AnImplausiblePauseDoesNotCount) {
  age_of("a");
  restart();
  machine.switch_off_for(RetentionLedger::kMaxPause + days(1));
  EXPECT_LE(age_of("a"), hours(1));
}

TEST_F(Ledger, TheMachinesRunningTimeCountsWithoutAnySynchronizedClock) {
  machine.is_synchronized = false;
  age_of("a");
  restart();
  machine.now += days(5);
  machine.wrong_by = -kTenYears;
  EXPECT_EQ(age_of("a"), days(5)) << "another daemon, the same machine";
  machine.wrong_by = kTenYears;
  machine.now += days(1);
  EXPECT_EQ(age_of("a"), days(6));
}

TEST_F(Ledger, TheOrderOfEndingSurvivesARestart) {
  ledger.advance(machine.read());
  const auto first = ledger.note("z", "").number;
  restart();
  machine.wrong_by = -kTenYears;
  ledger.advance(machine.read());
  EXPECT_GT(ledger.note("a", "").number, first);
  EXPECT_EQ(ledger.note("z", "").number, first);
  ledger.keep_only({"a"});
  EXPECT_GT(ledger.note("z", "").number, ledger.note("a", "").number);
}

TEST_F(Ledger, ADamagedFileMakesEveryJobCountFromNow) {
  age_of("a");
  machine.now += days(9);
  age_of("a");
  restart();
  const auto whole = *read_file(file());
  for (const auto& [what, with] :
       {std::pair("\"count_s\": ", "\"count_s\": -"), std::pair("\"count_s\": ", "\"count_s\": 1e3"),
        std::pair("\"running_s\": ", "\"running_s\": 99999999999999999999"), std::pair("{", "["),
        std::pair("\"version\": 1", "\"version\": 2"), std::pair("\"since_s\": 0", "\"since_s\": 99999999"),
        std::pair("\"synchronized\": true", "\"synchronized\": 1")}) {
    auto text = whole;
    ASSERT_NE(text.find(what), std::string::npos) << what;
    scan_samples::write_text(file(), text.replace(text.find(what), std::string_view(what).size(), with));
    ledger = RetentionLedger::read(file());
    EXPECT_EQ(age_of("a"), seconds(0)) << with;
  }
  scan_samples::write_text(file(), whole);
  ledger = RetentionLedger::read(file());
  EXPECT_EQ(age_of("a"), days(9));
}

/// Whatever the clock does, synchronized or not, no age is ever larger than the true one.
TEST_F(Ledger, NoSequenceOfWrongClocksMakesAJobOlderThanItIs) {
  std::mt19937 random(1);
  const auto pick = [&](int count) { return static_cast<int>(random() % static_cast<unsigned>(count)); };
  std::map<std::string, seconds> first_seen;
  for (int step = 0; step < 600; ++step) {
    switch (pick(6)) {
      case 0: machine.now += hours(pick(200)); break;
      case 1: machine.wrong_by = kTenYears * (pick(3) - 1); break;
      case 2: machine.is_synchronized = pick(2) == 1; break;
      case 3: restart(); break;
      case 4:
        restart();
        machine.switch_off_for(hours(pick(24 * 60)));
        break;
      default: first_seen.try_emplace(std::to_string(step), machine.now); break;
    }
    for (const auto& [id, since] : first_seen) ASSERT_LE(age_of(id), machine.now - since) << step;
  }
  EXPECT_GT(age_of(first_seen.begin()->first), days(30)) << "it does count";
}

}  // namespace
}  // namespace scanrig
