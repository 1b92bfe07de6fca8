// Small statistics that estimators, evaluation and tests share.
#pragma once

#include <span>

namespace loc {

/// Root mean square. @throws std::invalid_argument when empty.
double root_mean_square(std::span<const double> values);

/// Arithmetic mean. @throws std::invalid_argument when empty.
double mean(std::span<const double> values);

/// Linear interpolation between order statistics, as numpy.quantile does by default.
/// @param probability in [0, 1]
/// @throws std::invalid_argument when empty, a value is NaN or the probability is out of range.
double quantile(std::span<const double> values, double probability);

/// Distribution function of chi-square: P(X <= x). @throws std::invalid_argument unless dof > 0.
double chi_square_cdf(double x, double dof);

/// Upper tail of chi-square: P(X > x), with all its digits where the distribution function is 1 to rounding.
/// @throws std::invalid_argument unless dof > 0.
double chi_square_survival(double x, double dof);

/// x with P(X <= x) = probability: the bound of a gate. @throws std::invalid_argument unless 0 <= probability < 1, dof
/// > 0.
double chi_square_quantile(double probability, double dof);

}  // namespace loc
