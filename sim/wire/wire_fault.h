#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace scanrig::sim::wire {

/// A fault for the next requests.
struct WireFault {
  enum class Kind {
    request_lost,  ///< does not receive the request
    reply_lost,    ///< obeys, its reply is lost
    late,          ///< obeys, replies `delay` later; meanwhile it receives nothing else
    wrong_crc,     ///< obeys, the reply is damaged
    cut_short,     ///< obeys, half of the reply arrives
    refuse,        ///< does not obey, replies with `exception`
    earlier_reply  ///< obeys, repeats its previous reply
  };
  Kind kind = Kind::request_lost;
  int count = -1;                          ///< requests with the fault; negative: all
  std::optional<std::uint8_t> function{};  ///< only requests of this kind: Modbus function, or first letter
  std::chrono::milliseconds delay{0};
  std::uint8_t exception = 4;
};

}  // namespace scanrig::sim::wire
