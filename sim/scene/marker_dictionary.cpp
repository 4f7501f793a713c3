#include "sim/scene/marker_dictionary.h"

#include <opencv2/core/version.hpp>
#if CV_VERSION_MAJOR > 4 || (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 7)
#include <opencv2/objdetect/aruco_dictionary.hpp>
#else
#include <opencv2/aruco.hpp>
#endif

namespace scanrig::sim {

std::vector<MarkerBits> dict_4x4_100() {
#if CV_VERSION_MAJOR > 4 || (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 7)
  const cv::aruco::Dictionary dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_100);
#else
  const auto predefined = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_100);
  const cv::aruco::Dictionary& dictionary = *predefined;
#endif
  std::vector<MarkerBits> markers;
  for (int id = 0; id < dictionary.bytesList.rows; ++id) {
    const cv::Mat bits = cv::aruco::Dictionary::getBitsFromByteList(dictionary.bytesList.row(id), 4);
    MarkerBits marker{};
    for (int i = 0; i < 16; ++i) marker[i] = bits.at<std::uint8_t>(i / 4, i % 4) != 0;
    markers.push_back(marker);
  }
  return markers;
}

}  // namespace scanrig::sim
