// A small analytic motion for tests of simulated sensors: a circle that rises and falls, with heading and roll of their
// own.
#pragma once

#include <cmath>
#include <limits>

#include "libloc/core/check.hpp"
#include "libloc/sim/motion.hpp"

namespace loc::test {

class WobbleMotion final : public Motion {
 public:
  double duration_s() const override { return std::numeric_limits<double>::infinity(); }
  MotionState at(double t) const override {
    require_not_negative("time_s", t);
    MotionState s;
    s.time_s = t;
    const double w = 0.7;
    s.T_world_body.translation = {3 * std::cos(w * t), 3 * std::sin(w * t), 0.5 * std::sin(2 * t)};
    s.velocity = {-3 * w * std::sin(w * t), 3 * w * std::cos(w * t), std::cos(2 * t)};
    s.acceleration = {-3 * w * w * std::cos(w * t), -3 * w * w * std::sin(w * t), -2 * std::sin(2 * t)};
    // R = Rz(yaw) Rx(roll): body rate = (roll', yaw' sin(roll), yaw' cos(roll))
    const double yaw = 0.9 * t + 0.3 * std::sin(1.3 * t);
    const double yaw1 = 0.9 + 0.39 * std::cos(1.3 * t);
    const double yaw2 = -0.507 * std::sin(1.3 * t);
    const double roll = 0.4 * std::sin(5 * t);
    const double roll1 = 2 * std::cos(5 * t);
    const double roll2 = -10 * std::sin(5 * t);
    s.T_world_body.rotation =
        Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
    s.angular_velocity = {roll1, yaw1 * std::sin(roll), yaw1 * std::cos(roll)};
    s.angular_acceleration = {roll2, yaw2 * std::sin(roll) + yaw1 * roll1 * std::cos(roll),
                              yaw2 * std::cos(roll) - yaw1 * roll1 * std::sin(roll)};
    return s;
  }
};

/// At rest where the world begins.
class RestingMotion final : public Motion {
 public:
  double duration_s() const override { return std::numeric_limits<double>::infinity(); }
  MotionState at(double t) const override {
    MotionState s;
    s.time_s = t;
    return s;
  }
};

}  // namespace loc::test
