// The log's entries for orders that the API refuses.
#include "tests/component/api/api_bench.h"

namespace scanrig {
namespace {

using api_bench::ApiBench;
using testing::AllOf;
using testing::Each;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class RefusedOrders : public ApiBench {
 protected:
  void SetUp() override {
    ApiBench::SetUp();
    options.journal = [this](JournalEntry entry) {
      const std::lock_guard guard(mutex);
      lines.push_back(std::move(entry));
    };
    serve();
  }
  std::vector<JournalEntry> told() {
    const std::lock_guard guard(mutex);
    return std::exchange(lines, {});
  }
  static auto says(const std::string& words) { return Field(&JournalEntry::message, words); }
  const std::string me = "user " + std::to_string(::getuid());

 private:
  std::mutex mutex;
  std::vector<JournalEntry> lines;
};

TEST_F(RefusedOrders, AreToldWithWhoAskedWhatAndWhy) {
  EXPECT_EQ(ask(local(), request("POST", "/api/v1/start")).status, 409);
  const auto log = told();
  ASSERT_EQ(log.size(), 1u);
  EXPECT_EQ(log[0].priority, Priority::notice);
  EXPECT_THAT(log[0].message, testing::StartsWith("POST /api/v1/start, requested by " + me +
                                                  " (engineer), is refused: The rig is Preoperational"));
  EXPECT_EQ(log[0].job, "");
}

TEST_F(RefusedOrders, NameTheJobTheyAreAbout) {
  EXPECT_EQ(ask(local(), request("POST", "/api/v1/jobs/old/resume")).status, 409);
  EXPECT_EQ(ask(local(), request("DELETE", "/api/v1/jobs/new")).status, 404);
  EXPECT_THAT(told(), ElementsAre(AllOf(says("POST /api/v1/jobs/old/resume, requested by " + me +
                                             " (engineer), is refused: there is no rig"),
                                        Field(&JournalEntry::job, "old")),
                                  AllOf(says("DELETE /api/v1/jobs/new, requested by " + me +
                                             " (engineer), is refused: there is no job of that name"),
                                        Field(&JournalEntry::job, ""))));
}

TEST_F(RefusedOrders, ForWantOfARoleAreToldToo) {
  EXPECT_EQ(ask(tcp(), request("POST", "/api/v1/maintenance/on", tokens[Role::viewer])).status, 403);
  EXPECT_THAT(told(), ElementsAre(says("POST /api/v1/maintenance/on, requested by 127.0.0.1 (viewer), is refused: "
                                       "this needs the role engineer; yours is viewer")));
}

TEST_F(RefusedOrders, DoNotBringTokensBodiesOrQueriesIntoTheLog) {
  for (const auto& [role, token] : tokens) {
    ask(tcp(), request("POST", "/api/v1/maintenance/on?token=" + token, token));
    ask(tcp(), request("POST", "/api/v1/jobs", token, R"({"token": ")" + token + "\"}"));
  }
  const auto log = told();
  EXPECT_FALSE(log.empty());
  for (const auto& [role, token] : tokens) {
    EXPECT_THAT(log, Each(Field(&JournalEntry::message, Not(HasSubstr(token)))));
  }
}

TEST_F(RefusedOrders, AreNotWhatIsObeyedOrOnlyLooks) {
  EXPECT_EQ(ask(local(), request("GET", "/api/v1/jobs/new")).status, 404);
  EXPECT_EQ(ask(local(), request("POST", "/api/v1/maintenance/lamp_test", "guess")).status, 401);
  EXPECT_EQ(ask(local(), request("POST", "/api/v1/config/check")).status, 409);
  EXPECT_THAT(told(), testing::SizeIs(1)) << "the last one";
}

/// A rig where only a person at the panel lets an engineer jog.
class WithoutAGuard : public ApiBench {
 protected:
  void SetUp() override {
    ApiBench::SetUp();
    has_guard = false;
    serve();
  }
};

TEST_F(WithoutAGuard, AJogIsRefusedToAnotherRequesterThanTheOneThatSwitchedMaintenanceOn) {
  auto& loop = station->loop;
  loop.post(event::PanelFound{true, true});
  loop.post(event::Stopped{});
  EXPECT_EQ(ask(local(), request("POST", "/api/v1/maintenance/on")).status, 200);
  loop.post(event::Pressed{Button::reset, Origin::panel, {}});
  loop.post(event::WarningOver{});
  loop.post(event::Homed{});
  const std::string jog = R"({"by_deg": 5})";
  const auto refused = ask(tcp(), request("POST", "/api/v1/maintenance/jog", tokens[Role::engineer], jog));
  EXPECT_EQ(refused.status, 409);
  EXPECT_THAT(refused.body, HasSubstr("who switched maintenance on"));
  EXPECT_EQ(ask(local(), request("POST", "/api/v1/maintenance/jog", "", jog)).status, 200);
}

}  // namespace
}  // namespace scanrig
