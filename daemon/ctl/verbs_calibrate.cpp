#include <fmt/ranges.h>
#include <unistd.h>
#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/catch_exceptions.h"
#include "core/files.h"
#include "core/hash.h"
#include "core/signal_stop.h"
#include "core/timestamp.h"
#include "daemon/ctl/output.h"
#include "daemon/ctl/verbs.h"
#include "pipeline/calibrate/calibration_json.h"
#include "pipeline/calibrate/report/calibration_html.h"
#include "pipeline/calibration/board/print_board.h"
#include "pipeline/storage/calibration_file.h"

namespace scanrig::ctl {
namespace {

constexpr double kMaxNumber = 1e6;

/// The numbers of "12x9" or "40x84.5x2.4"; empty if there are not `count` of them, each of a size that can be.
std::vector<double> numbers_of(const std::string& text, std::size_t count) {
  std::vector<double> numbers;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('x', begin), text.size());
    double value = 0.0;
    const auto read = std::from_chars(text.data() + begin, text.data() + end, value);
    if (read.ec != std::errc() || read.ptr != text.data() + end || !(std::abs(value) < kMaxNumber)) return {};
    numbers.push_back(value);
    begin = end + 1;
  }
  return numbers.size() == count ? numbers : std::vector<double>{};
}

Result<Board> board_of(const BoardOptions& options) {
  const auto squares = numbers_of(options.squares, 2);
  if (squares.empty()) {
    return fail(ErrorCode::invalid_input, "--board {}: must be COLUMNSxROWS in squares, as 12x9", options.squares);
  }
  Board board;
  board.columns = static_cast<int>(squares[0]);
  board.rows = static_cast<int>(squares[1]);
  board.square_mm = options.square_mm;
  board.thickness_mm = options.thickness_mm;
  board.markers = BoardMarkers{options.marker_mm, options.dictionary};
  if (options.chessboard) board.markers.reset();
  if (auto possible = check_board(board); !possible) return pass_on(possible);
  return board;
}

std::optional<MeasuredLength> row_length(const std::vector<double>& measured, const Board& board) {
  if (measured.size() != 2) return std::nullopt;
  return first_row_length(board, measured[0], measured[1]);
}

Result<CalibrateOptions> options_of(const CalibrateFolderVerb& verb, const CalibrationImages& images) {
  CalibrateOptions options = verb.options;
  const auto named = board_of(verb.board);
  if (!named) return pass_on(named);
  if (verb.has_board) options.board = *named;
  const Board board = verb.has_board ? *named : images.board.value_or(*named);
  if (verb.paper) options.board_kind = BoardKind::paper;
  options.length = row_length(verb.length_mm, board);
  options.second_length = row_length(verb.second_length_mm, board);
  if (!verb.rim_dots.empty()) {
    const auto dots = numbers_of(verb.rim_dots, 3);
    if (dots.empty()) {
      return fail(ErrorCode::invalid_input, "--rim-dots {}: must be COUNTxRADIUSxDIAMETER in mm, as 40x84.5x2.4",
                  verb.rim_dots);
    }
    options.rim_dots = RimDots{static_cast<int>(dots[0]), dots[1], dots[2]};
  }
  return options;
}

std::string hash_of_file(const std::filesystem::path& file) {
  const auto bytes = read_file(file);
  return bytes ? sha256(*bytes) : std::string();
}

CalibrationOrigin origin_of(const CalibrateFolderVerb& verb, const CalibrationImages& images) {
  CalibrationOrigin origin;
  origin.date = iso_time(std::chrono::system_clock::now());
  origin.previous = hash_of_file(verb.out);
  for (const CalibrationPair& pair : images.pairs) {
    for (const auto& file : pair.files) origin.sources.emplace_back(file.filename().string(), hash_of_file(file));
  }
  return origin;
}

std::filesystem::path report_of(const CalibrateFolderVerb& verb) {
  if (!verb.with_report) return {};
  if (!verb.report.empty()) return verb.report;
  auto beside = verb.out;
  return beside.replace_extension(".html");
}

/// `file` with a part of its calibration's hash in its name.
std::filesystem::path kept_name(std::filesystem::path file, const std::string& hash) {
  const std::string extension = file.extension().string();
  return file.replace_extension(hash.substr(0, 8) + extension);
}

