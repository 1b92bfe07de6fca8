// What the tests of the Madgwick filter share: feeding it from the simulation, its error, a motion that excites all
// axes.
#pragma once

#include <cmath>
#include <numbers>

#include "libloc/estimators/madgwick.hpp"
#include "support/simulated_imu.hpp"

namespace loc::test {

inline constexpr double kDegree = std::numbers::pi / 180;

inline double error_deg(const MadgwickFilter& filter, const SimulatedImu& sim) {
  return so3::angle_between(filter.orientation(), sim.q_world_body) / kDegree;
}

inline double tilt_error_deg(const MadgwickFilter& filter, const SimulatedImu& sim) {
  const Eigen::Quaterniond e = filter.orientation() * sim.q_world_body.conjugate();
  return 2 * std::atan2(std::hypot(e.x(), e.y()), std::hypot(e.w(), e.z())) / kDegree;
}

inline void feed(MadgwickFilter& filter, const SimulatedImu& sim) {
  filter.update(sim.magnetometer);
  filter.update(sim.imu);
}

/// Angular velocity [rad/s, body] at t [s].
inline Eigen::Vector3d hand_held_rate(double t) {
  return {1.2 * std::sin(1.1 * t), 0.9 * std::cos(0.7 * t + 1), 0.8 * std::sin(0.5 * t + 2)};
}

}  // namespace loc::test
