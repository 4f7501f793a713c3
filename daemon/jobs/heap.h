#pragma once

namespace scanrig {

/// Of the process: large blocks become pages of their own, which the system has back when they are freed. Otherwise the
/// C library raises the size from which it does so with every large block that is freed, up to 32 MiB, and what a
/// reconstruction used stays in its heaps, in pieces [mallopt(3), M_MMAP_THRESHOLD]. The end of a heap that is free
/// goes back, too, whatever was freed before this is called [M_TRIM_THRESHOLD]; malloc_trim() has only that of the
/// first heap.
void keep_large_blocks_apart();

/// Of the process: what is free in the heaps of all threads goes back to the system [malloc_trim(3)].
void give_memory_back();

}  // namespace scanrig
