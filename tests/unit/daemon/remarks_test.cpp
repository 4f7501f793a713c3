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
    return read_rig_remarks(file);
  }
};

TEST_F(Remarks, ARestThatWasNotSuggestedIsOne) {
  EXPECT_THAT(remarks_of(R"({"next_rest": {"taken": null, "sentence": "Laid on another rest."}})"),
              ElementsAre("Laid on another rest."));
  EXPECT_THAT(remarks_of(R"({"next_rest": {"taken": 1, "sentence": null}})"), ElementsAre());
  EXPECT_THAT(remarks_of(R"({})"), ElementsAre());
}

TEST_F(Remarks, EachSentenceComesOnce) {
  EXPECT_THAT(remarks_of(R"({"poses": [{"watch": {"sentences": ["a", "b"]}}, {"watch": {"sentences": ["b"]}}],
                            "disagreements": [{"sentence": "c"}, {"sentence": "c"}]})"),
              ElementsAre("a", "b", "c"));
}

}  // namespace
}  // namespace scanrig