/// The file that stood there before, under the name of its hash.
Result<void> keep_previous(const CalibrateFolderVerb& verb, const std::string& hash) {
  if (hash.empty()) return {};
  const auto text = read_file(verb.out);
  if (!text) return pass_on(text);
  return write_file_atomically(kept_name(verb.out, hash), *text);
}

/// Writes the report. One that stood there belongs to the previous calibration and is kept by the name of that; the
/// first is, for later ones are of attempts that were refused.
Result<void> write_report(const CalibrateFolderVerb& verb, const FolderCalibration& outcome,
                          const CalibrationOrigin& origin) {
  const auto file = report_of(verb);
  if (file.empty()) return {};
  if (const auto old = read_file(file); old && !origin.previous.empty()) {
    const auto kept = kept_name(file, origin.previous);
    std::error_code ignored;
    if (!std::filesystem::exists(kept, ignored)) {
      if (auto written = write_file_atomically(kept, *old); !written) return written;
    }
  }
  return write_file_atomically(file, calibration_html(outcome, origin));
}

void print_outcome(const CalibrateFolderVerb& verb, const FolderCalibration& outcome) {
  const SolvedCalibration& solved = outcome.judged.solved;
  const CalibrationJudgement& judgement = outcome.judged.judgement;
  const auto used = std::ranges::count_if(solved.images, &ImageFit::is_used);
  if (verb.json) {
    nlohmann::ordered_json all{{"grade", to_string(judgement.grade)}, {"graded_um", judgement.graded_um},
                               {"images", solved.images.size()},      {"used", used},
                               {"noise_px", solved.noise_px},         {"sentences", judgement.sentences}};
    if (solved.sigma) {
      all["volume_um"] = solved.sigma->volume;
      all["scale_um"] = solved.sigma->scale;
    }
    if (verb.with_report) all["report"] = report_of(verb);
    if (const auto& ab = judgement.cross_validation) all["a_b_ratio"] = ab->ratio();
    for (const ImageRemark& remark : outcome.boards.remarks) {
      all["remarks"].push_back({{"pair", remark.pair},
                                {"camera", remark.side == 0 ? "left" : "right"},
                                {"message", remark.message},
                                {"left_out", remark.is_left_out}});
    }
    fmt::print("{}\n", all.dump(2));
    return;
  }
  for (const ImageRemark& remark : outcome.boards.remarks) {
    if (!remark.is_left_out) continue;
    fmt::print("  {}, {}: {} (left out)\n", remark.pair, remark.side == 0 ? "left" : "right", remark.message);
  }
  for (const auto& [message, remarks] : remarks_on_used_images(outcome.boards)) {
    fmt::print("  {} {}, used: {}\n", remarks.size(), remarks.size() == 1 ? "image" : "images", message);
  }
  for (const std::string& sentence : judgement.sentences) fmt::print("  {}\n", sentence);
  fmt::print("grade {}: ", to_string(judgement.grade));
  if (solved.sigma) {
    fmt::print("{:.1f} um in the working volume, lengths to {:.1f} um, ", solved.sigma->volume, solved.sigma->scale);
  }
  fmt::print("{} of {} images, corners to {:.3f} px\n", used, solved.images.size(), solved.noise_px);
}

void print_check(const CalibrateFolderVerb& verb, const DriftCheck& check) {
  if (!verb.json) {
    for (const std::string& sentence : check.sentences) fmt::print("{}\n", sentence);
    return;
  }
  const nlohmann::ordered_json all{{"verdict", to_string(check.verdict)},
                                   {"difference_um", check.difference_um},
                                   {"sigma_um", check.sigma_um},
                                   {"cameras_px", {check.cameras_px.x(), check.cameras_px.y()}},
                                   {"axis_mm", check.axis_mm},
                                   {"axis_deg", check.axis_deg},
                                   {"noise_px", check.noise_px},
                                   {"sentences", check.sentences}};
  fmt::print("{}\n", all.dump(2));
}

Result<void> check_cameras(const Calibration& known, const CalibrationImages& images) {
  if (is_of_cameras(known, images.serials[0], images.serials[1])) return {};
  return fail(
      ErrorCode::invalid_input,
      "{}: its images are of the cameras {} and {}, the calibration of {} and {}; name the calibration of these "
      "cameras",
      images.folder.string(), images.serials[0], images.serials[1], known.left.serial, known.right.serial);
}

