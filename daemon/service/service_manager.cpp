#include "daemon/service/service_manager.h"

#include <systemd/sd-daemon.h>

#include <ctime>

namespace scanrig {
namespace {

unsigned long long monotonic_us() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<unsigned long long>(now.tv_sec) * 1'000'000 + static_cast<unsigned long long>(now.tv_nsec) / 1000;
}

}  // namespace

ServiceManager::~ServiceManager() {
  if (ever_ready_) ::sd_notify(0, "STOPPING=1");
}

void ServiceManager::alive(const std::string& sentence) {
  const std::lock_guard guard(mutex_);
  std::string words = "WATCHDOG=1";
  if (state_ == State::starting) words += "\nREADY=1";
  if (state_ != State::reloading && (state_ == State::starting || sentence != told_)) {
    words += "\nSTATUS=" + sentence;
    told_ = sentence;
  }
  if (state_ == State::starting) state_ = State::ready;
  ever_ready_ = true;
  ::sd_notify(0, words.c_str());
}

void ServiceManager::reloading() {
  const std::lock_guard guard(mutex_);
  state_ = State::reloading;
  ::sd_notifyf(0, "RELOADING=1\nMONOTONIC_USEC=%llu\nSTATUS=The configuration is reloaded.", monotonic_us());
}

void ServiceManager::stays(const std::string& sentence) {
  const std::lock_guard guard(mutex_);
  state_ = State::ready;
  ::sd_notify(0, ("READY=1\nSTATUS=" + sentence).c_str());
}

void ServiceManager::begins_again() {
  const std::lock_guard guard(mutex_);
  state_ = State::starting;
  ::sd_notify(0, "WATCHDOG=1");
}

}  // namespace scanrig
