#pragma once

#include <unistd.h>

#include <fstream>

namespace scanrig {

/// Resident memory of this process [proc(5), statm].
inline long resident_kib() {
  std::ifstream statm("/proc/self/statm");
  long all = 0, resident = 0;
  statm >> all >> resident;
  return resident * (::sysconf(_SC_PAGESIZE) / 1024);
}

}  // namespace scanrig
