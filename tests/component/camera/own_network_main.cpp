#include <gtest/gtest.h>

#include <iostream>

#include "sim/wire/loopback.h"

// The cameras of these tests are on their own loopback, so that several tests can run at once.
int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (const auto own = scanrig::sim::wire::enter_own_loopback(); !own) {
    std::cout << "skipped: " << own.error().message << '\n';
    return 77;
  }
  return RUN_ALL_TESTS();
}
