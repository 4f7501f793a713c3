#include "pipeline/calibration/board/markers.h"

#include <algorithm>
#include <map>
#include <opencv2/core/version.hpp>
#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
#include <opencv2/objdetect/aruco_detector.hpp>
#else
#include <opencv2/aruco.hpp>
#endif

namespace scanrig {
namespace {

const std::map<std::string, int>& dictionaries() {
  using namespace cv::aruco;
  static const std::map<std::string, int> names = {
      {"4x4_50", DICT_4X4_50}, {"4x4_100", DICT_4X4_100}, {"4x4_250", DICT_4X4_250}, {"4x4_1000", DICT_4X4_1000},
      {"5x5_50", DICT_5X5_50}, {"5x5_100", DICT_5X5_100}, {"5x5_250", DICT_5X5_250}, {"5x5_1000", DICT_5X5_1000},
      {"6x6_50", DICT_6X6_50}, {"6x6_100", DICT_6X6_100}, {"6x6_250", DICT_6X6_250}, {"6x6_1000", DICT_6X6_1000},
      {"7x7_50", DICT_7X7_50}, {"7x7_100", DICT_7X7_100}, {"7x7_250", DICT_7X7_250}, {"7x7_1000", DICT_7X7_1000},
  };
  return names;
}

Result<int> find_dictionary(const std::string& name) {
  const auto found = dictionaries().find(name);
  if (found != dictionaries().end()) return found->second;
  return fail(ErrorCode::invalid_input, "board: unknown marker dictionary \"{}\"; use one such as \"4x4_100\"", name);
}

using Quads = std::vector<std::vector<cv::Point2f>>;

#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
cv::aruco::Dictionary open_dictionary(int name) { return cv::aruco::getPredefinedDictionary(name); }

void detect(const cv::Mat1b& grey, int name, Quads& quads, std::vector<int>& ids) {
  cv::aruco::ArucoDetector(open_dictionary(name)).detectMarkers(grey, quads, ids);
}
#else
cv::aruco::Dictionary open_dictionary(int name) { return *cv::aruco::getPredefinedDictionary(name); }

void detect(const cv::Mat1b& grey, int name, Quads& quads, std::vector<int>& ids) {
  cv::aruco::detectMarkers(grey, cv::aruco::getPredefinedDictionary(name), quads, ids);
}
#endif

}  // namespace

Result<int> marker_count(const std::string& dictionary) {
  const auto name = find_dictionary(dictionary);
  if (!name) return pass_on(name);
  return open_dictionary(*name).bytesList.rows;
}

Result<cv::Mat1b> marker_bits(const std::string& dictionary, int id) {
  const auto name = find_dictionary(dictionary);
  if (!name) return pass_on(name);
  const cv::aruco::Dictionary opened = open_dictionary(*name);
  if (id < 0 || id >= opened.bytesList.rows) {
    return fail(ErrorCode::invalid_input, "board: dictionary {} has no marker {}", dictionary, id);
  }
  const cv::Mat inner =
      cv::aruco::Dictionary::getBitsFromByteList(opened.bytesList.rowRange(id, id + 1), opened.markerSize);
  cv::Mat1b cells(inner.rows + 2, inner.cols + 2, uchar{0});
  for (int y = 0; y < inner.rows; ++y) {
    for (int x = 0; x < inner.cols; ++x) cells(y + 1, x + 1) = inner.at<uchar>(y, x) != 0 ? 255 : 0;
  }
  return cells;
}

Result<std::vector<FoundMarker>> detect_markers(const cv::Mat1b& grey, const std::string& dictionary) {
  const auto name = find_dictionary(dictionary);
  if (!name) return pass_on(name);
  if (grey.empty()) return fail(ErrorCode::invalid_input, "board: empty image");
  Quads quads;
  std::vector<int> ids;
  try {
    detect(grey, *name, quads, ids);
  } catch (const cv::Exception& error) {
    return fail(ErrorCode::internal, "board: OpenCV's marker detection failed: {}", error.what());
  }
  std::map<int, int> times;
  for (const int id : ids) ++times[id];
  std::vector<FoundMarker> found;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (times[ids[i]] != 1) continue;
    FoundMarker marker{ids[i], {}};
    for (std::size_t k = 0; k < 4; ++k) marker.corners[k] = {quads[i][k].x, quads[i][k].y};
    found.push_back(marker);
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  return found;
}

}  // namespace scanrig
