#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "libloc/calib/dense.hpp"
#include "libloc/calib/ellipsoid_detail.hpp"
#include "libloc/calib/least_squares.hpp"
#include "libloc/core/random.hpp"

namespace loc::detail {
namespace {

constexpr double kSmallestSigma = 1e-12;  // normalised: exact data must not divide by zero
constexpr int kSubsets = 300;             // 30 % outliers: 12 subsets of 9 without one
constexpr int kSubsetSize = 9;
constexpr int kBestSubsets = 10;
constexpr Eigen::Index kLmedsReadings = 500;  // of a longer recording, every n-th

using Vector6 = Eigen::Matrix<double, 6, 1>;

Ellipsoid moved(const Ellipsoid& e, const Vector9& step) {
  Ellipsoid out = e;
  out.centre += step.head<3>();
  const auto w = step.tail<6>();
  Eigen::Matrix3d d;
  d << w[0], w[3], w[4], w[3], w[1], w[5], w[4], w[5], w[2];
  out.matrix += d;
  return out;
}

bool positive_definite(const Eigen::Matrix3d& m) {
  const Eigen::LLT<Eigen::Matrix3d> llt(m);
  return llt.info() == Eigen::Success && llt.matrixL().toDenseMatrix().diagonal().minCoeff() > 1e-9;
}

// Tukey's loss, 1 beyond c.
double tukey_loss(double ratio_squared) {
  if (ratio_squared >= 1) return 1;
  const double inside = 1 - ratio_squared;
  return 1 - inside * inside * inside;
}
// Least squares of the robust cost: c^2/6 sum tukey(r / (c sigma)) + prior.
class Problem {
 public:
  Problem(const NormalisedReadings& readings, const RobustOptions& options)
      : readings_(readings), options_(options), residuals_(static_cast<std::size_t>(readings.z.cols())) {
    if (options.sphere) {
      basis_ = Eigen::MatrixXd::Zero(9, 4);
      basis_.topLeftCorner<3, 3>().setIdentity();
      basis_.block<3, 1>(3, 3).setOnes();
    } else {
      basis_ = Eigen::MatrixXd::Identity(9, 9);
    }
  }

  int parameters() const { return static_cast<int>(basis_.cols()); }
  const Eigen::MatrixXd& basis() const { return basis_; }

  double scale(const Ellipsoid& e) {
    residuals(readings_, e, residuals_);
    return std::max(scale_of(readings_, residuals_, parameters(), buffer_), kSmallestSigma);
  }

  double cost(const Ellipsoid& e, double sigma) {
    residuals(readings_, e, residuals_);
    const double bound = options_.tukey_c * sigma;
    double sum = 0;
    for (const double r : residuals_) sum += tukey_loss(r * r / (bound * bound));
    return options_.tukey_c * options_.tukey_c / 6 * sum + prior_cost(e);
  }

  // Gauss-Newton's normal equations of the cost.
  void linearise(const Ellipsoid& e, double sigma, Matrix9& hessian, Vector9& gradient) const {
    hessian.setZero();
    gradient.setZero();
    Vector9 jacobian;
    for (Eigen::Index i = 0; i < readings_.z.cols(); ++i) {
      double distance = 0;
      if (!sampson_distance(e, readings_.z.col(i), distance, &jacobian)) continue;
      const double weight = readings_.weights[i];
      const double w = tukey_weight(distance * std::sqrt(weight) / sigma, options_.tukey_c) * weight / (sigma * sigma);
      if (w == 0) continue;
      hessian.selfadjointView<Eigen::Lower>().rankUpdate(jacobian, w);
      gradient += w * distance * jacobian;
    }
    hessian = Matrix9(hessian.selfadjointView<Eigen::Lower>());
    if (options_.shape_prior_sigma > 0 && !options_.sphere) {
      Vector6 residual;
      Eigen::Matrix<double, 6, 6> prior;
      shape_prior(e, options_.shape_prior_sigma, residual, prior);
      hessian.bottomRightCorner<6, 6>() += dense::gram(prior);
      gradient.tail<6>() += prior.transpose() * residual;
    }
  }

 private:
  double prior_cost(const Ellipsoid& e) const {
    if (!(options_.shape_prior_sigma > 0) || options_.sphere) return 0;
    Vector6 residual;
    Eigen::Matrix<double, 6, 6> jacobian;
    shape_prior(e, options_.shape_prior_sigma, residual, jacobian);
    return residual.squaredNorm() / 2;
  }

