// What a solved camera-IMU calibration is worth: deviations, checks of what was held, verdict. Internal to calib.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "libloc/calib/camera_imu.hpp"
#include "libloc/calib/camera_imu_problem.hpp"

namespace loc::calib {

/// The normal equations of the shared unknowns at the solution, everything else eliminated; also for unknowns that were
/// held.
struct SharedEquations {
  SharedLayout estimated;
  SharedLayout all;
  Eigen::MatrixXd information;  // by all
  Eigen::MatrixXd pulls;        // gradient by all, one column a group of windows
};

/// Deviations and covariance of each camera's mounting; what was held: one step from where it is; and the verdict.
/// Needs what became of the pictures in fit.
/// @param intrinsics_sigma of each camera, for intrinsics that were not refined
/// @param too_fast the motion is more than the knots can follow @param length_s of the recording
/// @throws DataError where the equations do not determine the mounting.
void conclude(const SharedEquations& equations, const CameraImuState& state, const CameraImuOptions& options,
              std::span<const Vector8d> intrinsics_sigma, bool too_fast, double length_s, CameraImuFit& fit);

}  // namespace loc::calib
