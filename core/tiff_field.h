#pragma once

#include <tiffio.h>

#include <cstdint>

namespace scanrig {

/// Value of a tag of an open TIFF file, or what the format takes where the tag is missing.
template <typename Value>
Value tiff_field(TIFF* file, std::uint32_t tag) {
  Value value{};
  TIFFGetFieldDefaulted(file, tag, &value);
  return value;
}

}  // namespace scanrig
