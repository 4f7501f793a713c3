// planted race|overrun|overflow: a fault on purpose, of the kind that a sanitizer has to find in our own code.

#include <cstdio>
#include <latch>
#include <limits>
#include <string>
#include <vector>

#include "core/parallel.h"

int main(int argc, char** argv) {
  const std::string fault = argc > 1 ? argv[1] : "";
  int total = std::numeric_limits<int>::max();
  const std::vector<int> numbers(static_cast<std::size_t>(argc), 1);
  if (fault == "race") {
    std::latch both(2);
    scanrig::with_threads(2, [&] {
      scanrig::parallel_for(2, [&](std::size_t i) {
        both.arrive_and_wait();
        total -= static_cast<int>(i);
      });
    });
  }
  if (fault == "overrun") total -= numbers.data()[argc];
  if (fault == "overflow") total += numbers.front();
  std::printf("%d\n", total);
}
