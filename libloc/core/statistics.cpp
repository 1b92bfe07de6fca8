#include "libloc/core/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

struct GammaTails {
  double lower;  // P(a, x)
  double upper;  // Q(a, x) = 1 - P(a, x)
};

// Regularised incomplete gamma functions; Abramowitz & Stegun 6.5.29 below the mode, the continued fraction 6.5.31
// (Lentz's evaluation) above it, where each converges fast. The smaller of the two is the one that is computed, so both
// keep their digits far out in the tails.
GammaTails gamma_tails(double a, double x) {
  if (x <= 0) return {0, 1};
  if (std::isinf(x)) return {1, 0};
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
    return {sum * scale, 1 - sum * scale};
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
  return {1 - scale * fraction, scale * fraction};
}

GammaTails chi_square_tails(double x, double dof) {
  require_positive("dof", dof);
  require(!std::isnan(x), "x", x, "must be a number");
  return gamma_tails(dof / 2, x / 2);
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
  // NaN has no place in an order.
  require(std::none_of(values.begin(), values.end(), [](double v) { return std::isnan(v); }),
          "quantile: a value is NaN");
  std::vector<double> sorted(values.begin(), values.end());
  const double position = probability * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const auto nth = sorted.begin() + static_cast<std::ptrdiff_t>(below);
  std::nth_element(sorted.begin(), nth, sorted.end());
  if (position == static_cast<double>(below)) return *nth;
  const double next = *std::min_element(nth + 1, sorted.end());
  return *nth + (position - static_cast<double>(below)) * (next - *nth);
}

double chi_square_cdf(double x, double dof) {
  return chi_square_tails(x, dof).lower;
}

double chi_square_survival(double x, double dof) {
  return chi_square_tails(x, dof).upper;
}

double chi_square_quantile(double probability, double dof) {
  require_positive("dof", dof);
  require(probability >= 0 && probability < 1, "probability", probability, "must be in [0, 1)");
  if (probability == 0) return 0;
  // Compared in the smaller tail; 1 - probability is exact above one half.
  const auto is_below = [&](double x) {
    const GammaTails tails = chi_square_tails(x, dof);
    return probability > 0.5 ? tails.upper > 1 - probability : tails.lower < probability;
  };
  double high = dof + 10;
  while (is_below(high)) high *= 2;
  double low = 0;
  // Bisection to the last bit: called when filters are set up, never per measurement.
  for (int i = 0; i < 2000; ++i) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) break;
    (is_below(middle) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace loc
