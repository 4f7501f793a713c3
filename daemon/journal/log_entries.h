#pragma once

#include <vector>

#include "daemon/journal/entry.h"
#include "daemon/station/snapshot.h"

namespace scanrig {

/// What the log says of the change from one published snapshot to the next: states of machine and jobs with their
/// causes, faults with what to do, views acknowledged and exposures redone, devices lost and back, stages of the
/// reconstruction. The one place where the log's lines about the station's states are made.
std::vector<JournalEntry> log_entries(const Snapshot& before, const Snapshot& now);

/// A button that changed nothing. What the API refuses is told by the API, which knows who asked.
JournalEntry refused_at_panel(const event::Pressed& pressed, const Error& why, const Snapshot& now);

}  // namespace scanrig
