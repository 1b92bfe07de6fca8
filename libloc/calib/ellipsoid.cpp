#include "libloc/calib/ellipsoid.hpp"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <vector>

#include "libloc/calib/dense.hpp"
#include "libloc/calib/ellipsoid_detail.hpp"
#include "libloc/core/check.hpp"

namespace loc {
namespace {

using detail::Ellipsoid;
using detail::Matrix9;
using detail::NormalisedReadings;
using detail::Vector9;

constexpr std::array<EllipsoidMethod, 4> kMethods = {EllipsoidMethod::kLsq, EllipsoidMethod::kRobust,
                                                     EllipsoidMethod::kAls, EllipsoidMethod::kSphere};
constexpr double kLowInliers = 0.8;
constexpr double kFairInliers = 0.95;
constexpr double kAbsurdNoise = 0.15;  // of the radius: these are not readings of one field
constexpr double kHighNoise = 0.05;    // no sensor is that noisy, the field varied
constexpr double kFairNoise = 0.03;
constexpr double kHighAxisRatio = 2.0;
constexpr std::int64_t kFewReadings = 30;
constexpr Eigen::Index kLongestCorrelation = 500;  // readings

std::string percent(double ratio) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g %%", 100 * ratio);
  return text.data();
}

bool is_robust(EllipsoidMethod method) {
  return method == EllipsoidMethod::kRobust || method == EllipsoidMethod::kSphere;
}

// A device that lay still for most of a recording gives the same reading again and again, and the median of the
// residuals would be that of this one: of each direction only so many readings tell the scale.
void find_spread(NormalisedReadings& readings) {
  constexpr std::size_t kLeast = 10;
  const Eigen::Vector3d middle = readings.z.rowwise().minCoeff() / 2 + readings.z.rowwise().maxCoeff() / 2;
  std::array<std::vector<Eigen::Index>, SphereCoverage::kCells> cells;
  for (Eigen::Index i = 0; i < readings.z.cols(); ++i) {
    const Eigen::Vector3d direction = readings.z.col(i) - middle;
    if (direction.norm() > 0) cells[static_cast<std::size_t>(SphereCoverage::cell(direction))].push_back(i);
  }
  std::vector<std::size_t> sizes;
  for (const auto& cell : cells) {
    if (!cell.empty()) sizes.push_back(cell.size());
  }
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2), sizes.end());
  const std::size_t most = std::max(kLeast, 3 * sizes[sizes.size() / 2]);
  for (const auto& cell : cells) {
    const std::size_t taken = std::min(cell.size(), most);
    for (std::size_t k = 0; k < taken; ++k) readings.spread.push_back(cell[k * cell.size() / taken]);
  }
  std::sort(readings.spread.begin(), readings.spread.end());
}

NormalisedReadings normalise(const detail::Readings& readings, std::span<const double> weights, EllipsoidFit& fit) {
  NormalisedReadings out;
  std::vector<Eigen::Index> taken;
  taken.reserve(static_cast<std::size_t>(readings.rows()));
  for (Eigen::Index i = 0; i < readings.rows(); ++i) {
    const bool counts = weights.empty() || weights[static_cast<std::size_t>(i)] > 0;
    if (!readings.row(i).allFinite()) {
      ++fit.not_finite;
    } else if (counts) {
      taken.push_back(i);
    }
  }
  const auto n = static_cast<Eigen::Index>(taken.size());
  fit.readings = n;
  out.z.resize(3, n);
  out.weights = Eigen::VectorXd::Ones(n);
  if (n == 0) return out;
  for (Eigen::Index i = 0; i < n; ++i) {
    out.z.col(i) = readings.row(taken[static_cast<std::size_t>(i)]).transpose();
    if (!weights.empty()) out.weights[i] = weights[static_cast<std::size_t>(taken[static_cast<std::size_t>(i)])];
  }
  out.weights /= out.weights.mean();
  // Halves: the sum of two huge readings must not overflow.
  out.origin = out.z.rowwise().minCoeff() / 2 + out.z.rowwise().maxCoeff() / 2;
  out.z.colwise() -= out.origin;
  const double reach = out.z.cwiseAbs().maxCoeff();
  if (!(reach > 0) || !std::isfinite(reach)) {
    out.scale = 0;
    return out;
  }
  out.z /= reach;
  const Eigen::Vector3d mean = out.z * out.weights / static_cast<double>(n);
  out.z.colwise() -= mean;
  const double spread = std::sqrt(out.z.colwise().squaredNorm().dot(out.weights) / static_cast<double>(n));
  out.z /= spread;
  out.origin += reach * mean;
  out.scale = reach * spread;
  find_spread(out);
  return out;
}

