// Images of libloc as those of OpenCV and back. The only header of libloc that shows OpenCV: for files inside vision/
// and for users who have it.
#pragma once

#include <opencv2/core.hpp>

#include "libloc/sensors/measurements.hpp"

namespace loc {

/// The same bytes, to be read only, valid as long as the image's data: grey, BGR or RGB, 8 bits.
/// @throws std::invalid_argument when data, size and row length do not fit together, or for JPEG.
cv::Mat view_of(const ImageMeasurement& image);

/// A copy with three channels, blue first. @throws std::invalid_argument as view_of.
cv::Mat bgr_of(const ImageMeasurement& image);

/// A copy of a picture of 8 bits. @param format kGray for one channel, kBgr or kRgb for three.
/// @throws std::invalid_argument when the format does not fit.
ImageMeasurement image_of(const cv::Mat& picture, PixelFormat format);

}  // namespace loc
