#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/transform.h"
#include "pipeline/range/range_image.h"

namespace scanrig {

/// Relation of one range image to one point.
struct RangeSample {
  enum class Kind : std::uint8_t {
    none,     ///< unmeasured there, or across a depth step
    free,     ///< seen through: the ray continues behind the point
    surface,  ///< within the band of the measured surface
    behind    ///< deeper than the band: hidden from the view
  };
  Kind kind = Kind::none;
  bool clearly_free = false;  ///< free, together with everything within a voxel around the ray
  float distance = 0.0F;      ///< to the tangent plane of the pixel, mm, positive outside; +infinity over background
  float weight = 0.0F;        ///< cos(incidence) / sigma^2, fading towards the edges of the measured area; 1/mm^2
  float sigma = 0.0F;         ///< of `distance`, mm
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< of the surface, model frame
};

/// Limits for preparing and sampling a range image.
struct RangeSamplerOptions {
  float min_facing = 0.2F;           ///< cosine of incidence (78 deg) below which a range pixel is rejected
  float min_sigma_mm = 0.001F;       ///< keeps the weights of noise-free data finite
  float max_step = 0.5F;             ///< share of the band: pixels farther off each other's planes are two surfaces
  int pinhole_passes = 2;            ///< each closes gaps by one pixel from every side
  int min_pinhole_neighbours = 5;    ///< measured neighbours, of 8, that a closed pixel needs
  float fade_px = 8.0F;              ///< weights fade over the last pixels before an edge
  float footprint_gap_mm = 3.0F;     ///< gaps up to twice this are bridged in a footprint
  float footprint_margin_mm = 1.0F;  ///< range images lose this much at a limb
};

/// A range image prepared for sampling: tangent planes in the model frame, pinholes of a pixel or two closed, specks
/// and flying pixels removed, free space eroded by a voxel. All of its pixels, or those around one place: the bits of a
/// sample are the same. Any number of threads may sample it.
class RangeSampler {
 public:
  /// Gives the pixels of a box of a range image; the projection of what it returns is not looked at. Called from any
  /// thread.
  using PartSource = std::function<RangeImage(const cv::Rect& box)>;

  /// All of `range`. `band_mm`: half width of the zone around the surface in which it is evidence.
  RangeSampler(const RangeImage& range, const Transform& model_from_pose, double band_mm, double voxel_mm,
               const RangeSamplerOptions& options);

  /// From now on only points within `box` (model frame) may be sampled; `part` gives the pixels, of the image that this
  /// was made of. Everything but sample() and surface() holds for all points still.
  void focus(const Eigen::AlignedBox3f& box, const PartSource& part);
  /// No point may be sampled until the next focus(); its pixels are let go.
  void release() { set_area({}); }
  /// Pixels that focus() prepares for `box`, of the part that measured anything.
  [[nodiscard]] cv::Rect area_for(const Eigen::AlignedBox3f& box) const;
  static constexpr std::size_t kBytesPerPixel = 32;

  [[nodiscard]] RangeSample sample(const Eigen::Vector3f& point_in_model) const;

  /// True where nothing within `radius` (mm) of the point can be free or surface: the view adds no data there.
  [[nodiscard]] bool has_no_data_near(const Eigen::Vector3f& point_in_model, float radius) const;

  /// Distance of the point beside this image's measured area, mm; very negative if the image cannot decide. Replaces a
  /// silhouette where a range image has neither silhouettes nor background.
  [[nodiscard]] float beside_footprint_mm(const Eigen::Vector3f& point_in_model) const;

  [[nodiscard]] bool has_outline() const { return has_outline_; }
  [[nodiscard]] float window_mm() const {
    return window_mm_;
  }  ///< half width of the range image's window, on the surface
  struct SurfacePixel {
    Eigen::Vector3f point;  ///< model frame
    float weight;
    float sigma;
  };
  [[nodiscard]] std::vector<SurfacePixel> surface() const;  ///< row by row
  /// Unit vector, model frame, from the point towards the camera.
  [[nodiscard]] Eigen::Vector3d towards_camera(const Eigen::Vector3d& point_in_model) const;

 private:
  enum class State : std::uint8_t { unknown, surface, background };
  struct Pixel {
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< model frame
    float offset = 0.0F;                               ///< plane: normal . x = offset
    float weight = 0.0F;
    float sigma = 0.0F;       ///< along the normal
    float free_depth = 0.0F;  ///< everything nearer than this is free in the whole window; +infinity: background
    State state = State::unknown;
  };
  struct PixelPosition {
    float u, v, depth;  ///< u, v in the crop
  };

  void crop(const RangeImage& range);
  void set_area(const cv::Rect& area);
  void make_planes(const RangeImage& range, const cv::Point& first);
  void close_pinholes();
  void drop_specks_and_fade_edges(int radius);
  void erode_free_depth(int radius);
  void make_footprint();
  void make_tiles();
  [[nodiscard]] bool one_surface(const std::vector<Eigen::Vector3f>& points, std::size_t i, std::size_t j) const;
  [[nodiscard]] int margin() const;
  [[nodiscard]] PixelPosition project(const Eigen::Vector3f& point_in_model) const;
  [[nodiscard]] Eigen::Vector3f point_on(const Pixel& pixel, int x, int y) const;
  [[nodiscard]] float depth_on_plane(const Pixel& plane, int x, int y) const;
  [[nodiscard]] double mm_per_pixel() const;
  /// Of the crop's pixel (x, y), which must be in `area_`.
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y - area_.y) * area_.width + (x - area_.x);
  }
  [[nodiscard]] const Pixel& pixel(int x, int y) const { return pixels_[index(x, y)]; }
  [[nodiscard]] Pixel& pixel(int x, int y) { return pixels_[index(x, y)]; }

  RangeSamplerOptions options_;
  Transform camera_from_model_;
  Eigen::Matrix3f rotation_;
  Eigen::Vector3f translation_;
  Projection projection_;  ///< of the crop
  cv::Rect crop_;
  float window_mm_ = 0.0F;
  bool has_outline_ = false;  ///< then all of the image outside the crop is background
  float band_mm_ = 0.0F;
  int width_ = 0, height_ = 0;  ///< of the crop
  int voxel_pixels_ = 1;
  cv::Rect area_;  ///< of the crop: the pixels that are held
  std::vector<Pixel> pixels_;
  cv::Mat1f footprint_px_;  ///< distance to the footprint, positive beside it; empty if the background is given
  cv::Mat1f tile_reach_;    ///< beyond this depth nothing in the tile is free or surface
};

}  // namespace scanrig
