// Noise of an IMU as continuous densities; one function turns them into deviations of discrete samples.
// Source: IEEE Std 952 for the terms; Crassidis, "Sigma-point Kalman filtering for integrated GPS and inertial
// navigation", 2006, for the discretisation.
#pragma once

#include <array>
#include <string_view>

namespace loc {

struct ImuNoise {
  double gyroscope_noise_density = 1.7e-4;    ///< [rad/s/sqrt(Hz)], white
  double gyroscope_random_walk = 2e-5;        ///< [rad/s^2/sqrt(Hz)], of the bias
  double accelerometer_noise_density = 2e-3;  ///< [m/s^2/sqrt(Hz)], white
  double accelerometer_random_walk = 3e-3;    ///< [m/s^3/sqrt(Hz)], of the bias
  double gyroscope_bias_sigma = 1e-2;         ///< [rad/s], turn-on
  double accelerometer_bias_sigma = 2e-1;     ///< [m/s^2], turn-on

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// Names of ImuNoise's fields, in their order: as files write them.
inline constexpr std::array<std::string_view, 6> kImuNoiseFields = {
    "gyroscope_noise_density",   "gyroscope_random_walk", "accelerometer_noise_density",
    "accelerometer_random_walk", "gyroscope_bias_sigma",  "accelerometer_bias_sigma"};

/// Deviations of samples dt apart.
struct DiscreteImuNoise {
  double sigma_angular_velocity;         ///< [rad/s], of a sample
  double sigma_specific_force;           ///< [m/s^2], of a sample
  double sigma_gyroscope_bias_step;      ///< [rad/s], by which the bias walks in dt
  double sigma_accelerometer_bias_step;  ///< [m/s^2]
};

/// @param dt_s time between samples [s] @throws std::invalid_argument unless positive.
DiscreteImuNoise discretise(const ImuNoise& noise, double dt_s);

}  // namespace loc
