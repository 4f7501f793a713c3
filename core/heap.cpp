#include "core/heap.h"

#include <malloc.h>

namespace scanrig {

// Other C libraries than glibc do so already, or have no such setting.

void keep_heaps_small() {
#ifdef M_MMAP_THRESHOLD
  ::mallopt(M_MMAP_THRESHOLD, 1 << 20);
  ::mallopt(M_TRIM_THRESHOLD, 1 << 17);
#endif
}

void give_memory_back() {
#ifdef __GLIBC__
  ::malloc_trim(0);
#endif
}

}  // namespace scanrig
