#include "tests/component/turntable/modbus_bench.h"
#include "tests/component/turntable/turntable_compliance.h"

namespace scanrig {
namespace {

std::unique_ptr<TurntableBench> make_bench() { return std::make_unique<ModbusBench>(); }

INSTANTIATE_TEST_SUITE_P(Modbus, TurntableCompliance, testing::Values(&make_bench));

}  // namespace
}  // namespace scanrig
