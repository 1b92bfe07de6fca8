#include "libloc/eval/consistency.hpp"

#include <Eigen/Cholesky>
#include <string>

#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"

namespace loc {

double normalised_error_squared(const Eigen::Ref<const Eigen::VectorXd>& error,
                                const Eigen::Ref<const Eigen::MatrixXd>& covariance) {
  require(error.size() > 0, "error: has no entries");
  require(covariance.rows() == error.size() && covariance.cols() == error.size(),
          "covariance: is " + std::to_string(covariance.rows()) + " x " + std::to_string(covariance.cols()) +
              " for an error of size " + std::to_string(error.size()));
  require(error.allFinite(), "error: must be finite");
  require(covariance.allFinite(), "covariance: must be finite");
  const double asymmetry = (covariance - covariance.transpose()).cwiseAbs().maxCoeff();
  require(asymmetry <= 1e-9 * covariance.cwiseAbs().maxCoeff(), "covariance: asymmetry", asymmetry, "must be 0");
  const Eigen::LLT<Eigen::MatrixXd> cholesky(covariance);
  require(cholesky.info() == Eigen::Success, "covariance: must be positive definite");
  // e^T (L L^T)^-1 e = |L^-1 e|^2: never negative.
  return cholesky.matrixL().solve(error).squaredNorm();
}

Consistency average_consistency(std::span<const double> values, int dof, double probability) {
  require(dof > 0, "dof", dof, "must be positive");
  require(probability > 0 && probability < 1, "probability", probability, "must be in (0, 1)");
  for (const double value : values) require_not_negative("value", value);
  Consistency result;
  result.dof = dof;
  result.samples = static_cast<std::int64_t>(values.size());
  result.average = mean(values);
  // The sum of n values is chi-square with n dof degrees of freedom.
  const auto n = static_cast<double>(values.size());
  result.lower = chi_square_quantile((1 - probability) / 2, n * dof) / n;
  result.upper = chi_square_quantile((1 + probability) / 2, n * dof) / n;
  return result;
}

}  // namespace loc
