#pragma once

#include <nlohmann/json.hpp>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace scanrig::bench {

/// One image's disparities beside the true ones, all on the left image's pixels, px, NaN unknown.
struct DisparityPair {
  cv::Mat1f measured, sigma, truth;
  cv::Mat1b seen_by_all;  ///< not 0: the point is seen by left, right and projector
  cv::Mat1f incidence;    ///< of the camera that sees it more obliquely, degrees; empty: unknown
};

/// Errors of matched pixels. Shares are of pixels, errors in px of disparity.
class DisparityFigures {
 public:
  void add(const DisparityPair& pair);
  /// Figures of everything added. `wanted`: pixels that left, right and projector see at an incidence below 70 degrees
  /// (any, where it is unknown), outside 10 px of a depth step. `edges`: those within. `bands`: by incidence. `hidden`:
  /// pixels that not all see, most per image.
  [[nodiscard]] nlohmann::json json() const;

 private:
  struct Group {
    double wanted = 0.0;
    std::vector<double> errors, ratios;
    void add(double error, double sigma);
    [[nodiscard]] nlohmann::json json() const;
  };
  Group inner_, edges_;
  std::vector<Group> bands_ = std::vector<Group>(6);
  double wide_ = 0.0;  ///< measured more than 1 px wrong, farther than 2 px from a step but within 10
  std::vector<double> hidden_wrong_, hidden_measured_;  ///< per image
};

}  // namespace scanrig::bench