  const NormalisedReadings& readings_;
  RobustOptions options_;
  Eigen::MatrixXd basis_;
  std::vector<double> residuals_;
  std::vector<double> buffer_;
};

}  // namespace

bool sampson_distance(const Ellipsoid& e, const Eigen::Vector3d& z, double& distance, Vector9* jacobian) {
  // g = |y| - 1 over its gradient by z: the first-order distance, nearly exact also far from the surface.
  const Eigen::Vector3d d = z - e.centre;
  const Eigen::Vector3d y = e.matrix * d;
  const double length = y.norm();
  if (!(length > 1e-9)) return false;
  const Eigen::Vector3d u = y / length;
  const Eigen::Vector3d gradient = e.matrix * u;
  const double slope = gradient.norm();
  distance = (length - 1) / slope;
  if (jacobian == nullptr) return true;
  // dr = (dg - r d|W u|) / |W u|, with dy = dW d - W dC and d|W u| = v' (dW u + W du).
  const Eigen::Vector3d v = gradient / slope;
  const Eigen::Vector3d wv = e.matrix * v;
  const Eigen::Vector3d q = (wv - u * u.dot(wv)) / length;
  const Eigen::Vector3d a = u - distance * q;  // factor of dy
  jacobian->head<3>() = -(e.matrix * a) / slope;
  Vector9& j = *jacobian;
  for (int i = 0; i < 3; ++i) j[3 + i] = (a[i] * d[i] - distance * v[i] * u[i]) / slope;
  int k = 6;
  for (const auto& [row, column] : {std::pair{0, 1}, std::pair{0, 2}, std::pair{1, 2}}) {
    j[k++] = (a[row] * d[column] + a[column] * d[row] - distance * (v[row] * u[column] + v[column] * u[row])) / slope;
  }
  return true;
}

void residuals(const NormalisedReadings& readings, const Ellipsoid& e, std::span<double> out) {
  for (Eigen::Index i = 0; i < readings.z.cols(); ++i) {
    double distance = 0;
    // The centre itself is as far from the surface as the shortest axis: an outlier in any case.
    if (!sampson_distance(e, readings.z.col(i), distance, nullptr)) distance = 1 / e.matrix.norm();
    out[static_cast<std::size_t>(i)] = distance * std::sqrt(readings.weights[i]);
  }
}

double scale_of(const NormalisedReadings& readings, std::span<const double> all, int parameters,
                std::vector<double>& buffer) {
  buffer.clear();
  for (const Eigen::Index i : readings.spread) buffer.push_back(all[static_cast<std::size_t>(i)]);
  return robust_scale(buffer, parameters);
}

double robust_scale(std::span<double> values, int parameters) {
  for (double& v : values) v = std::abs(v);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  const double n = static_cast<double>(values.size());
  // Rousseeuw and Leroy, "Robust regression and outlier detection", 1987: the factor for small samples.
  return 1.4826 * (1 + 5 / std::max(1.0, n - parameters)) * *middle;
}

void shape_prior(const Ellipsoid& e, double sigma, Vector6& residual, Eigen::Matrix<double, 6, 6>& jacobian) {
  const Eigen::Matrix3d& w = e.matrix;
  const double mean = w.trace() / 3;
  const double root2 = std::sqrt(2.0);  // off the diagonal each element stands for two
  residual << w(0, 0) / mean - 1, w(1, 1) / mean - 1, w(2, 2) / mean - 1, root2 * w(0, 1) / mean,
      root2 * w(0, 2) / mean, root2 * w(1, 2) / mean;
  residual /= sigma;
  jacobian.setZero();
  for (int i = 0; i < 6; ++i) {
    jacobian(i, i) = (i < 3 ? 1 : root2) / (mean * sigma);
    const double ratio = residual[i] + (i < 3 ? 1 / sigma : 0);
    for (int j = 0; j < 3; ++j) jacobian(i, j) -= ratio / (3 * mean);
  }
}

RobustFit refine(const NormalisedReadings& readings, const Ellipsoid& start, const RobustOptions& options) {
  Problem problem(readings, options);
  RobustFit fit;
  fit.ellipsoid = start;
  fit.sigma = problem.scale(start);
  double damping = 1e-4;
  // The scale follows the fit at first; then it is held, so that one cost falls to its minimum.
  constexpr int kScaleIterations = 15;
  double cost = problem.cost(fit.ellipsoid, fit.sigma);
  Matrix9 hessian;
  Vector9 gradient;
  const Eigen::MatrixXd& basis = problem.basis();
  while (fit.iterations < options.max_iterations) {
    ++fit.iterations;
    problem.linearise(fit.ellipsoid, fit.sigma, hessian, gradient);
    const Eigen::MatrixXd h = dense::propagate(basis.transpose(), hessian);
    const Eigen::VectorXd g = basis.transpose() * gradient;
    Eigen::VectorXd step;
    bool accepted = false;
    for (int attempt = 0; attempt < 12 && !accepted; ++attempt) {
      Eigen::MatrixXd damped = h;
      damped.diagonal() += damping * h.diagonal() + Eigen::VectorXd::Constant(h.rows(), 1e-12 * h.trace());
      step = dense::solve_symmetric(damped, -g);
      const Ellipsoid candidate = moved(fit.ellipsoid, basis * step);
      if (step.allFinite() && positive_definite(candidate.matrix)) {
        const double candidate_cost = problem.cost(candidate, fit.sigma);
        if (candidate_cost <= cost) {
          fit.ellipsoid = candidate;
          cost = candidate_cost;
          accepted = true;
          damping = std::max(damping / 5, 1e-9);
          continue;
        }
      }
      damping = std::max(damping, 1e-6) * 10;
    }
    // In units of the deviations that the curvature predicts: a thousandth of them is nowhere to be seen.
    const bool small_step = accepted && -step.dot(g) < 1e-6;
    if (fit.iterations < kScaleIterations) {
      const double sigma = problem.scale(fit.ellipsoid);
      const bool settled = std::abs(sigma - fit.sigma) < 1e-4 * fit.sigma;
      fit.sigma = sigma;
      cost = problem.cost(fit.ellipsoid, fit.sigma);
      if (settled && (small_step || !accepted)) {
        fit.converged = true;
        return fit;
      }
    } else if (small_step || !accepted) {
      fit.converged = true;
      return fit;
    }
  }
  return fit;
}

std::optional<Ellipsoid> fit_lmeds(const NormalisedReadings& all, std::uint64_t seed) {
  NormalisedReadings readings;
  const auto count = static_cast<Eigen::Index>(all.spread.size());
  const Eigen::Index stride = (count + kLmedsReadings - 1) / kLmedsReadings;
  const Eigen::Index n = stride > 0 ? (count + stride - 1) / stride : 0;
  if (n < kSubsetSize) return std::nullopt;
  readings.z.resize(3, n);
  readings.weights = Eigen::VectorXd::Ones(n);
  for (Eigen::Index i = 0; i < n; ++i) readings.z.col(i) = all.z.col(all.spread[static_cast<std::size_t>(i * stride)]);

  std::vector<double> r(static_cast<std::size_t>(n));
  const auto median = [&](const Ellipsoid& e) {
    residuals(readings, e, r);
    return robust_scale(r, kSubsetSize);
  };
  struct Candidate {
    double scale;
    Ellipsoid ellipsoid;
  };
  std::vector<Candidate> candidates;
  Random random(seed);
  for (int subset = 0; subset < kSubsets; ++subset) {
    QuarticMoments moments;
    for (int i = 0; i < kSubsetSize; ++i) {
      const auto k = static_cast<Eigen::Index>(random.uniform() * static_cast<double>(n));
      moments.add(readings.z.col(k), 1);
    }
    if (const auto e = fit_li_griffiths(moments)) candidates.push_back({median(*e), *e});
  }
  if (candidates.empty()) return std::nullopt;
  const auto by_scale = [](const Candidate& a, const Candidate& b) { return a.scale < b.scale; };
  const std::size_t keep = std::min<std::size_t>(kBestSubsets, candidates.size());
  std::partial_sort(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(keep), candidates.end(),
                    by_scale);
  candidates.resize(keep);
  // Concentration: fit again to the half that fits best (Rousseeuw, van Driessen, "Computing LTS regression", 2006).
  for (Candidate& candidate : candidates) {
    for (int pass = 0; pass < 5; ++pass) {
      const double bound = 0.6745 * candidate.scale;
      QuarticMoments moments;
      for (Eigen::Index i = 0; i < n; ++i) {
        double distance = 0;
        if (!sampson_distance(candidate.ellipsoid, readings.z.col(i), distance, nullptr)) continue;
        if (std::abs(distance) <= bound) moments.add(readings.z.col(i), 1);
      }
      const auto e = fit_li_griffiths(moments);
      if (!e) break;
      const double scale = median(*e);
      if (scale >= candidate.scale) break;
      candidate = {scale, *e};
    }
  }
  return std::min_element(candidates.begin(), candidates.end(), by_scale)->ellipsoid;
}

}  // namespace loc::detail
