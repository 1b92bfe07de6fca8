#include "libloc/calib/accelerometer.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "libloc/calib/dense.hpp"
#include "libloc/calib/least_squares.hpp"
#include "libloc/calib/sphere_coverage.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"

namespace loc {
namespace {

constexpr int kN = kAccelerometerParameters;
constexpr int kSpare = 7;               // poses beyond the parameters, below which no outlier can be told
constexpr double kFlat = 1e-3;          // poses in a plane: thickness over width
constexpr double kWorstAxisRatio = 10;  // no accelerometer's axes differ so much

Eigen::Matrix3d symmetric(const Vector9d& p) {
  Eigen::Matrix3d m;
  m << p[kMxx], p[kMxy], p[kMxz], p[kMxy], p[kMyy], p[kMyz], p[kMxz], p[kMyz], p[kMzz];
  return m;
}

/// d (M v) / d (Mxx Myy Mzz Mxy Mxz Myz)
Eigen::Matrix<double, 3, 6> entry_jacobian(const Eigen::Vector3d& v) {
  Eigen::Matrix<double, 3, 6> j = Eigen::Matrix<double, 3, 6>::Zero();
  j(0, 0) = j(1, 3) = j(2, 4) = v.x();
  j(1, 1) = j(0, 3) = j(2, 5) = v.y();
  j(2, 2) = j(0, 4) = j(1, 5) = v.z();
  return j;
}

/// Poses brought to length 1 around 0, so that all parameters are of one size.
struct Scaled {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 1;
  std::vector<Eigen::Vector3d> y;
  std::vector<double> sample_variance;  ///< of the length of y, from the samples
};

using Use = std::vector<bool>;

/// Centre and radius of the sphere that fits best: |p|^2 = 2 c p + k is linear. nullopt when the poses lie in a plane.
std::optional<std::pair<Eigen::Vector3d, double>> sphere(const std::vector<Eigen::Vector3d>& points) {
  const auto n = static_cast<Eigen::Index>(points.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : points) mean += p / static_cast<double>(n);
  double size = 0;
  for (const auto& p : points) size = std::max(size, (p - mean).cwiseAbs().maxCoeff());
  if (!(std::isfinite(size) && size > 0)) return std::nullopt;
  Eigen::MatrixX4d a(n, 4);
  Eigen::VectorXd b(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d q = (points[static_cast<std::size_t>(i)] - mean) / size;
    a.row(i) << 2 * q.transpose(), 1;
    b[i] = q.squaredNorm();
  }
  const Eigen::VectorXd spread = dense::singular_values(a.leftCols<3>());
  if (!(spread[2] > kFlat * spread[0])) return std::nullopt;
  const Eigen::Vector4d x = dense::least_squares(a, b);
  const double r2 = x[3] + x.head<3>().squaredNorm();
  if (!(std::isfinite(r2) && r2 > 0)) return std::nullopt;
  return std::pair<Eigen::Vector3d, double>{mean + size * x.head<3>(), size * std::sqrt(r2)};
}

/// Parameters from the quadric through the scaled poses; nullopt when it is no ellipsoid.
std::optional<Vector9d> quadric_start(const Scaled& scaled, const Use& use) {
  Eigen::MatrixXd a(static_cast<Eigen::Index>(scaled.y.size()), kN);
  Eigen::Index n = 0;
  for (std::size_t i = 0; i < scaled.y.size(); ++i) {
    if (!use[i]) continue;
    const Eigen::Vector3d& y = scaled.y[i];
    a.row(n++) << y.x() * y.x(), y.y() * y.y(), y.z() * y.z(), 2 * y.x() * y.y(), 2 * y.x() * y.z(), 2 * y.y() * y.z(),
        y.x(), y.y(), y.z();
  }
  if (n < kN) return std::nullopt;
  const Eigen::VectorXd q = dense::least_squares(a.topRows(n), Eigen::VectorXd::Ones(n));
  Eigen::Matrix3d m;
  m << q[0], q[3], q[4], q[3], q[1], q[5], q[4], q[5], q[2];
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(m);
  if (!q.allFinite() || !ldlt.isPositive()) return std::nullopt;
  const Eigen::Vector3d c = -0.5 * ldlt.solve(q.tail<3>());
  const double level = 1 + c.dot(m * c);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(m / level);
  if (!(eigen.eigenvalues()[0] > 0) || !c.allFinite()) return std::nullopt;
  const Eigen::Matrix3d root = eigen.operatorSqrt();
  Vector9d p;
  p << c, root(0, 0), root(1, 1), root(2, 2), root(0, 1), root(0, 2), root(1, 2);
  return p;
}

/// Weighted fit; weights multiply the residuals, 0 leaves a pose out.
LeastSquaresResult fit(const Scaled& scaled, const Eigen::VectorXd& weights, const Vector9d& start) {
  const ResidualFunction function = [&](const Eigen::VectorXd& x, Eigen::VectorXd& r, Eigen::MatrixXd* jacobian) {
    const auto n = static_cast<Eigen::Index>(scaled.y.size());
    r.resize(n);
    if (jacobian != nullptr) jacobian->resize(n, kN);
    Eigen::Matrix<double, 1, kN> row;
    for (Eigen::Index i = 0; i < n; ++i) {
      r[i] = weights[i] * gravity_residual(x, scaled.y[static_cast<std::size_t>(i)], &row);
      if (jacobian != nullptr) jacobian->row(i) = weights[i] * row;
    }
  };
  return minimise(function, start);
}

std::vector<double> residuals_at(const Scaled& scaled, const Vector9d& p) {
  std::vector<double> r;
  for (const auto& y : scaled.y) r.push_back(gravity_residual(p, y, nullptr));
  return r;
}

Eigen::VectorXd as_weights(const Use& use) {
  Eigen::VectorXd w(static_cast<Eigen::Index>(use.size()));
  for (std::size_t i = 0; i < use.size(); ++i) w[static_cast<Eigen::Index>(i)] = use[i] ? 1 : 0;
  return w;
}

/// Start values from the sphere (0, I) and the quadric, and, to get free of a bad pose, from the fits without each one:
/// the fit with the least median residual.
Vector9d best_start(const Scaled& scaled) {
  const std::size_t n = scaled.y.size();
  Vector9d ball;
  ball << 0, 0, 0, 1, 1, 1, 0, 0, 0;
  const Use all(n, true);
  Vector9d best = fit(scaled, as_weights(all), ball).x;
  double least = robust_sigma(residuals_at(scaled, best));
  const auto consider = [&](const Use& use, const Vector9d& start) {
    const Vector9d x = fit(scaled, as_weights(use), start).x;
    const double sigma = robust_sigma(residuals_at(scaled, x));
    if (sigma < least) {
      least = sigma;
      best = x;
    }
  };
  if (const auto start = quadric_start(scaled, all)) consider(all, *start);
  if (n < kN + kSpare) return best;
  const Vector9d first = best;
  for (std::size_t out = 0; out < n; ++out) {
    Use use = all;
    use[out] = false;
    consider(use, first);
  }
  return best;
}

/// Tukey's loss with the scale found anew at each step.
Vector9d robust_fit(const Scaled& scaled, Vector9d p, double tukey_c) {
  const auto n = static_cast<double>(scaled.y.size());
  for (int i = 0; i < 30; ++i) {
    const std::vector<double> r = residuals_at(scaled, p);
    const double sigma = robust_sigma(r) * std::sqrt(n / (n - kN));
    if (!(sigma > 0)) return p;
    Eigen::VectorXd w(static_cast<Eigen::Index>(r.size()));
    for (std::size_t k = 0; k < r.size(); ++k) {
      w[static_cast<Eigen::Index>(k)] = std::sqrt(tukey_weight(r[k] / sigma, tukey_c));
    }
    if ((w.array() > 0).count() < kN) return p;
    const Vector9d next = fit(scaled, w, p).x;
    const double change = (next - p).norm();
    p = next;
    if (change < 1e-9) break;
  }
  return p;
}

struct Solution {
  LeastSquaresResult result;
  double pose_variance = 0;  ///< of the length, scaled
  Eigen::VectorXd weights;   ///< one over the deviation
};

/// Maximum likelihood on the poses in use, with the variance from pose to pose that makes chi-square what it should be.
Solution weighted_fit(const Scaled& scaled, const Use& use, const Vector9d& start) {
  const auto used = static_cast<int>(std::count(use.begin(), use.end(), true));
  Solution s;
  const auto weights = [&](double pose_variance) {
    Eigen::VectorXd w(static_cast<Eigen::Index>(use.size()));
    for (std::size_t i = 0; i < use.size(); ++i) {
      const double v = pose_variance + scaled.sample_variance[i];
      w[static_cast<Eigen::Index>(i)] = use[i] ? 1 / std::sqrt(v) : 0;
    }
    return w;
  };
  s.result = fit(scaled, as_weights(use), start);
  const int dof = used - kN;
  // Readings are rounded: even poses that fit exactly are not known better than to 1e-9 of gravity.
  const double floor = 1e-18;
  s.pose_variance = std::max(floor, s.result.cost / std::max(1, dof));
  for (int i = 0; i < 20; ++i) {
    s.weights = weights(s.pose_variance);
    s.result = fit(scaled, s.weights, s.result.x);
    if (dof < 1) break;
    // The variance from pose to pose for these residuals, by bisection: chi-square falls with it.
    const std::vector<double> r = residuals_at(scaled, s.result.x);
    const auto chi2 = [&](double v) {
      double sum = 0;
      for (std::size_t k = 0; k < r.size(); ++k) sum += use[k] ? r[k] * r[k] / (v + scaled.sample_variance[k]) : 0;
      return sum;
    };
    double low = floor;
    double high = std::max(floor, 10 * s.result.cost) + 10 * root_mean_square(r) * root_mean_square(r) * used;
    if (chi2(low) <= dof) high = low;
    for (int k = 0; k < 100 && high > low * (1 + 1e-9); ++k) {
      const double middle = std::sqrt(low * high);
      (chi2(middle) > dof ? low : high) = middle;
    }
    const double before = s.pose_variance;
    s.pose_variance = high;
    if (std::abs(before - high) < 1e-6 * high) break;
  }
  return s;
}

/// Poses whose residual, given how much they pull the fit themselves, is within so many sigmas.
Use inliers_of(const Scaled& scaled, const Use& use, const Solution& s, double sigmas) {
  const auto cov = covariance_from(s.result.information);
  if (!cov) return use;
  const double limit = sigmas * small_sample_factor(static_cast<int>(std::count(use.begin(), use.end(), true)) - kN);
  Use inlier(use.size());
  Eigen::Matrix<double, 1, kN> row;
  for (std::size_t i = 0; i < use.size(); ++i) {
    const double r = gravity_residual(s.result.x, scaled.y[i], &row);
    const double own = s.pose_variance + scaled.sample_variance[i];
    const double spread = dense::propagate(row, *cov)(0, 0);
    // A pose in the fit has drawn it towards itself, one outside has not.
    const double variance = use[i] ? std::max(own - spread, 0.05 * own) : own + spread;
    inlier[i] = r * r <= limit * limit * variance;
  }
  return inlier;
}

/// Rms over all directions of the error of a corrected reading, over gravity.
double predicted_error(const Vector9d& p, const Eigen::MatrixXd& cov) {
  const Eigen::Matrix3d m = symmetric(p);
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(m);
  double sum = 0;
  for (int cell = 0; cell < SphereCoverage::kCells; ++cell) {
    const Eigen::Vector3d v = ldlt.solve(SphereCoverage::direction(cell));
    Eigen::Matrix<double, 3, kN> j;
    j << -m, entry_jacobian(v);
    sum += dense::propagate(j, cov).trace();
  }
  return std::sqrt(sum / SphereCoverage::kCells);
}

int count_distinct(const Scaled& scaled, const Vector9d& p, const Use& use, double angle, std::vector<PoseFit*>& fits) {
  std::vector<Eigen::Vector3d> seen;
  const Eigen::Matrix3d m = symmetric(p);
  for (std::size_t i = 0; i < use.size(); ++i) {
    if (!use[i]) continue;
    const Eigen::Vector3d u = (m * (scaled.y[i] - p.head<3>())).normalized();
    const bool known = std::any_of(seen.begin(), seen.end(), [&](const Eigen::Vector3d& s) {
      return std::atan2(s.cross(u).norm(), s.dot(u)) < angle;
    });
    if (known) continue;
    seen.push_back(u);
    fits[i]->distinct = true;
  }
  return static_cast<int>(seen.size());
}

std::string milli_g(double share) {
  return to_text(std::round(share * 1e5) / 100) + " mg";
}

void judge(const AccelerometerFit& fit, const AccelerometerOptions& options, Quality& quality) {
  const std::string distinct = std::to_string(fit.distinct_poses);
  if (fit.distinct_poses < options.least_poses) {
    quality.lower_to(Verdict::kRefused, "Only " + distinct + " distinct still poses: at least " +
                                            std::to_string(options.least_poses) + " are needed, " +
                                            std::to_string(options.good_poses) + " or more are good.");
  } else if (fit.distinct_poses < options.good_poses) {
    quality.lower_to(fit.distinct_poses < 12 ? Verdict::kWarn : Verdict::kFair,
                     distinct + " distinct still poses: with " + std::to_string(options.good_poses) +
                         " or more, spread over all directions, the error on new poses becomes several times smaller.");
  }
  if (fit.inliers <= kN) {
    quality.lower_to(Verdict::kWarn, "As many parameters as poses: nothing is left to judge the error by. Add poses.");
  } else if (fit.predicted_error > options.ok_error) {
    const Verdict verdict = fit.predicted_error > options.warn_error   ? Verdict::kRefused
                            : fit.predicted_error > options.fair_error ? Verdict::kWarn
                                                                       : Verdict::kFair;
    quality.lower_to(verdict, "Predicted error of a corrected reading " + milli_g(fit.predicted_error) +
                                  ", ok is up to " + milli_g(options.ok_error) +
                                  ": add poses in directions that are missing.");
  }
  int outliers = 0;
  for (const PoseFit& pose : fit.poses) outliers += pose.finite && !pose.inlier ? 1 : 0;
  if (outliers > 0) {
    const bool many = 5 * outliers > static_cast<int>(fit.poses.size());
    quality.lower_to(many ? Verdict::kWarn : Verdict::kFair,
                     std::to_string(outliers) + " of " + std::to_string(fit.poses.size()) +
                         " poses do not fit and were left out: the device probably moved or was pushed there.");
  }
}

}  // namespace

void AccelerometerOptions::check() const {
  require_positive("gravity", gravity);
  require_positive("distinct_angle", distinct_angle);
  require(least_poses >= kN, "least_poses", least_poses, "must be at least 9, the number of parameters");
  require(good_poses >= least_poses, "good_poses", good_poses, "must not be below least_poses");
  require_positive("outlier_sigmas", outlier_sigmas);
  require_positive("ok_error", ok_error);
  require(std::isfinite(fair_error) && fair_error >= ok_error, "fair_error", fair_error, "must not be below ok_error");
  require(std::isfinite(warn_error) && warn_error >= fair_error, "warn_error", warn_error,
          "must not be below fair_error");
}

double gravity_residual(const Vector9d& parameters, const Eigen::Vector3d& y,
                        Eigen::Matrix<double, 1, kAccelerometerParameters>* jacobian) {
  const Eigen::Vector3d v = y - parameters.head<3>();
  const Eigen::Matrix3d m = symmetric(parameters);
  const Eigen::Vector3d corrected = m * v;
  const double length = corrected.norm();
  if (jacobian != nullptr) {
    // At length 0 the derivative does not exist; 0 keeps the pose from pulling anywhere.
    const Eigen::RowVector3d u =
        length > 0 ? Eigen::RowVector3d(corrected.transpose() / length) : Eigen::RowVector3d::Zero();
    *jacobian << -u * m, u * entry_jacobian(v);
  }
  return length - 1;
}

std::vector<StillPose> accelerometer_poses(std::span<const StillSegment> segments) {
  std::vector<StillPose> poses;
  for (const StillSegment& s : segments) {
    require(s.samples > 0, "samples", static_cast<double>(s.samples), "must be positive");
    poses.push_back({.mean = s.accelerometer.mean, .mean_cov = s.accelerometer.cov / static_cast<double>(s.samples)});
  }
  return poses;
}

AccelerometerFit fit_accelerometer(std::span<const StillPose> poses, const AccelerometerOptions& options) {
  options.check();
  AccelerometerFit out;
  out.poses.resize(poses.size());
  std::vector<Eigen::Vector3d> means;
  std::vector<PoseFit*> fits;
  std::vector<const StillPose*> used;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    out.poses[i].finite = poses[i].mean.allFinite() && poses[i].mean_cov.allFinite();
    if (!out.poses[i].finite) continue;
    means.push_back(poses[i].mean);
    fits.push_back(&out.poses[i]);
    used.push_back(&poses[i]);
  }
  const auto refuse = [&](std::string reason) {
    out.quality.lower_to(Verdict::kRefused, std::move(reason));
    return out;
  };
  if (means.size() < kN) {
    return refuse("Only " + std::to_string(means.size()) + " still poses: at least " +
                  std::to_string(options.least_poses) + " distinct ones are needed.");
  }
  const auto ball = sphere(means);
  if (!ball) {
    return refuse(
        "The still poses lie in a plane or in one place: turn the device into all directions, upside down too.");
  }
  Scaled scaled;
  scaled.centre = ball->first;
  scaled.radius = ball->second;
  for (const StillPose* pose : used) {
    const Eigen::Vector3d y = (pose->mean - scaled.centre) / scaled.radius;
    const Eigen::Vector3d u = y.normalized();
    scaled.y.push_back(y);
    scaled.sample_variance.push_back(std::max(0.0, u.dot(pose->mean_cov * u)) / (scaled.radius * scaled.radius));
  }

