#include "libloc/sim/piecewise_cubic.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

void check(const std::vector<double>& knots, const std::vector<double>& values) {
  require(knots.size() >= 2, "number of knots", static_cast<double>(knots.size()), "must be at least 2");
  require(values.size() == knots.size(), "number of values", static_cast<double>(values.size()),
          "must be the number of knots");
  for (std::size_t i = 0; i < knots.size(); ++i) {
    require_finite("knots[" + std::to_string(i) + "]", knots[i]);
    require_finite("values[" + std::to_string(i) + "]", values[i]);
    require(i == 0 || knots[i] > knots[i - 1], "knots[" + std::to_string(i) + "]", knots[i],
            "must be greater than the one before");
  }
}

// Three-point slope at an end, limited so that the end piece keeps the shape. h0, d0: width and slope of the end piece.
double end_slope(double h0, double h1, double d0, double d1) {
  const double slope = ((2 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
  if (slope * d0 <= 0) return 0;
  if (d0 * d1 <= 0 && std::abs(slope) > 3 * std::abs(d0)) return 3 * d0;
  return slope;
}

}  // namespace

PiecewiseCubic PiecewiseCubic::hermite(std::vector<double> knots, const std::vector<double>& values,
                                       const std::vector<double>& slopes) {
  check(knots, values);
  require(slopes.size() == knots.size(), "number of slopes", static_cast<double>(slopes.size()),
          "must be the number of knots");
  for (std::size_t i = 0; i < slopes.size(); ++i) require_finite("slopes[" + std::to_string(i) + "]", slopes[i]);
  PiecewiseCubic out;
  out.knots_ = std::move(knots);
  for (std::size_t i = 0; i + 1 < out.knots_.size(); ++i) {
    const double h = out.knots_[i + 1] - out.knots_[i];
    const double secant = (values[i + 1] - values[i]) / h;
    out.pieces_.push_back({{values[i], slopes[i], (3 * secant - 2 * slopes[i] - slopes[i + 1]) / h,
                            (slopes[i] + slopes[i + 1] - 2 * secant) / (h * h)}});
    for (const double c : out.pieces_.back().c) {
      require(std::isfinite(c), "knots[" + std::to_string(i + 1) + "]", out.knots_[i + 1],
              "is too close to the one before for the values there");
    }
  }
  return out;
}

PiecewiseCubic PiecewiseCubic::shape_preserving(std::vector<double> knots, const std::vector<double>& values) {
  check(knots, values);
  const std::size_t pieces = knots.size() - 1;
  std::vector<double> h(pieces);
  std::vector<double> secant(pieces);
  for (std::size_t i = 0; i < pieces; ++i) {
    h[i] = knots[i + 1] - knots[i];
    secant[i] = (values[i + 1] - values[i]) / h[i];
  }
  std::vector<double> slopes(knots.size(), secant.front());
  if (pieces > 1) {
    for (std::size_t i = 1; i < pieces; ++i) {
      const double before = 2 * h[i] + h[i - 1];
      const double after = h[i] + 2 * h[i - 1];
      const bool turns = secant[i - 1] * secant[i] <= 0;
      slopes[i] = turns ? 0 : (before + after) / (before / secant[i - 1] + after / secant[i]);
    }
    slopes.front() = end_slope(h[0], h[1], secant[0], secant[1]);
    slopes.back() = end_slope(h[pieces - 1], h[pieces - 2], secant[pieces - 1], secant[pieces - 2]);
  }
  return hermite(std::move(knots), values, slopes);
}

PiecewiseCubic PiecewiseCubic::spline(std::vector<double> knots, const std::vector<double>& values) {
  check(knots, values);
  const std::size_t n = knots.size();
  if (n == 2) return shape_preserving(std::move(knots), values);
  const auto h = [&](std::size_t i) { return knots[i + 1] - knots[i]; };
  const auto secant = [&](std::size_t i) { return (values[i + 1] - values[i]) / h(i); };
  if (n == 3) {
    const double bend = (secant(1) - secant(0)) / (h(0) + h(1));  // half the second derivative
    const double middle = secant(0) + bend * h(0);
    const std::vector<double> slopes = {middle - 2 * bend * h(0), middle, middle + 2 * bend * h(1)};
    return hermite(std::move(knots), values, slopes);
  }
  // Slopes from a tridiagonal system: equal second derivatives at the inner knots, equal third ones at the second and
  // the last but one, where the neighbour's equation has been used to keep the first and last row to two unknowns.
  std::vector<double> low(n, 0);
  std::vector<double> diagonal(n, 0);
  std::vector<double> high(n, 0);
  std::vector<double> slopes(n, 0);
  const auto set_end = [&](double near, double far, double d_near, double d_far, double& own, double& next) {
    own = far;
    next = near + far;
    return ((near + 2 * next) * far * d_near + near * near * d_far) / next;
  };
  slopes[0] = set_end(h(0), h(1), secant(0), secant(1), diagonal[0], high[0]);
  slopes[n - 1] = set_end(h(n - 2), h(n - 3), secant(n - 2), secant(n - 3), diagonal[n - 1], low[n - 1]);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    low[i] = h(i);
    diagonal[i] = 2 * (h(i - 1) + h(i));
    high[i] = h(i - 1);
    slopes[i] = 3 * (h(i) * secant(i - 1) + h(i - 1) * secant(i));
  }
  for (std::size_t i = 1; i < n; ++i) {
    const double factor = low[i] / diagonal[i - 1];
    diagonal[i] -= factor * high[i - 1];
    slopes[i] -= factor * slopes[i - 1];
  }
  slopes[n - 1] /= diagonal[n - 1];
  for (std::size_t i = n - 1; i-- > 0;) slopes[i] = (slopes[i] - high[i] * slopes[i + 1]) / diagonal[i];
  return hermite(std::move(knots), values, slopes);
}

std::size_t PiecewiseCubic::piece(double x) const {
  const auto inner_begin = knots_.begin() + 1;
  return static_cast<std::size_t>(std::upper_bound(inner_begin, knots_.end() - 1, x) - inner_begin);
}

PiecewiseCubic::Value PiecewiseCubic::at(double x, std::size_t piece) const {
  const double d = x - knots_[piece];
  const double* c = pieces_[piece].c;
  return {c[0] + d * (c[1] + d * (c[2] + d * c[3])), c[1] + d * (2 * c[2] + 3 * d * c[3]), 2 * c[2] + 6 * d * c[3]};
}

}  // namespace loc
