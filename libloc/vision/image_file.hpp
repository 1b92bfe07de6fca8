// Pictures as files: PNG (exact), JPEG and what else OpenCV knows by the file's ending.
#pragma once

#include <filesystem>

#include "libloc/sensors/measurements.hpp"

namespace loc {

/// Time, camera and sequence are not kept. @throws DataError when it cannot be written or the ending is not known;
/// std::invalid_argument for an image whose data and size do not fit together.
void write_image(const std::filesystem::path& path, const ImageMeasurement& image);

/// @param format kGray or kBgr: what it is converted to. @throws DataError when there is no such file or it is no
/// picture.
ImageMeasurement read_image(const std::filesystem::path& path, PixelFormat format = PixelFormat::kGray);

}  // namespace loc
