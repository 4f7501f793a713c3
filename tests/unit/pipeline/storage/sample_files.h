#pragma once

#include <filesystem>
#include <fstream>
#include <string>

namespace scanrig::scan_samples {

inline std::string camera_json() {
  return R"({ "serial": "A1", "width": 64, "height": 48, "fx": 200.0, "fy": 201.0, "cx": 31.5, "cy": 23.5,
              "distortion": [0.1, -0.2, 0.001, 0.002, 0.05],
              "camera_from_turntable": { "rotation": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
                                         "translation": [10, 45, 640] } })";
}

inline std::string calibration_json() {
  return R"({ "format": "scanrig-calibration", "version": 1, "date": "2026-11-21T09:00:00Z", "table_radius_mm": 90,
              "left": )" +
         camera_json() + R"(, "right": )" + camera_json() + "}";
}

inline void write_text(const std::filesystem::path& file, const std::string& text) { std::ofstream(file) << text; }

}  // namespace scanrig::scan_samples
