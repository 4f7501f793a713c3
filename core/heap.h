#pragma once

namespace scanrig {

/// Returns freed memory of the process: large blocks become separate pages, which the system gets back when freed, and
/// so does the free end of every heap. Otherwise the C library raises both limits with every large freed block, up to
/// 32 and 64 MiB, and keeps what a reconstruction used [mallopt(3), M_MMAP_THRESHOLD, M_TRIM_THRESHOLD].
void keep_heaps_small();

/// Returns free memory inside the heaps of all threads to the system [malloc_trim(3)].
void give_memory_back();

}  // namespace scanrig
