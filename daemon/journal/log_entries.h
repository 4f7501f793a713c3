#pragma once

#include <vector>

#include "daemon/journal/journal.h"
#include "daemon/station/snapshot.h"

namespace scanrig {

/// Log entries for the change from one published snapshot to the next: states of machine and jobs with their
/// causes, faults with the next action, stored views and retakes, devices lost and back, stages of the
/// reconstruction. The log's lines about the station's states are made only here.
std::vector<JournalEntry> log_entries(const Snapshot& before, const Snapshot& now);

/// Entry for a button that changed nothing. The API reports its refusals itself, because it has the requester's name.
JournalEntry refused_at_panel(const event::Pressed& pressed, const Error& why, const Snapshot& now);

}  // namespace scanrig