/// Does the calibration hold? Only poses that may replace the old ones are written.
ExitCode check_folder(const CalibrateFolderVerb& verb, const CalibrationImages& images,
                      const CalibrateOptions& options) {
  const auto text = read_file(verb.check);
  if (!text) return report_error(text.error());
  const auto known = parse_calibration(*text, verb.check);
  if (!known) return report_error(known.error());
  if (auto same = check_cameras(*known, images); !same) return report_error(same.error());
  const Board board = options.board ? *options.board : images.board.value_or(Board{});
  const SignalStop stop;
  const auto check = catch_exceptions("the check", [&]() -> Result<DriftCheck> {
    const auto boards = find_boards(images, options.pixel_format.empty() ? images.pixel_format : options.pixel_format,
                                    board, {stop.token(), {}});
    if (!boards) return pass_on(boards);
    return check_drift(*known, board, boards->pairs, {stop.token(), {}});
  });
  if (!check) return report_error(check.error());
  print_check(verb, *check);
  if (check->verdict == DriftVerdict::calibrate) {
    return report_error({ErrorCode::below_limits, "the calibration does not hold; calibrate the rig"});
  }
  if (check->verdict == DriftVerdict::holds) return ExitCode::ok;
  const auto origin = origin_of(verb, images);
  const auto moved = moved_calibration_json(*text, *check, origin);
  if (!moved) return report_error(moved.error());
  if (auto kept = keep_previous(verb, origin.previous); !kept) return report_error(kept.error());
  if (auto written = write_file_atomically(verb.out, *moved); !written) return report_error(written.error());
  if (!verb.json) fmt::print("{}\n", verb.out.string());
  return ExitCode::ok;
}

}  // namespace

ExitCode calibrate_folder(const CalibrateFolderVerb& verb) {
  const auto images = read_calibration_images(verb.images);
  if (!images) return report_error(images.error());
  const auto options = options_of(verb, *images);
  if (!options) return report_error(options.error());
  if (!verb.check.empty()) return check_folder(verb, *images, *options);

  const SignalStop stop;
  std::FILE* told = verb.json ? stderr : stdout;  // bars beside the JSON, not in it
  StageBars bars(told, ::isatty(::fileno(told)) == 1);
  const auto outcome = catch_exceptions("the calibration", [&] {
    return calibrate_images(*images, *options, {stop.token(), [&](std::string_view stage, double fraction) {
                                                  bars.update(std::string(stage), fraction);
                                                }});
  });
  bars.end(outcome.has_value());
  if (!outcome) return report_error(outcome.error());
  print_outcome(verb, *outcome);

  const auto origin = origin_of(verb, *images);
  if (auto written = write_report(verb, *outcome, origin); !written) return report_error(written.error());
  if (!verb.json && verb.with_report) fmt::print("{}\n", report_of(verb).string());
  const auto text = calibration_json(*outcome, origin);
  if (!text) return report_error(text.error());
  if (auto kept = keep_previous(verb, origin.previous); !kept) return report_error(kept.error());
  if (auto written = write_file_atomically(verb.out, *text); !written) return report_error(written.error());
  if (!verb.json) fmt::print("{}\n", verb.out.string());
  return ExitCode::ok;
}

ExitCode board(const BoardVerb& verb) {
  const auto wanted = board_of(verb.board);
  if (!wanted) return report_error(wanted.error());
  PageOptions page;
  if (verb.page_mm.size() == 2) {
    page.width_mm = verb.page_mm[0];
    page.height_mm = verb.page_mm[1];
  }
  std::error_code ignored;
  if (std::filesystem::exists(verb.out, ignored)) {
    return report_error({ErrorCode::exists, verb.out.string() + ": already there; name another file with --out"});
  }
  const auto pdf = print_board(*wanted, page);
  if (!pdf) return report_error(pdf.error());
  if (auto written = write_file_atomically(verb.out, *pdf); !written) return report_error(written.error());
  fmt::print(
      "{}\nPrint it at 100 % and compare its length marks: {}\n"
      "Then measure its first row from the first to the last inner corner, {:g} mm as ordered: that is its length.\n"
      "Write it into rig.toml as length_mm under [calibration], or pass it to scanrig calibrate DIR --length.\n",
      verb.out.string(), board_check_line(*wanted), first_row_length(*wanted, 0.0, 0.0).nominal_mm);
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
