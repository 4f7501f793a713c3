#include "pipeline/reconstruct/kept_photo.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

namespace scanrig {
namespace {

/// The photograph lies 7 px right of the silhouette's image and 5 px above it.
RectifyingMap shifted_map(const cv::Size& size) {
  RectifyingMap map{cv::Mat1f(size), cv::Mat1f(size)};
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      map.u(y, x) = static_cast<float>(x + 7);
      map.v(y, x) = static_cast<float>(y - 5);
    }
  }
  return map;
}

KeptPhoto noise_photo(const cv::Size& size) {
  KeptPhoto photo{cv::Mat3b(size)};
  cv::randu(photo.pixels, cv::Scalar::all(1), cv::Scalar::all(255));
  return photo;
}

Silhouette cropped_silhouette(const cv::Size& size, const cv::Rect& box) {
  Silhouette s;
  s.projection.width = size.width;
  s.projection.height = size.height;
  s.projection = s.projection.cropped(box.x, box.y, box.width, box.height);
  return s;
}

TEST(KeptPhoto, KeepsWhatTheSilhouetteShows) {
  const cv::Size size(200, 150);
  const cv::Rect box(40, 30, 60, 50);
  KeptPhoto photo = noise_photo(size);
  const cv::Mat3b before = photo.pixels.clone();
  crop_photo(photo, cropped_silhouette(size, box), shifted_map(size));
  EXPECT_LT(photo.pixels.total(), before.total() / 5);
  const cv::Mat3b whole = photo.whole();
  ASSERT_EQ(whole.size(), size);
  const cv::Rect shown(box.x + 7, box.y - 5, box.width, box.height);
  EXPECT_EQ(cv::norm(whole(shown), before(shown), cv::NORM_L1), 0.0);
  EXPECT_EQ(whole(140, 190), cv::Vec3b(0, 0, 0));
}

TEST(KeptPhoto, KeepsAllWhereTheSilhouetteIsWhole) {
  const cv::Size size(200, 150);
  KeptPhoto photo = noise_photo(size);
  Silhouette whole;
  whole.projection.width = size.width;
  whole.projection.height = size.height;
  crop_photo(photo, whole, shifted_map(size));
  EXPECT_EQ(photo.whole().data, photo.pixels.data);
  EXPECT_EQ(photo.pixels.size(), size);
}

TEST(KeptPhoto, EndsAtTheSensor) {
  const cv::Size size(200, 150);
  KeptPhoto photo = noise_photo(size);
  const cv::Mat3b before = photo.pixels.clone();
  crop_photo(photo, cropped_silhouette(size, {150, 0, 50, 60}), shifted_map(size));
  const cv::Rect shown(157, 0, 43, 55);
  EXPECT_EQ(cv::norm(photo.whole()(shown), before(shown), cv::NORM_L1), 0.0);
}

}  // namespace
}  // namespace scanrig
