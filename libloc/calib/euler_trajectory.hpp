// A pose over time as six B-splines, three angles and a position, with the mean attitude taken out:
//   R_world_body(t) = R_mean R(phi(t)),  R(phi) = Rz(phi_3) Ry(phi_2) Rx(phi_1)
//   angular velocity in body = S(phi) phi',
//                 ( 1    0         -sin phi_2          )
//        S(phi) = ( 0  cos phi_1   sin phi_1 cos phi_2 )
//                 ( 0 -sin phi_1   cos phi_1 cos phi_2 )
// The form of Furgale, Rehder, Siegwart, "Unified temporal and spatial calibration for multi-sensor systems", IROS
// 2013, and of the slides that this project began with. S is singular at phi_2 = +-90 deg, and what is common to all
// attitudes would bring it there: hence the mean. Good for a rig that is waved about one attitude; for anything else
// PoseSpline has no such limit.
//
// Frames: a pose is T_world_body. Units: m, rad, s. Times are seconds since an origin of the caller's.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <span>

#include "libloc/calib/spline.hpp"

namespace loc {

/// R(phi) = Rz(phi_3) Ry(phi_2) Rx(phi_1), from body axes.
Eigen::Quaterniond rotation_from_angles(const Eigen::Vector3d& phi);
/// Inverse, with |phi_2| <= 90 deg. At 90 deg only phi_1 - phi_3 is determined; phi_3 = 0 then.
Eigen::Vector3d angles_of(const Eigen::Quaterniond& rotation);

/// S(phi): angular velocity in body = S(phi) phi'; also d rho = S(phi) d phi for R(phi) Exp(rho).
Eigen::Matrix3d angle_rate_matrix(const Eigen::Vector3d& phi);
/// d (S(phi) v) / d phi.
Eigen::Matrix3d angle_rate_matrix_derivative(const Eigen::Vector3d& phi, const Eigen::Vector3d& v);

/// Rotation nearest to all in the mean square of matrix entries; q and -q count the same (Markley, Cheng, Crassidis,
/// Oshman, "Averaging quaternions", 2007). @throws std::invalid_argument when empty.
Eigen::Quaterniond mean_rotation(std::span<const Eigen::Quaterniond> rotations);

class EulerTrajectory {
 public:
  /// @param control_points (6, n): angles above positions
  /// @throws std::invalid_argument as VectorSpline, for another number of rows, or a mean whose norm is not 1.
  EulerTrajectory(const Eigen::Quaterniond& mean, const SplineGrid& grid, Eigen::MatrixXd control_points);

  const Eigen::Quaterniond& mean() const { return mean_; }
  const SplineGrid& grid() const { return spline_.grid(); }
  const Eigen::MatrixXd& control_points() const { return spline_.control_points(); }
  Eigen::MatrixXd& control_points() { return spline_.control_points(); }

  PoseState at(double t_s) const;
  /// Rotation alone; Jacobians by the three angles of each control point, the result perturbed on the right.
  RotationState rotation_at(double t_s, RotationJacobians* jacobians = nullptr) const;

 private:
  Eigen::Quaterniond mean_;
  VectorSpline spline_;
};

struct EulerTrajectoryFit {
  EulerTrajectory trajectory;
  double rms_rotation = 0;  ///< of the residuals' angles [rad]
  double rms_position = 0;  ///< of their distances [m]
};

/// Least squares of angles and positions. @throws as fit_pose_spline; DataError when some phi_2 is beyond 80 deg: that
/// motion is too wide for three angles.
EulerTrajectoryFit fit_euler_trajectory(std::span<const double> times_s, std::span<const Pose3> poses,
                                        const SplineFitOptions& options = {});

}  // namespace loc
