#include "pipeline/deviation/reference_fit.h"

#include <gmock/gmock.h>

#include "core/units.h"
#include "tests/unit/pipeline/deviation/part.h"

namespace scanrig {
namespace {

using deviation_part::moved_mesh;
using deviation_part::part_mesh;
using deviation_part::some_motion;
using ::testing::HasSubstr;

TEST(ReferenceFitTest, aPartIsFoundHoweverItLies) {
  const Mesh reference = part_mesh(1.5);
  for (const double turn_deg : {0.0, 77.0, 140.0, 180.0}) {
    const Transform truth = some_motion(turn_deg);  // reference from model
    const auto fit = fit_to_reference(moved_mesh(part_mesh(1.1), truth.inverse()), reference);
    ASSERT_TRUE(fit) << turn_deg << ": " << fit.error().message;
    const Transform off = fit->reference_from_model * truth.inverse();
    EXPECT_LT(to_degrees(rotation_angle(off.linear())), 0.1) << turn_deg;
    EXPECT_LT((off * deviation_part::kMiddle - deviation_part::kMiddle).norm(), 0.05) << turn_deg;
    EXPECT_GT(fit->confirmed, 0.98);
    EXPECT_FALSE(fit->fits_otherwise) << "the part has no symmetry";
  }
}

TEST(ReferenceFitTest, onlyWhatWasMeasuredIsAligned) {
  const Mesh reference = part_mesh(1.5);
  Mesh model = part_mesh(1.1);
  model.views.assign(model.vertices.size(), 3);
  for (std::size_t v = 0; v < model.vertices.size(); ++v) {
    if (model.vertices[v].y() > 4.0F) continue;  // its foot was closed by the table, 4 mm too low
    model.views[v] = 0;
    model.vertices[v].y() -= 4.0F;
  }
  const auto fit = fit_to_reference(model, reference);
  ASSERT_TRUE(fit) << fit.error().message;
  EXPECT_LT((fit->reference_from_model * deviation_part::kMiddle - deviation_part::kMiddle).norm(), 0.05);
}

TEST(ReferenceFitTest, aSymmetricPartFitsInSeveralWays) {
  const auto box = testing::box_mesh({0, 0, 0}, {40, 20, 30});
  const auto fit = fit_to_reference(moved_mesh(box, some_motion(33.0)), box);
  ASSERT_TRUE(fit) << fit.error().message;
  EXPECT_GT(fit->confirmed, 0.98);
  EXPECT_TRUE(fit->fits_otherwise);
}

std::string refusal(const Mesh& model, const Mesh& reference, ErrorCode code = ErrorCode::no_overlap) {
  const auto fit = fit_to_reference(model, reference);
  EXPECT_FALSE(fit);
  if (fit) return "";
  EXPECT_EQ(fit.error().code, code);
  return fit.error().message;
}

TEST(ReferenceFitTest, anotherPartIsRefusedAndOneInOtherUnits) {
  const Mesh part = part_mesh(1.5);
  const auto ball = testing::mesh_of(testing::ball(deviation_part::kMiddle, 30.0), {-40, -10, -40}, {40, 70, 40}, 1.5);
  EXPECT_THAT(refusal(part, ball), HasSubstr("does not fit"));
  EXPECT_THAT(refusal(part, testing::box_mesh({0, 0, 0}, {60, 50, 40})), HasSubstr("does not fit"));
  for (const float scale : {0.001F, 1.0F / 25.4F, 25.4F}) {
    Mesh other = part;
    for (auto& vertex : other.vertices) vertex *= scale;
    EXPECT_THAT(refusal(part, other), HasSubstr("in mm")) << scale;
  }
}

TEST(ReferenceFitTest, aModelOfWhichNothingWasMeasuredIsRefused) {
  Mesh model = part_mesh(2.0);
  model.views.assign(model.vertices.size(), 0);
  EXPECT_THAT(refusal(model, part_mesh(1.5), ErrorCode::degenerate), HasSubstr("measured surface has no area"));
}

TEST(ReferenceFitTest, aStopEndsIt) {
  std::stop_source stop;
  stop.request_stop();
  const auto fit = fit_to_reference(part_mesh(2.0), part_mesh(1.5), {}, {stop.get_token(), {}});
  ASSERT_FALSE(fit);
  EXPECT_EQ(fit.error().code, ErrorCode::stopped);
}

}  // namespace
}  // namespace scanrig
