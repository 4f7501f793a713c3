#include "core/priority.h"

#include <sys/resource.h>
#include <unistd.h>

namespace scanrig {
namespace {

constexpr int kBackground = 15;  // about a thirtieth of the time of a thread with normal priority

}  // namespace

int niceness() { return ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid())); }

void lower_priority_to(int nice) {
  if (niceness() < nice) ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), nice);
}

void lower_priority() { lower_priority_to(kBackground); }

}  // namespace scanrig
