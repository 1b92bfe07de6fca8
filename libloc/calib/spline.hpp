// Functions of time as uniform B-splines: vectors, rotations, and poses. Usable on their own: fit_vector_spline and
// fit_pose_spline find the control points from samples.
//
// Rotations are cumulative (Kim, Kim, Shin, "A general construction scheme for unit quaternion curves", 1995), with
// L_j of spline_grid.hpp and d_j = Log(R_{j-1}^T R_j):
//   R = R_0 A_1 … A_{k-1},  A_j = Exp(L_j d_j)
//   w_j = A_j^T w_{j-1} + L'_j d_j                                    angular velocity, w = w_{k-1}
//   a_j = A_j^T a_{j-1} + L''_j d_j + (A_j^T w_{j-1}) x L'_j d_j      angular acceleration
// (Sommer et al. 2020, equations 38-41). Both in body axes. No attitude is special; neighbouring control points must
// be less than half a turn apart. A fit's error falls with the spacing's power of the order on R^n; on SO(3), where
// rotations do not commute, no faster than with the fourth (measured with order 6). Jacobians are by perturbations on
// the right of the control rotations, R_j = R_j Exp(e_j), and of the result, derived in spline.cpp.
//
// Frames: a pose is T_world_body. Units: m, rad, s. Times are seconds since an origin of the caller's.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <span>
#include <vector>

#include "libloc/calib/spline_grid.hpp"
#include "libloc/geometry/pose3.hpp"

namespace loc {

/// On R^n. The Jacobian of value or derivative by control point segment + j is weights_at(…)[j] times the identity.
class VectorSpline {
 public:
  /// @param control_points one column each
  /// @throws std::invalid_argument for a grid that cannot be, another number of columns, no rows, or not finite.
  VectorSpline(const SplineGrid& grid, Eigen::MatrixXd control_points);

  const SplineGrid& grid() const { return grid_; }
  const Eigen::MatrixXd& control_points() const { return control_points_; }
  Eigen::MatrixXd& control_points() { return control_points_; }

  /// @param derivative 0, 1 or 2, by time
  /// @throws std::invalid_argument for another derivative.
  Eigen::VectorXd value(double t_s, int derivative = 0) const;

 private:
  SplineGrid grid_;
  Eigen::MatrixXd control_points_;
};

struct RotationState {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();    ///< R_world_body
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();      ///< in body [rad/s]
  Eigen::Vector3d angular_acceleration = Eigen::Vector3d::Zero();  ///< in body [rad/s^2]
};

/// By the control points first … first + order - 1.
struct RotationJacobians {
  int first = 0;
  std::array<Eigen::Matrix3d, kMaxSplineOrder> rotation;
  std::array<Eigen::Matrix3d, kMaxSplineOrder> angular_velocity;
  std::array<Eigen::Matrix3d, kMaxSplineOrder> angular_acceleration;
};

/// On SO(3).
class RotationSpline {
 public:
  /// @throws std::invalid_argument for a grid that cannot be, another number of rotations, or norms that are not 1.
  RotationSpline(const SplineGrid& grid, std::vector<Eigen::Quaterniond> control_points);

  const SplineGrid& grid() const { return grid_; }
  const std::vector<Eigen::Quaterniond>& control_points() const { return control_points_; }
  std::vector<Eigen::Quaterniond>& control_points() { return control_points_; }

  RotationState at(double t_s, RotationJacobians* jacobians = nullptr) const;

 private:
  SplineGrid grid_;
  std::vector<Eigen::Quaterniond> control_points_;
};

struct PoseState {
  Pose3 pose;                                                      ///< T_world_body
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();              ///< in world [m/s]
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();          ///< in world [m/s^2]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();      ///< in body [rad/s]
  Eigen::Vector3d angular_acceleration = Eigen::Vector3d::Zero();  ///< in body [rad/s^2]
};

/// Rotation and position apart, on one grid.
class PoseSpline {
 public:
  /// @throws std::invalid_argument when the grids differ or positions have not three rows.
  PoseSpline(RotationSpline rotation, VectorSpline position);

  const SplineGrid& grid() const { return rotation_.grid(); }
  const RotationSpline& rotation() const { return rotation_; }
  const VectorSpline& position() const { return position_; }

  PoseState at(double t_s) const;

 private:
  RotationSpline rotation_;
  VectorSpline position_;
};

struct SplineFitOptions {
  int order = 4;
  double spacing_s = 0.1;
  /// Weight of the squared second differences of the control points against the squared residuals: what decides where
  /// there are no samples (Eilers, Marx, "Flexible smoothing with B-splines and penalties", 1996). So small, it is not
  /// seen elsewhere.
  double smoothing = 1e-9;
  int max_iterations = 20;  ///< of rotations
  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

struct VectorSplineFit {
  VectorSpline spline;
  double rms = 0;  ///< of the residuals' norms
};

/// Least squares; the grid begins at the first sample and covers the last.
/// @param times_s increasing  @param values one column for each time
/// @throws std::invalid_argument for options; DataError naming the index for no samples, other numbers of times and
/// values, times that do not increase, what is not finite, and a span of time (a stamp far too late) for which there
/// would be more than 20 control points a sample and more than 10^5 in all.
VectorSplineFit fit_vector_spline(std::span<const double> times_s, const Eigen::MatrixXd& values,
                                  const SplineFitOptions& options = {});

struct PoseSplineFit {
  PoseSpline spline;
  double rms_rotation = 0;  ///< of the residuals' angles [rad]
  double rms_position = 0;  ///< of their distances [m]
  int iterations = 0;
  bool converged = false;
};

/// Least squares of rotations (Gauss and Newton) and positions.
/// @throws as fit_vector_spline; DataError also when poses that follow each other are more than 120 degrees apart: the
/// way between them is not known.
PoseSplineFit fit_pose_spline(std::span<const double> times_s, std::span<const Pose3> poses,
                              const SplineFitOptions& options = {});

}  // namespace loc