detail::QuarticMoments moments_of(const NormalisedReadings& readings) {
  detail::QuarticMoments moments;
  for (Eigen::Index i = 0; i < readings.z.cols(); ++i) moments.add(readings.z.col(i), readings.weights[i]);
  return moments;
}

double outlier_share(const NormalisedReadings& readings, const detail::RobustFit& fit) {
  std::vector<double> r(static_cast<std::size_t>(readings.z.cols()));
  detail::residuals(readings, fit.ellipsoid, r);
  const auto far = [&](Eigen::Index i) { return std::abs(r[static_cast<std::size_t>(i)]) > 3.5 * fit.sigma; };
  const auto& spread = readings.spread;
  return static_cast<double>(std::count_if(spread.begin(), spread.end(), far)) / static_cast<double>(spread.size());
}

// A sphere through the data, for where no ellipsoid can be had directly.
Ellipsoid sphere_start(const NormalisedReadings& readings) {
  Ellipsoid e;
  // |z|^2 = 2 c.z + k
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  for (Eigen::Index i = 0; i < readings.z.cols(); ++i) {
    const Eigen::Vector4d row(2 * readings.z(0, i), 2 * readings.z(1, i), 2 * readings.z(2, i), 1);
    normal += readings.weights[i] * row * row.transpose();
    right += readings.weights[i] * row * readings.z.col(i).squaredNorm();
  }
  const Eigen::Vector4d solution = dense::solve_symmetric(normal, right);
  const double square = solution[3] + solution.head<3>().squaredNorm();
  if (solution.allFinite() && square > 0) {
    e.centre = solution.head<3>();
    e.matrix = Eigen::Matrix3d::Identity() / std::sqrt(square);
  }
  return e;
}

std::optional<Ellipsoid> solve(const NormalisedReadings& readings, const EllipsoidOptions& options, EllipsoidFit& fit) {
  const detail::QuarticMoments moments = moments_of(readings);
  fit.converged = true;
  if (options.method == EllipsoidMethod::kLsq) return detail::fit_lsq(moments);
  if (options.method == EllipsoidMethod::kAls) return detail::fit_als(moments);

  const bool sphere = options.method == EllipsoidMethod::kSphere;
  const detail::RobustOptions robust{.tukey_c = options.tukey_c,
                                     .shape_prior_sigma = sphere ? 0 : options.shape_prior_sigma,
                                     .max_iterations = options.max_iterations,
                                     .sphere = sphere};
  const auto as_start = [&](Ellipsoid e) {
    if (sphere) e.matrix = Eigen::Matrix3d::Identity() * std::cbrt(e.matrix.determinant());
    return e;
  };
  const auto direct = sphere ? std::nullopt : detail::fit_li_griffiths(moments);
  detail::RobustFit best = detail::refine(readings, direct ? *direct : sphere_start(readings), robust);
  if (!direct || outlier_share(readings, best) > options.outlier_share) {
    if (const auto start = detail::fit_lmeds(readings, options.seed)) {
      const detail::RobustFit other = detail::refine(readings, as_start(*start), robust);
      if (other.sigma < best.sigma) best = other;
    }
  }
  fit.converged = best.converged;
  fit.iterations = best.iterations;
  return best.ellipsoid;
}

// By how much correlation between successive residuals raises the variance of what is fitted to them: the integrated
// autocorrelation time (Sokal, "Monte Carlo methods in statistical mechanics", 1989: window of 5 times itself).
double variance_inflation(const std::vector<double>& r) {
  const auto n = static_cast<Eigen::Index>(r.size());
  const Eigen::Map<const Eigen::VectorXd> raw(r.data(), n);
  const Eigen::VectorXd x = raw.array() - raw.mean();
  const double variance = x.squaredNorm();
  if (!(variance > 0)) return 1;
  double time = 1;
  for (Eigen::Index lag = 1; lag < std::min(n / 4, kLongestCorrelation); ++lag) {
    const double rho = x.head(n - lag).dot(x.tail(n - lag)) / variance;
    time += 2 * rho;
    if (static_cast<double>(lag) >= 5 * time) break;
  }
  // Readings in random order give 1 only to within this.
  return time < 1 + 6 / std::sqrt(static_cast<double>(n)) ? 1 : time;
}

