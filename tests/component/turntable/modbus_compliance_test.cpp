#include "tests/component/turntable/modbus_bench.h"
#include "tests/component/turntable/turntable_compliance.h"

namespace scanrig {
namespace {

std::unique_ptr<TurntableBench> leadshine() { return std::make_unique<ModbusBench>(kLeadshine); }
std::unique_ptr<TurntableBench> oriental() { return std::make_unique<ModbusBench>(kOriental); }

INSTANTIATE_TEST_SUITE_P(Leadshine, TurntableCompliance, testing::Values(&leadshine));
INSTANTIATE_TEST_SUITE_P(Oriental, TurntableCompliance, testing::Values(&oriental));

}  // namespace
}  // namespace scanrig
