#include <cstdlib>

#include "drivers/projector/lightcrafter_projector.h"
#include "tests/unit/sim/devices/manual_clock.h"

// The LightCrafter's driver against a device that replies anything. The input is a row of reports. Before each, a byte
// gives its length (7 bits). Its top bit puts the report behind the header of a right reply, so that it is read
// at all. For any input: no crash, and an end before the deadline and the reply time-out are over.

namespace {

using namespace scanrig;

class Anything final : public dlpc350::Transport {
 public:
  Anything(const std::uint8_t*& data, std::size_t& size, sim::ManualClock& clock)
      : data_(data), size_(size), clock_(clock) {}

  Result<void> send(const dlpc350::Report& report, Deadline) override {
    sequence_ = report[1];
    return {};
  }
  Result<dlpc350::Report> receive(Deadline deadline) override {
    if (size_ == 0) {
      clock_.sleep_until(deadline.at);
      return fail(ErrorCode::timeout, "no reply");
    }
    const std::uint8_t kind = take();
    dlpc350::Report report{};
    std::size_t at = 0;
    const std::size_t length = std::min<std::size_t>(kind & 0x3F, size_);
    if (kind & 0x80) {
      report = {0x00, sequence_, static_cast<std::uint8_t>(length), 0x00};
      at = 4;
    }
    for (std::size_t i = 0; i < length; ++i) {
      const std::uint8_t byte = take();
      if (at < report.size()) report[at++] = byte;
    }
    return report;
  }

 private:
  std::uint8_t take() {
    --size_;
    return *data_++;
  }

  const std::uint8_t*& data_;
  std::size_t& size_;
  sim::ManualClock& clock_;
  std::uint8_t sequence_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  sim::ManualClock clock;
  auto projector = LightCrafterProjector::create(
      {},
      [&]() -> Result<std::unique_ptr<dlpc350::Transport>> { return std::make_unique<Anything>(data, size, clock); },
      clock);
  const auto begun = clock.now();
  for (const Light light : {Light::pattern, Light::plain}) {
    std::ignore = (*projector)->fire(light, clock.within(std::chrono::seconds(1)));
    std::ignore = (*projector)->turn_off(clock.within(std::chrono::seconds(1)));
  }
  if (clock.now() - begun > std::chrono::seconds(10)) std::abort();  // a wait without end
  return 0;
}
