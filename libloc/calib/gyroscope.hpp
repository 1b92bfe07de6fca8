// Calibration of a gyroscope against an accelerometer that is calibrated already, from a recording in which the device
// is put down in many poses:
//
//   angular velocity = A (raw - b)
//
// b is what the gyroscope shows at rest. A (scale, misalignment, and the rotation to the accelerometer's axes: nine
// parameters) is what makes the integral of each turn carry gravity as the accelerometer saw it before the turn to what
// it saw after: R^T u_before = u_after. A heading change is not seen by one turn, but by the others.
// Source: Tedaldi, Pretto, Menegatti, "A robust and easy to implement method for IMU calibration without external
// equipments", ICRA 2014. In addition the residuals are weighted by a full covariance (noise of the samples along the
// turn, of the bias before and after, of both gravity directions, shared by neighbouring turns, and of the
// accelerometer's calibration), the bias may drift from pose to pose, and the rate is taken as linear between samples
// (Magnus expansion to second order, the coning term).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "libloc/calib/accelerometer.hpp"
#include "libloc/calib/stillness.hpp"
#include "libloc/core/quality.hpp"
#include "libloc/sensors/rig.hpp"

namespace loc {

struct GyroscopeOptions {
  double gap_periods = 5;      ///< a longer pause between samples makes a turn unusable
  double outlier_chi2 = 18.4;  ///< of a turn's two residuals, in units of their own scatter: beyond, it is left out
  double ok_sigma = 2e-3;      ///< predicted relative deviation of A in its worst direction: up to here ok, …
  double fair_sigma = 5e-3;
  double warn_sigma = 2e-2;  ///< beyond: refused, only the bias is given

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// One turn between two still segments that follow each other.
struct GyroscopeTurn {
  std::size_t from_segment = 0;
  std::size_t to_segment = 0;
  double duration_s = 0;
  double gravity_angle = kUnknown;  ///< [rad] by which gravity turned, as the accelerometer saw it
  double residual = kUnknown;       ///< [rad] between gravity as turned and as seen
  bool usable = true;               ///< false: a gap or bad rows in it
  bool inlier = false;
};

struct GyroscopeFit {
  bool bias_known = false;
  bool matrix_known = false;  ///< false: bias only, triad.matrix is identity
  TriadCalibration triad;     ///< raw -> [rad/s] in the accelerometer's axes; bias: mean over the still segments
  Eigen::Matrix3d bias_cov = Eigen::Matrix3d::Constant(kUnknown);     ///< raw units
  Eigen::Vector3d bias_spread = Eigen::Vector3d::Constant(kUnknown);  ///< deviation over the segments, raw units
  Eigen::Vector3d bias_range = Eigen::Vector3d::Constant(kUnknown);   ///< largest less smallest, raw units
  Eigen::Vector3d bias_slope = Eigen::Vector3d::Constant(kUnknown);   ///< raw units per second
  Matrix9d cov = Matrix9d::Constant(kUnknown);                        ///< of A row by row, [rad/s per raw unit]^2
  double relative_sigma = kUnknown;  ///< largest deviation of A, any direction, over its mean scale
  double residual_rms = kUnknown;    ///< of the inliers' angles [rad]
  double chi2_ratio = kUnknown;      ///< of the inliers, over the degrees of freedom; 1 when all noise is known
  double rotation_angle = kUnknown;  ///< [rad] between the gyroscope's and the accelerometer's axes
  bool left_handed = false;          ///< an axis has the opposite sign
  bool converged = false;
  int segments = 0;  ///< still ones, that the bias is from
  std::vector<GyroscopeTurn> turns;
  int inliers = 0;
  Quality quality;
};

/// Bias alone, from any still segments.
GyroscopeFit fit_gyroscope_bias(std::span<const StillSegment> segments);

/// @param times_ns, gyroscope the recording that segments was found in. @param accelerometer calibration of the
/// accelerometer whose means the segments hold; when it is not solved, only the bias is found.
/// @throws std::invalid_argument for wrong options, sizes, or segments that are not inside the recording in order. Bad
/// data do not throw: see GyroscopeFit::quality.
GyroscopeFit fit_gyroscope(std::span<const TimeNs> times_ns, const TriadRows& gyroscope,
                           std::span<const StillSegment> segments, const AccelerometerFit& accelerometer,
                           const GyroscopeOptions& options = {});

/// Raw readings, less the bias, at both ends of one sampling period.
struct RateStep {
  double dt_s = 0;
  double share = 0;  ///< of the turn that is over at the middle of the step: between the bias before and after
  Eigen::Vector3d begin = Eigen::Vector3d::Zero();
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
};

/// Attitude after a turn relative to before, and how its right perturbation depends on what it was made of.
struct TurnIntegral {
  Eigen::Quaterniond q_before_after = Eigen::Quaterniond::Identity();
  Eigen::Matrix<double, 3, 9> d_matrix = Eigen::Matrix<double, 3, 9>::Zero();  ///< A row by row
  Eigen::Matrix3d d_bias_before = Eigen::Matrix3d::Zero();  ///< the bias goes linearly from before to after
  Eigen::Matrix3d d_bias_after = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d noise = Eigen::Matrix3d::Zero();  ///< covariance from the samples' noise
};

/// @param sample_cov of a raw reading
TurnIntegral integrate_turn(std::span<const RateStep> steps, const Eigen::Matrix3d& matrix,
                            const Eigen::Matrix3d& sample_cov);

}  // namespace loc
