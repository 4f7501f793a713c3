// scanrig-gige-camera: two GigE Vision cameras in a process of their own, for tests of the camera driver.
//
//   scanrig-gige-camera GPIO_SOCKET WIDTH HEIGHT LATE_MS [TRIGGER_SELECTOR [OUTPUTS [PROPERTY...]]]
//
// Serves the trigger lines DOTS and PLAIN on GPIO_SOCKET (see gpio_socket.h): a rising edge exposes both cameras.
// Prints "ready" when both are on the wire. Accepts commands, one per line, with the reply "ok" or words:
//   fault left|right KIND COUNT        rates LOST LATE TORN STALE SEED      counts
//   plug left|right 0|1                clock left|right MILLISECONDS        edge 0|1
//   value left|right FEATURE           of its registers
//   flash N                            the Nth flash by the left camera's outputs, from 0: "pattern 1234" (ns) or
//   "none" lit                                whether one is lit now: "0" or "1"
// OUTPUTS: see parse_gige_outputs(). PROPERTY: see change_gige_model(), or exposure-us=N, the exposure for which the
// images are right.
// Ends at the end of its input. Run it in its own network namespace.

#include <iostream>
#include <sstream>

#include "sim/wire/gige_camera.h"
#include "sim/wire/gpio_socket.h"

namespace scanrig::sim::wire {
namespace {

std::string in_words(const std::vector<GigeFlash>& flashes, std::size_t index) {
  if (index >= flashes.size()) return "none";
  const auto& [pattern, at] = flashes[index];
  return fmt::format("{} {}", pattern ? "pattern" : "plain", at.time_since_epoch().count());
}

std::string obey(GigeCameras& cameras, const std::string& line) {
  std::istringstream words(line);
  std::string verb, side_word, kind;
  words >> verb;
  const auto read_side = [&] {
    words >> side_word;
    return side_word == "left" ? Side::left : Side::right;
  };
  if (verb == "fault") {
    const Side side = read_side();
    int count = 0;
    words >> kind >> count;
    const auto fault = parse_gige_fault(kind);
    if (!fault) return "unknown fault " + kind;
    cameras.inject(side, *fault, count);
    return "ok";
  }
  if (verb == "rates") {
    FaultRates rates;
    words >> rates.lost >> rates.late >> rates.torn >> rates.stale >> rates.seed;
    cameras.happen(rates);
    return "ok";
  }
  if (verb == "counts") {
    const FaultCounts counts = cameras.happened();
    return fmt::format("{} {} {} {}", counts.lost, counts.late, counts.torn, counts.stale);
  }
  if (verb == "plug") {
    const Side side = read_side();
    bool in = false;
    words >> in;
    const auto plugged = cameras.plug(side, in);
    return plugged ? "ok" : plugged.error().message;
  }
  if (verb == "clock") {
    const Side side = read_side();
    long by = 0;
    words >> by;
    cameras.set_clock(side, std::chrono::milliseconds(by));
    return "ok";
  }
  if (verb == "value") {
    const Side side = read_side();
    words >> kind;
    return cameras.value(side, kind);
  }
  if (verb == "edge") {
    bool pattern = false;
    words >> pattern;
    return fmt::format("{}", cameras.edge(pattern));
  }
  if (verb == "flash") {
    std::size_t index = 0;
    words >> index;
    return in_words(cameras.flashes(), index);
  }
  if (verb == "lit") return cameras.is_lit() ? "1" : "0";
  return "what?";
}

Result<void> change(GigeCamerasOptions& options, const std::string& property) {
  constexpr std::string_view kExposure = "exposure-us=";
  if (!property.starts_with(kExposure)) return change_gige_model(options.model, property);
  options.nominal_exposure = std::chrono::microseconds(std::atol(property.c_str() + kExposure.size()));
  return {};
}

int run(const std::string& socket, const GigeCamerasOptions& options) {
  RealClock clock;
  const auto cameras = GigeCameras::start(options, &draw_test_image, clock);
  if (!cameras) {
    std::cerr << cameras.error().message << '\n';
    return static_cast<int>(exit_code(cameras.error().code));
  }
  const auto lines = GpioSocket::start(socket, {{"DOTS", false}, {"PLAIN", false}}, clock);
  if (!lines) {
    std::cerr << lines.error().message << '\n';
    return static_cast<int>(exit_code(lines.error().code));
  }
  (*lines)->on_edge([&](const GpioSocket::Edge& edge) {
    if (edge.high) (*cameras)->edge(edge.line == "DOTS");
  });
  std::cout << "ready" << std::endl;
  for (std::string line; std::getline(std::cin, line);) std::cout << obey(**cameras, line) << std::endl;
  return 0;
}

}  // namespace
}  // namespace scanrig::sim::wire

int main(int argc, char** argv) {
  const auto outputs = scanrig::sim::wire::parse_gige_outputs(argc > 6 ? argv[6] : "full");
  scanrig::sim::wire::GigeCamerasOptions options;
  scanrig::Result<void> changed;
  for (int i = 7; i < argc && changed; ++i) changed = scanrig::sim::wire::change(options, argv[i]);
  if (argc < 5 || !outputs || !changed) {
    if (!changed) std::cerr << changed.error().message << '\n';
    std::cerr
        << "usage: scanrig-gige-camera GPIO_SOCKET WIDTH HEIGHT LATE_MS [TRIGGER_SELECTOR [OUTPUTS [PROPERTY...]]]\n";
    return static_cast<int>(scanrig::ExitCode::usage);
  }
  options.size = {std::atoi(argv[2]), std::atoi(argv[3])};
  options.late_by = std::chrono::milliseconds(std::atoi(argv[4]));
  if (argc > 5) options.model.frame_trigger = argv[5];
  options.model.outputs = *outputs;
  return scanrig::sim::wire::run(argv[1], options);
}
