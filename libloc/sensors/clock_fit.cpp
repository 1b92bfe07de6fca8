#include "libloc/sensors/clock_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

namespace loc {
namespace {

constexpr std::size_t kMaxPoints = 64;
using Values = std::array<double, kMaxPoints>;

double median(double* values, std::size_t count) {
  double* middle = values + count / 2;
  std::nth_element(values, middle, values + count);
  return *middle;
}

// Median over the slopes of all pairs that are not close neighbours, whose slopes are mostly noise.
double theil_sen_slope(std::span<const EnvelopePoint> points) {
  std::array<double, kMaxPoints*(kMaxPoints - 1) / 2> slopes;
  std::size_t count = 0;
  const double nearest = -points.front().x_s / 3;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = i + 1; j < points.size(); ++j) {
      const double dx = points[j].x_s - points[i].x_s;
      if (dx > 0 && dx >= nearest) slopes[count++] = (points[j].y_ns - points[i].y_ns) / dx;
    }
  }
  return count == 0 ? 0 : median(slopes.data(), count);
}

// Mean of one-sided errors from the differences of neighbours, to which slow changes of the curve add little: for
// exponential errors the median of |difference| is ln 2 times the mean.
double mean_error(std::span<const EnvelopePoint> points, double slope) {
  Values differences{};
  for (std::size_t i = 1; i < points.size(); ++i) {
    differences[i - 1] = std::abs(points[i].y_ns - points[i - 1].y_ns - slope * (points[i].x_s - points[i - 1].x_s));
  }
  return median(differences.data(), points.size() - 1) / std::numbers::ln2;
}

}  // namespace

Envelope fit_envelope(std::span<const EnvelopePoint> points, const EnvelopePrior& prior) {
  assert(!points.empty() && points.size() <= kMaxPoints);
  const std::size_t n = points.size();
  const double span = -points.front().x_s;
  if (n == 1 || span <= 0) {
    // The lowest of few: nothing is known but that it is late by something.
    double lowest = points.front().y_ns;
    for (const EnvelopePoint& p : points) lowest = std::min(lowest, p.y_ns);
    // Not lowered by the mean error, which is known badly by now: sigma covers it (root mean square of an exponential).
    return {lowest, prior.slope, std::numbers::sqrt2 * prior.noise_ns, prior.sigma_slope, prior.noise_ns};
  }

  // What few points say of their own error is doubtful: the prior counts as three more.
  const double steep = n >= 5 ? theil_sen_slope(points) : prior.slope;
  const double seen = mean_error(points, steep);
  const double weight_prior = 3.0 / static_cast<double>(n + 2);
  const double noise = std::max((1 - weight_prior) * seen + weight_prior * prior.noise_ns, 1.0);

  // Points far above or below the line by Theil and Sen do not count.
  Values residuals{};
  for (std::size_t i = 0; i < n; ++i) residuals[i] = points[i].y_ns - steep * points[i].x_s;
  Values work = residuals;
  const double level = median(work.data(), n);
  for (std::size_t i = 0; i < n; ++i) work[i] = std::abs(residuals[i] - level);
  const double spread = median(work.data(), n);
  const double bend_over_span = prior.sigma_bend * span * span / 2;
  const double limit = 5 * std::max(1.5 * spread, noise) + bend_over_span;

  // y = value + slope x + bend x^2 / 2, in units of the span so that the equations are well scaled.
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const double weight = 1 / (noise * noise);
  std::size_t used = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (n >= 5 && std::abs(residuals[i] - level) > limit) continue;
    ++used;
    const double x = points[i].x_s / span;
    const Eigen::Vector3d row(1, x, x * x / 2);
    information += weight * row * row.transpose();
    right += weight * points[i].y_ns * row;
  }
  const double sigma_slope = prior.sigma_slope * span;
  const double sigma_bend = prior.sigma_bend * span * span;
  information(1, 1) += 1 / (sigma_slope * sigma_slope);
  right(1) += prior.slope * span / (sigma_slope * sigma_slope);
  information(2, 2) += 1 / (sigma_bend * sigma_bend);
  const Eigen::LDLT<Eigen::Matrix3d> solver(information);
  const Eigen::Vector3d solution = solver.solve(right);
  const Eigen::Matrix3d cov = solver.solve(Eigen::Matrix3d::Identity());

  // Errors that the model of the curve leaves show in the residuals.
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (n >= 5 && std::abs(residuals[i] - level) > limit) continue;
    const double x = points[i].x_s / span;
    const double r = points[i].y_ns - solution.dot(Eigen::Vector3d(1, x, x * x / 2));
    sum += r * r;
  }
  const double misfit = std::max(1.0, sum * weight / std::max<double>(1, static_cast<double>(used) - 2));
  Envelope out;
  out.value_ns = solution(0) - noise;
  out.slope = solution(1) / span;
  // The mean error itself is known to one part in sqrt(n).
  out.sigma_value_ns = std::sqrt(cov(0, 0) * misfit + noise * noise / static_cast<double>(n));
  out.sigma_slope = std::sqrt(cov(1, 1) * misfit) / span;
  out.noise_ns = noise;
  return out;
}

}  // namespace loc
