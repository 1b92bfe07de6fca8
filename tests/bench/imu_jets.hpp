// Residuals of one IMU sample on a pose spline, differentiated automatically: for bench_camera_imu to compare with.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>

#include "libloc/calib/spline_grid.hpp"

namespace loc::bench {

constexpr int kJetOrder = 6;
using ImuResiduals = Eigen::Matrix<double, 6, 1>;
/// By the rotations' control points (perturbed on the right), then by the positions'.
using ImuJacobian = Eigen::Matrix<double, 6, 6 * kJetOrder>;

struct ImuSegment {
  std::span<const Eigen::Quaterniond> rotations;  ///< control points of the segment
  Eigen::Matrix<double, 3, kJetOrder> positions;
  Eigen::Vector3d gravity;
};

/// Gyroscope w(t) - w_m above accelerometer R(t)^T (p''(t) - g) - a_m.
/// @param weights B_j  @param cumulative L_j  @param reading w_m above a_m
void imu_by_jets(const ImuSegment& segment, const SplineWeights& weights, const SplineWeights& cumulative,
                 const ImuResiduals& reading, ImuResiduals& residuals, ImuJacobian& jacobian);

}  // namespace loc::bench
