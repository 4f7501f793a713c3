#include "drivers/modbus/bus.h"

#include <map>

namespace scanrig::modbus {

std::shared_ptr<Bus> Bus::at(const ClientOptions& options, Clock& clock) {
  static std::mutex mutex;
  static std::map<std::string, std::weak_ptr<Bus>> buses;
  const std::scoped_lock lock(mutex);
  auto& known = buses[options.device];
  if (auto bus = known.lock()) return bus;
  std::shared_ptr<Bus> bus(new Bus(options, clock));
  known = bus;
  return bus;
}

}  // namespace scanrig::modbus
