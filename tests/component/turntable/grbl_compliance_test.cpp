#include "tests/component/turntable/grbl_bench.h"
#include "tests/component/turntable/turntable_compliance.h"

namespace scanrig {
namespace {

std::unique_ptr<TurntableBench> make_bench() { return std::make_unique<GrblBench>(); }

INSTANTIATE_TEST_SUITE_P(Grbl, TurntableCompliance, testing::Values(&make_bench));

}  // namespace
}  // namespace scanrig
