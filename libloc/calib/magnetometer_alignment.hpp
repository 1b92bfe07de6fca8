// Rotation between the axes of a magnetometer and those of the IMU, from one recording in which the device is turned
// about several axes. The magnetometer is calibrated already (calib/ellipsoid gives it up to this rotation), the IMU as
// well.
//
//   field in body axes = R m
//
// Two constraints, both in body axes:
//   1. The field stands still in the world, so the gyroscope carries it from one moment to the next:
//      R m_j = dR_ij^T R m_i, with dR_ij integrated over a short interval. A magnetometer is often later than the IMU
//      by some milliseconds, which a fast turn shows as an angle: the delay is estimated too.
//   2. Its angle to gravity, the dip, stays the same: u . R m = -sin(dip) where the accelerometer shows gravity u
//   alone.
// What is left of the errors of both calibrations (scale and misalignment of the gyroscope, a symmetric matrix and the
// centre of the field) turns R, by about as much as it is large: both are estimated too, with what is known of them
// beforehand, so that the covariance holds what the recording does not determine.
// Start: constraint 1 is linear in R (the smallest singular vector of all intervals). Then Levenberg-Marquardt with
// Tukey's loss on R, the gyroscope's remaining bias, the dip, the delay and those errors.
//
// Not observable: constraint 1 and 2 hold for -R as well as for R, with the field reversed. A mirrored (left-handed)
// magnetometer therefore looks like a right-handed one in a reversed field; only the sign of the dip tells them apart:
// give expected_dip (from a magnetic model, or just + in the north and - in the south).
// Source: Kok, Schon, "Magnetometer calibration using inertial sensors", IEEE Sensors Journal 16, 2016, for the use of
// both sensors; the start is the rotation part of the hand-eye problem.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <numbers>
#include <span>
#include <string>

#include "libloc/calib/stillness.hpp"
#include "libloc/core/quality.hpp"
#include "libloc/sensors/rig.hpp"

