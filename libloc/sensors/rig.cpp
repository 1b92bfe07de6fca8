#include "libloc/sensors/rig.hpp"

#include <Eigen/LU>
#include <cmath>

#include "libloc/core/check.hpp"

namespace loc {

void TriadCalibration::check(const std::string& name) const {
  require(bias.allFinite(), name + ".bias: must be finite");
  require(matrix.allFinite(), name + ".matrix: must be finite");
  // Relative to the size of the entries: a magnetometer calibration may carry a unit.
  const double scale = matrix.cwiseAbs().maxCoeff();
  require(scale > 0 && std::abs((matrix / scale).determinant()) > 1e-9, name + ".matrix: must not be singular");
}

void Rig::check() const {
  if (imu) {
    require_not_negative("imu.rate_hz", imu->rate_hz);
    imu->noise.check();
    imu->gyroscope.check("imu.gyroscope");
    imu->accelerometer.check("imu.accelerometer");
  }
  if (magnetometer) magnetometer->triad.check("magnetometer");
  for (const CameraCalibration& camera : cameras) {
    require(camera.width_px > 0 && camera.height_px > 0, camera.name + ".resolution: must be positive");
    require(camera.intrinsics_px.allFinite() && camera.intrinsics_px.head<2>().minCoeff() > 0,
            camera.name + ".intrinsics: must be finite, with positive focal lengths");
    require(camera.distortion.allFinite(), camera.name + ".distortion_coeffs: must be finite");
    require(camera.T_body_camera.translation.allFinite(), camera.name + ".T_cam_imu: must be finite");
    // The comparison is false for NaN.
    const double norm = camera.T_body_camera.rotation.norm();
    require(std::abs(norm - 1) < 1e-6, camera.name + ".T_cam_imu: norm of its rotation", norm, "must be 1");
    require_finite(camera.name + ".timeshift_cam_imu", camera.time_offset_s);
    require_not_negative(camera.name + ".rate_hz", camera.rate_hz);
  }
  if (gps) require(gps->antenna_in_body.allFinite(), "gps.antenna_in_body: must be finite");
}

Measurement calibrated(const Rig& rig, Measurement measurement) {
  if (auto* imu = std::get_if<ImuMeasurement>(&measurement); imu != nullptr && rig.imu) {
    imu->angular_velocity = rig.imu->gyroscope.apply(imu->angular_velocity);
    imu->specific_force = rig.imu->accelerometer.apply(imu->specific_force);
  } else if (auto* field = std::get_if<MagnetometerMeasurement>(&measurement); field != nullptr && rig.magnetometer) {
    field->magnetic_field = rig.magnetometer->triad.apply(field->magnetic_field);
  }
  return measurement;
}

}  // namespace loc
