// A device that is put down in one pose after the other, with its sensors' raw readings: the truth for calibrations
// from still poses. The motion is smooth and sampled exactly.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/core/time.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc::test {

struct PoseSequence {
  // corrected = matrix * (raw - bias), as the calibrations give it
  Eigen::Matrix3d gyroscope_matrix = Eigen::Matrix3d::Identity();
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Zero();
  Eigen::Matrix3d accelerometer_matrix = Eigen::Matrix3d::Identity();
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();
  double sigma_gyroscope = 0;      // raw, of a sample
  double sigma_accelerometer = 0;  // raw, of a sample
  double rate_hz = 100;
  double rest_s = 3;
  double turn_s = 2;
  double gravity = 9.80665;
  Eigen::Vector3d field{0, 20e-6, -40e-6};  // in world [T]

  std::vector<TimeNs> times_ns;
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> gyroscope;
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> accelerometer;
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> magnetometer;  // [T], body axes, exact
  std::vector<Eigen::Quaterniond> q_world_body;

  /// Rests in poses + 1 poses with a turn between each two, each about an axis that itself moves.
  void run(int poses, Random& random) {
    const int rest = static_cast<int>(rest_s * rate_hz);
    const int turn = static_cast<int>(turn_s * rate_hz);
    const int n = rest + poses * (rest + turn);
    gyroscope.resize(n, 3);
    accelerometer.resize(n, 3);
    magnetometer.resize(n, 3);
    times_ns.clear();
    q_world_body.clear();
    Eigen::Quaterniond q = random.rotation();
    const Eigen::Matrix3d to_gyroscope = gyroscope_matrix.inverse();
    const Eigen::Matrix3d to_accelerometer = accelerometer_matrix.inverse();
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
    Eigen::Vector3d second = Eigen::Vector3d::Zero();
    const auto rate_at = [&](double phase) -> Eigen::Vector3d {
      if (phase <= 0 || phase >= 1) return Eigen::Vector3d::Zero();
      const double s = std::sin(std::numbers::pi * phase);
      return s * s * first + s * s * std::sin(2 * std::numbers::pi * phase) * second;
    };
    for (int i = 0; i < n; ++i) {
      const int within = (i % (rest + turn)) - rest;  // >= 0: turning
      if (within == 0) {
        first = random.uniform(1.5, 4) / turn_s * random.direction();
        second = random.uniform(0, 2) / turn_s * random.direction();
      }
      const double phase = static_cast<double>(within) / turn;
      times_ns.push_back(from_seconds(i / rate_hz));
      q_world_body.push_back(q);
      const Eigen::Quaterniond back = q.conjugate();
      gyroscope.row(i) = to_gyroscope * rate_at(phase) + gyroscope_bias + sigma_gyroscope * random.normal3();
      accelerometer.row(i) = to_accelerometer * (back * Eigen::Vector3d(0, 0, gravity)) + accelerometer_bias +
                             sigma_accelerometer * random.normal3();
      magnetometer.row(i) = back * field;
      // Small steps of the exact motion to the next sample.
      constexpr int kParts = 20;
      for (int k = 0; k < kParts && within >= 0; ++k) {
        const double middle = phase + (k + 0.5) / kParts / turn;
        q = so3::boxplus(q, rate_at(middle) / rate_hz / kParts);
      }
    }
  }
};

}  // namespace loc::test
