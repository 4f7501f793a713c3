#include "drivers/camera/stereo_camera.h"

namespace scanrig {

std::string to_string(PixelFormat format) {
  switch (format) {
    case PixelFormat::mono8: return "Mono8";
    case PixelFormat::bayer_rggb8: return "BayerRG8";
    case PixelFormat::bgr8: return "BGR8";
  }
  return "";
}

}  // namespace scanrig
