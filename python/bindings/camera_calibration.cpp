// Calibration targets and intrinsic calibration of cameras (sensors/target, io/target_yaml, calib/camera_intrinsics).
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "columns.hpp"
#include "fields.hpp"
#include "libloc/calib/camera_intrinsics.hpp"
#include "libloc/io/target_yaml.hpp"

namespace locpy {
namespace {

using loc::CalibrationTarget;
using loc::CameraFit;
using loc::CameraFitCorner;
using loc::CameraFitOptions;
using loc::CameraFitView;
using loc::TargetView;

void bind_target(py::module_& m) {
  py::class_<CalibrationTarget>(
      m, "CalibrationTarget",
      "A flat target: CalibrationTarget('checkerboard 9x6 0.025') with inner corners and the side of a square [m], or "
      "CalibrationTarget('aprilgrid 6x6 0.088 0.3') as Kalibr has it, with the side of a tag [m] and the spacing as a "
      "share of it. Origin at corner 0, x right, y up, z towards who looks at it.")
      .def(py::init(&loc::parse_target), py::arg("text"))
      .def_static("read_kalibr", &loc::read_kalibr_target, py::arg("path"), "From Kalibr's target.yaml.")
      .def(
          "write_kalibr",
          [](const CalibrationTarget& self, const std::filesystem::path& path) {
            loc::write_kalibr_target(path, self);
          },
          py::arg("path"))
      .def_property_readonly("is_april_grid",
                             [](const CalibrationTarget& self) { return self.kind == loc::TargetKind::kAprilGrid; })
      .def_readonly("columns", &CalibrationTarget::columns, "inner corners or tags along x")
      .def_readonly("rows", &CalibrationTarget::rows)
      .def_readonly("size_m", &CalibrationTarget::size_m, "side of a square or tag")
      .def_readonly("spacing", &CalibrationTarget::spacing)
      .def_readonly("first_tag", &CalibrationTarget::first_tag)
      .def_property_readonly("has_direction", &CalibrationTarget::has_direction,
                             "False for a checkerboard that looks the same after half a turn.")
      .def(
          "corners",
          [](const CalibrationTarget& self) {
            std::vector<int> ids(static_cast<std::size_t>(self.corner_count()));
            for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<int>(i);
            return rows<3>(ids, [&](int id) { return self.corner(id); });
          },
          "(N, 3): places of all corners [m]; the row is the corner's id.")
      .def("__str__", &loc::target_text)
      .def("__repr__",
           [](const CalibrationTarget& self) { return "CalibrationTarget('" + loc::target_text(self) + "')"; });

  py::class_<TargetView>(m, "TargetView", "The corners of the target in one picture: TargetView(ids, pixels_px).")
      .def(py::init([](const TimeArray& ids, const FloatArray& pixels, std::optional<loc::TimeNs> time_ns) {
             const auto id = times_view(ids, "ids");
             const Rows<2> pixel = rows_view<2>(pixels, "pixels_px", static_cast<py::ssize_t>(id.size()), "ids");
             TargetView view;
             view.time_ns = time_ns.value_or(loc::kNoTime);
             for (std::size_t i = 0; i < id.size(); ++i) {
               if (id[i] < 0 || id[i] > std::numeric_limits<std::int32_t>::max()) {
                 throw py::value_error("ids: " + std::to_string(id[i]) + " is no corner");
               }
               view.corners.push_back(
                   {static_cast<std::int32_t>(id[i]), pixel.row(static_cast<Eigen::Index>(i)).transpose()});
             }
             return view;
           }),
           py::arg("ids"), py::arg("pixels_px"), py::arg("time_ns") = py::none())
      .def_property_readonly("time_ns", [](const TargetView& self) { return optional_time(self.time_ns); })
      .def_property_readonly("ids",
                             [](const TargetView& self) {
                               return column<std::int64_t>(self.corners,
                                                           [](const auto& c) { return std::int64_t{c.id}; });
                             })
      .def_property_readonly(
          "pixels_px",
          [](const TargetView& self) { return rows<2>(self.corners, [](const auto& c) { return c.pixel_px; }); },
          "(N, 2); (0, 0) is the centre of the top-left pixel")
      .def("__len__", [](const TargetView& self) { return self.corners.size(); });
}

void bind_fit(py::module_& m) {
  py::class_<CameraFitOptions>(m, "CameraFitOptions", "Options of calibrate_camera; every field is a keyword.")
      .def(py::init([](const py::kwargs& fields) { return with_fields<CameraFitOptions>("CameraFitOptions", fields); }))
      .def_readwrite("model", &CameraFitOptions::model)
      .def_readwrite("min_corners", &CameraFitOptions::min_corners, "pictures with fewer are not used")
      .def_readwrite("corner_limit", &CameraFitOptions::corner_limit, "corners farther off are dropped [sigmas]")
      .def_readwrite("view_limit", &CameraFitOptions::view_limit, "pictures with a larger rms are dropped [medians]")
      .def_readwrite("max_iterations", &CameraFitOptions::max_iterations)
      .def_readwrite("compare_models", &CameraFitOptions::compare_models, "also fits the other distortion model")
      .def("check", &CameraFitOptions::check);
  py::class_<CameraFitView>(m, "CameraFitView", "One picture in the result of calibrate_camera.")
      .def_readonly("used", &CameraFitView::used)
      .def_readonly("reason", &CameraFitView::reason, "why it is not used; empty when it is")
      .def_readonly("T_camera_target", &CameraFitView::T_camera_target)
      .def_readonly("corners", &CameraFitView::corners)
      .def_readonly("corners_dropped", &CameraFitView::corners_dropped)
      .def_readonly("rms_px", &CameraFitView::rms_px, "NaN: there is no pose")
      .def_readonly("worst_px", &CameraFitView::worst_px)
      .def_readonly("tilt", &CameraFitView::tilt, "[rad] 0: seen from straight ahead");
  using F = CameraFit;
  py::class_<F>(m, "CameraFit", "Result of calibrate_camera.")
      .def_readonly("camera", &F::camera)
      .def_property_readonly(
          "covariance", [](const F& self) { return to_matrix_array(self.covariance); },
          "(8, 8) of fx fy cx cy and the distortion, from the size of the residuals")
      .def_property_readonly(
          "sigma_by_views", [](const F& self) { return to_array(self.sigma_by_views); },
          "(8,) deviations from how differently the pictures pull; NaN for fewer than 16 pictures")
      .def_property_readonly(
          "sigma", [](const F& self) { return to_array(self.sigma()); }, "(8,) the larger of both")
      .def_readonly("noise_px", &F::noise_px, "deviation of one coordinate of a corner")
      .def_readonly("rms_px", &F::rms_px, "of the distances of all corners that were used")
      .def_property_readonly(
          "views", [](const F& self) { return self.views; }, "one for each picture that was given")
      .def_readonly("views_used", &F::views_used)
      .def_readonly("corners_used", &F::corners_used)
      .def_readonly("corners_dropped", &F::corners_dropped)
      .def_readonly("covered_share", &F::covered_share, "of 12 x 9 cells of the image, those with a corner")
      .def_readonly("radius_share", &F::radius_share, "farthest corner from the middle, of half the diagonal")
      .def_readonly("tilt_range", &F::tilt_range, "largest angle between two of the target's normals [rad]")
      .def_property_readonly(
          "uncertainty_px",
          [](const F& self) {
            const auto& u = self.uncertainty;
            py::array_t<double> out({py::ssize_t{u.rows}, py::ssize_t{u.columns}});
            std::ranges::copy(u.sigma_px, out.mutable_data());
            return out;
          },
          "(9, 12) deviation of the pixel of a given ray across the image; NaN: no ray there")
      .def_property_readonly("worst_uncertainty_px", [](const F& self) { return self.uncertainty.worst_px; })
      .def_property_readonly("median_uncertainty_px", [](const F& self) { return self.uncertainty.median_px; })
      .def_readonly("other_model_rms_px", &F::other_model_rms_px, "NaN: not compared")
      .def_readonly("quality", &F::quality)
      .def_readonly("iterations", &F::iterations)
      .def_readonly("converged", &F::converged)
      .def_property_readonly(
          "corner_view",
          [](const F& self) {
            return column<std::int64_t>(self.corners, [](const CameraFitCorner& c) { return std::int64_t{c.view}; });
          },
          "(M,) index of the picture of each corner that has a residual")
      .def_property_readonly("corner_id",
                             [](const F& self) {
                               return column<std::int64_t>(self.corners,
                                                           [](const CameraFitCorner& c) { return std::int64_t{c.id}; });
                             })
      .def_property_readonly(
          "corner_used", [](const F& self) { return column<bool>(self.corners, [](const auto& c) { return c.used; }); })
      .def_property_readonly(
          "corner_pixel_px",
          [](const F& self) { return rows<2>(self.corners, [](const auto& c) { return c.pixel_px; }); })
      .def_property_readonly(
          "corner_residual_px",
          [](const F& self) { return rows<2>(self.corners, [](const auto& c) { return c.residual_px; }); },
          "(M, 2) found less projected");
  m.def(
      "calibrate_camera",
      [](const CalibrationTarget& target, const std::vector<TargetView>& views, int width, int height,
         const std::optional<CameraFitOptions>& options) {
        const py::gil_scoped_release release;
        return loc::calibrate_camera(target, views, width, height, options.value_or(CameraFitOptions{}));
      },
      py::arg("target"), py::arg("views"), py::arg("width_px"), py::arg("height_px"), py::arg("options") = py::none(),
      "Intrinsics and distortion of a camera from the target's corners in several pictures. DataError when there is "
      "nothing to be solved.");
  m.def(
      "choose_views",
      [](const CalibrationTarget& target, const std::vector<TargetView>& views, int width, int height,
         std::size_t count) { return loc::choose_views(target, views, width, height, count); },
      py::arg("target"), py::arg("views"), py::arg("width_px"), py::arg("height_px"), py::arg("count"),
      "Indices of at most so many views, as different as can be.");
}

}  // namespace

void bind_camera_calibration(py::module_& m) {
  bind_target(m);
  bind_fit(m);
}

}  // namespace locpy
