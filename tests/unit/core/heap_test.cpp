#include "core/heap.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <thread>

#include "tests/resident_memory.h"
#include "tests/slowness.h"

namespace scanrig {
namespace {

constexpr std::size_t kPicture = 24 << 20, kPiece = 256 << 10, kPieces = 100, kPage = 4096;

/// Writes to every page; the compiler must leave nothing out here.
void* used(std::size_t size) {
  auto* block = static_cast<volatile char*>(std::malloc(size));
  for (std::size_t i = 0; i < size; i += kPage) block[i] = 1;
  return const_cast<char*>(block);
}

/// Memory that a thread used in pieces too small for separate pages, and freed.
void work() {
  std::array<void*, kPieces> pieces{};
  for (void*& piece : pieces) piece = used(kPiece);
  for (void* piece : pieces) std::free(piece);
}

TEST(Heap, WhatAThreadUsedGoesBackThoughALargeBlockWasFreedBefore) {
#ifndef __GLIBC__
  GTEST_SKIP() << "another C library";
#endif
  if (kSlowness > 1) GTEST_SKIP() << "the sanitizer's own heap";
  std::free(used(kPicture));  // from now on the C library would keep twice as much
  keep_heaps_small();
  const long before = resident_kib();
  std::thread(work).join();
  give_memory_back();
  EXPECT_LT(resident_kib() - before, long{kPieces * kPiece >> 10} / 4);
}

}  // namespace
}  // namespace scanrig
