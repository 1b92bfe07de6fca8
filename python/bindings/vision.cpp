// Images (vision/): only where libloc is built with OpenCV. HAS_VISION tells.
#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "images.hpp"
#ifdef LOC_VISION
#include "libloc/core/check.hpp"
#include "libloc/vision/feature_video.hpp"
#include "libloc/vision/image_codec.hpp"
#include "libloc/vision/image_source.hpp"
#include "libloc/vision/target_detector.hpp"
#include "libloc/vision/video_source.hpp"
#endif

namespace locpy {

namespace py = pybind11;

#ifdef LOC_VISION
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

py::array_t<std::uint8_t> array_from(const loc::ImageMeasurement& image) {
  loc::require(image.format != loc::PixelFormat::kMjpeg, "image: is a JPEG, which decode_image() decodes");
  const py::ssize_t channels = image.format == loc::PixelFormat::kGray ? 1 : 3;
  const py::ssize_t row = image.width_px * channels;
  const py::ssize_t stride = image.row_stride_bytes;
  loc::require(image.data && image.width_px > 0 && image.height_px > 0 && stride >= row &&
                   static_cast<py::ssize_t>(image.data->size()) >= stride * (image.height_px - 1) + row,
               "image: data and size do not fit together");
  std::vector<py::ssize_t> shape{image.height_px, image.width_px};
  if (channels == 3) shape.push_back(3);
  py::array_t<std::uint8_t> out(shape);
  for (py::ssize_t y = 0; y < image.height_px; ++y) {
    std::copy_n(image.data->data() + y * stride, row, out.mutable_data() + y * row);
  }
  return out;
}

namespace {

namespace fs = std::filesystem;
using loc::FeatureVideo;
using loc::ImageMeasurement;
using loc::TargetDetection;
using loc::TargetDetector;

loc::PixelFormat format_of(bool colour) {
  return colour ? loc::PixelFormat::kBgr : loc::PixelFormat::kGray;
}

void bind_images(py::module_& m) {
  m.def(
      "image_measurement",
      [](loc::TimeNs time_ns, const py::array& image, std::int32_t camera) {
        ImageMeasurement out = image_from(image);
        out.time_ns = time_ns;
        out.camera = camera;
        return out;
      },
      py::arg("time_ns"), py::arg("image"), py::arg("camera") = 0,
      "An ImageMeasurement of uint8, (height, width) or (height, width, 3) with blue first.");
  m.def("image_array", &array_from, py::arg("image"),
        "An ImageMeasurement as uint8, (height, width) or (height, width, 3) in its own order. ValueError for a JPEG.");
  m.def(
      "decode_image",
      [](const ImageMeasurement& image, bool colour) {
        const py::gil_scoped_release no_gil;
        return loc::decode_image(image, format_of(colour));
      },
      py::arg("image"), py::kw_only(), py::arg("colour") = false,
      "The same picture, grey or with blue first, whatever it is in. DataError for a damaged JPEG.");
  m.def("euroc_cameras", &loc::euroc_cameras, py::arg("folder"),
        "The numbers of the cameras whose pictures are in a EuRoC / ASL recording, ascending.");
  m.def(
      "open_euroc_images",
      [](const fs::path& folder, std::vector<std::int32_t> cameras, bool other, bool reference, bool colour) {
        loc::EurocImageOptions options;
        options.read.format = format_of(colour);
        options.cameras = std::move(cameras);
        options.read_other = other;
        options.other.read_reference = reference;
        return loc::open_euroc_images(folder, options);
      },
      py::arg("folder"), py::kw_only(), py::arg("cameras") = std::vector<std::int32_t>{}, py::arg("other") = true,
      py::arg("reference") = true, py::arg("colour") = false,
      "A EuRoC / ASL recording with its pictures. cameras: none are named: all. other: with IMU and all else.");
  m.def(
      "open_image_folder",
      [](const fs::path& folder, double rate_hz, loc::TimeNs first_time_ns, const std::string& name_unit,
         const std::optional<fs::path>& times_file, const std::string& time_unit, std::int32_t camera, bool colour) {
        loc::ImageFolderOptions options;
        options.read.format = format_of(colour);
        options.camera = camera;
        options.rate_hz = rate_hz;
        options.first_time_ns = first_time_ns;
        options.name_unit = name_unit;
        options.times_file = times_file.value_or(fs::path());
        options.time_unit = time_unit;
        return loc::open_image_folder(folder, options);
      },
      py::arg("folder"), py::kw_only(), py::arg("rate_hz") = 0.0, py::arg("first_time_ns") = 0,
      py::arg("name_unit") = "", py::arg("times_file") = py::none(), py::arg("time_unit") = "", py::arg("camera") = 0,
      py::arg("colour") = false,
      "A folder of pictures. One of these tells their times: rate_hz (the names are numbers), name_unit (the names are "
      "times in ns, us, ms, s), times_file; without any: rgb.txt or times.txt in the folder.");
  m.def(
      "open_video",
      [](const fs::path& path, std::int32_t camera, loc::TimeNs start_time_ns, double rate_hz, bool colour) {
        return loc::open_video(path, {format_of(colour), camera, start_time_ns, rate_hz});
      },
      py::arg("path"), py::kw_only(), py::arg("camera") = 0, py::arg("start_time_ns") = 0, py::arg("rate_hz") = 0.0,
      py::arg("colour") = false,
      "The pictures of a video. start_time_ns: of the file's beginning. rate_hz: in place of the file's times.");
}

void bind_video(py::module_& m) {
  const loc::FeatureVideoOptions d;
  py::class_<FeatureVideo>(m, "FeatureVideo", "A video file of features over the camera's pictures: .mp4 or .avi.")
      .def(py::init([](const fs::path& path, int width_px, int height_px, double rate_hz, int tail_frames,
                       bool identities, int dot_radius_px) {
             return FeatureVideo(path, {width_px, height_px, rate_hz, tail_frames, identities, dot_radius_px});
           }),
           py::arg("path"), py::arg("width_px"), py::arg("height_px"), py::arg("rate_hz") = d.rate_hz, py::kw_only(),
           py::arg("tail_frames") = d.tail_frames, py::arg("identities") = d.identities,
           py::arg("dot_radius_px") = d.dot_radius_px,
           "DataError when it cannot be written; ValueError for sizes that are not positive and even.")
      .def(
          "add",
          [](FeatureVideo& self, const loc::FeaturesMeasurement& features, const ImageMeasurement* picture) {
            self.add(features, picture);
          },
          py::arg("features"), py::arg("picture") = py::none(), "picture: ImageMeasurement; None: white.")
      .def("finish", &FeatureVideo::finish, "Closes the file and looks whether it holds what was added.")
      .def_property_readonly("frames", [](const FeatureVideo& self) { return self.file().frames(); })
      .def_property_readonly("codec", [](const FeatureVideo& self) { return self.file().codec(); });
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
            const py::gil_scoped_release no_gil;
            return self.detect(picture);
          },
          py::arg("image"), "image: uint8, (height, width) or (height, width, 3) with blue first.");
}

}  // namespace
#endif

void bind_vision(py::module_& m) {
#ifdef LOC_VISION
  m.attr("HAS_VISION") = true;
  bind_images(m);
  bind_video(m);
  bind_detector(m);
  m.def("finds_april_grids", &loc::finds_april_grids, "True when AprilGrids can be found, not only checkerboards.");
#else
  m.attr("HAS_VISION") = false;
#endif
}

}  // namespace locpy
