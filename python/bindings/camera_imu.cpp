// calib/camera_imu and camera_imu_lint: camera and IMU from one recording of a target.
#include "libloc/calib/camera_imu.hpp"

#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "columns.hpp"
#include "fields.hpp"
#include "libloc/calib/camera_imu_lint.hpp"

namespace locpy {
namespace {

using loc::CameraImuCamera;
using loc::CameraImuCheck;
using loc::CameraImuFit;
using loc::CameraImuMatrixCheck;
using loc::CameraImuOptions;
using loc::CameraImuProgress;
using loc::CameraImuStart;
using loc::CameraImuView;
using loc::CameraRecording;

std::vector<loc::ImuMeasurement> imu_of(const TimeArray& times_ns, const FloatArray& angular_velocity,
                                        const FloatArray& specific_force) {
  const auto times = times_view(times_ns, "imu_times_ns");
  const auto n = static_cast<py::ssize_t>(times.size());
  const Rows<3> gyro = rows_view<3>(angular_velocity, "angular_velocity", n, "imu_times_ns");
  const Rows<3> accel = rows_view<3>(specific_force, "specific_force", n, "imu_times_ns");
  std::vector<loc::ImuMeasurement> imu(times.size());
  for (std::size_t i = 0; i < imu.size(); ++i) {
    imu[i].time_ns = times[i];
    imu[i].angular_velocity = gyro.row(static_cast<Eigen::Index>(i));
    imu[i].specific_force = accel.row(static_cast<Eigen::Index>(i));
  }
  return imu;
}

// An Eigen member as an array.
template <class Class, class T, class M>
void array_getter(Class& c, const char* name, M T::*member, const char* doc) {
  c.def_property_readonly(
      name,
      [member](const T& self) {
        if constexpr (M::ColsAtCompileTime == 1) {
          return to_array(self.*member);
        } else {
          return to_matrix_array(self.*member);
        }
      },
      doc);
}

// A list of times.
template <class Class>
void times_getter(Class& c, const char* name, std::vector<loc::TimeNs> CameraImuFit::*member, const char* doc) {
  c.def_property_readonly(
      name,
      [member](const CameraImuFit& self) { return column<loc::TimeNs>(self.*member, [](loc::TimeNs t) { return t; }); },
      doc);
}

void bind_recording_options(py::module_& m) {
  py::enum_<loc::RotationForm>(m, "RotationForm", "How the IMU's attitude is written as a spline.")
      .value("CUMULATIVE", loc::RotationForm::kCumulative)
      .value("THREE_ANGLES", loc::RotationForm::kThreeAngles);
  py::class_<CameraRecording>(m, "CameraRecording",
                              "What one camera of the rig has seen: CameraRecording(camera, views).")
      .def(py::init([](const loc::CameraCalibration& camera, std::vector<loc::TargetView> views) {
             return CameraRecording{camera, std::move(views)};
           }),
           py::arg("camera"), py::arg("views"))
      .def_readonly("camera", &CameraRecording::camera,
                    "CameraCalibration: intrinsics, with their deviations when it has them; its pose plays no part")
      .def_readonly("views", &CameraRecording::views, "[TargetView] with their times on the camera's clock");
  using O = CameraImuOptions;
  py::class_<O>(m, "CameraImuOptions", "Options of calibrate_camera_imu; every field is a keyword.")
      .def(py::init([](const py::kwargs& fields) { return with_fields<O>("CameraImuOptions", fields); }))
      .def_readwrite("order", &O::order, "of the pose's spline, 4 or 6 are usual")
      .def_readwrite("rotation", &O::rotation)
      .def_readwrite("knot_spacing_s", &O::knot_spacing_s, "0: from the IMU's spectrum")
      .def_readwrite("bias_spacing_s", &O::bias_spacing_s, "biases run straight between knots so far apart")
      .def_readwrite("corner_sigma_px", &O::corner_sigma_px, "of a coordinate")
      .def_readwrite("loss_sigmas", &O::loss_sigmas, "Cauchy's: a corner so far off counts half")
      .def_readwrite("gravity", &O::gravity, "[m/s^2]")
      .def_readwrite("adapt_noise", &O::adapt_noise,
                     "noise of both IMU sensors and of each picture from the residuals, then once more")
      .def_readwrite("time_offset_s", &O::time_offset_s, "known to half a second; None: all offsets are tried")
      .def_readwrite("refine_intrinsics", &O::refine_intrinsics)
      .def_readwrite("estimate_line_delay", &O::estimate_line_delay, "rolling shutter: time from one row to the next")
      .def_readwrite("estimate_drift", &O::estimate_drift, "the offset changes evenly over the recording")
      .def_readwrite("estimate_gravity", &O::estimate_gravity, "its size too")
      .def_readwrite("estimate_imu_matrices", &O::estimate_imu_matrices,
                     "scale and misalignment of gyroscope and accelerometer")
      .def_readwrite("check_line_delay", &O::check_line_delay, "where it is not estimated: would it be another than 0?")
      .def_readwrite("max_iterations", &O::max_iterations, "in all")
      .def_readwrite("time_limit_s", &O::time_limit_s, "of the start and the solution; 0: none")
      .def_readwrite("memory_limit_mb", &O::memory_limit_mb, "what needs more is refused")
      .def("check", &O::check);
}

void bind_camera_imu_parts(py::module_& m) {
  py::class_<CameraImuProgress>(m, "CameraImuProgress", "Where the solution stands.")
      .def_readonly("iteration", &CameraImuProgress::iteration)
      .def_readonly("cost", &CameraImuProgress::cost)
      .def_readonly("time_offset_s", &CameraImuProgress::time_offset_s, "of the first camera")
      .def_readonly("elapsed_s", &CameraImuProgress::elapsed_s);
  py::class_<CameraImuCheck>(m, "CameraImuCheck",
                             "A quantity, estimated, or (where it was held) one step from there with everything else "
                             "free. NaN: not looked at.")
      .def_readonly("value", &CameraImuCheck::value)
      .def_readonly("sigma", &CameraImuCheck::sigma)
      .def_readonly("estimated", &CameraImuCheck::estimated);
  py::class_<CameraImuMatrixCheck> matrix(m, "CameraImuMatrixCheck", "Likewise a matrix, entry by entry.");
  matrix.def_readonly("estimated", &CameraImuMatrixCheck::estimated);
  array_getter(matrix, "value", &CameraImuMatrixCheck::value, "(3, 3)");
  array_getter(matrix, "sigma", &CameraImuMatrixCheck::sigma, "(3, 3)");
  py::class_<CameraImuView>(m, "CameraImuView", "What became of a picture.")
      .def_readonly("used", &CameraImuView::used)
      .def_readonly("reason", &CameraImuView::reason, "why it was not used")
      .def_readonly("rms_px", &CameraImuView::rms_px, "of its corners' distances")
      .def_readonly("sigma_px", &CameraImuView::sigma_px, "that each coordinate of its corners was given");
  using S = CameraImuStart;
  py::class_<S> start(m, "CameraImuStart", "Start values of a camera, from the recording alone.");
  start.def_readonly("time_offset_s", &S::time_offset_s)
      .def_property_readonly("R_camera_imu_wxyz", [](const S& self) { return to_wxyz(self.R_camera_imu); })
      .def_readonly("correlation", &S::correlation, "of the turn rates, at the offset")
      .def_readonly("second_correlation", &S::second_correlation, "the best elsewhere")
      .def_readonly("rate_ratio", &S::rate_ratio, "size of the gyroscope's rates over that of the camera's")
      .def_property_readonly(
          "curve_offset_s",
          [](const S& self) { return column<double>(self.curve.offset_s, [](double x) { return x; }); },
          "(N,) all offsets that were tried")
      .def_property_readonly(
          "curve_correlation",
          [](const S& self) { return column<double>(self.curve.correlation, [](double x) { return x; }); },
          "(N,) correlation of the turn rates there");
  array_getter(start, "gyroscope_bias", &S::gyroscope_bias, "(3,) [rad/s]");
  array_getter(start, "excitation", &S::excitation, "(3,) deviations of the turn rate along its main axes [rad/s]");
}

void bind_mounted_camera(py::module_& m) {
  using C = CameraImuCamera;
  py::class_<C> c(m, "CameraImuCamera", "One camera in the result of calibrate_camera_imu.");
  c.def_readonly("T_camera_imu", &C::T_camera_imu)
      .def_readonly("time_offset_s", &C::time_offset_s,
                    "t_imu = t_camera + offset; with a drift, in the middle of the recording")
      .def_readonly("camera", &C::camera,
                    "as given, with pose, offset and mounting_quality; when refined with intrinsics and their quality")
      .def_readonly("line_delay_s", &C::line_delay_s, "from one row to the next")
      .def_readonly("offset_drift", &C::offset_drift, "[s/s]")
      .def_readonly("start", &C::start)
      .def_property_readonly(
          "views", [](const C& self) { return self.views; }, "one for each picture that was given")
      .def_readonly("corner_chi", &C::corner_chi,
                    "root of the mean square of the residuals over their deviation: 1 is right")
      .def_property_readonly(
          "corner_view",
          [](const C& self) {
            return column<std::int64_t>(self.corners, [](const auto& x) { return std::int64_t{x.view}; });
          },
          "(M,) index of the picture of each corner that was used")
      .def_property_readonly("corner_id",
                             [](const C& self) {
                               return column<std::int64_t>(self.corners,
                                                           [](const auto& x) { return std::int64_t{x.id}; });
                             })
      .def_property_readonly(
          "corner_pixel_px",
          [](const C& self) { return rows<2>(self.corners, [](const auto& x) { return x.pixel_px; }); })
      .def_property_readonly(
          "corner_residual_px",
          [](const C& self) { return rows<2>(self.corners, [](const auto& x) { return x.residual_px; }); },
          "(M, 2) found less projected")
      .def_property_readonly(
          "corner_weight",
          [](const C& self) { return column<double>(self.corners, [](const auto& x) { return x.weight; }); },
          "(M,) that the loss leaves it");
  array_getter(c, "covariance", &C::covariance,
               "(7, 7) of a small turn of the camera about the IMU's axes [rad] (R_camera_imu Exp(turn)), of the "
               "translation of T_camera_imu [m], of the offset [s]");
  array_getter(c, "sigma", &C::sigma, "(7,) deviations of covariance: of all that follow");
  array_getter(c, "sigma_by_noise", &C::sigma_by_noise, "(7,) from the noise as given or adapted");
  array_getter(c, "sigma_by_blocks", &C::sigma_by_blocks, "(7,) from how pieces of the recording pull");
  array_getter(c, "sigma_by_intrinsics", &C::sigma_by_intrinsics, "(7,) from the deviations of the intrinsics");
  array_getter(c, "intrinsics_sigma", &C::intrinsics_sigma,
               "(8,) that were taken for fx fy cx cy and the distortion; when refined: found");
  array_getter(c, "intrinsics_change", &C::intrinsics_change,
               "(8,) that the recording would make, or has made when refined");
  array_getter(c, "by_intrinsics", &C::by_intrinsics,
               "(7, 8) how the mounting moves with fx fy cx cy and the distortion that are held");
}

void bind_camera_imu_fit(py::module_& m) {
  using F = CameraImuFit;
  py::class_<F> f(m, "CameraImuFit", "Result of calibrate_camera_imu.");
  f.def_property_readonly(
       "cameras", [](const F& self) { return self.cameras; }, "[CameraImuCamera], one for each that was given")
      .def_readonly("gravity_direction_sigma", &F::gravity_direction_sigma, "[rad]")
      .def_readonly("gravity_size", &F::gravity_size, "CameraImuCheck [m/s^2]")
      .def_readonly("target_scale", &F::target_scale,
                    "CameraImuCheck: the target's true size over what it was said to be, by the accelerometer; never "
                    "estimated")
      .def_property_readonly(
          "biases", [](const F& self) { return to_matrix_array(self.biases.transpose()); },
          "(K, 6) gyroscope [rad/s], then accelerometer [m/s^2], straight between bias_time_ns")
      .def_property_readonly(
          "imu_residuals", [](const F& self) { return to_matrix_array(self.imu_residuals.transpose()); },
          "(N, 6) predicted less read at imu_time_ns, over their deviations: gyroscope, then accelerometer")
      .def_property_readonly(
          "target_imu_position",
          [](const F& self) { return rows<3>(self.T_target_imu, [](const auto& T) { return T.translation; }); },
          "(N, 3) of the IMU in target at imu_time_ns [m]")
      .def_property_readonly(
          "target_imu_q_wxyz",
          [](const F& self) {
            return rows<4>(self.T_target_imu, [](const auto& T) {
              return Eigen::Vector4d(T.rotation.w(), T.rotation.x(), T.rotation.y(), T.rotation.z());
            });
          },
          "(N, 4) attitude of the IMU in target at imu_time_ns")
      .def_readonly("knot_spacing_s", &F::knot_spacing_s)
      .def_readonly("bandwidth_hz", &F::bandwidth_hz, "below which the IMU's spectrum holds the motion")
      .def_readonly("knot_reason", &F::knot_reason, "why this spacing")
      .def_readonly("gyroscope_chi", &F::gyroscope_chi,
                    "root of the mean square of the residuals over their deviation: 1 is right")
      .def_readonly("accelerometer_chi", &F::accelerometer_chi)
      .def_readonly("gyroscope_noise_scale", &F::gyroscope_noise_scale, "on the noise that was given, when adapted")
      .def_readonly("accelerometer_noise_scale", &F::accelerometer_noise_scale)
      .def_property_readonly(
          "counts",
          [](const F& self) {
            py::dict out;
            for (const loc::NamedCount& count : self.counts) out[py::str(count.name)] = count.value;
            return out;
          },
          "{name: number} of samples used and skipped, and why")
      .def_readonly("cost", &F::cost)
      .def_readonly("iterations", &F::iterations)
      .def_readonly("converged", &F::converged)
      .def_readonly("stopped", &F::stopped, "why, when it has not converged: 'interrupted', 'time limit'")
      .def_readonly("start_cpu_s", &F::start_cpu_s)
      .def_readonly("solve_cpu_s", &F::solve_cpu_s)
      .def_readonly("quality", &F::quality);
  array_getter(f, "gravity_target", &F::gravity_target, "(3,) in target [m/s^2]");
  f.def_readonly("gyroscope_matrix", &F::gyroscope_matrix,
                 "CameraImuMatrixCheck: reading = matrix * what the sensor feels + bias");
  f.def_readonly("accelerometer_matrix", &F::accelerometer_matrix,
                 "CameraImuMatrixCheck, likewise; a lower triangle: body is the frame in which it is one");
  times_getter(f, "bias_time_ns", &F::bias_time_ns, "(K,)");
  times_getter(f, "imu_time_ns", &F::imu_time_ns, "(N,) of the samples that were used");
}

void bind_camera_imu_lint(py::module_& m) {
  using Finding = loc::CameraImuFinding;
  py::class_<Finding>(
      m, "CameraImuFinding",
      "What lint_camera_imu found. severity OK: to be known; FAIR: a better recording would help; WARN: "
      "the result is in doubt; REFUSED: the calibration would fail or be wrong.")
      .def_readonly("severity", &Finding::severity)
      .def_readonly("code", &Finding::code, "\"imu.gyroscope_unit\", \"camera.gaps\", ...: the same in all versions")
      .def_readonly("text", &Finding::text, "complete sentences with the figures")
      .def("__repr__", [](const Finding& self) {
        return std::string("CameraImuFinding(") + loc::verdict_name(self.severity) + ", " + self.code + ": " +
               self.text + ")";
      });
  m.def(
      "lint_camera_imu",
      [](const loc::CalibrationTarget& target, const std::vector<CameraRecording>& recordings,
         const TimeArray& imu_times_ns, const FloatArray& angular_velocity, const FloatArray& specific_force,
         const std::optional<loc::ImuNoise>& noise, double imu_rate_hz) {
        const auto imu = imu_of(imu_times_ns, angular_velocity, specific_force);
        const py::gil_scoped_release release;
        return loc::lint_camera_imu(target, recordings, imu, noise.value_or(loc::ImuNoise{}), imu_rate_hz);
      },
      py::arg("target"), py::arg("recordings"), py::arg("imu_times_ns"), py::arg("angular_velocity"),
      py::arg("specific_force"), py::arg("noise") = py::none(), py::arg("imu_rate_hz") = 0,
      "Looks at a recording before it is calibrated: units, rates, gaps, times, saturation, clocks, the target in the "
      "pictures, noise densities. recordings: [CameraRecording]; imu_times_ns (N,), angular_velocity (N, 3) [rad/s], "
      "specific_force (N, 3) [m/s^2] of the IMU; imu_rate_hz nominal, 0 when unknown. The worst finding comes first; "
      "none for a good recording.");
}

// Ctrl-C ends the solution, and the best so far is the result.
bool goes_on(const py::object& progress, const CameraImuProgress& at) {
  const py::gil_scoped_acquire gil;
  if (PyErr_CheckSignals() != 0) {
    if (!PyErr_ExceptionMatches(PyExc_KeyboardInterrupt)) throw py::error_already_set();
    PyErr_Clear();
    return false;
  }
  if (progress.is_none()) return true;
  try {
    const py::object answer = progress(at);
    return answer.is_none() || answer.cast<bool>();
  } catch (py::error_already_set& error) {
    if (!error.matches(PyExc_KeyboardInterrupt)) throw;
    return false;
  }
}

void bind_camera_imu_calibration(py::module_& m) {
  m.def(
      "calibrate_camera_imu",
      [](const loc::CalibrationTarget& target, const std::vector<CameraRecording>& recordings,
         const TimeArray& imu_times_ns, const FloatArray& angular_velocity, const FloatArray& specific_force,
         const std::optional<loc::ImuNoise>& noise, const std::optional<CameraImuOptions>& options,
         const py::object& progress) {
        const auto imu = imu_of(imu_times_ns, angular_velocity, specific_force);
        CameraImuOptions own = options.value_or(CameraImuOptions{});
        own.progress = [&progress](const CameraImuProgress& at) { return goes_on(progress, at); };
        const py::gil_scoped_release release;
        return loc::calibrate_camera_imu(target, recordings, imu, noise.value_or(loc::ImuNoise{}), own);
      },
      py::arg("target"), py::arg("recordings"), py::arg("imu_times_ns"), py::arg("angular_velocity"),
      py::arg("specific_force"), py::arg("noise") = py::none(), py::arg("options") = py::none(),
      py::arg("progress") = py::none(),
      "Where cameras sit on an IMU, and by how much their clocks differ, from a target that was waved in front of the "
      "rig (or the rig before the target). recordings: [CameraRecording], one for each camera; imu_times_ns (N,), "
      "angular_velocity (N, 3) [rad/s], specific_force (N, 3) [m/s^2] of the IMU, calibrated; noise: ImuNoise; "
      "progress: called with CameraImuProgress after each iteration, False stops. Ctrl-C stops too: the best so far "
      "is the result, with stopped = 'interrupted'. DataError for what cannot be calibrated, with the reason.");
}

}  // namespace

void bind_camera_imu(py::module_& m) {
  bind_recording_options(m);
  bind_camera_imu_parts(m);
  bind_mounted_camera(m);
  bind_camera_imu_fit(m);
  bind_camera_imu_calibration(m);
  bind_camera_imu_lint(m);
}

}  // namespace locpy
