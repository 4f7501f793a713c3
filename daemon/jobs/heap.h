#pragma once

namespace scanrig {

/// Of the process: large blocks become pages of their own, which the system has back when they are freed, and so does
/// the free end of every heap. Otherwise the C library raises both limits with every large block that is freed, up to
/// 32 and 64 MiB, and keeps what a reconstruction used [mallopt(3), M_MMAP_THRESHOLD, M_TRIM_THRESHOLD].
void keep_heaps_small();

/// Of the process: what is free inside the heaps of all threads goes back to the system [malloc_trim(3)].
void give_memory_back();

}  // namespace scanrig
