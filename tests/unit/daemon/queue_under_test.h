#pragma once

#include <string>
#include <vector>

#include "tests/unit/daemon/station_under_test.h"

namespace scanrig {

/// The rules for the next active job.
class Queue : public Station {
 protected:
  void order(const std::string& recipe, int repeat = 1, const std::string& part = {}) {
    event::JobsOrdered ordered{{recipe, part, repeat}, {}, 7};
    for (int i = 0; i < repeat; ++i) ordered.new_ids.push_back(fmt::format("new{}", i));
    tell(ordered);
  }
  void ask(event::JobRequested::What what, const std::string& job) {
    tell(event::JobRequested{.what = what, .job = job, .request_id = 7});
  }
  void see(bool part_present, bool flipped = false) {
    PanelInputs inputs;
    inputs.part_present = part_present;
    inputs.flipped = flipped;
    tell(event::InputsRead{inputs});
  }
  std::vector<std::string> waiting() const {
    std::vector<std::string> ids;
    for (const auto& job : state.queue) ids.push_back(job->id);
    return ids;
  }
  static Recipe by_parts() { return {.name = "line", .poses = 1, .views = 1, .start_on_part = true}; }
  /// All events of a one-view job of by_parts().
  void scan(const std::string& job) {
    tell(event::JobStarted{job, 0, 0});
    tell(event::WarningOver{});
    tell(event::ViewTaken{std::make_shared<TakenView>(TakenView{.id = {job, 0, 0}})});
    tell(event::ViewStored{{job, 0, 0}, 0.0});
    tell(event::CheckViewTaken{});
    tell(event::MovementChecked{job, {.unmoved = true}});
    tell(event::PoseStored{job, 0});
  }
  void run_a_line_of(int jobs) {
    get_ready();
    for (int i = 0; i < jobs; ++i) know(queued(fmt::format("{}", i), i, by_parts()));
    press(Button::start);
  }
};

}  // namespace scanrig
