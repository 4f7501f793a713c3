#pragma once

#include <functional>
#include <mutex>
#include <vector>

#include "core/files.h"
#include "daemon/jobs/reconstructor.h"

namespace scanrig::fakes {

/// Inputs of fake reconstructions, and the results they return.
struct ReconstructionLog {
  std::mutex mutex;
  std::vector<std::string> calls;                ///< "view 0/3", "pose 0", "finish"
  std::vector<std::pair<int, int>> grey_levels;  ///< of pattern and plain, per view
  int prepared = 0;                              ///< models
  Result<void> answer_to_view{};
  Result<void> answer_to_finish{};
  std::function<void()> at_finish = [] {};  ///< may throw
};

class FakeReconstructor final : public Reconstructor {
 public:
  explicit FakeReconstructor(ReconstructionLog& log) : log_(log) {}
  Result<void> add_view(std::size_t pose, const RawView& raw, const ViewRecord& record,
                        const Context& context) override {
    context.report("range", 0.5);
    const std::lock_guard guard(log_.mutex);
    log_.calls.push_back(fmt::format("view {}/{}", pose, record.index));
    log_.grey_levels.emplace_back(raw.left_pattern.at<unsigned char>(0, 0), raw.left_plain.at<unsigned char>(0, 0));
    return log_.answer_to_view;
  }
  Result<void> finish_pose(std::size_t pose, const Context& context) override {
    context.report("registration", 1.0);
    const std::lock_guard guard(log_.mutex);
    log_.calls.push_back(fmt::format("pose {}", pose));
    return {};
  }
  Result<void> prepare(const Context&) override {
    const std::lock_guard guard(log_.mutex);
    ++log_.prepared;
    return {};
  }
  std::string live_view(std::size_t) override { return "view so far"; }
  std::string live_pose(std::size_t) override { return "pose so far"; }
  std::vector<Suggestion> suggestions(std::size_t) override {
    return {{{.sentence = "Lay it on its back.", .gain = 0.75}, "an image"}, {{.sentence = "Turn it over."}, ""}};
  }
  Result<void> finish(const std::filesystem::path& folder, const Context& context) override {
    context.report("texture", 1.0);
    log_.at_finish();
    if (context.stopped()) return fail(ErrorCode::stopped, "stopped by request");
    const std::lock_guard guard(log_.mutex);
    log_.calls.emplace_back("finish");
    if (!log_.answer_to_finish) return log_.answer_to_finish;
    if (auto made = create_directories_synced(folder); !made) return made;
    if (auto written = write_file_atomically(folder / "model.glb", "glTF"); !written) return written;
    return write_file_atomically(folder / "report.json", "{}");
  }

 private:
  ReconstructionLog& log_;
};

}  // namespace scanrig::fakes
