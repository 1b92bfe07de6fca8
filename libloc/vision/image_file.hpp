// Pictures as files: PNG (exact), JPEG and what else OpenCV knows by the file's ending.
#pragma once

#include <filesystem>

#include "libloc/sensors/measurements.hpp"

namespace loc {

/// Time, camera and sequence are not kept. @throws DataError when it cannot be written or the ending is not known;
/// std::invalid_argument for an image whose data and size do not fit together.
void write_image(const std::filesystem::path& path, const ImageMeasurement& image);

/// @param format kGray or kBgr: what it is converted to. kMjpeg: a JPEG is given as it is stored, only its beginning
/// and its end are looked at; another picture is decoded, grey or BGR as it is stored.
/// @throws DataError naming the file when there is none or it is no picture, or a damaged one.
ImageMeasurement read_image(const std::filesystem::path& path, PixelFormat format = PixelFormat::kGray);

}  // namespace loc
