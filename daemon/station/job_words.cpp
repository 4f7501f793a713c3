#include "daemon/station/job_words.h"

#include <fmt/format.h>

#include <algorithm>

namespace scanrig {
namespace {

std::string why(const JobInfo& job) { return job.error ? job.error->message : "no reason was kept"; }

/// Of the pose that is being scanned.
auto views_of_pose(const JobInfo& job) {
  return std::ranges::count(job.stored, job.complete, [](const StoredView& view) { return view.pose; });
}

Words when_queued(const JobInfo& job) {
  const std::string sentence =
      job.stored.empty() ? "It waits in the queue." : "It waits in the queue to go on where it stopped.";
  if (job.recipe.start_on_part) {
    return {sentence, "Put its part on the table when it is the first of the queue; Start begins the line."};
  }
  return {sentence, "Press Start when it is the first of the queue."};
}

std::string making_model(const JobInfo& job) {
  const auto stage = std::ranges::find_if(job.stages, [](const StageShare& share) { return share.fraction < 1.0; });
  if (stage == job.stages.end()) return "Its model is being made.";
  return fmt::format("Its model is being made: {}, {:.0f} %.", stage->name, 100 * stage->fraction);
}

Words when_failed(const JobInfo& job) {
  const auto sentence = fmt::format("It failed: {}.", why(job));
  if (job.quarantined) return {sentence, "Bundle it for whoever must help, or reprocess it."};
  const bool images_are_good = job.error && job.complete == job.recipe.poses && job.error->code != ErrorCode::moved &&
                               job.error->code != ErrorCode::same_rest;
  return {sentence,
          images_are_good ? "Reprocess it with other options, or scan the object again." : "Scan the object again."};
}

Words when_interrupted(const JobInfo& job) {
  const auto sentence = fmt::format("It was interrupted: {}.", why(job));
  if (!job.resumable) return {sentence, "Cancel it, and scan the object again."};
  if (views_of_pose(job) > 0) return {sentence, "Resume it, leave the object as it lies, and press Start."};
  if (job.complete > 0) return {sentence, "Resume it, put its object on the table, turned over, and press Start."};
  return {sentence, "Resume it, put its object on the table, and press Start."};
}

}  // namespace

Words describe(const JobInfo& job) {
  switch (job.state) {
    case JobState::queued: return when_queued(job);
    case JobState::scanning:
      return {fmt::format("Pose {} of {}: {} of {} views stored.", job.complete + 1, job.recipe.poses,
                          views_of_pose(job), job.recipe.views),
              "Leave its object as it lies."};
    case JobState::waiting_for_flip:
      return {fmt::format("Pose {} of {} is complete.", job.complete, job.recipe.poses), how_to_flip(job.recipe)};
    case JobState::reconstructing: return {making_model(job), "Wait for its model."};
    case JobState::done:
      if (job.passed.value_or(true)) return {"Its model is ready.", "Look at its model."};
      return {fmt::format("Its model is ready, but does not pass: {}.", why(job)),
              fmt::format("Look at the model; scan the object again, or change the limits of the recipe {}.",
                          job.recipe.name)};
    case JobState::failed: return when_failed(job);
    case JobState::interrupted: return when_interrupted(job);
    case JobState::cancelled:
      return {fmt::format("It was cancelled: {}.", why(job)), "Scan its object again if it is still wanted."};
  }
  return {};
}

}  // namespace scanrig
