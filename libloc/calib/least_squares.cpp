#include "libloc/calib/least_squares.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "libloc/calib/dense.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"

namespace loc {

LeastSquaresResult minimise(const ResidualFunction& function, const Eigen::VectorXd& start,
                            const LeastSquaresOptions& options) {
  LeastSquaresResult result;
  result.x = start;
  Eigen::MatrixXd jacobian;
  function(result.x, result.residuals, &jacobian);
  require(result.residuals.size() >= start.size(), "residuals", static_cast<double>(result.residuals.size()),
          "must be at least as many as parameters");
  require(result.residuals.allFinite() && jacobian.allFinite(), "the residuals at the start must be finite");
  result.cost = result.residuals.squaredNorm();

  double damping = 1e-4;
  double growth = 2;
  Eigen::VectorXd trial;
  Eigen::VectorXd trial_residuals;
  while (result.iterations < options.max_iterations && !result.converged) {
    ++result.iterations;
    const Eigen::MatrixXd hessian = dense::gram(jacobian);
    const Eigen::VectorXd gradient = jacobian.transpose() * result.residuals;
    // Parameters differ by orders of magnitude: damp each by its own curvature, and a little where there is none.
    const double floor = std::max(1e-12 * hessian.diagonal().maxCoeff(), std::numeric_limits<double>::min());
    const Eigen::VectorXd scale = hessian.diagonal().cwiseMax(floor);
    bool accepted = false;
    while (!accepted && !result.converged) {
      Eigen::MatrixXd damped = hessian;
      damped.diagonal() += damping * scale;
      const Eigen::VectorXd step = dense::solve_symmetric(damped, -gradient);
      // Lengths are compared in the metric of the curvature, where all parameters have one unit.
      const Eigen::VectorXd root = scale.cwiseSqrt();
      const double step_size = step.cwiseProduct(root).norm();
      if (!(step_size > options.step_tolerance * (result.x.cwiseProduct(root).norm() + options.step_tolerance))) {
        result.converged = step.allFinite();
        break;
      }
      trial = result.x + step;
      function(trial, trial_residuals, nullptr);
      const double trial_cost = trial_residuals.squaredNorm();
      const double predicted = step.dot(damping * scale.cwiseProduct(step) - gradient);
      if (std::isfinite(trial_cost) && trial_cost < result.cost) {
        const double gain = (result.cost - trial_cost) / predicted;
        result.converged = result.cost - trial_cost <= options.cost_tolerance * result.cost;
        result.x = trial;
        result.cost = trial_cost;
        function(result.x, result.residuals, &jacobian);
        damping = std::max(1e-15, damping * std::max(1.0 / 3.0, 1 - std::pow(2 * gain - 1, 3)));
        growth = 2;
        accepted = true;
      } else {
        // At the bottom to rounding: no step can lower the cost any more.
        if (predicted <= 1e-14 * result.cost) result.converged = true;
        damping *= growth;
        growth *= 2;
        if (damping > 1e30) break;
      }
    }
    if (!accepted) break;
  }
  result.information = dense::gram(jacobian);
  return result;
}

std::optional<Eigen::MatrixXd> covariance_from(const Eigen::MatrixXd& information) {
  if (!information.allFinite() || !(information.diagonal().array() > 0).all()) return std::nullopt;
  const Eigen::VectorXd scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const dense::SymmetricEigen eigen = dense::symmetric_eigen(scaled);
  const Eigen::VectorXd& values = eigen.values;
  if (!(values[0] > 1e-13 * values[values.size() - 1])) return std::nullopt;
  const Eigen::MatrixXd inverse = dense::compose(eigen.vectors, values.cwiseInverse());
  return scale.asDiagonal() * inverse * scale.asDiagonal();
}

double small_sample_factor(int dof) {
  if (dof < 1) return std::numeric_limits<double>::infinity();
  // 97.5 % quantile of Student's t: exact for 1 and 2, from there the expansion of Abramowitz and Stegun 26.7.5, good
  // to 1 %.
  constexpr double kNormal = 1.959963984540054;
  if (dof == 1) return 12.706204736 / kNormal;
  if (dof == 2) return 4.302652730 / kNormal;
  const double z = kNormal;
  const double n = dof;
  const double z2 = z * z;
  const double g1 = (z2 + 1) * z / 4;
  const double g2 = ((5 * z2 + 16) * z2 + 3) * z / 96;
  const double g3 = (((3 * z2 + 19) * z2 + 17) * z2 - 15) * z / 384;
  return (z + g1 / n + g2 / (n * n) + g3 / (n * n * n)) / z;
}

double golden_section(const std::function<double(double)>& cost, double low, double high, double width) {
  const double ratio = (std::sqrt(5.0) - 1) / 2;
  double left = high - ratio * (high - low);
  double right = low + ratio * (high - low);
  double left_cost = cost(left);
  double right_cost = cost(right);
  while (high - low > width) {
    if (left_cost < right_cost) {
      high = right;
      right = left;
      right_cost = left_cost;
      left = high - ratio * (high - low);
      left_cost = cost(left);
    } else {
      low = left;
      left = right;
      left_cost = right_cost;
      right = low + ratio * (high - low);
      right_cost = cost(right);
    }
  }
  return (low + high) / 2;
}

double robust_sigma(std::span<const double> values) {
  std::vector<double> magnitudes(values.size());
  std::transform(values.begin(), values.end(), magnitudes.begin(), [](double v) { return std::abs(v); });
  constexpr double kMedianOfHalfNormal = 0.6744897501960817;
  return quantile(magnitudes, 0.5) / kMedianOfHalfNormal;
}

double tukey_weight(double r, double c) {
  const double u = r / c;
  if (!(std::abs(u) < 1)) return 0;
  const double w = 1 - u * u;
  return w * w;
}

}  // namespace loc
