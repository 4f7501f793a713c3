#include "tests/component/camera/aravis_bench.h"
#include "tests/component/camera/stereo_camera_compliance.h"

namespace scanrig {
namespace {

std::unique_ptr<StereoCameraBench> make_bench() {
  auto bench = std::make_unique<AravisBench>();
  EXPECT_TRUE(bench->opened()) << bench->opened().error().message;
  return bench;
}

INSTANTIATE_TEST_SUITE_P(Aravis, StereoCameraCompliance, testing::Values(&make_bench));

}  // namespace
}  // namespace scanrig