// What the true shape, which is not quite a sphere, does to a sphere's centre: nothing where all sides were seen, much
// on a small cap. The shape is as the prior and the residuals of the sphere have it (one Gauss-Newton step).
Matrix9 effect_of_shape(const Ellipsoid& e, double prior_sigma, const Matrix9& information, const Vector9& gradient,
                        const Eigen::MatrixXd& basis, const Eigen::MatrixXd& sphere_cov) {
  Eigen::Matrix<double, 6, 1> residual;
  Eigen::Matrix<double, 6, 6> jacobian;
  detail::shape_prior(e, prior_sigma, residual, jacobian);
  const dense::SymmetricEigen prior = dense::symmetric_eigen(dense::gram(jacobian));
  Eigen::MatrixXd shapes = Eigen::MatrixXd::Zero(9, 5);
  shapes.bottomRows(6) = prior.vectors.rightCols(5);  // the first one is the size, which has no prior
  Eigen::MatrixXd turned(9, 9);                       // transposed: a direction per row
  turned.topRows(4) = basis.transpose();
  turned.bottomRows(5) = shapes.transpose();
  Eigen::MatrixXd normal = dense::propagate(turned, information);
  normal.diagonal().tail(5) += prior.values.tail(5);
  Eigen::MatrixXd right(9, 10);
  right.col(0) = -dense::product(turned, gradient);
  right.rightCols(9).setIdentity();
  const Eigen::MatrixXd solution = dense::solve_symmetric(normal, right);
  const Eigen::MatrixXd shape = solution.bottomLeftCorner(5, 1);
  const Eigen::MatrixXd shape_cov = solution.bottomRightCorner(5, 5);
  const Eigen::MatrixXd effect =
      dense::product(dense::propagate(basis, sphere_cov), dense::product(information, shapes));
  return dense::propagate(effect, shape_cov + dense::gram(shape.transpose()));
}