  Vector9d p = best_start(scaled);
  Use use(scaled.y.size(), true);
  const bool can_reject = scaled.y.size() >= kN + kSpare;
  if (can_reject) {
    p = robust_fit(scaled, p, options.outlier_sigmas);
    const std::vector<double> r = residuals_at(scaled, p);
    const double sigma =
        robust_sigma(r) * std::sqrt(static_cast<double>(r.size()) / static_cast<double>(r.size() - kN));
    const double limit = options.outlier_sigmas * small_sample_factor(static_cast<int>(r.size()) - kN);
    for (std::size_t i = 0; i < r.size(); ++i) use[i] = std::abs(r[i]) <= limit * std::max(sigma, 1e-9);
    if (std::count(use.begin(), use.end(), true) < kN) use.assign(use.size(), true);
  }
  Solution solution = weighted_fit(scaled, use, p);
  for (int i = 0; can_reject && i < 10; ++i) {
    const Use next = inliers_of(scaled, use, solution, options.outlier_sigmas);
    if (next == use || std::count(next.begin(), next.end(), true) < kN + 1) break;
    use = next;
    solution = weighted_fit(scaled, use, solution.result.x);
  }
  p = solution.result.x;

  const Eigen::VectorXd axes = dense::symmetric_eigenvalues(symmetric(p));
  const auto cov = covariance_from(solution.result.information);
  if (!p.allFinite() || !cov || !(axes[0] * kWorstAxisRatio > axes[2])) {
    return refuse("The still poses do not determine the nine parameters: turn the device into more directions.");
  }
  out.solved = true;
  out.converged = solution.result.converged;
  out.triad.bias = scaled.centre + scaled.radius * p.head<3>();
  out.triad.matrix = symmetric(p) * (options.gravity / scaled.radius);
  Vector9d unit;
  unit << Eigen::Vector3d::Constant(scaled.radius),
      Eigen::Matrix<double, 6, 1>::Constant(options.gravity / scaled.radius);
  out.inliers = static_cast<int>(std::count(use.begin(), use.end(), true));
  const int dof = out.inliers - kN;

