// Simulated IMU: true motion to readings of a gyroscope and an accelerometer.
//   reading = round(matrix * input + bias + white noise), within the range
//   bias    = constant + turn-on (drawn once) + random walk + Gauss-Markov (bias instability)
// The input is true angular velocity and specific force R^T (a - g), in body axes.
// Source of the terms: IEEE Std 952. What there is called bias instability (flicker noise) is modelled as a first-order
// Gauss-Markov process, whose Allan deviation is flat around 1.89 time constants only, at 0.437 sigma.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>

#include "libloc/core/random.hpp"
#include "libloc/core/time.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sensors/rig.hpp"
#include "libloc/sim/motion.hpp"
#include "libloc/sim/noise.hpp"

namespace loc {

/// A gyroscope [u = rad/s] or an accelerometer [u = m/s^2].
struct InertialTriadModel {
  double noise_density = 0;         ///< [u/sqrt(Hz)], white: a sample's deviation is density * sqrt(rate)
  double random_walk = 0;           ///< [u/s/sqrt(Hz)], of the bias: its deviation after one second
  double instability_sigma = 0;     ///< [u], of the Gauss-Markov part of the bias, each axis
  double instability_time_s = 100;  ///< its time constant [s]
  double turn_on_bias_sigma = 0;    ///< [u], of the part of the bias that is drawn once a run, each axis
  Eigen::Vector3d constant_bias = Eigen::Vector3d::Zero();  ///< [u]
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();     ///< scale and misalignment
  double range = std::numeric_limits<double>::infinity();   ///< [u], saturates beyond
  double resolution = 0;                                    ///< [u], step of a reading; 0: not rounded

  /// @throws std::invalid_argument naming the field and its value. @param name goes before the field's.
  void check(std::string_view name) const;
};

/// Which true value a reading stands for.
enum class ImuSampleModel : std::uint8_t {
  kPoint,         ///< the value at the time of the sample: sensors without an anti-aliasing filter
  kIntervalMean,  ///< mean since the last sample of what the axes of body feel: sensors that average
  /// Change of attitude and of velocity since the last sample, divided by its length: sensors that integrate inside,
  /// with coning and sculling removed. Rotation vector from the last to this attitude; change of velocity (without
  /// gravity) in the axes half way between the two. Exact: a filter that turns by the rotation vector and adds the
  /// change in the axes half way gets the true attitude and velocity.
  kIncrement
};
const char* sampling_name(ImuSampleModel sampling);
/// "point", "interval-mean", "increment". @throws std::invalid_argument naming the text.
ImuSampleModel parse_sampling(const std::string& name);

struct ImuModel {
  double rate_hz = 200;
  InertialTriadModel gyroscope;      ///< [rad/s]
  InertialTriadModel accelerometer;  ///< [m/s^2]
  ImuSampleModel sampling = ImuSampleModel::kPoint;
  /// 1: specific force, +9.81 upwards at rest. -1: its negative, R^T (g - a), as the IMU of the example
  /// "Visual-Inertial Odometry Using Synthetic Data" gives out.
  int accelerometer_sign = 1;
  Eigen::Vector3d gravity{0, 0, -9.80665};  ///< in world [m/s^2]

  static ImuModel consumer();                     ///< MEMS of a phone, 200 Hz
  static ImuModel vio_example();                  ///< that example's, 100 Hz; with the sign of specific force
  static ImuModel perfect(double rate_hz = 200);  ///< no error at all

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
  /// What calibration would tell of it: the densities, and matrices that take out scale, misalignment and sign. Biases
  /// are left to the estimator.
  ImuCalibration calibration() const;
};

/// libloc's density from one of a one-sided spectrum, whose samples have the deviation density * sqrt(rate / 2): so
/// MATLAB's imuSensor understands NoiseDensity.
constexpr double density_from_one_sided(double density) {
  return density / std::numbers::sqrt2;
}

/// What an IMU without errors reads.
struct ImuInput {
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/s], body axes
  Eigen::Vector3d specific_force = Eigen::Vector3d::Zero();    ///< [m/s^2], body axes
};
/// @param gravity in world [m/s^2]
ImuInput imu_point(const MotionState& state, const Eigen::Vector3d& gravity);
/// By eight-point Gauss-Legendre quadrature: exact to rounding for what is smooth in the interval.
/// @throws std::invalid_argument unless begin_s < end_s; as Motion::at
ImuInput imu_interval_mean(const Motion& motion, double begin_s, double end_s, const Eigen::Vector3d& gravity);
/// @throws std::invalid_argument unless begin is before end.
ImuInput imu_increment(const MotionState& begin, const MotionState& end, const Eigen::Vector3d& gravity);

/// What of the last reading was error. In the units of the readings.
struct ImuTruth {
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Zero();      ///< [rad/s]
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();  ///< [m/s^2]
  std::int64_t saturated = 0;                                    ///< readings so far with an axis beyond its range
};

class ImuSimulator {
 public:
  /// @throws as ImuModel::check
  ImuSimulator(const ImuModel& model, Random random);

  /// One sample. Its time is time_ns, the times of successive samples increase; the first one is a point sample,
  /// because there is no interval before it.
  /// @param time_ns since the start of the motion @throws std::invalid_argument when it does not increase; as
  /// Motion::at
  ImuMeasurement measure(const Motion& motion, TimeNs time_ns);
  /// The same from an input of one's own. @throws std::invalid_argument also when it is not finite.
  ImuMeasurement measure(const ImuInput& input, TimeNs time_ns);

  const ImuModel& model() const { return model_; }
  const ImuTruth& truth() const { return truth_; }

 private:
  struct Triad {
    Triad(const InertialTriadModel& model, Random random);
    Eigen::Vector3d measure(const InertialTriadModel& model, const Eigen::Vector3d& input, double rate_hz,
                            bool& saturated);

    Random white;
    Eigen::Vector3d fixed_bias;
    RandomWalk walk;
    GaussMarkov instability;
  };

  ImuModel model_;
  Triad gyroscope_;
  Triad accelerometer_;
  ImuTruth truth_;
  TimeNs last_time_ns_ = kNoTime;
  std::optional<MotionState> last_state_;
};

}  // namespace loc
