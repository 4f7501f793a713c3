#include "core/priority.h"

#include <sys/resource.h>
#include <unistd.h>

namespace scanrig {
namespace {

constexpr int kBackground = 15;  // about a thirtieth of the time of a thread that does not give way

}  // namespace

int niceness() { return ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid())); }

void give_way_by(int value) {
  if (niceness() < value) ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), value);
}

void lower_priority() { give_way_by(kBackground); }

}  // namespace scanrig
