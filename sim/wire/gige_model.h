#pragma once

#include <cstdint>
#include <map>
#include <opencv2/core/types.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/result.h"
#include "sim/wire/gige_outputs.h"

namespace scanrig::sim::wire {

/// What a GigE camera offers, and the state in which another program left it.
struct GigeModel {
  enum class Ptp {
    none,   ///< no PtpEnable
    slave,  ///< follows a clock of the network 1 s after it is switched on
    never,  ///< there is no such clock: Listening for ever
    wide,   ///< follows it, and stays 2 ms beside it
  };

  cv::Size sensor{160, 120};
  std::string frame_trigger = "FrameStart";  ///< name of the trigger that starts a frame
  GigeOutputs outputs = GigeOutputs::full;
  Ptp ptp = Ptp::none;
  bool has_user_sets = true;
  /// Seed of the values of all registers at power-on. Empty: those of the user set Default.
  std::optional<std::uint64_t> state;
  int max_exposure_us = 0;           ///< it confirms a longer exposure and takes this; 0: any
  std::vector<std::string> without;  ///< features that it lacks
  std::vector<std::string> stuck;    ///< features that confirm a write and keep their value
};

/// Changes `model` by one word: "state=SEED", "user-sets=no", "ptp=slave", "without=NAME", "stuck=NAME".
/// Fails with `usage`.
Result<void> change_gige_model(GigeModel& model, std::string_view word);

/// A feature of GenICam and its register [GenICam SFNC 2.7].
struct GigeFeature {
  enum class Kind { integer, real, boolean, choice, command, computed };

  std::string name;
  Kind kind = Kind::integer;
  double standard = 0.0, low = 0.0, high = 0.0;  ///< `standard`: in the user set Default
  std::vector<std::pair<std::string, std::uint32_t>> entries;
  std::string selector;    ///< feature that chooses one of several values; empty: there is one
  bool is_locked = false;  ///< while the camera acquires
  std::string limit;       ///< feature that has the largest value
  std::uint32_t address = 0;
};

/// Features of a model, with addresses.
std::vector<GigeFeature> gige_features(const GigeModel& model);

/// GenICam description of the features.
std::string describe(const std::vector<GigeFeature>& features);

/// Words from one feature to the next: values of a feature with a selector stand one after the other.
inline constexpr std::uint32_t kGigeWords = 8;
inline constexpr std::uint32_t kGigeFirstAddress = 0x20000;

}  // namespace scanrig::sim::wire
