// Small dense nonlinear least squares by Levenberg and Marquardt, for calibrations with a handful of parameters.
// Source: Nocedal, Wright, "Numerical optimization", 2006, section 10.3; damping by the gain ratio after Nielsen,
// "Damping parameter in Marquardt's method", 1999.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>

namespace loc {

/// Residuals at x, whitened by whoever writes the function, and their Jacobian unless that is null. The number of
/// residuals must not change between calls.
using ResidualFunction =
    std::function<void(const Eigen::VectorXd& x, Eigen::VectorXd& residuals, Eigen::MatrixXd* jacobian)>;

struct LeastSquaresOptions {
  int max_iterations = 100;
  double step_tolerance = 1e-11;  ///< of a step relative to its parameters: below, it has converged
  double cost_tolerance = 1e-15;  ///< relative fall of the cost: below, it has converged
};

struct LeastSquaresResult {
  Eigen::VectorXd x;
  Eigen::VectorXd residuals;    ///< at x
  Eigen::MatrixXd information;  ///< J^T J at x
  double cost = 0;              ///< sum of squares
  int iterations = 0;
  bool converged = false;
};

/// @throws std::invalid_argument when there are fewer residuals than parameters, or the residuals at the start are not
/// finite.
LeastSquaresResult minimise(const ResidualFunction& function, const Eigen::VectorXd& start,
                            const LeastSquaresOptions& options = {});

/// Inverse of an information matrix; nullopt when some direction is not determined (reciprocal condition, with the
/// parameters scaled to a unit diagonal, below 1e-13).
std::optional<Eigen::MatrixXd> covariance_from(const Eigen::MatrixXd& information);

/// Factor on a deviation that was itself estimated with few degrees of freedom, so that +-1.96 of it still covers 95 %:
/// Student's t over the normal quantile. Infinite for dof < 1.
double small_sample_factor(int dof);

/// Place of the minimum of a function with one minimum in [low, high], to this width, by golden section (Kiefer 1953).
double golden_section(const std::function<double(double)>& cost, double low, double high, double width);

/// 1.4826 * median(|values|): the deviation of normal values around zero, whatever a minority of them is.
double robust_sigma(std::span<const double> values);

/// Tukey's weight (1 - (r/c)^2)^2, 0 beyond c; r in sigmas.
double tukey_weight(double r, double c = 4.685);

}  // namespace loc
