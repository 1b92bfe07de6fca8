// Error-state filters that differ in their heading only, fed with the same data, for as long as the heading is not
// known: a single filter cannot linearise about "any heading". What they expect of GPS differs as soon as the body
// accelerates or turns; the likelihood of what GPS says tells which of them is right, whatever way the sensor is
// mounted and whatever way the vehicle goes. Then the best one goes on alone.
//   score_i = sum over measurements of NIS + ln det S        (-2 ln of the likelihood)
// Not observable: the heading at rest and at constant velocity; the bank waits then.
// Source: D. Magill, "Optimal adaptive estimation of sampled stochastic processes", IEEE Transactions on Automatic
// Control 10, 1965.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "libloc/estimators/error_state_filter.hpp"

namespace loc {

struct HeadingBankOptions {
  int headings = 12;               ///< evenly around; each has a deviation of 0.6 of their distance
  double separation = 25;          ///< score by which every other heading must be worse than the best
  double max_heading_sigma = 0.2;  ///< of the best, before the others go [rad]
  int min_measurements = 4;        ///< that were scored
  /// Mean NIS of the best over the last few, per number measured: with more none of them is right (a bias beyond its
  /// deviation, a wrong start), and the best of bad ones is not chosen.
  double max_mean_nis = 3;

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

class HeadingBank {
 public:
  /// @throws std::invalid_argument as the options' check.
  HeadingBank(const HeadingBankOptions& options, const ErrorStateOptions& filter);

  /// One filter, as ErrorStateFilter::start.
  void start(TimeNs time_ns, const ErrorStateState& state, const Eigen::MatrixXd& covariance);
  /// One filter for each heading: attitude and velocity are turned about the vertical through the body.
  /// @param covariance whose heading uncertainty is replaced by that of each filter
  void start_all_headings(TimeNs time_ns, const ErrorStateState& state, const Eigen::MatrixXd& covariance);

  std::size_t size() const { return filters_.size(); }
  const ErrorStateFilter& best() const { return filters_[best_]; }

  /// Of the best one; results() holds what became of its waiting measurements.
  PredictOutcome predict(const ImuMeasurement& imu);
  const std::vector<FusionResult>& results() const { return filters_[best_].finished(); }
  /// Feeds all. @returns the result of the best.
  FusionResult fuse(const std::function<FusionResult(ErrorStateFilter&)>& feed);
  /// @param variances of the error state, as ErrorStateFilter::widen
  void widen(const Eigen::VectorXd& variances);

  /// Looks whether one heading stands out. @returns true when the others have just gone; what they said of the heading
  /// is in the covariance of the one that stays.
  bool decide();
  /// Variance of the heading: of the best one, and of where the others are, by their likelihood [rad^2].
  double heading_variance() const;
  /// Variance that the others add to the best one's heading [rad^2]; 0 when it is alone.
  double spread() const;

 private:
  void score(std::size_t i, const FusionResult& result);
  void find_best();
  Eigen::MatrixXd mixed_covariance() const;

  HeadingBankOptions options_;
  std::vector<ErrorStateFilter> filters_;
  std::vector<double> scores_;
  std::vector<double> nis_;  // weighted sums of the last few
  std::size_t best_ = 0;
  int scored_ = 0;
  double dof_ = 0;  // numbers measured in them, weighted alike
};

/// Variance of the heading in the covariance of an error state [rad^2].
double heading_variance(const ErrorStateState& state, const Eigen::Ref<const Eigen::MatrixXd>& covariance);

/// Turns attitude and velocity by an angle about the vertical through the body, and the covariance with them.
/// @param sigma uncertainty of that turn [rad]
void turn_heading(double angle, double sigma, ErrorStateState& state, Eigen::MatrixXd& covariance);

}  // namespace loc
