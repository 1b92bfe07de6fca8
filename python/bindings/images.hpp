// Pictures as NumPy arrays. Only where libloc is built with OpenCV.
#pragma once

#include <pybind11/numpy.h>

#include "libloc/sensors/measurements.hpp"

namespace locpy {

/// A copy of a picture of uint8: (height, width) grey, (height, width, 3) blue first.
/// @throws py::type_error, py::value_error
loc::ImageMeasurement image_from(const pybind11::array& array);

/// A copy: (height, width), or (height, width, 3) in the image's own order. @throws std::invalid_argument for a JPEG.
pybind11::array_t<std::uint8_t> array_from(const loc::ImageMeasurement& image);

}  // namespace locpy
