#include "tests/component/turntable/modbus_bench.h"
#include "tests/component/turntable/turntable_compliance.h"

namespace scanrig {
namespace {

template <const char* kProfile>
std::unique_ptr<TurntableBench> make_bench() {
  return std::make_unique<ModbusBench>([](auto&) {}, kProfile);
}
constexpr char kLeadshine[] = "leadshine-rs", kOriental[] = "oriental-az";

INSTANTIATE_TEST_SUITE_P(Leadshine, TurntableCompliance, testing::Values(&make_bench<kLeadshine>));
INSTANTIATE_TEST_SUITE_P(Oriental, TurntableCompliance, testing::Values(&make_bench<kOriental>));

}  // namespace
}  // namespace scanrig
