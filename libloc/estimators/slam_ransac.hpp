// Which measurements of a frame agree with each other.
//
// 1-point RANSAC: one measurement and the prior are enough for a hypothesis of the whole state; what it says of all
// others follows from the innovation covariance S alone, so that a hypothesis costs a few numbers for each of them:
//   r_j|i = r_j - S_ji S_ii^-1 r_i
// and j agrees with i when r_j|i is within the gate of the pixel's own noise. The hypothesis that makes all residuals
// together most likely wins, where one outside the gate counts as much as the gate: r_i S_ii^-1 r_i + sum of
// min(|r_j|i|^2/sigma^2, gate). So a wrong measurement that all others are indifferent to is not preferred to the
// prior, and many right ones overrule a prior that is wrong. What does not agree may still be right: a near feature,
// one of unknown depth. It is for compatible() to tell, once those that agree have corrected the state. Source: J.
// Civera, O. Grasa, A. Davison, J. Montiel, "1-Point RANSAC for extended Kalman filtering", Journal of Field Robotics
// 27, 2010. There the state is corrected and projected anew; here the correction is the linear one.
//
// Compatible: one after the other, the nearest to its prediction first, is taken when it is within the gate of what
// those taken before make of it. Alone, each of two contradictory ones may pass where the state is uncertain.
// Source: after J. Neira, J. Tardos, "Data association in stochastic mapping using the joint compatibility test", 2001
// (greedy, for known identities).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libloc/estimators/slam_options.hpp"
#include "libloc/filter/map_covariance.hpp"

namespace loc {

class OnePointRansac {
 public:
  /// @param capacity largest number of measurements
  OnePointRansac(const SlamAssociationOptions& options, SlamMotion motion, int capacity);

  /// @param covariance after innovate() of measurements of two numbers each @param residual two of each measurement
  /// @param sigma of a number's own noise @param draw changes the draws from frame to frame
  /// @returns of each measurement whether it agrees with the most likely hypothesis.
  const std::vector<char>& run(const MapCovariance& covariance, const std::vector<double>& residual, double sigma,
                               std::uint64_t draw);
  /// @returns of each measurement whether it is compatible with the others that are. Parameters as of run().
  const std::vector<char>& compatible(const MapCovariance& covariance, const std::vector<double>& residual);
  int hypotheses() const { return hypotheses_; }
  double gate() const { return gate_; }

 private:
  // @param by the measurement that is believed; -1: none
  double cost(const MapCovariance& covariance, const std::vector<double>& residual, double sigma, int by,
              std::vector<char>& agrees);
  static std::size_t row_start(std::size_t row);

  SlamAssociationOptions options_;
  double gate_;
  int hypotheses_ = 0;
  std::vector<char> best_;
  std::vector<char> agrees_;
  std::vector<int> order_;
  std::vector<int> taken_;
  std::vector<double> distance_;
  std::vector<double> rows_;  // of the Cholesky factor, one after the other
  std::vector<double> y_;
};

}  // namespace loc
