#pragma once

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/result.h"
#include "drivers/camera/aravis_stereo_camera.h"
#include "drivers/camera/v4l2_stereo_camera.h"
#include "drivers/gpio/lines.h"
#include "drivers/projector/lightcrafter_projector.h"
#include "drivers/turntable/grbl_turntable.h"
#include "drivers/turntable/modbus_turntable.h"
#include "pipeline/calibration/board/board.h"
#include "pipeline/calibration/observations.h"

namespace scanrig::config {

/// A digital input or output: a GPIO line by its name or by chip and offset, or a channel of a Modbus I/O module.
struct Pin {
  std::string line;  ///< empty: by chip and offset, or a channel
  std::string chip;  ///< empty: by name, or a channel
  int offset = 0;    ///< on `chip`
  int channel = 0;
  bool active_low = false;
  gpio::Bias bias = gpio::Bias::as_is;  ///< inputs only

  [[nodiscard]] bool is_same_contact(const Pin& other) const {
    return line == other.line && chip == other.chip && offset == other.offset && channel == other.channel;
  }
};

struct SafetyConfig {
  enum class HomeAfterRestart { on_reset, guarded };
  Pin estop;
  std::optional<Pin> guard;
  HomeAfterRestart home_after_restart = HomeAfterRestart::on_reset;
  bool remote_start = false;  ///< only with a guard
};

/// Content of a file when it was read.
struct SourceFile {
  std::string name;  ///< without its folder
  std::string text;
};

struct TurntableConfig {
  enum class Driver { modbus, grbl };
  Driver driver = Driver::modbus;
  ModbusTurntableOptions modbus;           ///< with the drive profile it names
  std::optional<SourceFile> profile_file;  ///< of modbus
  GrblTurntableOptions grbl;

  [[nodiscard]] const AxisTurntableOptions& motion() const {
    if (driver == Driver::grbl) return grbl;
    return modbus;
  }
  [[nodiscard]] const std::string& device() const {
    return driver == Driver::grbl ? grbl.drive.link.device : modbus.line.device;
  }
};

struct ProjectorConfig {
  enum class Driver { gpio, modbus_io, lightcrafter4500, camera_strobe, manual };
  Driver driver = Driver::gpio;
  /// gpio, modbus_io: fires the pattern and both cameras. camera_strobe: name of the left camera's output that fires
  /// the pattern and the right camera.
  Pin line;
  std::optional<Pin> plain_line;           ///< as `line`, with plain light and without the pattern
  modbus::ClientOptions io_module;         ///< modbus_io: the panel's
  std::chrono::microseconds pulse{15000};  ///< gpio, modbus_io: at least the exposure
  std::string serial;                      ///< lightcrafter4500: empty: the only one connected
  LightCrafterOptions lightcrafter;
  std::chrono::seconds warm_up{600};  ///< a job starts automatically only after the projector was connected this long
};

inline constexpr std::size_t kMaxPatternExposures = 2;

struct StereoCameraConfig {
  enum class Driver { aravis, v4l2, v4l2_side_by_side, simulated };
  Driver driver = Driver::aravis;
  AravisOptions aravis;
  V4l2Options v4l2;             ///< with `right` for v4l2, without for v4l2-side-by-side
  std::filesystem::path truth;  ///< simulated: the control socket that returns the position of the table
  std::chrono::microseconds exposure{12000};
  /// Other exposures of the pattern, for views with dark or bright parts; at most kMaxPatternExposures.
  std::vector<std::chrono::microseconds> pattern_exposures{};

  /// The same as multiples of `exposure`.
  [[nodiscard]] std::vector<double> pattern_factors() const {
    std::vector<double> factors;
    for (const auto other : pattern_exposures)
      factors.push_back(static_cast<double>(other.count()) / static_cast<double>(exposure.count()));
    return factors;
  }
  [[nodiscard]] std::chrono::microseconds longest_exposure() const {
    auto longest = exposure;
    for (const auto other : pattern_exposures) longest = std::max(longest, other);
    return longest;
  }

