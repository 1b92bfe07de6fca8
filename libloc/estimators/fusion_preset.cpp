#include "libloc/estimators/fusion_preset.hpp"

#include <cmath>
#include <numbers>
#include <string>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

double squared(double a) {
  return a * a;
}

Eigen::Matrix3d isotropic(double variance) {
  return variance * Eigen::Matrix3d::Identity();
}

// What steps of this length add as sigma^2 dt^2 is a white density of sigma sqrt(dt).
ImuNoise densities(const FusionPresetSensors& s) {
  const double dt = 1 / s.imu_rate_hz;
  ImuNoise noise;
  const auto density = [&](double one_sided, double resolution) {
    return std::sqrt((squared(one_sided) * s.imu_rate_hz / 2 + squared(resolution) / 12) * dt);
  };
  noise.gyroscope_noise_density = density(s.gyroscope_noise_density, s.gyroscope_resolution);
  noise.accelerometer_noise_density = density(s.accelerometer_noise_density, s.accelerometer_resolution);
  noise.gyroscope_random_walk = 1e-5;
  noise.accelerometer_random_walk = 1e-4;
  return noise;
}

Eigen::VectorXd start_variances() {
  constexpr double kDegree = std::numbers::pi / 180;
  Eigen::VectorXd variances(kInertialDim + 1);
  variances << Eigen::Vector3d::Constant(squared(kDegree)), Eigen::Vector3d::Constant(squared(0.1)),
      Eigen::Vector3d::Constant(squared(0.1)), Eigen::Vector3d::Constant(squared(5 * kDegree)),
      Eigen::Vector3d::Constant(squared(0.1)), squared(1.5);
  return variances;
}

ErrorStateOptions common(const FusionPresetSensors& s) {
  s.check();
  ErrorStateOptions options;
  options.noise = densities(s);
  options.gravity = {0, 0, -9.81};
  options.estimate_scale = true;
  options.scale_random_walk = 0;
  return options;
}

double drift_step_sigma(const FusionPresetSensors& s) {
  const double tau = s.odometry_drift_tau;
  return std::sqrt(2 / tau + 1 / squared(tau)) * s.odometry_drift_sigma;
}

}  // namespace

void FusionPresetSensors::check() const {
  require_positive("imu_rate_hz", imu_rate_hz);
  require_positive("gyroscope_noise_density", gyroscope_noise_density);
  require_not_negative("gyroscope_resolution", gyroscope_resolution);
  require_positive("accelerometer_noise_density", accelerometer_noise_density);
  require_not_negative("accelerometer_resolution", accelerometer_resolution);
  require_positive("odometry_rate_hz", odometry_rate_hz);
  require_positive("odometry_white_sigma", odometry_white_sigma);
  require_positive("odometry_drift_sigma", odometry_drift_sigma);
  require(std::isfinite(odometry_drift_tau) && odometry_drift_tau > 1, "odometry_drift_tau", odometry_drift_tau,
          "must be greater than 1");
  require_positive("odometry_orientation_sigma", odometry_orientation_sigma);
}

FusionPreset FusionPreset::as_published(const FusionPresetSensors& sensors) {
  FusionPreset preset;
  ErrorStateOptions& o = preset.options;
  o = common(sensors);
  const double dt = 1 / sensors.imu_rate_hz;
  o.integration = ImuIntegration::kEuler;
  o.noise.gyroscope_noise_density = std::sqrt(1e-6 * dt);
  o.noise.accelerometer_noise_density = std::sqrt(1e-4 * dt);
  o.noise.gyroscope_random_walk = std::sqrt(1e-9);
  o.noise.accelerometer_random_walk = std::sqrt(1e-4);
  o.gate = false;
  o.reset_jacobian = false;
  // The published start sets blocks of a matrix of ones: errors of the start are taken as fully correlated.
  preset.start_cov = Eigen::MatrixXd::Ones(kInertialDim + 1, kInertialDim + 1);
  preset.start_cov.block<3, 3>(kGyroscopeBias, kGyroscopeBias).setConstant(1e6);
  preset.start_cov(kInertialDim, kInertialDim) = 2e2;
  preset.odometry_position_cov = isotropic(0.1);
  preset.odometry_orientation_cov = isotropic(0.1);
  return preset;
}

FusionPreset FusionPreset::inflated(const FusionPresetSensors& sensors) {
  FusionPreset preset;
  preset.options = common(sensors);
  preset.start_cov = start_variances().asDiagonal();
  const double phi = 1 - 1 / sensors.odometry_drift_tau;
  preset.odometry_position_cov =
      isotropic(squared(sensors.odometry_white_sigma) + squared(sensors.odometry_drift_sigma) * (1 + phi) / (1 - phi));
  preset.odometry_orientation_cov = isotropic(squared(sensors.odometry_orientation_sigma));
  return preset;
}

FusionPreset FusionPreset::drift(const FusionPresetSensors& sensors) {
  FusionPreset preset = inflated(sensors);
  ErrorStateOptions& o = preset.options;
  const double phi = 1 - 1 / sensors.odometry_drift_tau;
  o.estimate_drift = true;
  o.drift_time_constant_s = -1 / (sensors.odometry_rate_hz * std::log(phi));
  o.drift_sigma = drift_step_sigma(sensors) / std::sqrt(1 - squared(phi));
  Eigen::VectorXd variances(kInertialDim + 4);
  variances << start_variances(), Eigen::Vector3d::Constant(squared(drift_step_sigma(sensors)));
  preset.start_cov = variances.asDiagonal();
  preset.odometry_position_cov = isotropic(squared(sensors.odometry_white_sigma));
  return preset;
}

FusionPreset FusionPreset::by_name(std::string_view name, const FusionPresetSensors& sensors) {
  if (name == "as_published") return as_published(sensors);
  if (name == "16") return inflated(sensors);
  if (name == "19") return drift(sensors);
  throw std::invalid_argument("preset '" + std::string(name) + "' is not as_published, 16 or 19");
}

}  // namespace loc
