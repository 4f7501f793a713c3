#pragma once

#include "daemon/station/events.h"
#include "pipeline/storage/scan_folder.h"

namespace scanrig {

/// One view as the rig delivered it, in memory only.
struct TakenView {
  ViewId id;
  ViewRecord record{};  ///< `files` still empty
  RawView images{};
};

}  // namespace scanrig
