// Files of SLAM: settings (io/slam_yaml), saved map and state (msgs/slam_file), points for viewers (io/ply).
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "libloc/io/ply.hpp"
#include "libloc/io/slam_yaml.hpp"
#include "msgs/slam_file.hpp"

namespace locpy {
namespace {

namespace fs = std::filesystem;
using loc::SlamFile;
using loc::SlamOptions;

void bind_settings(py::module_& m) {
  m.def(
      "read_slam_options",
      [](const fs::path& path, const std::optional<SlamOptions>& options) {
        return loc::read_slam_options(path, options.value_or(SlamOptions{}));
      },
      py::arg("path"), py::arg("options") = py::none(),
      "slam.yaml; what it does not say is as in options. DataError names file, line and key. Ranges are "
      "SlamOptions.check()'s, which needs the camera too.");
  m.def("slam_options_text", &loc::slam_options_text, py::arg("options"), "As write_slam_options() writes it.");
  m.def("write_slam_options", &loc::write_slam_options, py::arg("path"), py::arg("options"),
        "Writes slam.yaml: every field but the camera; numbers read back as the same.");
}

void bind_saved(py::module_& m) {
  py::class_<SlamFile>(m, "SlamFile", "A saved map and state.")
      .def_readonly("snapshot", &SlamFile::snapshot)
      .def_readonly("motion", &SlamFile::motion)
      .def_readonly("camera", &SlamFile::camera, "that the map was made with")
      .def_readonly("options", &SlamFile::options, "text of slam.yaml: what the filter ran with")
      .def(
          "why_not_restorable",
          [](const SlamFile& self, const SlamOptions& options) { return loc::why_not_restorable(self, options); },
          py::arg("options"), "What speaks against going on with these options; empty when nothing does.");
  m.def("save_slam", &loc::save_slam, py::arg("path"), py::arg("snapshot"), py::arg("options"),
        "Saves what a filter knows, to go on from with restore(); options: the filter's. All numbers come back bit for "
        "bit.");
  m.def("load_slam", &loc::load_slam, py::arg("path"),
        "DataError names the file when it is missing, cut, changed, or of another format.");
}

void bind_points(py::module_& m) {
  m.def(
      "write_ply",
      [](const fs::path& path, const FloatArray& position, const TimeArray& id, const FloatArray& sigma,
         const std::vector<std::string>& comments, bool ascii) {
        const Rows<3> places = rows_view<3>(position, "position");
        const auto ids = times_view(id, "id");
        const auto sigmas = values_view(sigma, "sigma");
        require_rows(static_cast<py::ssize_t>(ids.size()), "id", places.rows(), "position");
        require_rows(static_cast<py::ssize_t>(sigmas.size()), "sigma", places.rows(), "position");
        std::vector<loc::PlyPoint> points;
        for (Eigen::Index i = 0; i < places.rows(); ++i) {
          const auto k = static_cast<std::size_t>(i);
          points.push_back({.position = places.row(i).transpose(), .id = ids[k], .sigma = sigmas[k]});
        }
        return loc::write_ply(path, points, comments, ascii ? loc::PlyFormat::kAscii : loc::PlyFormat::kBinary);
      },
      py::arg("path"), py::arg("position"), py::arg("id"), py::arg("sigma"), py::kw_only(),
      py::arg("comments") = std::vector<std::string>{}, py::arg("ascii") = false,
      "Points (N, 3) [m] with identities int64 (N,) of 32 bit and deviations (N,) [m] for viewers. Points that are not "
      "finite are left out; returns how many.");
}

}  // namespace

void bind_slam_files(py::module_& m) {
  bind_settings(m);
  bind_saved(m);
  bind_points(m);
}

}  // namespace locpy
