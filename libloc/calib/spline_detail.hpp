// The cumulative rotation spline in one segment, for those who keep the differences of its control points. Internal to
// calib.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "libloc/calib/spline.hpp"
#include "libloc/calib/spline_grid.hpp"

namespace loc::calib {

/// d_j = Log(R_{j-1}^T R_j), and how it changes: d d_j = right_inverse e_j - right_inverse^T e_{j-1}.
struct RotationStep {
  Eigen::Vector3d difference = Eigen::Vector3d::Zero();
  Eigen::Matrix3d right_inverse = Eigen::Matrix3d::Identity();
};
RotationStep step_between(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to);

/// @param first the segment's first control point  @param steps the order - 1 steps from there
/// @param weights cumulative; the order is one more than the number of steps
RotationState rotation_at(const Eigen::Quaterniond& first, std::span<const RotationStep> steps,
                          const SplineWeights& weights, RotationJacobians* jacobians);

/// The three angles likewise (euler_trajectory.hpp). @param angles of the segment's control points, 3 x order
RotationState angles_at(const Eigen::Quaterniond& mean, const Eigen::Ref<const Eigen::MatrixXd>& angles,
                        const SplineWeights& weights, RotationJacobians* jacobians);

/// What every fit of poses needs. @throws DataError naming the index: other numbers of times and poses, times that do
/// not increase, what is not finite, and poses that follow each other by more than 120 degrees.
void check_samples(std::span<const double> times_s, std::span<const Pose3> poses);

/// Fits over a grid that is given. Rotations need times that cover it, in steps well below the spacing. @{
Eigen::MatrixXd fit_vectors(const SplineGrid& grid, std::span<const double> times_s, const Eigen::MatrixXd& values,
                            double smoothing);
std::vector<Eigen::Quaterniond> fit_rotations(const SplineGrid& grid, std::span<const double> times_s,
                                              std::span<const Pose3> poses, double smoothing);
/// @}

}  // namespace loc::calib
