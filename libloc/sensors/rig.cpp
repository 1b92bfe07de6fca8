#include "libloc/sensors/rig.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

// A difference larger than this is a matter of the clock model, not of a sensor's latency.
constexpr double kLargestGpsOffset = 86'400;  // [s]
// No oscillator is that wrong: a unit was mistaken.
constexpr double kLargestSkew = 10'000;  // [ppm]
// A picture of 480 rows would take five seconds: a unit was mistaken.
constexpr double kLargestLineDelay = 0.01;  // [s]

// One line of print: it becomes a line of a log.
void require_line(const std::string& name, const std::string& text) {
  require(!text.empty(), name + ": must not be empty");
  const bool print = std::ranges::none_of(text, [](char c) { return static_cast<unsigned char>(c) < ' '; });
  require(print, name + ": must be one line without control characters");
}

void require_known_or_not_negative(const std::string& name, double value) {
  require(std::isnan(value) || (std::isfinite(value) && value >= 0), name, value, "must not be negative, and finite");
}

// Known or unknown as a whole: half of a matrix says nothing.
template <class Matrix>
void require_whole(const std::string& name, const Matrix& sigma) {
  const bool fine = sigma.array().isNaN().all() || (sigma.allFinite() && (sigma.array() >= 0).all());
  require(fine, name + ": must not be negative, and finite (or all NaN: unknown)");
}

template <class Quality>
void check_origin(const std::string& name, const Quality& quality) {
  require_line(name + ".method", quality.method);
  for (const std::string& reason : quality.reasons) require_line(name + ".reasons", reason);
}

}  // namespace

void TriadQuality::check(const std::string& name) const {
  check_origin(name, *this);
  require(samples >= 0, name + ".samples", static_cast<double>(samples), "must not be negative");
  require_whole(name + ".bias_sigma", bias_sigma);
  require_whole(name + ".matrix_sigma", matrix_sigma);
  require_known_or_not_negative(name + ".residual_rms", residual_rms);
}

void IntrinsicsQuality::check(const std::string& name) const {
  check_origin(name, *this);
  require(pictures >= 0, name + ".pictures", static_cast<double>(pictures), "must not be negative");
  require_whole(name + ".intrinsics_sigma", intrinsics_sigma_px);
  require_whole(name + ".distortion_sigma", distortion_sigma);
  require_known_or_not_negative(name + ".reprojection_rms_px", reprojection_rms_px);
}

void MountingQuality::set_deviations(const Pose3& T_body_camera, const Eigen::Matrix<double, 7, 7>& covariance) {
  require(covariance.allFinite() && covariance.diagonal().minCoeff() >= 0,
          "covariance: must be finite, with variances that are not negative");
  // With R_bc, t_bc of T_body_camera, a turn e, and a shift d of T_camera_body's translation:
  // t_bc becomes Exp(-e) (t_bc - R_bc d) = t_bc + [t_bc]x e - R_bc d, R_bc becomes Exp(-e) R_bc.
  Eigen::Matrix<double, 3, 6> J;
  J << so3::hat(T_body_camera.translation), -T_body_camera.rotation.toRotationMatrix();
  const Eigen::Matrix3d of_translation = J * covariance.topLeftCorner<6, 6>() * J.transpose();
  require(of_translation.diagonal().minCoeff() >= 0, "covariance: must be positive semidefinite");
  rotation_sigma = covariance.diagonal().head<3>().cwiseSqrt();
  translation_sigma = of_translation.diagonal().cwiseSqrt();
  time_offset_sigma_s = std::sqrt(covariance(6, 6));
}

void MountingQuality::check(const std::string& name) const {
  check_origin(name, *this);
  require(pictures >= 0, name + ".pictures", static_cast<double>(pictures), "must not be negative");
  require_whole(name + ".rotation_sigma", rotation_sigma);
  require_whole(name + ".translation_sigma", translation_sigma);
  require_known_or_not_negative(name + ".time_offset_sigma_s", time_offset_sigma_s);
  require(std::isnan(line_delay_s) || std::abs(line_delay_s) <= kLargestLineDelay, name + ".line_delay_s", line_delay_s,
          "must be within +-0.01");
  require_known_or_not_negative(name + ".line_delay_sigma_s", line_delay_sigma_s);
}

void TriadCalibration::check(const std::string& name) const {
  require(bias.allFinite(), name + ".bias: must be finite");
  require(matrix.allFinite(), name + ".matrix: must be finite");
  // Relative to the size of the entries: a magnetometer calibration may carry a unit.
  const double scale = matrix.cwiseAbs().maxCoeff();
  require(scale > 0 && std::abs((matrix / scale).determinant()) > 1e-9, name + ".matrix: must not be singular");
  if (quality) quality->check(name + ".quality");
}

