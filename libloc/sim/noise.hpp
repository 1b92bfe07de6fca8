// What simulated sensors share: correlated noise in three axes, and stretches of time.
#pragma once

#include <Eigen/Core>
#include <string_view>
#include <vector>

#include "libloc/core/random.hpp"

namespace loc {

/// A stretch of time since the start of the motion: begin_s <= t < end_s.
struct TimeInterval {
  double begin_s = 0;
  double end_s = 0;

  bool contains(double time_s) const { return time_s >= begin_s && time_s < end_s; }
};
bool contains(const std::vector<TimeInterval>& intervals, double time_s);
/// @throws std::invalid_argument naming the field and its value, unless each begins at 0 or later and ends after that.
void check_intervals(std::string_view name, const std::vector<TimeInterval>& intervals);

/// First-order Gauss-Markov process in three independent axes: correlation sigma^2 exp(-|dt| / time constant), exact
/// for steps of any length. It starts from its stationary distribution.
class GaussMarkov {
 public:
  /// @param sigma of one axis, of whatever unit; 0: always zero
  /// @param time_constant_s not used when sigma is 0
  GaussMarkov(const Eigen::Vector3d& sigma, double time_constant_s, Random random);
  GaussMarkov(double sigma, double time_constant_s, Random random)
      : GaussMarkov(Eigen::Vector3d(Eigen::Vector3d::Constant(sigma)), time_constant_s, random) {}

  const Eigen::Vector3d& value() const { return value_; }
  /// @param dt_s not negative @return the new value
  const Eigen::Vector3d& advance(double dt_s);

 private:
  Eigen::Vector3d sigma_;
  double time_constant_s_;
  Random random_;
  Eigen::Vector3d value_;
};

/// Random walk in three independent axes, from zero.
class RandomWalk {
 public:
  /// @param density deviation after one second
  RandomWalk(double density, Random random) : density_(density), random_(random) {}

  const Eigen::Vector3d& value() const { return value_; }
  const Eigen::Vector3d& advance(double dt_s);

 private:
  double density_;
  Random random_;
  Eigen::Vector3d value_ = Eigen::Vector3d::Zero();
};

/// A reading as a sensor of limited range gives it out: rounded to a multiple of resolution (0: not rounded) and kept
/// within the multiples that are inside [-range, range].
struct RoundedReading {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  bool saturated = false;
};
RoundedReading round_reading(const Eigen::Vector3d& value, double range, double resolution);

}  // namespace loc