// Covariance of centre and matrix (normalised) from the curvature of the cost; for Tukey's loss with Huber's factors
// ("Robust statistics", 1981, section 7.6). Also noise, inliers and residuals.
Matrix9 covariance(const NormalisedReadings& readings, const Ellipsoid& e, const EllipsoidOptions& options,
                   EllipsoidFit& fit) {
  const bool sphere = options.method == EllipsoidMethod::kSphere;
  const int parameters = sphere ? 4 : 9;
  const auto n = static_cast<std::size_t>(readings.z.cols());
  std::vector<double> r(n);
  detail::residuals(readings, e, r);
  const bool robust = is_robust(options.method);
  std::vector<double> buffer;
  double sigma = detail::scale_of(readings, r, parameters, buffer);
  if (!robust) {
    const double sum = std::inner_product(r.begin(), r.end(), r.begin(), 0.0);
    sigma = std::sqrt(sum / std::max(1.0, static_cast<double>(n) - parameters));
  }
  sigma = std::max(sigma, 1e-12);
  fit.noise_sigma = sigma * readings.scale;

  Matrix9 hessian = Matrix9::Zero();
  Vector9 gradient = Vector9::Zero();
  double psi_square = 0;
  double psi_slope = 0;
  double inlier_square = 0;
  const double bound = options.tukey_c * sigma;
  std::vector<double> inlier_residuals;
  inlier_residuals.reserve(n);
  for (std::size_t i = 0; i < n; ++i) {
    const bool inlier = std::abs(r[i]) < bound;
    if (inlier) {
      ++fit.inliers;
      const double norm = (e.matrix * (readings.z.col(static_cast<Eigen::Index>(i)) - e.centre)).norm() - 1;
      inlier_square += norm * norm;
      inlier_residuals.push_back(r[i]);
    }
    double distance = 0;
    Vector9 jacobian;
    if (!detail::sampson_distance(e, readings.z.col(static_cast<Eigen::Index>(i)), distance, &jacobian)) continue;
    if (robust) {
      if (!inlier) continue;
      const double u = r[i] / bound;
      const double inside = 1 - u * u;
      const double psi = r[i] / sigma * inside * inside;
      psi_square += psi * psi;
      psi_slope += inside * (1 - 5 * u * u);
      gradient += psi / sigma * std::sqrt(readings.weights[static_cast<Eigen::Index>(i)]) * jacobian;
    }
    hessian.selfadjointView<Eigen::Lower>().rankUpdate(
        jacobian, readings.weights[static_cast<Eigen::Index>(i)] / (sigma * sigma));
  }
  hessian = Matrix9(hessian.selfadjointView<Eigen::Lower>());
  fit.residual_rms = std::sqrt(inlier_square / std::max<double>(1, static_cast<double>(fit.inliers)));

  double slope = 1;
  double variance = 1;
  if (robust && fit.inliers > 0) {
    const auto count = static_cast<double>(fit.inliers);
    slope = psi_slope / count;
    variance = psi_square / std::max(1.0, count - parameters);
  }
  if (!(slope > 0)) return Matrix9::Constant(kUnknown);
  variance *= variance_inflation(inlier_residuals);
  Matrix9 prior = Matrix9::Zero();
  if (options.method == EllipsoidMethod::kRobust && options.shape_prior_sigma > 0) {
    Eigen::Matrix<double, 6, 1> residual;
    Eigen::Matrix<double, 6, 6> jacobian;
    detail::shape_prior(e, options.shape_prior_sigma, residual, jacobian);
    prior.bottomRightCorner<6, 6>() = dense::gram(jacobian);
  }
  Eigen::MatrixXd basis = Eigen::MatrixXd::Identity(9, 9);
  if (sphere) {
    basis = Eigen::MatrixXd::Zero(9, 4);
    basis.topLeftCorner<3, 3>().setIdentity();
    basis.block<3, 1>(3, 3).setOnes();
  }
  const Eigen::MatrixXd rows = basis.transpose();
  const dense::SymmetricEigen eigen = dense::symmetric_eigen(dense::propagate(rows, slope * hessian + prior));
  const Eigen::MatrixXd spread = dense::propagate(rows, variance * hessian + prior);
  const Eigen::VectorXd& values = eigen.values;
  if (!(values[0] > 1e-14 * values[values.size() - 1])) return Matrix9::Constant(kUnknown);
  const Eigen::MatrixXd inverse = dense::compose(eigen.vectors, values.cwiseInverse());
  const Matrix9 cov = dense::propagate(basis, dense::propagate(inverse, spread));
  if (!sphere || options.shape_prior_sigma <= 0) return cov;
  return cov + effect_of_shape(e, options.shape_prior_sigma, slope * hessian, gradient, basis, inverse);
}

Eigen::Matrix3d symmetric(const Eigen::Matrix<double, 6, 1>& w) {
  Eigen::Matrix3d m;
  m << w[0], w[3], w[4], w[3], w[1], w[5], w[4], w[5], w[2];
  return m;
}

Eigen::Matrix<double, 6, 1> elements(const Eigen::Matrix3d& m) {
  Eigen::Matrix<double, 6, 1> w;
  w << m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(0, 2), m(1, 2);
  return w;
}

