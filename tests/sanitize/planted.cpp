// planted race|overrun|overflow: a fault on purpose, of the kind that a sanitizer has to find in our own code.

#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "core/parallel.h"

int main(int argc, char** argv) {
  const std::string fault = argc > 1 ? argv[1] : "";
  int total = std::numeric_limits<int>::max();
  const std::vector<int> numbers(static_cast<std::size_t>(argc), 1);
  if (fault == "race") scanrig::parallel_for(1000, [&](std::size_t i) { total -= static_cast<int>(i); });
  if (fault == "overrun") total -= numbers.data()[argc];
  if (fault == "overflow") total += numbers.front();
  std::printf("%d\n", total);
}
