// Images (vision/): only where libloc is built with OpenCV. HAS_VISION tells.
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "bindings.hpp"
#ifdef LOC_VISION
#include "libloc/vision/target_detector.hpp"
#endif

namespace locpy {

namespace py = pybind11;

#ifdef LOC_VISION
namespace {

using loc::TargetDetection;
using loc::TargetDetector;

/// A copy of a picture: (height, width) grey, (height, width, 3) blue first.
loc::ImageMeasurement image_from(const py::array& array) {
  if (!py::isinstance<py::array_t<std::uint8_t>>(array)) {
    throw py::type_error("image must be of uint8, is " + py::str(array.dtype()).cast<std::string>());
  }
  const bool grey = array.ndim() == 2;
  if (!grey && !(array.ndim() == 3 && array.shape(2) == 3)) {
    throw py::value_error("image must have shape (height, width) or (height, width, 3)");
  }
  constexpr py::ssize_t kLargest = 1 << 20;
  if (array.shape(0) < 1 || array.shape(1) < 1 || array.shape(0) > kLargest || array.shape(1) > kLargest) {
    throw py::value_error("image is empty or too large");
  }
  const auto packed = py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast>::ensure(array);
  loc::ImageMeasurement image;
  image.height_px = static_cast<std::int32_t>(array.shape(0));
  image.width_px = static_cast<std::int32_t>(array.shape(1));
  image.format = grey ? loc::PixelFormat::kGray : loc::PixelFormat::kBgr;
  image.row_stride_bytes = image.width_px * (grey ? 1 : 3);
  image.data = std::make_shared<std::vector<std::uint8_t>>(packed.data(), packed.data() + packed.size());
  return image;
}

void bind_detector(py::module_& m) {
  py::class_<TargetDetection>(m, "TargetDetection", "What a TargetDetector found in one picture.")
      .def_readonly("view", &TargetDetection::view, "no corners: the target was not found")
      .def_readonly("reason", &TargetDetection::reason, "why there are no corners")
      .def_readonly("foreign_tags", &TargetDetection::foreign_tags, "that are no part of the grid")
      .def_readonly("corners_left_out", &TargetDetection::corners_left_out, "not sharp enough to be placed");
  const loc::TargetDetectorOptions d;
  py::class_<TargetDetector>(m, "TargetDetector",
                             "Finds a calibration target in pictures, its corners to a few hundredths of a pixel.")
      .def(py::init([](const loc::CalibrationTarget& target, bool thorough, int min_tags, double min_contrast,
                       double max_disagreement) {
             return TargetDetector(target, {thorough, min_tags, min_contrast, max_disagreement});
           }),
           py::arg("target"), py::kw_only(), py::arg("thorough") = d.thorough, py::arg("min_tags") = d.min_tags,
           py::arg("min_contrast") = d.min_contrast, py::arg("max_disagreement_px") = d.max_disagreement_px)
      .def(
          "detect",
          [](const TargetDetector& self, const py::array& image) {
            const loc::ImageMeasurement picture = image_from(image);
            const py::gil_scoped_release release;
            return self.detect(picture);
          },
          py::arg("image"), "image: uint8, (height, width) or (height, width, 3) with blue first.");
}

}  // namespace
#endif

void bind_vision(py::module_& m) {
#ifdef LOC_VISION
  m.attr("HAS_VISION") = true;
  bind_detector(m);
  m.def("finds_april_grids", &loc::finds_april_grids, "True when AprilGrids can be found, not only checkerboards.");
#else
  m.attr("HAS_VISION") = false;
#endif
}

}  // namespace locpy
