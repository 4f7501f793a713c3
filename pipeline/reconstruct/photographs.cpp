#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "pipeline/reconstruct/reconstruction_state.h"

namespace scanrig {
namespace {

/// In the folder; past its end where it is missing.
std::size_t position_of(const ScanFolder& scan, std::size_t pose, int index) {
  if (pose >= scan.manifest().poses.size()) return 0;
  const auto& views = scan.manifest().poses[pose].views;
  return static_cast<std::size_t>(std::ranges::find(views, index, &ViewRecord::index) - views.begin());
}

cv::Mat grey_of(const cv::Mat& image) {
  cv::Mat grey;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

}  // namespace

void Reconstruction::State::take_view(PoseState& pose, View view, const ViewImages& images, WatchMode mode) {
  if (mode != WatchMode::off) {
    const StageLog::Timer timer(log, "watch");
    if (!pose.watch) pose.watch.emplace(*calibration, *rectification);
    pose.watch->add(images, view);
  }
  const std::size_t order = pose.views.size();
  pose.views.emplace_back();
  if (step() > 1) pose.full.emplace_back();
  set_view(pose, order, std::move(view));
  if (images.left_plain.channels() != 3) return;
  pose.plain.emplace_back();
  pose.pattern.push_back({.order = order, .left = {}, .right = {}});
  if (reads_again()) return;
  pose.plain.back() = {{images.left_plain}, {images.right_plain}};
  pose.pattern.back() = {order, grey_of(images.left_pattern), grey_of(images.right_pattern)};
}

/// To measure a view anew: kept, or from the folder.
Result<ViewImages> Reconstruction::State::whole_images(std::size_t pose, std::size_t v) const {
  const PoseState& state = poses[pose];
  const GreyPair& pattern = state.pattern[v];
  if (!reads_again()) {
    return ViewImages{.left_pattern = pattern.left,
                      .right_pattern = pattern.right,
                      .left_plain = state.plain[v].left.whole(),
                      .right_plain = state.plain[v].right.whole()};
  }
  const auto scan = ScanFolder::open(folder);
  if (!scan) return pass_on(scan);
  auto images = scan->load_images(pose, position_of(*scan, pose, state.views[v].index));
  if (!images) return pass_on(images);
  images->left_pattern = grey_of(images->left_pattern);
  images->right_pattern = grey_of(images->right_pattern);
  return images;
}

void Reconstruction::State::crop_photos(PoseState& pose) const {
  for (std::size_t v = 0; v < pose.plain.size(); ++v) {
    const auto& silhouettes = pose.views[v].silhouettes;
    if (silhouettes.size() < 2) continue;
    crop_photo(pose.plain[v].left, silhouettes[0], rectification->left_map, step());
    crop_photo(pose.plain[v].right, silhouettes[1], rectification->right_map, step());
  }
}

/// `scan`: null where photographs are kept.
Result<KeptPhoto> Reconstruction::State::photo(const ScanFolder* scan, std::size_t pose, std::size_t v,
                                               std::size_t camera) const {
  const PoseState& state = poses[pose];
  if (scan == nullptr) return camera == 0 ? state.plain[v].left : state.plain[v].right;
  auto image = scan->load_usable_image(pose, position_of(*scan, pose, state.views[v].index),
                                       camera == 0 ? "left_plain" : "right_plain");
  if (!image) return pass_on(image);
  KeptPhoto photo{.pixels = *image};
  const auto& silhouettes = state.views[v].silhouettes;
  if (camera < silhouettes.size()) {
    crop_photo(photo, silhouettes[camera], camera == 0 ? rectification->left_map : rectification->right_map, step());
  }
  return photo;
}

/// `scan`: as of photo().
Result<void> Reconstruction::State::add_photos(const ScanFolder* scan, std::size_t pose,
                                               const Transform& pose_from_model, std::vector<Photo>& photos) const {
  for (std::size_t v = 0; v < poses[pose].plain.size(); ++v) {
    // The registration of the view's range image holds for its photographs too.
    const Transform left_from_turntable =
        poses[pose].watch ? poses[pose].watch->left_from_turntable() : rectification->left_from_turntable;
    const Transform turntable_from_pose = left_from_turntable.inverse() * poses[pose].views[v].range.camera_from_pose;
    const Transform turntable_from_model = turntable_from_pose * pose_from_model;
    std::vector<Eigen::Vector3f> in_front;
    if (v < poses[pose].in_front.size()) {
      const Eigen::Isometry3f model_from_pose(pose_from_model.inverse().matrix().cast<float>());
      for (const Eigen::Vector3f& point : poses[pose].in_front[v]) in_front.emplace_back(model_from_pose * point);
    }
    const Calibration& cameras = poses[pose].watch ? poses[pose].watch->calibration() : *calibration;
    for (std::size_t camera = 0; camera < 2; ++camera) {
      auto kept = photo(scan, pose, v, camera);
      if (!kept) return pass_on(kept);
      photos.push_back({camera == 0 ? cameras.left : cameras.right, turntable_from_model, kept->pixels, kept->first});
      photos.back().in_front = in_front;
    }
  }
  return {};
}

Result<std::vector<Photo>> Reconstruction::State::photos(const FoundPoses& found) const {
  std::vector<Photo> photos;
  std::optional<ScanFolder> scan;
  if (reads_again()) {
    auto opened = ScanFolder::open(folder);
    if (!opened) return pass_on(opened);
    scan = std::move(*opened);
  }
  for (std::size_t p = 0; p < poses.size(); ++p) {
    if (!found.model_from_pose[p]) continue;
    const std::size_t first = photos.size();
    const Transform pose_from_model = p == 0 ? Transform::Identity() : found.model_from_pose[p]->inverse();
    if (auto done = add_photos(scan ? &*scan : nullptr, p, pose_from_model, photos); !done) return pass_on(done);
    for (std::size_t i = first; found.layers && i < photos.size(); ++i) photos[i].layer = static_cast<int>(p);
  }
  return photos;
}

/// Each pose's own photographs on its own surface, then both together.
Result<ColourDecision> Reconstruction::State::turn_by_colours(std::size_t pose1, std::size_t pose2,
                                                              const PoseEstimate& estimate,
                                                              const Context& context) const {
  std::optional<ScanFolder> scan;
  if (reads_again()) {
    auto opened = ScanFolder::open(folder);
    if (!opened) return pass_on(opened);
    scan = std::move(*opened);
  }
  std::vector<std::vector<PaintedPoint>> painted;
  for (const std::size_t p : {pose1, pose2}) {
    std::vector<Photo> photographs;
    if (auto done = add_photos(scan ? &*scan : nullptr, p, Transform::Identity(), photographs); !done) {
      return pass_on(done);
    }
    auto paint = paint_of(poses[p].partial.mesh, photographs, context);
    if (!paint) return pass_on(paint);
    painted.push_back(std::move(*paint));
  }
  std::vector<Transform> motions;
  for (const Transform& element : estimate.symmetry.elements) motions.push_back(element * estimate.pose1_from_pose2);
  return turn_by_colour(painted[0], painted[1], motions, estimate.symmetry.free_turns());
}

/// Grey where there is no photograph, or it cannot be read: it is only to be looked at.
LivePhoto Reconstruction::State::live_photo(std::size_t pose, std::size_t v) const {
  const PoseState& state = poses[pose];
  LivePhoto live{rectification->left_from_turntable.inverse() * state.views[v].range.camera_from_pose, {}};
  if (v >= state.plain.size()) return live;
  if (!reads_again()) {
    live.image = state.plain[v].left.whole();
  } else if (const auto scan = ScanFolder::open(folder); scan) {
    const auto image = scan->load_usable_image(pose, position_of(*scan, pose, state.views[v].index), "left_plain");
    if (image) live.image = *image;
  }
  return live;
}

}  // namespace scanrig
