#include "daemon/service_manager.h"

#include <systemd/sd-daemon.h>

namespace scanrig {

ServiceManager::~ServiceManager() {
  if (ready_) ::sd_notify(0, "STOPPING=1");
}

void ServiceManager::alive(const std::string& sentence) {
  std::string words = "WATCHDOG=1";
  if (!ready_) words += "\nREADY=1";
  if (!ready_ || sentence != told_) words += "\nSTATUS=" + sentence;
  ready_ = true;
  told_ = sentence;
  ::sd_notify(0, words.c_str());
}

}  // namespace scanrig
