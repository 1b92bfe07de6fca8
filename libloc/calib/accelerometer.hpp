// Calibration of an accelerometer from still poses: at rest the corrected reading has the length of gravity,
//
//   corrected = M (raw - b),   |corrected| = gravity
//
// with bias b and a symmetric M (scale and cross-axis), nine parameters. A rotation of the corrected readings is not
// observable from their length: the axes of the result are those that M's symmetry picks, within the sensor's own
// misalignment of its mechanical axes.
//
// Weighted least squares on |M (mean - b)| - gravity over the poses' means. The noise of a mean has two parts: that of
// its samples, which the segment tells, and one from pose to pose (bias instability, nonlinearity, settling), which the
// residuals tell (Paule, Mandel, "Consensus values and weighting factors", 1982). A pose that does not fit (taken while
// moving, pushed) is found with Tukey's loss and left out where there are 16 poses or more; with fewer it cannot be
// told from the noise, and shows in the predicted error. Source: Tedaldi, Pretto, Menegatti, ICRA 2014, for poses by
// hand instead of a turntable.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "libloc/calib/stillness.hpp"
#include "libloc/core/quality.hpp"
#include "libloc/sensors/rig.hpp"

namespace loc {

struct AccelerometerOptions {
  double gravity = 9.80665;                             ///< [m/s^2] where the recording was made
  double distinct_angle = 10 * std::numbers::pi / 180;  ///< [rad]; poses closer to each other count once
  int least_poses = 9;                                  ///< distinct ones; below: refused
  int good_poses = 15;                                  ///< distinct ones; below: fair, or warn when not above 11
  double outlier_sigmas = 4.685;                        ///< a pose further off is left out
  double ok_error = 1e-3;                               ///< predicted error over gravity: up to here ok, …
  double fair_error = 3e-3;
  double warn_error = 1e-2;  ///< beyond: refused

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// Mean of the readings in one still pose.
struct StillPose {
  Eigen::Vector3d mean = Eigen::Vector3d::Constant(kUnknown);  ///< raw, any unit
  Eigen::Matrix3d mean_cov = Eigen::Matrix3d::Zero();          ///< of the mean; zero when not known
};

/// Accelerometer means of segments; the covariance of a mean is that of a sample over the number of samples.
std::vector<StillPose> accelerometer_poses(std::span<const StillSegment> segments);

/// Order of the nine parameters in AccelerometerFit::cov.
enum AccelerometerParameter { kBiasX, kBiasY, kBiasZ, kMxx, kMyy, kMzz, kMxy, kMxz, kMyz, kAccelerometerParameters };
using Vector9d = Eigen::Matrix<double, kAccelerometerParameters, 1>;
using Matrix9d = Eigen::Matrix<double, kAccelerometerParameters, kAccelerometerParameters>;

struct PoseFit {
  double residual = kUnknown;  ///< |corrected| - gravity [m/s^2]
  double left_out = kUnknown;  ///< the same from a fit without this pose [m/s^2]
  bool finite = true;          ///< false: the pose was not usable at all
  bool inlier = false;
  bool distinct = false;  ///< first of its direction
};

struct AccelerometerFit {
  bool solved = false;  ///< false: the poses determine no calibration, triad is identity and what follows NaN
  bool converged = false;
  TriadCalibration triad;                       ///< raw -> [m/s^2]; matrix symmetric
  Matrix9d cov = Matrix9d::Constant(kUnknown);  ///< bias in raw units, M in m/s^2 per raw unit
  std::vector<PoseFit> poses;                   ///< as given
  int inliers = 0;                              ///< poses used
  int distinct_poses = 0;                       ///< of the inliers
  double pose_sigma = kUnknown;                 ///< from pose to pose, beyond the samples' noise [m/s^2]
  double residual_rms = kUnknown;               ///< over the inliers [m/s^2]
  double leave_one_out_rms = kUnknown;          ///< over the inliers, each predicted by the others [m/s^2]
  double predicted_error = kUnknown;  ///< of a corrected reading, rms over all directions, over gravity; with the
                                      ///< uncertainty that few poses leave in the noise itself
  Quality quality;
};

/// @throws std::invalid_argument for wrong options. Bad data do not throw: see AccelerometerFit::quality.
AccelerometerFit fit_accelerometer(std::span<const StillPose> poses, const AccelerometerOptions& options = {});

/// |M (y - b)| - 1 of scaled readings y, and its derivative with respect to the nine parameters unless null.
double gravity_residual(const Vector9d& parameters, const Eigen::Vector3d& y,
                        Eigen::Matrix<double, 1, kAccelerometerParameters>* jacobian);

}  // namespace loc
