// How far apart the knots of the pose's spline are to be: by the IMU's spectrum. Internal to calib.
// A spline of order 6 follows motion up to a frequency of a fifth of its knots a second, of order 4 up to an eighth;
// what it cannot follow looks like noise of the IMU and pulls at the calibration.
#pragma once

#include <span>
#include <string>

#include "libloc/calib/camera_imu_start.hpp"

namespace loc::calib {

struct KnotChoice {
  double spacing_s = 0;
  double bandwidth_hz = 0;  ///< below which the motion lies
  bool too_fast = false;    ///< the motion would need knots closer than two samples
  std::string reason;       ///< a sentence
};

/// Frequency above which the spectrum of gyroscope and accelerometer holds no more than a quarter of their noise's
/// power besides the noise. @returns 0 for too few samples
double bandwidth_of(std::span<const ImuRow> imu);

/// @param given_s 0: to be chosen  @param camera_period_s of the first camera: the knots must not keep step with it
KnotChoice choose_knots(std::span<const ImuRow> imu, int order, double given_s, double camera_period_s);

}  // namespace loc::calib
