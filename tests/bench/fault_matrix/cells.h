#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/clock.h"
#include "core/result.h"

namespace scanrig::bench {

/// Faults on the wire: the columns of the matrix.
enum class Fault { silent, late, damaged, device_error, stalled, unplugged, back_after_2s, earlier_answer };

inline constexpr std::array kFaults{std::pair(Fault::silent, "silent"),
                                    std::pair(Fault::late, "late"),
                                    std::pair(Fault::damaged, "wrong CRC or short frame"),
                                    std::pair(Fault::device_error, "device error or alarm"),
                                    std::pair(Fault::stalled, "stalled"),
                                    std::pair(Fault::unplugged, "unplugged"),
                                    std::pair(Fault::back_after_2s, "back after 2 s"),
                                    std::pair(Fault::earlier_answer, "answer of an earlier request")};

/// Result of one call of one driver under one fault.
struct Outcome {
  bool applicable = true;
  std::string told{};                 ///< error of the call, or why the cell is not applicable
  std::vector<std::string> wrongs{};  ///< violated requirements; empty: held
  bool hung = false;
  bool wrong_position = false;

  void expect(bool held, std::string otherwise) {
    if (!held) wrongs.push_back(std::move(otherwise));
  }
};

/// One field of the matrix: a driver, a function of its interface, a fault.
struct Cell {
  std::string driver;  ///< the class
  std::string device;  ///< profile or wire, where a class has several
  std::string method;
  Fault fault;
  std::function<Outcome()> run;
};

inline Outcome not_applicable(std::string reason) { return {.applicable = false, .told = std::move(reason)}; }

/// Cells of every shipped driver of an interface. `scratch`: an empty folder for ports; `profiles`: config/drives.
std::vector<Cell> turntable_cells(const std::filesystem::path& scratch, const std::filesystem::path& profiles);
std::vector<Cell> projector_cells(const std::filesystem::path& scratch);
std::vector<Cell> panel_cells(const std::filesystem::path& scratch);
/// In a network namespace of this process, see sim/wire/loopback.h.
std::vector<Cell> camera_cells();
std::vector<Cell> lightcrafter_cells();

constexpr std::chrono::milliseconds kGrace{50};  ///< margin of a call past its deadline

/// True if `holds` becomes true within `limit`; checks every millisecond.
bool soon(Clock& clock, Clock::Duration limit, const std::function<bool()>& holds);

/// Runs `call` and notes its result: in time or not, with an error of `named` (empty: success is required) or not.
Outcome timed(Clock& clock, Clock::Duration limit, const std::vector<ErrorCode>& named,
              const std::function<Result<void>(Deadline)>& call);

}  // namespace scanrig::bench
