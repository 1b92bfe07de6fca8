// Is an estimator as good as its covariance says? Normalised estimation error squared (NEES) with the error of the
// state, normalised innovation squared (NIS) with an innovation: both are e^T P^-1 e and, of a consistent estimator,
// chi-square with as many degrees of freedom as e has.
// Source: Bar-Shalom, Li, Kirubarajan, "Estimation with Applications to Tracking and Navigation", 2001, section 5.4.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

namespace loc {

/// e^T P^-1 e. For a state on a manifold, error = boxminus(true, estimate), in the axes of the covariance.
/// @throws std::invalid_argument when sizes do not fit, a value is not finite, or the covariance is not symmetric (to
/// 1e-9 of its largest entry) or not positive definite.
double normalised_error_squared(const Eigen::Ref<const Eigen::VectorXd>& error,
                                const Eigen::Ref<const Eigen::MatrixXd>& covariance);

struct Consistency {
  double average = 0;  ///< of the values; its expectation is dof
  double lower = 0;    ///< two-sided bounds of the average, of a consistent estimator
  double upper = 0;
  int dof = 0;  ///< of one value
  std::int64_t samples = 0;

  bool optimistic() const { return average > upper; }   ///< the covariance is too small, or there is a bias
  bool pessimistic() const { return average < lower; }  ///< the covariance is too large
  bool consistent() const { return !optimistic() && !pessimistic(); }
};

/// Average of independent values (runs of a Monte Carlo at one time, or white innovations) against its bounds.
/// @param dof size of the error
/// @param probability of a consistent estimator being inside the bounds
/// @throws std::invalid_argument when empty, a value is negative or not finite, or dof or probability are out of range.
Consistency average_consistency(std::span<const double> values, int dof, double probability = 0.95);

}  // namespace loc
