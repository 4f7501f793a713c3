#include "tests/component/turntable/grbl_bench.h"
#include "tests/component/turntable/turntable_compliance.h"

namespace scanrig {
namespace {

template <sim::wire::GrblFirmware firmware>
std::unique_ptr<TurntableBench> make_bench() {
  return std::make_unique<GrblBench>([](auto&, sim::wire::GrblSettings& settings) { settings.firmware = firmware; });
}

using sim::wire::GrblFirmware;
INSTANTIATE_TEST_SUITE_P(Grbl, TurntableCompliance, testing::Values(&make_bench<GrblFirmware::grbl>));
INSTANTIATE_TEST_SUITE_P(GrblHal, TurntableCompliance, testing::Values(&make_bench<GrblFirmware::grblhal>));
INSTANTIATE_TEST_SUITE_P(FluidNc, TurntableCompliance, testing::Values(&make_bench<GrblFirmware::fluidnc>));

}  // namespace
}  // namespace scanrig
