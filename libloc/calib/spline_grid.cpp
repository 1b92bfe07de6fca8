#include "libloc/calib/spline_grid.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr int kOrders = kMaxSplineOrder + 1;
constexpr int kMostSegments = 10'000'000;

// Coefficients of B_j(u) in powers of u, for each order.
using Coefficients = std::array<std::array<double, kMaxSplineOrder>, kMaxSplineOrder>;

constexpr double binomial(int n, int k) {
  double out = 1;
  for (int i = 0; i < k; ++i) out = out * (n - i) / (i + 1);
  return out;
}

constexpr double power(int base, int exponent) {
  double out = 1;
  for (int i = 0; i < exponent; ++i) out *= base;
  return out;
}

constexpr Coefficients coefficients_of(int k) {
  double factorial = 1;
  for (int i = 2; i < k; ++i) factorial *= i;
  Coefficients out{};
  for (int j = 0; j < k; ++j) {
    for (int n = 0; n < k; ++n) {
      double sum = 0;
      for (int l = j; l < k; ++l) {
        sum += ((l - j) % 2 == 0 ? 1 : -1) * binomial(k, l - j) * power(k - 1 - l, k - 1 - n);
      }
      out[static_cast<std::size_t>(j)][static_cast<std::size_t>(n)] = binomial(k - 1, n) / factorial * sum;
    }
  }
  return out;
}

constexpr std::array<Coefficients, kOrders> all_coefficients() {
  std::array<Coefficients, kOrders> out{};
  for (int k = 1; k < kOrders; ++k) out[static_cast<std::size_t>(k)] = coefficients_of(k);
  return out;
}

constexpr std::array<Coefficients, kOrders> kCoefficients = all_coefficients();

}  // namespace

void SplineGrid::check() const {
  require_finite("start_s", start_s);
  require_positive("spacing_s", spacing_s);
  require(segments > 0 && segments <= kMostSegments, "segments", segments, "must be in [1, 10^7]");
  require(order >= kMinSplineOrder && order <= kMaxSplineOrder, "order", order, "must be in [3, 8]");
}

SplineGrid grid_over(double begin_s, double end_s, double spacing_s, int order) {
  require_finite("begin_s", begin_s);
  require_finite("end_s", end_s);
  require_positive("spacing_s", spacing_s);
  require(end_s >= begin_s, "end_s", end_s, "must not be before begin_s");
  const double segments = std::max(1.0, std::ceil((end_s - begin_s) / spacing_s * (1 - 1e-14)));
  require(segments <= kMostSegments, "segments", segments, "must be at most 10^7");
  SplineGrid grid{begin_s, spacing_s, static_cast<int>(segments), order};
  grid.check();
  return grid;
}

SplinePlace place_of(const SplineGrid& grid, double t_s) {
  const double x = (t_s - grid.start_s) / grid.spacing_s;
  const double segment = std::clamp(std::floor(x), 0.0, grid.segments - 1.0);
  return {static_cast<int>(segment), x - segment};
}

double abscissa_of(const SplineGrid& grid, int i) {
  return grid.start_s + (i + 1 - grid.order * 0.5) * grid.spacing_s;
}

SplineWeights weights_at(int order, double spacing_s, double u) {
  assert(order >= 1 && order <= kMaxSplineOrder && spacing_s > 0);
  const Coefficients& c = kCoefficients[static_cast<std::size_t>(order)];
  const auto k = static_cast<std::size_t>(order);
  const double rate = 1 / spacing_s;
  SplineWeights out;
  for (std::size_t j = 0; j < k; ++j) {
    // Horner, with both derivatives along.
    double value = 0;
    double first = 0;
    double half_second = 0;
    for (std::size_t n = k; n-- > 0;) {
      half_second = half_second * u + first;
      first = first * u + value;
      value = value * u + c[j][n];
    }
    out.value[j] = value;
    out.first[j] = first * rate;
    out.second[j] = 2 * half_second * rate * rate;
  }
  return out;
}

SplineWeights cumulative_weights_at(int order, double spacing_s, double u) {
  SplineWeights out = weights_at(order, spacing_s, u);
  for (auto j = static_cast<std::size_t>(order) - 1; j-- > 0;) {
    out.value[j] += out.value[j + 1];
    out.first[j] += out.first[j + 1];
    out.second[j] += out.second[j + 1];
  }
  // Exactly, and not to rounding.
  out.value[0] = 1;
  out.first[0] = 0;
  out.second[0] = 0;
  return out;
}

}  // namespace loc
