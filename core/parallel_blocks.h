#pragma once

#include <algorithm>
#include <cstddef>

#include "core/parallel.h"

namespace scanrig {

/// Runs `body(begin, end)` for blocks of neighbours that together are [0, count): for work that is too little for a
/// task of its own.
template <class Body>
void for_blocks(std::size_t count, const Body& body) {
  constexpr std::size_t kBlock = 1024;
  parallel_for((count + kBlock - 1) / kBlock,
               [&](std::size_t block) { body(block * kBlock, std::min(count, (block + 1) * kBlock)); });
}

/// Runs `body(i)` for i in [0, count), a block to a task.
template <class Body>
void for_each_in_blocks(std::size_t count, const Body& body) {
  for_blocks(count, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(i);
  });
}

}  // namespace scanrig
