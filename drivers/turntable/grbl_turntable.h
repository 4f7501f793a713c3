#pragma once

#include <memory>

#include "drivers/turntable/axis_turntable.h"
#include "drivers/turntable/grbl_drive.h"

namespace scanrig {

/// `scale.gear_ratio`: the controller's units per table degree; 1 where its steps ($100) are set for table degrees.
struct GrblTurntableOptions : AxisTurntableOptions {
  GrblDriveOptions drive;
};

/// A turntable moved by a GRBL 1.1 controller. There is no feedback: positions are counted steps. It does not detect a
/// blocked table or lost steps; home() finds the zero again.
class GrblTurntable final : public AxisTurntable {
 public:
  /// Checks the options; the port is opened by the first use. Fails with `out_of_range`.
  static Result<std::unique_ptr<GrblTurntable>> create(GrblTurntableOptions options, Clock& clock);

  [[nodiscard]] const grbl::LinkStatistics& statistics() const { return link_; }

 private:
  GrblTurntable(const GrblTurntableOptions& options, std::unique_ptr<GrblDrive> drive, const grbl::LinkStatistics& link,
                Clock& clock);

  const grbl::LinkStatistics& link_;
};

}  // namespace scanrig
