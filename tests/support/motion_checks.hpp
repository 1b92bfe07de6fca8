// The one check of motions: velocity, acceleration and both angular quantities are the derivatives that they claim to
// be. Differences of fourth order; one-sided beside the ends of the motion and beside times where a derivative jumps.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "libloc/geometry/so3.hpp"
#include "libloc/sim/motion.hpp"

namespace loc::test {

struct MotionCheck {
  std::vector<double> breaks_s;  ///< where acceleration or rate may jump: the state there is that of the later side
  double step_s = 1e-3;
  double tolerance = 1e-7;  ///< of a derivative: times 1 + its size
};

inline bool close(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double tolerance) {
  return (a - b).norm() <= tolerance * (1 + b.norm());  // false for NaN
}

/// Differentiates at the times and compares.
inline void check_derivatives(const Motion& motion, const std::vector<double>& times, const MotionCheck& check = {}) {
  const double h = check.step_s;
  for (const double t : times) {
    // Offsets in steps and weights: central, forwards, or backwards.
    std::array<double, 5> offsets = {-2, -1, 0, 1, 2};
    std::array<double, 5> weights = {1.0 / 12, -8.0 / 12, 0, 8.0 / 12, -1.0 / 12};
    const auto one_sided = [&](double side) {
      offsets = {0, side, 2 * side, 3 * side, 4 * side};
      weights = {-25.0 / 12 * side, 4.0 * side, -3.0 * side, 4.0 / 3 * side, -0.25 * side};
    };
    for (const double at_break : check.breaks_s) {
      if (t >= at_break && t < at_break + 2 * h) one_sided(1);
      if (t < at_break && t >= at_break - 2 * h) one_sided(-1);
    }
    if (t < 2 * h) one_sided(1);
    if (t + 2 * h > motion.duration_s()) one_sided(-1);
    const MotionState here = motion.at(t);
    EXPECT_EQ(here.time_s, t);
    EXPECT_NEAR(here.T_world_body.rotation.norm(), 1, 1e-12);
    Eigen::Matrix<double, 3, 4> derivative = Eigen::Matrix<double, 3, 4>::Zero();
    for (std::size_t i = 0; i < 5; ++i) {
      const MotionState state = motion.at(t + offsets[i] * h);
      derivative.col(0) += weights[i] / h * (state.T_world_body.translation - here.T_world_body.translation);
      derivative.col(1) += weights[i] / h * state.velocity;
      derivative.col(2) += weights[i] / h * so3::boxminus(state.T_world_body.rotation, here.T_world_body.rotation);
      derivative.col(3) += weights[i] / h * state.angular_velocity;
    }
    const auto expect = [&](const char* what, const Eigen::Vector3d& claimed, int column) {
      EXPECT_TRUE(close(claimed, derivative.col(column), check.tolerance))
          << what << " at " << t << " s: " << claimed.transpose() << ", difference quotient "
          << derivative.col(column).transpose();
    };
    expect("velocity", here.velocity, 0);
    expect("acceleration", here.acceleration, 1);
    expect("angular velocity", here.angular_velocity, 2);
    expect("angular acceleration", here.angular_acceleration, 3);
  }
}

/// So many times from 0 to end, not multiples of anything, both ends included.
inline std::vector<double> spread_times(double end_s, int count) {
  std::vector<double> times = {0, end_s};
  for (int i = 1; i < count; ++i) times.push_back(end_s * std::fmod(i * 0.6180339887498949, 1.0));
  return times;
}

/// Times just before, at and just after each of these.
inline std::vector<double> times_around(const std::vector<double>& times, double duration_s) {
  std::vector<double> out;
  for (const double t : times) {
    for (const double d : {-1e-3, -1e-6, 0.0, 1e-6, 1e-3}) {
      if (t + d >= 0 && t + d <= duration_s) out.push_back(t + d);
    }
  }
  return out;
}

/// Pose and velocity do not jump; with smooth, nor does anything else.
inline void check_continuity(const Motion& motion, const std::vector<double>& times, bool smooth,
                             double tolerance = 1e-6) {
  constexpr double kGap = 1e-9;
  for (const double t : times) {
    if (t < kGap || t + kGap > motion.duration_s()) continue;
    const MotionState before = motion.at(t - kGap);
    const MotionState after = motion.at(t + kGap);
    EXPECT_TRUE(close(before.T_world_body.translation, after.T_world_body.translation, tolerance)) << t;
    EXPECT_LT(so3::angle_between(before.T_world_body.rotation, after.T_world_body.rotation), tolerance) << t;
    EXPECT_TRUE(close(before.velocity, after.velocity, tolerance)) << t;
    if (!smooth) continue;
    EXPECT_TRUE(close(before.acceleration, after.acceleration, tolerance)) << t;
    EXPECT_TRUE(close(before.angular_velocity, after.angular_velocity, tolerance)) << t;
    EXPECT_TRUE(close(before.angular_acceleration, after.angular_acceleration, tolerance)) << t;
  }
}

/// All of a state, for comparing two bit by bit.
inline Eigen::Matrix<double, 20, 1> numbers_of(const MotionState& s) {
  Eigen::Matrix<double, 20, 1> out;
  out << s.time_s, s.T_world_body.rotation.coeffs(), s.T_world_body.translation, s.velocity, s.acceleration,
      s.angular_velocity, s.angular_acceleration;
  return out;
}

/// Same states bit by bit, asked in another order.
inline void check_same(const Motion& a, const Motion& b, const std::vector<double>& times) {
  for (std::size_t i = 0; i < times.size(); ++i) {
    b.at(times[times.size() - 1 - i]);
    EXPECT_EQ(numbers_of(a.at(times[i])), numbers_of(b.at(times[i]))) << times[i];
  }
}

/// The time must be within the motion.
inline void check_time_bounds(const Motion& motion) {
  EXPECT_NO_THROW(motion.at(0));
  for (const double t : {-1e-9, std::nan(""), -HUGE_VAL}) EXPECT_THROW(motion.at(t), std::invalid_argument) << t;
  if (const double end = motion.duration_s(); std::isfinite(end)) {
    EXPECT_NO_THROW(motion.at(end));
    EXPECT_THROW(motion.at(std::nextafter(end, HUGE_VAL)), std::invalid_argument);
  } else {
    EXPECT_THROW(motion.at(HUGE_VAL), std::invalid_argument);
  }
}

/// The text of what is thrown.
template <class Function>
std::string thrown_text(const Function& function) {
  try {
    function();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing thrown";
}

}  // namespace loc::test
