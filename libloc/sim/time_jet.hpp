// Functions of time with their first two derivatives: sums, products and sines of them keep the derivatives analytic,
// and an attitude written as a product of rotations gives its angular velocity and acceleration.
#pragma once

#include <array>

#include "libloc/sim/motion.hpp"

namespace loc {

struct TimeJet {
  double value = 0;
  double rate = 0;          ///< first derivative [1/s]
  double acceleration = 0;  ///< second derivative [1/s^2]

  friend TimeJet operator+(const TimeJet& a, const TimeJet& b) {
    return {a.value + b.value, a.rate + b.rate, a.acceleration + b.acceleration};
  }
  friend TimeJet operator-(const TimeJet& a, const TimeJet& b) {
    return {a.value - b.value, a.rate - b.rate, a.acceleration - b.acceleration};
  }
  friend TimeJet operator*(const TimeJet& a, const TimeJet& b) {
    return {a.value * b.value, a.rate * b.value + a.value * b.rate,
            a.acceleration * b.value + 2 * a.rate * b.rate + a.value * b.acceleration};
  }
  friend TimeJet operator*(double a, const TimeJet& b) { return {a * b.value, a * b.rate, a * b.acceleration}; }
};

TimeJet sin(const TimeJet& angle);
TimeJet cos(const TimeJet& angle);

/// amplitude * sin(angular_rate * t + phase) [., rad/s, rad].
TimeJet sine(double t, double amplitude, double angular_rate, double phase);

/// From 0 to 1 in so long: 10 x^3 - 15 x^4 + 6 x^5, whose first two derivatives vanish at both ends. Exactly 0 before
/// the beginning, exactly 1 after the end.
TimeJet smooth_step(double t, double begin, double duration);
/// Its integral from the beginning [s]; t not after the end.
double smooth_step_integral(double t, double begin, double duration);

/// A rotation that changes: quaternion w, x, y, z.
struct RotationJet {
  std::array<TimeJet, 4> wxyz = {TimeJet{1, 0, 0}, TimeJet{}, TimeJet{}, TimeJet{}};

  /// About one axis: 0, 1, 2 for x, y, z; angle [rad].
  static RotationJet about(int axis, const TimeJet& angle);
  static RotationJet constant(const Eigen::Quaterniond& q);
  friend RotationJet operator*(const RotationJet& a, const RotationJet& b);
};

/// The state of a body with this position [m] and attitude, both in world.
MotionState motion_state(double time_s, const std::array<TimeJet, 3>& position, const RotationJet& R_world_body);

}  // namespace loc
