// Rest of an IMU, from its own samples: the likelihood-ratio test of the window behind the newest sample,
//   T = 1/n sum( |f_k - f_mean|^2 / sigma_f^2 + |w_k - w_mean|^2 / sigma_w^2 )
// in the form that takes both means as unknown, because of the biases: white noise alone gives 6 on average, any
// vibration or motion more. Besides, the mean rate must be the bias, the mean force as long as gravity, and both must
// stay what they were when this rest began: a smooth start, which does not vibrate, shows there.
//
// Not observable: rest and motion at constant velocity are the same to an IMU. On wheels, legs and in the hand they are
// told apart by vibration; where something else measures speed, say so through confirm_speed(): the detector then
// learns how calm this vehicle can be while it drives, and takes nothing rougher for rest any more. Gliding without any
// vibration and without any other sensor is taken for rest.
// Source: I. Skog, P. Handel, J.-O. Nilsson, J. Rantakokko, "Zero-velocity detection - an algorithm evaluation", IEEE
// Transactions on Biomedical Engineering 57, 2010.
#pragma once

#include <Eigen/Core>

#include "libloc/core/fifo.hpp"
#include "libloc/core/time.hpp"
#include "libloc/sensors/imu_noise.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

struct StandStillOptions {
  double window_s = 0.4;        ///< [s]
  double min_duration_s = 0.8;  ///< Calm for this long is rest; the window counts. [s]
  double threshold = 20;        ///< Of T; 6 is white noise of the densities alone.
  /// Deviations of one sample are at least this, whatever the densities say: quantisation, a desk.
  double force_sigma_floor = 0.02;     ///< [m/s^2]
  double rate_sigma_floor = 0.002;     ///< [rad/s]
  double max_angular_velocity = 0.03;  ///< Mean rate less the bias. [rad/s]
  double max_force_error = 0.5;        ///< Length of the mean force less gravity. [m/s^2]
  double max_force_change = 0.05;      ///< Of the mean force since this rest began. [m/s^2]
  double max_rate_change = 0.003;      ///< Of the mean rate since this rest began. [rad/s]
  double min_speed = 0.3;              ///< A speed that is surely higher says: not at rest. [m/s]

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

class StandStillDetector {
 public:
  /// @param gravity its size [m/s^2] @throws std::invalid_argument as the options' and the noise's check.
  StandStillDetector(const StandStillOptions& options, const ImuNoise& noise, double gravity);

  /// Takes the next sample; one that is not finite or not later than the last is left aside.
  /// @param gyroscope_bias as known so far [rad/s] @param bias_sigma its deviation, which widens the test of the mean
  /// rate [rad/s]
  /// @returns at_rest().
  bool update(const ImuMeasurement& imu, const Eigen::Vector3d& gyroscope_bias, double bias_sigma);
  /// Something else measured the speed just now: what looks like rest, and is not, teaches the threshold.
  void confirm_speed(double speed, double sigma);

  bool at_rest() const { return at_rest_; }
  double statistic() const { return statistic_; }  ///< T of the window; NaN before it is full
  double threshold() const { return threshold_; }  ///< as learnt
  std::int64_t false_alarms() const { return false_alarms_; }
  const Eigen::Vector3d& mean_rate() const { return mean_rate_; }    ///< of the window [rad/s]
  const Eigen::Vector3d& mean_force() const { return mean_force_; }  ///< of the window [m/s^2]
  double mean_rate_sigma() const { return mean_rate_sigma_; }        ///< deviation of mean_rate() by noise [rad/s]

  /// Forgets the samples (after a gap), not what was learnt.
  void reset();

 private:
  struct Sample {
    TimeNs time_ns = kNoTime;
    Eigen::Vector3d rate = Eigen::Vector3d::Zero();
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
  };

  void add(const Sample& sample, double sign);
  bool calm(const Eigen::Vector3d& bias, double bias_sigma);

  StandStillOptions options_;
  ImuNoise noise_;
  double gravity_;
  double threshold_;
  Fifo<Sample> window_;
  Eigen::Vector3d rate_sum_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_sum_ = Eigen::Vector3d::Zero();
  double rate_squares_ = 0;
  double force_squares_ = 0;
  std::size_t since_fresh_sums_ = 0;

  Eigen::Vector3d mean_rate_ = Eigen::Vector3d::Constant(kUnknown);
  Eigen::Vector3d mean_force_ = Eigen::Vector3d::Constant(kUnknown);
  double mean_rate_sigma_ = kUnknown;
  double statistic_ = kUnknown;
  TimeNs calm_since_ns_ = kNoTime;  // first window that was
  Eigen::Vector3d first_rate_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d first_force_ = Eigen::Vector3d::Zero();
  bool at_rest_ = false;
  std::int64_t false_alarms_ = 0;
};

}  // namespace loc
