#include "libloc/core/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

// Regularised lower incomplete gamma function P(a, x); Abramowitz & Stegun 6.5.29 below the mode, the continued
// fraction 6.5.31 (Lentz's evaluation) above it, where each converges fast.
double gamma_p(double a, double x) {
  if (x <= 0) return 0;
  const double scale = std::exp(a * std::log(x) - x - std::lgamma(a));
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
  // The number of terms grows with sqrt(a) near the mode.
  const int limit = 200 + static_cast<int>(20 * std::sqrt(a));
  if (x < a + 1) {
    double term = 1 / a;
    double sum = term;
    for (int n = 1; n < limit && term > sum * kEpsilon; ++n) {
      term *= x / (a + n);
      sum += term;
    }
    return sum * scale;
  }
  constexpr double kTiny = 1e-300;
  double b = x + 1 - a;
  double c = 1 / kTiny;
  double d = 1 / b;
  double fraction = d;
  for (int n = 1; n < limit; ++n) {
    const double an = -n * (n - a);
    b += 2;
    d = an * d + b;
    if (std::abs(d) < kTiny) d = kTiny;
    c = b + an / c;
    if (std::abs(c) < kTiny) c = kTiny;
    d = 1 / d;
    const double factor = d * c;
    fraction *= factor;
    if (std::abs(factor - 1) < kEpsilon) break;
  }
  return 1 - scale * fraction;
}

}  // namespace

double root_mean_square(std::span<const double> values) {
  require(!values.empty(), "root_mean_square: no values");
  double sum = 0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

double mean(std::span<const double> values) {
  require(!values.empty(), "mean: no values");
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double quantile(std::span<const double> values, double probability) {
  require(!values.empty(), "quantile: no values");
  require(probability >= 0 && probability <= 1, "probability", probability, "must be in [0, 1]");
  std::vector<double> sorted(values.begin(), values.end());
  const double position = probability * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const auto nth = sorted.begin() + static_cast<std::ptrdiff_t>(below);
  std::nth_element(sorted.begin(), nth, sorted.end());
  if (below + 1 == sorted.size()) return *nth;
  const double next = *std::min_element(nth + 1, sorted.end());
  return *nth + (position - static_cast<double>(below)) * (next - *nth);
}

double chi_square_cdf(double x, double dof) {
  require_positive("dof", dof);
  require(!std::isnan(x), "x", x, "must be a number");
  return gamma_p(dof / 2, x / 2);
}

double chi_square_quantile(double probability, double dof) {
  require_positive("dof", dof);
  require(probability >= 0 && probability < 1, "probability", probability, "must be in [0, 1)");
  double high = dof + 10;
  while (chi_square_cdf(high, dof) < probability) high *= 2;
  double low = 0;
  // Bisection to the last bit: called when filters are set up, never per measurement.
  for (int i = 0; i < 2000; ++i) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) break;
    (chi_square_cdf(middle, dof) < probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace loc
