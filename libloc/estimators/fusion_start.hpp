// Start of an inertial filter from its first second: the tilt from the mean specific force, the gyroscope's bias from
// the mean rate when it is at rest, the heading from a magnetometer or as given. Deviations are wide and honest: at
// rest the tilt is as good as the accelerometer's bias lets it be; in motion an acceleration may hide in the mean
// force.
//
// Not observable: the heading without a magnetometer (the state's is 0 then, and the result says that it means
// nothing), position, and velocity unless at rest.
// Frames: world has z up, x east (ENU) once the heading is known.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "libloc/estimators/stand_still.hpp"
#include "libloc/filter/imu_propagation.hpp"
#include "libloc/sensors/imu_noise.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

struct FusionStartOptions {
  double duration_s = 1;                 ///< so much of the data is looked at [s]
  double max_gap_s = 0.1;                ///< a longer step begins anew [s]
  double moving_acceleration_sigma = 2;  ///< of the mean over duration_s, when not at rest [m/s^2]
  double moving_velocity_sigma = 20;     ///< [m/s]
  double still_velocity_sigma = 0.1;     ///< [m/s]
  double tilt_sigma_floor = 0.005;       ///< [rad]
  double still_bias_sigma_floor = 2e-4;  ///< of the gyroscope's bias from a rest: earth rate, swaying [rad/s]
  double position_sigma = 1e-3;          ///< the start is the origin [m]

  std::optional<double> heading;        ///< of the body as so3::heading, from east to north [rad]
  double heading_sigma = 0.05;          ///< of the one that is given [rad]
  double magnetic_declination = 0;      ///< east of north positive [rad]
  double magnetic_heading_sigma = 0.2;  ///< iron nearby, declination not known [rad]

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

enum class HeadingSource : std::uint8_t { kNone, kGiven, kMagnetometer };

struct FusionStartEstimate {
  TimeNs time_ns = kNoTime;                                      ///< of the first sample that was looked at
  InertialState state;                                           ///< at that time; position zero, velocity zero
  Eigen::Matrix<double, kInertialDim, kInertialDim> covariance;  ///< diagonal but for the attitude, which is diagonal
                                                                 ///< in world (tilt, tilt, heading)
  bool at_rest = false;
  HeadingSource heading = HeadingSource::kNone;  ///< kNone: its variance is 0, for the state's defines the world's axes
};

class FusionStart {
 public:
  /// @param gravity its size [m/s^2] @throws std::invalid_argument as the options' check.
  FusionStart(const FusionStartOptions& options, const StandStillOptions& rest, const ImuNoise& noise, double gravity);

  /// Takes a finite sample; one that is not later than the last is left aside.
  /// @returns true when duration_s is over: estimate() may be asked.
  bool push(const ImuMeasurement& imu);
  void push(const MagnetometerMeasurement& magnetometer);
  /// What was looked at, in order.
  const std::vector<ImuMeasurement>& samples() const { return samples_; }
  /// Times that it began anew: a gap, or no gravity in the mean force (free fall).
  std::int64_t repeated() const { return repeated_; }

  /// @param may_be_at_rest false: something else says that the body moves, however calm the IMU is
  /// @throws std::invalid_argument before push() has said that it is over.
  FusionStartEstimate estimate(bool may_be_at_rest = true) const;
  /// The same when something else (a picture) says that the body stands still on the whole, though it may shake: an
  /// engine idles. @param sigma_rate of the mean rate, by what it cannot exclude [rad/s]
  FusionStartEstimate estimate_still(double sigma_rate) const;
  /// Begins anew.
  void reset();

 private:
  FusionStartEstimate estimate_of(bool at_rest, double sigma_rate) const;
  bool look_for_rest() const;
  std::vector<Eigen::Quaterniond> turns(const Eigen::Vector3d& bias) const;
  std::optional<double> magnetic_heading(const Eigen::Quaterniond& level,
                                         const std::vector<Eigen::Quaterniond>& turns) const;

  FusionStartOptions options_;
  StandStillOptions rest_;
  ImuNoise noise_;
  double gravity_;
  std::vector<ImuMeasurement> samples_;
  std::vector<MagnetometerMeasurement> fields_;
  std::int64_t repeated_ = 0;
  bool over_ = false;
};

}  // namespace loc
