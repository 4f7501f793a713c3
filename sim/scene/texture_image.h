#pragma once

#include <opencv2/core/mat.hpp>
#include <string_view>

#include "core/result.h"

namespace scanrig::sim {

/// The image of an object's texture, 8 bit BGR, of a PNG, JPEG or TIFF with 8 or 16 bits a channel. Fails with
/// `invalid_input`. May be called from any thread.
Result<cv::Mat> decode_texture(std::string_view bytes);

}  // namespace scanrig::sim
