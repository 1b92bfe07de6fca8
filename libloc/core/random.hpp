// Seeded random numbers. Whoever needs randomness is given a Random; there is no hidden generator. The same seed gives
// the same numbers on every machine, which the distributions of the standard library do not promise.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <random>

namespace loc {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// A generator for an independent part of a simulation: adding draws in one part leaves the others as they were.
  Random fork(std::uint64_t stream);

  /// Uniform in [0, 1), 53 bits.
  double uniform();
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Standard normal (Marsaglia's polar method).
  double normal();
  /// Three independent standard normals.
  Eigen::Vector3d normal3();
  /// Uniform on the unit sphere.
  Eigen::Vector3d direction();
  /// Uniform on SO(3).
  Eigen::Quaterniond rotation();

 private:
  std::mt19937_64 engine_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace loc
