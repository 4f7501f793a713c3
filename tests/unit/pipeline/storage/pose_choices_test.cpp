#include "pipeline/storage/pose_choices.h"

#include <gmock/gmock.h>

#include "core/files.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class PoseChoices : public scan_samples::FolderTest {
 protected:
  static std::vector<PoseChoice> two() {
    PoseChoice upright{.sentence = "as it stood", .png = "bytes of an image"};
    PoseChoice over{.sentence = "end for end"};
    over.pose1_from_pose2.linear() = Eigen::AngleAxisd(2.5, Eigen::Vector3d(1, 2, 2) / 3).toRotationMatrix();
    over.pose1_from_pose2.translation() = Eigen::Vector3d(1.25, -40, 3e-3);
    return {upright, over};
  }
};

TEST_F(PoseChoices, AScanHasNoneUntilTheyAreWritten) {
  const auto none = read_choices(folder_);
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->choices.empty());
  EXPECT_EQ(none->picked, 0);
  EXPECT_FALSE(picked_motion(folder_).value());
  EXPECT_EQ(pick_choice(folder_, 1).error().code, ErrorCode::refused);
}

TEST_F(PoseChoices, AreReadAsTheyWereWritten) {
  ASSERT_TRUE(write_choices(folder_, two()));
  const auto read = read_choices(folder_);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->choices.size(), 2U);
  EXPECT_EQ(read->choices[0].sentence, "as it stood");
  EXPECT_TRUE(read->choices[0].has_image);
  EXPECT_FALSE(read->choices[1].has_image);
  EXPECT_TRUE(read->choices[1].pose1_from_pose2.isApprox(two()[1].pose1_from_pose2, 1e-12));
  EXPECT_EQ(read_file(folder_ / choice_image(1)).value(), "bytes of an image");
  EXPECT_FALSE(fs::exists(folder_ / choice_image(2)));
  EXPECT_FALSE(picked_motion(folder_).value()) << "none is picked yet";
}

TEST_F(PoseChoices, OneIsPickedAndAnotherInstead) {
  ASSERT_TRUE(write_choices(folder_, two()));
  for (const int number : {2, 1, 2}) {
    ASSERT_TRUE(pick_choice(folder_, number));
    const auto motion = picked_motion(folder_);
    ASSERT_TRUE(motion && *motion);
    EXPECT_TRUE((*motion)->isApprox(two()[static_cast<std::size_t>(number) - 1].pose1_from_pose2, 1e-12));
  }
  for (const int number : {0, 3, -1}) {
    const auto refused = pick_choice(folder_, number);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::invalid_input);
    EXPECT_THAT(refused.error().message, HasSubstr("choose 1 to 2"));
  }
  EXPECT_EQ(read_choices(folder_)->picked, 2) << "a wrong number changes nothing";
}

TEST_F(PoseChoices, NewOnesReplaceAllOfTheOldAndThePick) {
  ASSERT_TRUE(write_choices(folder_, two()));
  ASSERT_TRUE(pick_choice(folder_, 1));
  ASSERT_TRUE(write_choices(folder_, std::array{PoseChoice{.sentence = "the only one"}}));
  EXPECT_EQ(read_choices(folder_)->choices.size(), 1U);
  EXPECT_EQ(read_choices(folder_)->picked, 0);
  EXPECT_FALSE(fs::exists(folder_ / choice_image(1)));
}

TEST_F(PoseChoices, DamagedOnesAreNamed) {
  ASSERT_TRUE(write_choices(folder_, two()));
  const auto text = read_file(folder_ / choices_file()).value();
  for (const auto& [what, with] : {std::pair<std::string, std::string>{"\"picked\": 0", "\"picked\": 3"},
                                   {"\"version\": 1", "\"version\": 2"},
                                   {"\"has_image\": true", "\"has_image\": 1"},
                                   {"\"sentence\"", "\"sentences\""}}) {
    scan_samples::write_text(folder_ / choices_file(), scan_samples::replaced(text, what, with));
    const auto read = read_choices(folder_);
    ASSERT_FALSE(read) << with;
    EXPECT_THAT(read.error().message, HasSubstr("choices.json"));
    EXPECT_FALSE(picked_motion(folder_)) << "no model is made with a pick that cannot be read";
  }
}

}  // namespace
}  // namespace scanrig