  /// Serial numbers of the left and the right camera; empty for simulated ones: their owner has them.
  [[nodiscard]] std::pair<std::string, std::string> serials() const {
    if (driver == Driver::aravis) return {aravis.left.serial, aravis.right.serial};
    if (driver == Driver::simulated) return {};
    return {v4l2.left.serial, v4l2.right.value_or(v4l2.left).serial};
  }
};

struct PanelConfig {
  enum class Driver { gpio, modbus_io };
  Driver driver = Driver::gpio;
  modbus::ClientOptions io_module;     ///< modbus_io
  std::chrono::milliseconds poll{20};  ///< modbus_io
  std::map<std::string, Pin> inputs;   ///< by the names of PanelInputs; always includes `start`
  std::map<std::string, Pin> outputs;  ///< by their keys, such as lamp_green
};

struct RecipeConfig {
  enum class Flip { button, signal };
  enum class Start { button, part_present };
  int views = 8;
  int poses = 2;
  std::chrono::minutes flip_timeout{30};
  Flip flip = Flip::button;     ///< `signal` needs the panel's `flipped` input
  Start start = Start::button;  ///< `part_present` needs the panel's input of that name
  bool fixture = false;         ///< parts stand on putty, pins or a magnet
  std::optional<double> min_measured_share;
  std::optional<double> max_residual_mm;
};

/// Minutes of the day; if `from` is later than `to`, over midnight.
struct QuietHoursConfig {
  std::chrono::minutes from{}, to{};
};

/// Receiver of reports about failed jobs: `http://HOST[:PORT]/PATH`.
struct WebhookConfig {
  std::string host, port, path;
};

/// The calibration board, and how the rig is calibrated.
struct CalibrationConfig {
  Board board{};
  BoardKind board_kind = BoardKind::glass;
  double table_radius_mm = 90.0;
  std::optional<RimDots> rim_dots;    ///< printed on the table
  std::optional<double> length_mm;    ///< measured between the first and the last corner of the board's first row
  double length_sigma_mm = 0.0;       ///< its standard deviation
  std::chrono::hours check_every{0};  ///< an older calibration is reported; 0: never
  bool accepts_by_itself = false;     ///< one that grades is used without a person
};

struct StorageConfig {
  std::filesystem::path root;
  double reserve_gib = 20;
  std::optional<std::chrono::days> keep_days;  ///< then ended jobs are deleted
  std::optional<double> keep_gib;              ///< of all jobs
};

/// A cluster that makes the models.
struct SlurmConfig {
  enum class Fallback { local, wait };
  std::string partition;                               ///< empty: the cluster's default
  std::vector<std::string> options;                    ///< further words for sbatch
  std::filesystem::path program = "/usr/bin/scanrig";  ///< on the nodes
  std::filesystem::path stage;                         ///< empty: the nodes see the jobs' folder itself
  std::filesystem::path commands;                      ///< folder of sbatch; empty: found in PATH
  int cores = 2;
  int resubmits = 2;                   ///< after lost nodes
  Fallback fallback = Fallback::wait;  ///< while the controller is not reached
  std::chrono::minutes wait{60};       ///< for the controller
};

struct ReconstructionConfig {
  enum class Executor { in_process, process, slurm };
  Executor executor = Executor::in_process;
  double memory_gib = 6;
  double voxel_mm = 0.25;
  std::chrono::minutes timeout{60};  ///< of the executors `process` and `slurm`
  SlurmConfig slurm;
};

struct ApiConfig {
  std::filesystem::path socket;
  std::optional<int> http_port;  ///< TCP; every request over it needs a token
  std::string http_address = "127.0.0.1";
  std::filesystem::path tokens;  ///< the file of tokens; empty: no tokens
  std::string http_origin;       ///< "https://rig.example": how browsers reach the proxy in front; empty: directly
  bool insecure_http = false;    ///< other machines may connect without TLS
  std::string proxy;             ///< address of the reverse proxy in front, or "unix:USER"; empty: no proxy
  /// Groups of local users by what they may do over the socket. Without groups, the daemon's own group may operate.
  std::optional<std::string> viewer_group, operator_group, engineer_group;
};

/// Checked content of rig.toml; relative paths start at the file's folder.
struct RigConfig {
  std::string text;                   ///< of the file
  std::vector<std::string> warnings;  ///< "FILE:LINE: [table] key: ...", about keys under their old names
  SafetyConfig safety;
  TurntableConfig turntable;
  ProjectorConfig projector;
  StereoCameraConfig stereo_camera;
  PanelConfig panel;
  std::filesystem::path calibration_file;
  CalibrationConfig calibration;
  std::map<std::string, RecipeConfig> recipes;  ///< always includes `default`
  StorageConfig storage;
  ReconstructionConfig reconstruction;
  std::optional<QuietHoursConfig> quiet_hours;
  std::optional<WebhookConfig> webhook;
  ApiConfig api;
  std::optional<std::filesystem::path> gpio_socket;  ///< tests only: GPIO lines behind a socket instead of chips
};

/// Simulated cameras are for scanrigd-sim: all other programs reject them as an unknown driver.
enum class Cameras { real, or_simulated };

/// Drive profiles are looked for in `drives`; by default in `drives` beside the file, in `../drives`, and in
/// /usr/share/scanrig/drives.
/// Fails with `not_found`, `io`, or `invalid_input`: at most 20 problems, each on a line of its own, in order of line.
Result<RigConfig> read_rig_config(const std::filesystem::path& file, const std::filesystem::path& drives = {},
                                  Cameras cameras = Cameras::real);

/// The drive profiles that a rig.toml at `file` can name, by their names: those of the first of the folders above that
/// is there. Fails as read_drive_profile(), and with `not_found`.
Result<std::map<std::string, DriveProfile>> read_drive_profiles(const std::filesystem::path& file);

/// Devices that make-safe switches off when no program controls the rig.
enum class SafetyDevice { turntable, projector, panel };

/// Reads only what `device` needs, whatever is wrong with the rest; everything else keeps its default.
/// Relative paths start at `base`. Fails as read_rig_config().
Result<RigConfig> read_device_config(SafetyDevice device, const std::filesystem::path& file,
                                     const std::filesystem::path& base);

}  // namespace scanrig::config