  std::vector<double> fitted;
  std::vector<double> predicted;
  for (std::size_t i = 0; i < use.size(); ++i) {
    fits[i]->inlier = use[i];
    fits[i]->residual = options.gravity * gravity_residual(p, scaled.y[i], nullptr);
    fits[i]->left_out = fits[i]->residual;
    if (!use[i]) continue;
    fitted.push_back(fits[i]->residual);
    fits[i]->left_out = kUnknown;
    if (dof < 1) continue;
    Eigen::VectorXd weights = solution.weights;
    weights[static_cast<Eigen::Index>(i)] = 0;
    const Vector9d without = fit(scaled, weights, p).x;
    fits[i]->left_out = options.gravity * gravity_residual(without, scaled.y[i], nullptr);
    predicted.push_back(fits[i]->left_out);
  }
  out.residual_rms = root_mean_square(fitted);
  if (dof >= 1) {
    out.cov = unit.asDiagonal() * *cov * unit.asDiagonal();
    out.pose_sigma = options.gravity * std::sqrt(solution.pose_variance);
    out.leave_one_out_rms = root_mean_square(predicted);
    out.predicted_error = predicted_error(p, *cov) * small_sample_factor(dof);
  }
  out.distinct_poses = count_distinct(scaled, p, use, options.distinct_angle, fits);
  if (!out.converged) out.quality.lower_to(Verdict::kWarn, "The fit did not converge: look at the residuals.");
  judge(out, options, out.quality);
  TriadQuality& q = out.triad.quality.emplace();
  q.verdict = out.quality.verdict;
  q.reasons = out.quality.reasons;
  q.method = "still-poses";
  q.samples = out.inliers;
  q.residual_rms = out.residual_rms / options.gravity;
  if (dof >= 1) {
    const Vector9d sigma = out.cov.diagonal().cwiseSqrt();
    q.bias_sigma = sigma.head<3>();
    q.matrix_sigma = symmetric(sigma);
  }
  return out;
}

}  // namespace loc
