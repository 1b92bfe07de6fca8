// calib/camera_imu_lint: what is wrong with a recording for camera-IMU calibration.
#include "libloc/calib/camera_imu_lint.hpp"

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"

namespace locpy {

void bind_camera_imu_lint(py::module_& m) {
  using Finding = loc::CameraImuFinding;
  using Camera = std::pair<loc::CameraCalibration, std::vector<loc::TargetView>>;
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
      [](const loc::CalibrationTarget& target, const std::vector<Camera>& cameras, const TimeArray& times_ns,
         const FloatArray& angular_velocity, const FloatArray& specific_force, const loc::ImuNoise& noise,
         double imu_rate_hz) {
        const auto times = times_view(times_ns, "times_ns");
        const auto n = static_cast<py::ssize_t>(times.size());
        const Rows<3> gyro = rows_view<3>(angular_velocity, "angular_velocity", n, "times_ns");
        const Rows<3> accel = rows_view<3>(specific_force, "specific_force", n, "times_ns");
        std::vector<loc::ImuMeasurement> imu(times.size());
        for (std::size_t i = 0; i < imu.size(); ++i) {
          imu[i].time_ns = times[i];
          imu[i].angular_velocity = gyro.row(static_cast<Eigen::Index>(i));
          imu[i].specific_force = accel.row(static_cast<Eigen::Index>(i));
        }
        std::vector<loc::CameraRecording> recordings;
        for (const Camera& camera : cameras) recordings.push_back({camera.first, camera.second});
        const py::gil_scoped_release release;
        return loc::lint_camera_imu(target, recordings, imu, noise, imu_rate_hz);
      },
      py::arg("target"), py::arg("cameras"), py::arg("times_ns"), py::arg("angular_velocity"),
      py::arg("specific_force"), py::arg("noise"), py::arg("imu_rate_hz") = 0,
      "Looks at a recording before it is calibrated: units, rates, gaps, times, saturation, clocks, the target in the "
      "pictures, noise densities. cameras: (CameraCalibration, its TargetViews with their times) for each; times_ns "
      "(N,), angular_velocity (N, 3) [rad/s], specific_force (N, 3) [m/s^2] of the IMU; imu_rate_hz nominal, 0 when "
      "unknown. The worst finding comes first; none for a good recording.");
}

}  // namespace locpy