// From normalised units to those of the readings and of the corrected field.
void fill_result(const NormalisedReadings& readings, const Ellipsoid& e, const Matrix9& cov,
                 const EllipsoidOptions& options, EllipsoidFit& fit) {
  const double root = std::cbrt(e.matrix.determinant());
  fit.is_ellipsoid = true;
  fit.centre = readings.origin + readings.scale * e.centre;
  fit.radius = readings.scale / root;
  const bool given = options.reference_norm > 0;
  fit.reference_norm = given ? options.reference_norm : fit.radius;
  const double to_matrix = fit.reference_norm / readings.scale;
  fit.matrix = to_matrix * e.matrix;

  Matrix9 j = Matrix9::Zero();
  j.topLeftCorner<3, 3>().diagonal().setConstant(readings.scale);
  if (given) {
    j.bottomRightCorner<6, 6>().diagonal().setConstant(to_matrix);
  } else {
    // The size is not ours to tell: W / cbrt(det W), whose change is (dW - W tr(W^-1 dW) / 3) / cbrt(det W).
    const Eigen::Matrix3d inverse = e.matrix.inverse();
    for (int k = 0; k < 6; ++k) {
      const Eigen::Matrix3d change = symmetric(Eigen::Matrix<double, 6, 1>::Unit(k));
      j.block<6, 1>(3, 3 + k) = elements(change - e.matrix * ((inverse * change).trace() / 3)) / root;
    }
  }
  fit.cov = dense::propagate(j, cov);

  const Eigen::VectorXd axes = dense::symmetric_eigenvalues(e.matrix);
  fit.axis_ratio = axes[2] / axes[0];
  fit.centre_over_radius = fit.centre.norm() / fit.radius;
  const Eigen::Matrix3d centre_cov = fit.cov.topLeftCorner<3, 3>();
  if (centre_cov.allFinite()) {
    fit.centre_sigma = std::sqrt(std::max(0.0, dense::symmetric_eigenvalues(centre_cov)[2])) / fit.radius;
  }
}

// Standard deviation over mean.
double variation(const Eigen::VectorXd& norms) {
  const double mean = norms.mean();
  return std::sqrt((norms.array() - mean).square().mean()) / mean;
}

void fill_norms(const NormalisedReadings& readings, const Ellipsoid& e, EllipsoidFit& fit) {
  const Eigen::Vector3d origin = readings.origin / readings.scale;
  Eigen::VectorXd before(readings.z.cols());
  Eigen::VectorXd after(readings.z.cols());
  for (Eigen::Index i = 0; i < readings.z.cols(); ++i) {
    const Eigen::Vector3d y = e.matrix * (readings.z.col(i) - e.centre);
    before[i] = (readings.z.col(i) + origin).norm();
    after[i] = y.norm();
    if (after[i] > 1e-9) fit.coverage.add(y);
  }
  fit.norm_variation_before = variation(before);
  fit.norm_variation_after = variation(after);
}

void judge(const EllipsoidOptions& options, EllipsoidFit& fit) {
  Quality& q = fit.quality;
  const std::string turn = "turn the device so that each of its axes points along and against the field";
  if (!std::isfinite(fit.centre_sigma)) {
    q.lower_to(Verdict::kRefused, "the readings do not determine the centre: " + turn);
  } else {
    const std::string predicted =
        "the centre is uncertain by " + percent(fit.centre_sigma) + " of the radius (one sigma)";
    if (fit.centre_sigma >= options.warn_centre_sigma) {
      q.lower_to(Verdict::kRefused, predicted + ": " + turn);
    } else if (fit.centre_sigma >= options.fair_centre_sigma) {
      q.lower_to(Verdict::kWarn, predicted + ": " + turn);
    } else if (fit.centre_sigma >= options.ok_centre_sigma) {
      q.lower_to(Verdict::kFair, predicted);
    }
  }
  const double share = static_cast<double>(fit.inliers) / static_cast<double>(fit.readings);
  if (share < kFairInliers) {
    q.lower_to(share < kLowInliers ? Verdict::kWarn : Verdict::kFair,
               "only " + percent(share) + " of the readings lie on one ellipsoid: iron or a current nearby, or motion");
  }
  const double noise = fit.noise_sigma / fit.radius;
  if (noise > kFairNoise) {
    const Verdict verdict = noise > kAbsurdNoise ? Verdict::kRefused
                            : noise > kHighNoise ? Verdict::kWarn
                                                 : Verdict::kFair;
    q.lower_to(verdict,
               "the readings scatter by " + percent(noise) + " of the radius: the field was not the same everywhere");
  }
  if (fit.readings < kFewReadings) {
    q.lower_to(Verdict::kWarn, std::to_string(fit.readings) + " readings check nine parameters poorly: take hundreds");
  }
  if (fit.axis_ratio > kHighAxisRatio) {
    q.lower_to(Verdict::kWarn, "the longest axis is " + to_text(std::round(100 * fit.axis_ratio) / 100) +
                                   " times the shortest: one axis counts in another unit, or the data mislead the fit");
  }
  if (!fit.converged) q.lower_to(Verdict::kWarn, "the fit stopped before it settled");
  if (fit.not_finite > 0) {
    q.lower_to(Verdict::kFair, std::to_string(fit.not_finite) + " readings are not finite and were left out");
  }
}

}  // namespace

