// What every estimator gives out: one struct, so that programs, logs and evaluation do not care which estimator it was.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

#include "libloc/core/time.hpp"
#include "libloc/geometry/geodesy.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

/// Which parts of an Estimate hold something; the others are NaN.
enum EstimateValid : std::uint32_t {
  kValidOrientation = 1U << 0U,
  kValidHeading =
      1U << 1U,  ///< The heading is tied to north (magnetometer, GPS), and was lately; otherwise it is relative.
  kValidPosition = 1U << 2U,
  kValidVelocity = 1U << 3U,
  kValidGyroscopeBias = 1U << 4U,
  kValidAccelerometerBias = 1U << 5U,
  kValidCovariance = 1U << 6U,
  kValidScale = 1U << 7U,  ///< scale and scale_sigma
};

/// What an estimator did with the input since its last estimate, and why. Zero is the normal case.
enum EstimateStatus : std::uint32_t {
  kInitialising = 1U << 0U,           ///< No estimate yet.
  kReinitialised = 1U << 1U,          ///< Started anew at this sample (after a gap).
  kAtRest = 1U << 2U,                 ///< Rest detected.
  kAccelerometerIgnored = 1U << 3U,   ///< Zero, saturated or outside its gate.
  kMagnetometerIgnored = 1U << 4U,    ///< Zero, or parallel to gravity: no heading in it.
  kMagnetometerDisturbed = 1U << 5U,  ///< Norm or dip away from its reference: rejected.
  kMagnetometerMissing = 1U << 6U,    ///< None yet or too old: heading from the gyroscope alone.
  kNotFinite = 1U << 7U,              ///< Input skipped: NaN or infinity.
  kTimeNotIncreasing = 1U << 8U,      ///< Input skipped: its time is not after the last one's.
  kGap = 1U << 9U,                    ///< Time since the last sample is past the limit.
  kOutOfRange = 1U << 10U,            ///< Input skipped: finite, but more than any sensor reads.
  kBridged = 1U << 11U,               ///< A short gap was integrated over, with more noise.
  kGpsRejected = 1U << 12U,           ///< GPS has been rejected for a while: one of the two is wrong.
  kOdometryRejected = 1U << 13U,      ///< The same of the odometry.
  kRecovered = 1U << 14U,             ///< The covariance was widened, because a source was rejected for too long.
  kTooLate = 1U << 15U,               ///< Input skipped: older than the history, or than the start.
  kBadCovariance = 1U << 16U,         ///< Input skipped: its covariance is not positive definite.
  kFewFeatures = 1U << 17U,           ///< The last frame had too few features that could be used, or none came.
  kFeaturesRejected = 1U << 18U,      ///< Most of the last frame's features are not believed.
  kScaleUnknown = 1U << 19U,          ///< Lengths are in a unit of their own: one camera alone cannot tell metres.
  kNoImages = 1U << 20U,              ///< No picture, or no tracks of one, for a while: the rest goes on without.
  kNoImu = 1U << 21U,                 ///< No IMU sample for a while.
  kNoGps = 1U << 22U,                 ///< No fix yet, or none for a while, where GPS is to tie the world to the Earth.
  kLost = 1U << 23U,     ///< The camera does not find itself in its map: the pose is a guess, as its covariance says.
  kRefound = 1U << 24U,  ///< It found itself again, since the last estimate.
  kCalibrationDoubtful = 1U << 25U,  ///< Pictures disagree with the map in a way that wrong intrinsics explain.
  kTiltDoubtful = 1U << 26U,         ///< The accelerometers by themselves say another vertical.
  kStampsDoubtful = 1U << 27U,       ///< Camera (odometry) and gyroscope turn alike, but not at the same time.
  /// It was lost and goes on in surroundings that are new: where they are in the map from before, and for a camera
  /// alone how long its unit of lengths is now, is a guess, as the covariance says. Until something of that map is seen
  /// again.
  kMapLinkUnknown = 1U << 28U,
  kGpsStampsDoubtful = 1U << 29U,  ///< Fixes fit the way gone at another time than their stamps say.
};

/// Error-state order of the covariance: theta, position, velocity, gyroscope bias, accelerometer bias.
inline constexpr int kMaxEstimateDim = 15;

struct Estimate {
  TimeNs time_ns = kNoTime;       ///< Of the measurement that it rests upon.
  TimeNs host_time_ns = kNoTime;  ///< Arrival of that measurement.
  std::int64_t sequence = -1;     ///< Its sequence number.
  std::uint32_t valid = 0;        ///< EstimateValid
  std::uint32_t status = 0;       ///< EstimateStatus
  Eigen::Quaterniond q_world_body{kUnknown, kUnknown, kUnknown, kUnknown};
  Eigen::Vector3d position = Eigen::Vector3d::Constant(kUnknown);  ///< of body in world [m]
  Eigen::Vector3d velocity = Eigen::Vector3d::Constant(kUnknown);  ///< in world [m/s]
  Eigen::Vector3d angular_velocity =
      Eigen::Vector3d::Constant(kUnknown);                               ///< of body in body axes, bias removed [rad/s]
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Constant(kUnknown);  ///< [rad/s]
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Constant(kUnknown);  ///< [m/s^2]
  /// Of the error (theta [rad, body axes], p, v, bg, ba); the first covariance_dim rows and columns hold something.
  Eigen::Matrix<double, kMaxEstimateDim, kMaxEstimateDim> covariance;
  int covariance_dim = 0;
  double scale = kUnknown;        ///< of the odometry: its unit per metre
  double scale_sigma = kUnknown;  ///< its deviation
  /// Where on the Earth world's (0, 0, 0) is; NaN when nothing ties it to the Earth.
  GeodeticPoint origin{kUnknown, kUnknown, kUnknown};
};

}  // namespace loc
