#include "libloc/sim/noise.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "libloc/core/check.hpp"

namespace loc {

bool contains(const std::vector<TimeInterval>& intervals, double time_s) {
  return std::any_of(intervals.begin(), intervals.end(), [&](const TimeInterval& i) { return i.contains(time_s); });
}

void check_intervals(std::string_view name, const std::vector<TimeInterval>& intervals) {
  for (const TimeInterval& i : intervals) {
    require_not_negative(std::string(name) + ".begin_s", i.begin_s);
    require(i.end_s > i.begin_s, std::string(name) + ".end_s", i.end_s, "must be after begin_s");
  }
}

GaussMarkov::GaussMarkov(const Eigen::Vector3d& sigma, double time_constant_s, Random random)
    : sigma_(sigma),
      time_constant_s_(time_constant_s),
      random_(random),
      value_(sigma.cwiseProduct(random_.normal3())) {}

const Eigen::Vector3d& GaussMarkov::advance(double dt_s) {
  if (sigma_.isZero(0)) return value_;
  const double phi = std::exp(-dt_s / time_constant_s_);
  // 1 - phi^2 without cancellation for short steps.
  const double fresh = std::sqrt(-std::expm1(-2 * dt_s / time_constant_s_));
  value_ = phi * value_ + fresh * sigma_.cwiseProduct(random_.normal3());
  return value_;
}

const Eigen::Vector3d& RandomWalk::advance(double dt_s) {
  if (density_ != 0) value_ += density_ * std::sqrt(dt_s) * random_.normal3();
  return value_;
}

RoundedReading round_reading(const Eigen::Vector3d& value, double range, double resolution) {
  RoundedReading out{value, (value.array().abs() > range).any()};
  // The last step inside the range; the small addition is for ranges that are a multiple of the resolution in decimals.
  const double limit =
      resolution > 0 && std::isfinite(range) ? resolution * std::floor(range / resolution + 1e-9) : range;
  if (resolution > 0) {
    for (double& x : out.value) x = resolution * std::round(x / resolution);
  }
  out.value = out.value.cwiseMax(-limit).cwiseMin(limit);
  return out;
}

}  // namespace loc
