#include <gmock/gmock.h>

#include "core/files.h"
#include "daemon/jobs/job_files.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

using ::testing::ElementsAre;

class Remarks : public scan_samples::FolderTest {
 protected:
  [[nodiscard]] std::vector<std::string> remarks_of(const std::string& report) const {
    const auto file = folder_ / "report.json";
    EXPECT_TRUE(write_file_atomically(file, report));
    return read_remarks(file);
  }
};

TEST_F(Remarks, ARestThatWasNotSuggestedIsOne) {
  EXPECT_THAT(remarks_of(R"({"next_rest": {"taken": null, "sentence": "Laid on another rest."}})"),
              ElementsAre("Laid on another rest."));
  EXPECT_THAT(remarks_of(R"({"next_rest": {"taken": 1, "sentence": null}})"), ElementsAre());
  EXPECT_THAT(remarks_of(R"({})"), ElementsAre());
}

TEST_F(Remarks, ASymmetricPartIsNamedAndAPoseThatIsKnownBadly) {
  EXPECT_THAT(remarks_of(R"({"pose_estimate": {"turn": {"sentence": "The part is round."}},
                            "pose_refinement": {"sentence": "A turn is open."}})"),
              ElementsAre("The part is round.", "A turn is open."));
  EXPECT_THAT(remarks_of(R"({"pose_refinement": {"poses": [{"pose": 1, "sentence": null},
                                                           {"pose": 2, "sentence": "Pose 3 is loose."}]}})"),
              ElementsAre("Pose 3 is loose."));
}

TEST_F(Remarks, EachSentenceComesOnce) {
  EXPECT_THAT(remarks_of(R"({"poses": [{"watch": {"sentences": ["a", "b"]}}, {"watch": {"sentences": ["b"]}}],
                            "disagreements": [{"sentence": "c"}, {"sentence": "c"}]})"),
              ElementsAre("a", "b", "c"));
}

}  // namespace
}  // namespace scanrig
