#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/setup/setup_options.h"
#include "core/result.h"
#include "daemon/ctl/farm.h"
#include "pipeline/calibrate/calibrate_images.h"
#include "pipeline/reconstruct/reconstruct.h"

/// The verbs of the scanrig command. Each prints its result on stdout, or one sentence "scanrig: ..." on stderr.
namespace scanrig::ctl {

/// Prints an error and returns its exit code.
ExitCode report_error(const Error& error);
ExitCode report_error(ExitCode code, const std::string& message);

/// An error of a device itself. A port, a line or a socket that cannot be used is a device that does not respond, not
/// a disk or file.
Error of_device(Error error);

// Clients of the daemon.

struct Connection {
  std::filesystem::path socket = "/run/scanrig/api.sock";
  bool json = false;  ///< print the API's reply as it is
};

struct StatusVerb {
  bool follow = false;
  bool watch = false;
};
ExitCode status(const Connection& connection, const StatusVerb& verb);
/// Shows one screen, redrawn on changes, until SIGINT; without a terminal, the lines that change. With JSON
/// one line per change.
ExitCode watch(const Connection& connection);
ExitCode health(const Connection& connection);

struct StopVerb {
  bool wait = true;
};
/// Stops, then reports the table's standstill: `ok` (standstill confirmed) or `standstill_unknown`.
ExitCode stop(const Connection& connection, const StopVerb& verb);

struct OpenVerb {
  std::string role = "operator";
  bool kiosk = false;
  std::string browser = "chromium";
};
/// Prints the page's address with a code that logs in once; for a kiosk becomes a browser with it.
ExitCode open_page(const Connection& connection, const OpenVerb& verb);

struct StartVerb {
  bool follow = false;
};
ExitCode start(const Connection& connection, const StartVerb& verb);
/// `button`: "stop" or "reset".
ExitCode press(const Connection& connection, const std::string& button);

struct JobsVerb {
  std::string id;  ///< empty: all jobs
  std::string state;
  int limit = 50;
  int choice = 0;         ///< of the job's choices this one is right; 0: nothing is chosen
  bool add_pose = false;  ///< the job is given another pose
};
ExitCode jobs(const Connection& connection, const JobsVerb& verb);
ExitCode job_files(const Connection& connection, const std::string& id);

struct ExportVerb {
  std::string id;
  std::string file = "model/model.glb";
  std::filesystem::path out;
};
ExitCode export_file(const Connection& connection, const ExportVerb& verb);

struct QueueVerb {
  std::string recipe = "default";
  std::string part;
  int repeat = 1;
};
ExitCode queue(const Connection& connection, const QueueVerb& verb);

struct JobVerb {
  std::string what;  ///< "cancel", "resume", "first", "reprocess", "delete"
  std::string id;
  std::optional<double> voxel_mm{};  ///< reprocess
  std::string fusion{};              ///< reprocess
  bool yes = false;                  ///< delete: without confirmation
};
ExitCode change_job(const Connection& connection, const JobVerb& verb);

struct BundleVerb {
  std::string id;
  std::filesystem::path out;  ///< empty: ID.tar.gz, here
};
ExitCode bundle(const Connection& connection, const BundleVerb& verb);

struct CalibrateVerb {
  bool rig = false;     ///< queue a calibration and follow it
  bool check = false;   ///< likewise a check of the calibration
  bool accept = false;  ///< the one that was solved last becomes the rig's
  bool abort = false;
};
/// With `rig` or `check`: queues it, or takes up what is queued or active, and follows it to its end.
ExitCode calibrate(const Connection& connection, const CalibrateVerb& verb);

struct MaintenanceVerb {
  std::string what = "on";  ///< on, off, home, jog, pulse, lamp_test, io
  std::optional<double> to_deg, by_deg;
  double speed_deg_s = 10.0;
};
ExitCode maintenance(const Connection& connection, const MaintenanceVerb& verb);

// Offline.

struct ReconstructVerb {
  std::filesystem::path scan;
  std::filesystem::path out;  ///< empty: `model` in the scan folder
  ReconstructOptions options;
  bool json = false;
  bool lines = false;  ///< for programs: "STAGE<tab>FRACTION", and "failed<tab>CODE<tab>MESSAGE" at the end
};
ExitCode reconstruct(const ReconstructVerb& verb);

struct FarmVerb {
  FarmOptions options;
  bool json = false;  ///< an object per line
};
/// Prints a line per scan as it ends, then the counts. Ends with the code of the first failure.
ExitCode farm_reprocess(const FarmVerb& verb);

/// A calibration board as it is named at the command line.
struct BoardOptions {
  std::string squares = "12x9";
  double square_mm = 10.0;
  double marker_mm = 6.0;
  std::string dictionary = "4x4_100";
  double thickness_mm = 3.0;
  bool chessboard = false;  ///< no markers
};

struct CalibrateFolderVerb {
  std::filesystem::path images;
  std::filesystem::path out = "calibration.json";
  std::filesystem::path check;  ///< the calibration that the images are compared with; empty: a new one is solved
  BoardOptions board;
  bool has_board = false;  ///< else that of the folder's list
  bool paper = false;
  std::vector<double> length_mm, second_length_mm;  ///< measured, and its standard uncertainty
  std::string rim_dots;                             ///< COUNTxRADIUSxDIAMETER
  std::filesystem::path report;                     ///< empty: beside `out`, as .html
  bool with_report = true;
  CalibrateOptions options;
  bool json = false;
};
ExitCode calibrate_folder(const CalibrateFolderVerb& verb);

struct BoardVerb {
  std::filesystem::path out;
  BoardOptions board;
  std::vector<double> page_mm;
};
ExitCode board(const BoardVerb& verb);

struct ConvertVerb {
  std::string what;            ///< "mrcal", "opencv", "colmap"
  std::filesystem::path from;  ///< a calibration.json, or a folder with one; colmap: a scan folder
  std::filesystem::path out;
  bool images = false;  ///< colmap: copies of the images, demosaiced, too
  bool json = false;
};
ExitCode convert(const ConvertVerb& verb);

struct RangeVerb {
  std::filesystem::path left, right;  ///< PNG or TIFF, 8 to 16 bits, grey or colour
  std::filesystem::path calibration;  ///< a calibration.json, or a folder with one; empty: `rectified`
  std::filesystem::path out;          ///< the folder to make
  bool rectified = false;             ///< rows correspond already
  double focal_px = 0.0;              ///< of a rectified pair
  double baseline_mm = 0.0;           ///< of a rectified pair
  std::vector<double> centre;         ///< of a rectified pair: principal point of both images, px; empty: the middle
  std::vector<int> disparities;       ///< lowest and highest, px; empty: of the working volume, or 0 to width / 4
  bool json = false;
};
/// Measures one stereo pair: disparity.tiff (px), depth.tiff and sigma.tiff (mm), colours.png.
ExitCode range(const RangeVerb& verb);

struct EvaluateVerb {
  std::filesystem::path scan;
  std::filesystem::path model;  ///< empty: `model` in the scan folder
  bool json = false;
};
ExitCode evaluate(const EvaluateVerb& verb);

struct AcceptanceVerb {
  std::string what;                           ///< "sphere", "ball-bar", "plane", "step-gauge"
  std::vector<std::filesystem::path> models;  ///< meshes, folders of models or scans, jobs
  double diameter_mm = 0.0, length_mm = 0.0;
  std::vector<double> heights_mm;
  double uncertainty_mm = 0.0;      ///< k = 2, of these
  std::vector<std::string> limits;  ///< "NAME=MM"
  std::filesystem::path report;     ///< empty: none
  std::filesystem::path jobs;       ///< of jobs by their id; empty: the folder that `config` names
  std::filesystem::path config = "/etc/scanrig/rig.toml";
  bool json = false;
};
/// What the scanner makes of a calibrated artefact. `below_limits` when a limit is missed.
ExitCode measure_artefact(const AcceptanceVerb& verb);

struct ImportVerb {
  std::vector<std::filesystem::path> conf;  ///< one per pose
  std::filesystem::path out;
  bool json = false;
};
ExitCode import_stanford(const ImportVerb& verb);

struct ImportMeshesVerb {
  std::vector<std::filesystem::path> scans;
  std::filesystem::path out;
  std::string unit;  ///< "mm", "cm", "m", "in"; empty: m for range grids, mm for meshes
  int threads = 0;   ///< 0: all of the machine's
  bool json = false;
};
/// Prints the scan folder, then a sentence per scan that was left out.
ExitCode import_meshes(const ImportMeshesVerb& verb);

struct CheckConfigVerb {
  std::filesystem::path file = "/etc/scanrig/rig.toml";
  std::filesystem::path drives;  ///< empty: the daemon's own places
  bool json = false;
};
ExitCode check_config(const CheckConfigVerb& verb);

struct TokenVerb {
  std::string what;  ///< "add", "list", "revoke"
  std::string name;
  std::string role = "viewer";
  std::filesystem::path file;  ///< empty: the one that `config` names
  std::filesystem::path config = "/etc/scanrig/rig.toml";
  bool json = false;
};
ExitCode token(const TokenVerb& verb);

struct ReferenceVerb {
  std::string what;  ///< "add", "list", "remove"
  std::string name;  ///< empty: add: as the file
  std::filesystem::path file;
  std::filesystem::path jobs;  ///< empty: the folder that `config` names
  std::filesystem::path config = "/etc/scanrig/rig.toml";
  bool json = false;
};
/// The meshes that models can be compared with.
ExitCode reference(const ReferenceVerb& verb);

// Verbs at the rig, on the devices themselves, while no daemon runs.

struct TurntableVerb {
  std::string what;  ///< "home", "move", "status", "read"
  double angle_deg = 0.0;
  std::filesystem::path config = "/etc/scanrig/rig.toml";
  bool yes = false;
  bool json = false;
};
/// `move` homes first: no angle is valid before homing.
ExitCode turntable(const TurntableVerb& verb);

struct PanelVerb {
  std::filesystem::path config = "/etc/scanrig/rig.toml";
  int seconds = 0;  ///< 0: until interrupted
  bool json = false;
};
ExitCode watch_panel(const PanelVerb& verb);

struct ProjectorVerb {
  std::string what;  ///< "info", "load"
  std::filesystem::path config = "/etc/scanrig/rig.toml";
  std::filesystem::path file;  ///< load: the firmware
  bool yes = false;
  bool json = false;
};
/// Of a LightCrafter 4500 only.
ExitCode projector(const ProjectorVerb& verb);

struct CameraVerb {
  std::string what;  ///< "list", "tune", "grab", "preview"
  std::filesystem::path config = "/etc/scanrig/rig.toml";
  std::filesystem::path out = ".";  ///< grab, preview: folder of the images
  std::string light = "none";       ///< projector mode: none, pattern, plain
  std::optional<int> exposure_us;   ///< instead of the configuration's
  std::optional<double> gain;
  int count = 0;  ///< tune, preview: how many pairs; 0: until interrupted
  bool json = false;
};
/// `preview` uses a running daemon; the others need the cameras for themselves.
ExitCode camera(const CameraVerb& verb);

struct CharacteriseVerb {
  std::filesystem::path from;  ///< folder of flat images; empty: they are taken at the rig
  std::filesystem::path config = "/etc/scanrig/rig.toml";
  std::filesystem::path out;               ///< empty: beside the calibration that `config` names, else here
  std::filesystem::path images = "flats";  ///< at the rig: new folder for what is taken
  std::string light = "none";              ///< projector mode: none, plain
  std::optional<double> gain;              ///< instead of the configuration's
  double gamma = 1.0;
  bool answers = false;  ///< replies come on standard input although it is no terminal
  bool json = false;
};
/// Noise, gain and defects of both cameras from flat images.
ExitCode characterise_cameras(const CharacteriseVerb& verb);

struct SetupVerb {
  config::setup::SetupOptions options;
  bool answers = false;  ///< replies come on standard input
  bool page = false;     ///< run by the service, for a person at the page: options.out is a draft
};
/// Finds what is connected, prompts for the rest, writes a rig.toml and lets the doctor examine the rig.
ExitCode set_up(const SetupVerb& verb);

struct DoctorVerb {
  std::filesystem::path config = "/etc/scanrig/rig.toml";
  bool yes_move = false;  ///< the table may be turned
  bool answers = false;   ///< a person at the rig replies on standard input although it is no terminal
  bool json = false;
  bool page = false;                   ///< run by the service, for a person at the page: the table does not turn
  std::filesystem::path machine_root;  ///< tests only: /proc and /sys are read below it
};
/// `device` when there is a finding.
ExitCode examine_rig(const DoctorVerb& verb);

}  // namespace scanrig::ctl