const char* ellipsoid_method_name(EllipsoidMethod method) {
  switch (method) {
    case EllipsoidMethod::kLsq:
      return "lsq";
    case EllipsoidMethod::kRobust:
      return "robust";
    case EllipsoidMethod::kAls:
      return "als";
    case EllipsoidMethod::kSphere:
      return "sphere";
  }
  return "unknown";
}

EllipsoidMethod parse_ellipsoid_method(const std::string& name) {
  for (const EllipsoidMethod method : kMethods) {
    if (name == ellipsoid_method_name(method)) return method;
  }
  throw std::invalid_argument("method '" + name + "': must be lsq, robust, als or sphere");
}

void EllipsoidOptions::check() const {
  require_not_negative("reference_norm", reference_norm);
  require_not_negative("shape_prior_sigma", shape_prior_sigma);
  require_positive("tukey_c", tukey_c);
  require(outlier_share >= 0 && outlier_share <= 1, "outlier_share", outlier_share, "must be in [0, 1]");
  require(max_iterations > 0, "max_iterations", max_iterations, "must be positive");
  require_positive("ok_centre_sigma", ok_centre_sigma);
  require(fair_centre_sigma >= ok_centre_sigma && std::isfinite(fair_centre_sigma), "fair_centre_sigma",
          fair_centre_sigma, "must not be below ok_centre_sigma");
  require(warn_centre_sigma >= fair_centre_sigma && std::isfinite(warn_centre_sigma), "warn_centre_sigma",
          warn_centre_sigma, "must not be below fair_centre_sigma");
}

TriadCalibration EllipsoidFit::triad() const {
  if (!is_ellipsoid) {
    std::string text = "no ellipsoid";
    for (const std::string& reason : quality.reasons) text += ": " + reason;
    throw DataError(text);
  }
  TriadCalibration triad;
  triad.bias = centre;
  triad.matrix = matrix;
  TriadQuality& q = triad.quality.emplace();
  q.verdict = quality.verdict;
  q.method = ellipsoid_method_name(method);
  q.samples = inliers;
  q.residual_rms = residual_rms;
  q.reasons = quality.reasons;
  if (cov.allFinite()) {
    const detail::Vector9 sigma = cov.diagonal().cwiseMax(0).cwiseSqrt();
    q.bias_sigma = sigma.head<3>();
    q.matrix_sigma = symmetric(sigma.tail<6>());
  }
  return triad;
}

EllipsoidFit fit_ellipsoid(const detail::Readings& readings, const EllipsoidOptions& options,
                           std::span<const double> weights) {
  options.check();
  require(weights.empty() || static_cast<Eigen::Index>(weights.size()) == readings.rows(), "number of weights",
          static_cast<double>(weights.size()), "must be the number of readings");
  for (const double w : weights) require_not_negative("weight", w);

  EllipsoidFit fit;
  fit.method = options.method;
  const NormalisedReadings normalised = normalise(readings, weights, fit);
  const int needed = options.method == EllipsoidMethod::kSphere ? 5 : 10;
  if (fit.readings < needed) {
    fit.quality.lower_to(Verdict::kRefused, std::to_string(fit.readings) + " readings: " + std::to_string(needed) +
                                                " are the least for this method, hundreds in all directions are good");
    return fit;
  }
  if (!(normalised.scale > 0)) {
    fit.quality.lower_to(Verdict::kRefused, "all readings are the same, or too large for a double");
    return fit;
  }
  const std::optional<Ellipsoid> solution = solve(normalised, options, fit);
  if (!solution) {
    fit.quality.lower_to(
        Verdict::kRefused,
        "the readings lie on no ellipsoid that this method can tell: turn the device about all its axes");
    return fit;
  }
  const Matrix9 cov = covariance(normalised, *solution, options, fit);
  fill_result(normalised, *solution, cov, options, fit);
  fill_norms(normalised, *solution, fit);
  judge(options, fit);
  return fit;
}

}  // namespace loc