void CameraCalibration::check() const {
  const std::string who = name.empty() ? "camera" : name;
  require(width_px > 0 && height_px > 0, who + ".resolution: must be positive");
  require(intrinsics_px.allFinite() && intrinsics_px.head<2>().minCoeff() > 0,
          who + ".intrinsics: must be finite, with positive focal lengths");
  require(distortion.allFinite(), who + ".distortion_coeffs: must be finite");
  require(T_body_camera.translation.allFinite(), who + ".T_cam_imu: must be finite");
  // The comparison is false for NaN.
  const double norm = T_body_camera.rotation.norm();
  require(std::abs(norm - 1) < 1e-6, who + ".T_cam_imu: norm of its rotation", norm, "must be 1");
  require_finite(who + ".timeshift_cam_imu", time_offset_s);
  require_not_negative(who + ".rate_hz", rate_hz);
  if (intrinsics_quality) intrinsics_quality->check(who + ".intrinsics_quality");
  if (mounting_quality) mounting_quality->check(who + ".mounting_quality");
}

void ClockCalibration::check() const {
  require_line("clocks.stream", stream);
  require_line("clocks.reference", reference);
  const std::string name = "clocks." + stream + ".";
  require(std::abs(skew_ppm) <= kLargestSkew, name + "skew_ppm", skew_ppm, "must be within +-10000");
  require_known_or_not_negative(name + "skew_sigma_ppm", skew_sigma_ppm);
  require_known_or_not_negative(name + "offset_sigma_s", offset_sigma_s);
  require_known_or_not_negative(name + "jitter_rms_s", jitter_rms_s);
  require_known_or_not_negative(name + "jitter_p99_s", jitter_p99_s);
}

void Rig::check() const {
  if (imu) {
    require_not_negative("imu.rate_hz", imu->rate_hz);
    imu->noise.check();
    for (const std::string& field : imu->noise_measured) {
      const bool known = std::ranges::find(kImuNoiseFields, field) != kImuNoiseFields.end();
      require(known, "imu.noise_measured: '" + field + "' is not a field of the noise");
      require(std::ranges::count(imu->noise_measured, field) == 1, "imu.noise_measured: '" + field + "' comes twice");
    }
    imu->gyroscope.check("imu.gyroscope");
    imu->accelerometer.check("imu.accelerometer");
  }
  if (magnetometer) magnetometer->triad.check("magnetometer");
  for (const CameraCalibration& camera : cameras) camera.check();
  if (gps) {
    require(gps->antenna_in_body.allFinite(), "gps.antenna_in_body: must be finite");
    require(std::abs(gps->time_offset_s) <= kLargestGpsOffset, "gps.time_offset_s", gps->time_offset_s,
            "must be within a day, and finite");
    require_known_or_not_negative("gps.time_offset_sigma_s", gps->time_offset_sigma_s);
  }
  std::set<std::pair<std::string, std::string>> compared;
  for (const ClockCalibration& clock : clocks) {
    clock.check();
    require(compared.emplace(clock.stream, clock.reference).second,
            "clocks: stream '" + clock.stream + "' against '" + clock.reference + "' comes twice");
  }
}

Measurement calibrated(const Rig& rig, Measurement measurement) {
  if (auto* imu = std::get_if<ImuMeasurement>(&measurement); imu != nullptr && rig.imu) {
    imu->angular_velocity = rig.imu->gyroscope.apply(imu->angular_velocity);
    imu->specific_force = rig.imu->accelerometer.apply(imu->specific_force);
  } else if (auto* field = std::get_if<MagnetometerMeasurement>(&measurement); field != nullptr && rig.magnetometer) {
    field->magnetic_field = rig.magnetometer->triad.apply(field->magnetic_field);
  } else if (auto* fix = std::get_if<GpsMeasurement>(&measurement); fix != nullptr && rig.gps) {
    // An absurd time that a broken sender can make stays as it is: the merger finds it.
    TimeNs moved = 0;
    const bool possible = !__builtin_add_overflow(fix->time_ns, from_seconds(rig.gps->time_offset_s), &moved);
    if (fix->time_ns != kNoTime && possible) fix->time_ns = moved;
  }
  return measurement;
}

std::vector<RigDoubt> doubts(const Rig& rig) {
  std::vector<RigDoubt> out;
  const auto look = [&](const std::string& block, const auto& quality) {
    if (!quality || quality->verdict < Verdict::kWarn) return;
    std::string text = quality->verdict == Verdict::kRefused
                           ? "the calibration was refused and written all the same (forced)"
                           : "the calibration came with a warning";
    for (const std::string& reason : quality->reasons) text += "; " + reason;
    out.push_back({block, quality->verdict, text});
  };
  if (rig.imu) {
    look("imu.gyroscope", rig.imu->gyroscope.quality);
    look("imu.accelerometer", rig.imu->accelerometer.quality);
  }
  if (rig.magnetometer) look("magnetometer", rig.magnetometer->triad.quality);
  for (const CameraCalibration& camera : rig.cameras) {
    look(camera.name + ".intrinsics", camera.intrinsics_quality);
    look(camera.name + ".mounting", camera.mounting_quality);
  }
  return out;
}

}  // namespace loc