namespace loc {

struct MagnetometerAlignmentOptions {
  double interval_s = 0.25;              ///< over which the gyroscope carries the field
  double expected_dip = kUnknown;        ///< [rad], positive where the field points down; NaN: mirroring is not checked
  double norm_tolerance = 0.2;           ///< of the field's length to its median; beyond, a reading is disturbed
  double force_tolerance = 0.03;         ///< of the specific force to its median where it is taken as gravity
  double gap_periods = 5;                ///< a longer pause between samples ends an interval
  double gyroscope_matrix_sigma = 0.01;  ///< of each entry of what is left of scale and misalignment; calibrated: 0.001
  double field_sigma = 0.005;      ///< of what is left of the magnetometer's matrix (symmetric; beside the diagonal
                                   ///< 1 / sqrt(2) of it) and of its centre over the field
  double least_second_axis = 0.1;  ///< of the turning: about a second axis, relative to the first; below: refused
  double ok_sigma =
      0.5 * std::numbers::pi / 180;  ///< [rad] predicted deviation of R, worst direction: up to here ok, …
  double fair_sigma = 1.0 * std::numbers::pi / 180;
  double warn_sigma = 3.0 * std::numbers::pi / 180;  ///< beyond: refused

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

struct MagnetometerAlignment {
  bool solved = false;                                   ///< false: no rotation can be given, matrix is identity
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();  ///< body = matrix * magnetometer; determinant -1 when mirrored
  bool mirror_checked = false;                           ///< false: expected_dip was not given or is near zero
  bool mirrored = false;
  Eigen::Matrix3d cov = Eigen::Matrix3d::Constant(kUnknown);  ///< [rad^2] of a rotation on the right of matrix
  double sigma = kUnknown;                                    ///< [rad] largest deviation of it, any direction
  double angle = kUnknown;                                    ///< [rad] of the rotation (of -matrix when mirrored)
  bool permuted = false;                                      ///< close to an exchange of axes that is not the identity
  std::string axes;  ///< "x y z": the signed magnetometer axis nearest to each body axis
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Constant(kUnknown);  ///< [rad/s] still in the readings
  double delay_s = kUnknown;  ///< the readings of the field are of so much before their time stamp
  double delay_sigma_s = kUnknown;
  double dip = kUnknown;                ///< [rad] positive down; NaN without gravity
  double dip_sigma = kUnknown;          ///< [rad]
  double dip_scatter = kUnknown;        ///< [rad] robust deviation of single readings
  double residual_rms = kUnknown;       ///< [rad] of constraint 1 over the inliers
  double second_axis_share = kUnknown;  ///< turning about a second axis relative to the first, 0 … 1
  std::int64_t intervals = 0;
  std::int64_t inliers = 0;
  std::int64_t gravity_readings = 0;  ///< intervals for constraint 2; below 10 they only give the dip
  std::int64_t not_finite = 0;        ///< rows
  std::int64_t repeated = 0;          ///< field readings equal to the one before: the sensor is slower
  std::int64_t too_fast = 0;          ///< rows with more than half a turn in one period: not a rate
  std::int64_t disturbed = 0;         ///< readings of another length
  Quality quality;
};

/// @param gyroscope [rad/s], accelerometer [m/s^2] or no rows, magnetometer any unit; a magnetometer that is slower
/// than the IMU repeats its reading or gives NaN in between.
/// @throws std::invalid_argument for wrong options or sizes. Bad data do not throw: see quality.
MagnetometerAlignment align_magnetometer(std::span<const TimeNs> times_ns, const TriadRows& gyroscope,
                                         const TriadRows& accelerometer, const TriadRows& magnetometer,
                                         const MagnetometerAlignmentOptions& options = {});

/// The calibration followed by the alignment, for the rig; its quality is the worse of both. @throws DataError with the
/// reasons unless solved.
TriadCalibration aligned(const TriadCalibration& magnetometer, const MagnetometerAlignment& alignment);

/// One interval between two readings of the field, for align_magnetometer and its test.
struct FieldInterval {
  Eigen::Quaterniond q_begin_end = Eigen::Quaterniond::Identity();             ///< by the gyroscope
  Eigen::Matrix3d d_bias = Eigen::Matrix3d::Zero();                            ///< its right perturbation by the bias
  Eigen::Matrix<double, 3, 9> d_matrix = Eigen::Matrix<double, 3, 9>::Zero();  ///< the same by G, the true rate being
                                                                               ///< (I + G) times the measured one
  Eigen::Vector3d begin = Eigen::Vector3d::Zero();  ///< field, length near 1, magnetometer axes
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate_begin = Eigen::Vector3d::Zero();  ///< [rad/s]
  Eigen::Vector3d rate_end = Eigen::Vector3d::Zero();
  bool has_gravity = false;
  Eigen::Vector3d up = Eigen::Vector3d::Zero();     ///< body axes
  Eigen::Vector3d field = Eigen::Vector3d::Zero();  ///< mean over the interval, magnetometer axes
};

/// theta (R = start * Exp(theta)), gyroscope bias, sin(dip), delay [s]
using AlignmentVector = Eigen::Matrix<double, 8, 1>;

/// Both constraints at x: three values, and one (0 without gravity). The Jacobian may be null.
Eigen::Vector4d alignment_residual(const FieldInterval& interval, const Eigen::Quaterniond& start,
                                   const AlignmentVector& x, Eigen::Matrix<double, 4, 8>* jacobian);

/// What is left of the errors of the calibrations: G of the gyroscope column by column, symmetric S (xx yy zz yz xz xy)
/// and centre c of the field, m -> (I + S) m + c with m of length 1.
constexpr int kCalibrationErrors = 18;

/// Derivative of alignment_residual() by them, at zero.
Eigen::Matrix<double, 4, kCalibrationErrors> alignment_error_jacobian(const FieldInterval& interval,
                                                                      const Eigen::Quaterniond& start,
                                                                      const AlignmentVector& x);

}  // namespace loc
