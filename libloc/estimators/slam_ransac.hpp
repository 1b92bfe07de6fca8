// 1-point RANSAC: which measurements of a frame agree with each other. One measurement and the prior are enough for a
// hypothesis of the whole state; what it says of all others follows from the innovation covariance S alone, so that a
// hypothesis costs a few numbers for each of them:
//   r_j|i = r_j - S_ji S_ii^-1 r_i,   S_j|i = S_jj - S_ji S_ii^-1 S_ij
// and j agrees with i when r_j|i is within the gate of S_j|i.
// Source: J. Civera, O. Grasa, A. Davison, J. Montiel, "1-Point RANSAC for extended Kalman filtering", Journal of Field
// Robotics 27, 2010. There the state is corrected and projected anew; here the correction is the linear one.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libloc/estimators/slam_options.hpp"
#include "libloc/filter/map_covariance.hpp"

namespace loc {

class OnePointRansac {
 public:
  /// @param capacity largest number of measurements
  OnePointRansac(const SlamAssociationOptions& options, int capacity);

  /// @param covariance after innovate() of measurements of two numbers each @param residual two of each measurement
  /// @param draw changes the draws from frame to frame
  /// @returns of each measurement whether it agrees with the hypothesis that most agree with.
  const std::vector<char>& run(const MapCovariance& covariance, const std::vector<double>& residual,
                               std::uint64_t draw);
  int hypotheses() const { return hypotheses_; }
  double gate() const { return gate_; }

 private:
  int vote(const MapCovariance& covariance, const std::vector<double>& residual, int by, std::vector<char>& agrees);

  SlamAssociationOptions options_;
  double gate_;
  int hypotheses_ = 0;
  std::vector<char> best_;
  std::vector<char> agrees_;
  std::vector<int> order_;
};

}  // namespace loc
