#include "libloc/estimators/stand_still.hpp"

#include <algorithm>
#include <cmath>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr std::size_t kMinSamples = 5;
constexpr std::size_t kMaxSamples = 100'000;
// A window whose samples cover this part of it is full.
constexpr double kFull = 0.8;
// What drove as calmly as this once is not taken for rest again, with this margin.
constexpr double kLearn = 0.7;

}  // namespace

void StandStillOptions::check() const {
  require_positive("window_s", window_s);
  require(std::isfinite(min_duration_s) && min_duration_s >= window_s, "min_duration_s", min_duration_s,
          "must be at least window_s");
  require(std::isfinite(threshold) && threshold > 6, "threshold", threshold, "must be greater than 6");
  require_positive("force_sigma_floor", force_sigma_floor);
  require_positive("rate_sigma_floor", rate_sigma_floor);
  require_positive("max_angular_velocity", max_angular_velocity);
  require_positive("max_force_error", max_force_error);
  require_positive("max_force_change", max_force_change);
  require_positive("max_rate_change", max_rate_change);
  require_not_negative("min_speed", min_speed);
}

StandStillDetector::StandStillDetector(const StandStillOptions& options, const ImuNoise& noise, double gravity)
    : options_(options), noise_(noise), gravity_(gravity), threshold_(options.threshold) {
  options_.check();
  noise_.check();
  require_positive("gravity", gravity);
}

void StandStillDetector::reset() {
  while (!window_.empty()) window_.pop_front();
  since_fresh_sums_ = 0;
  rate_sum_.setZero();
  force_sum_.setZero();
  rate_squares_ = force_squares_ = 0;
  mean_rate_.setConstant(kUnknown);
  mean_force_.setConstant(kUnknown);
  mean_rate_sigma_ = statistic_ = kUnknown;
  calm_since_ns_ = kNoTime;
  at_rest_ = false;
}

void StandStillDetector::add(const Sample& sample, double sign) {
  rate_sum_ += sign * sample.rate;
  force_sum_ += sign * sample.force;
  rate_squares_ += sign * sample.rate.squaredNorm();
  force_squares_ += sign * sample.force.squaredNorm();
}

bool StandStillDetector::calm(const Eigen::Vector3d& bias, double bias_sigma) {
  const double span = to_seconds(window_.back().time_ns - window_.front().time_ns);
  if (window_.size() < kMinSamples || span < kFull * options_.window_s) {
    statistic_ = kUnknown;
    return false;
  }
  const auto n = static_cast<double>(window_.size());
  mean_rate_ = rate_sum_ / n;
  mean_force_ = force_sum_ / n;
  const DiscreteImuNoise sample = discretise(noise_, span / (n - 1));
  const double rate_sigma = std::max(options_.rate_sigma_floor, sample.sigma_angular_velocity);
  const double force_sigma = std::max(options_.force_sigma_floor, sample.sigma_specific_force);
  const double rate_variance = std::max(0.0, rate_squares_ / n - mean_rate_.squaredNorm());
  const double force_variance = std::max(0.0, force_squares_ / n - mean_force_.squaredNorm());
  statistic_ = rate_variance / (rate_sigma * rate_sigma) + force_variance / (force_sigma * force_sigma);
  mean_rate_sigma_ = rate_sigma / std::sqrt(n);
  return statistic_ < threshold_ &&
         (mean_rate_ - bias).norm() < std::max(options_.max_angular_velocity, 3 * std::sqrt(3.0) * bias_sigma) &&
         std::abs(mean_force_.norm() - gravity_) < options_.max_force_error;
}

bool StandStillDetector::update(const ImuMeasurement& imu, const Eigen::Vector3d& gyroscope_bias, double bias_sigma) {
  if (!imu.angular_velocity.allFinite() || !imu.specific_force.allFinite() || imu.time_ns == kNoTime) return at_rest_;
  const TimeNs window_ns = from_seconds(options_.window_s);
  if (!window_.empty()) {
    if (imu.time_ns <= window_.back().time_ns) return at_rest_;
    TimeNs step = 0;
    if (__builtin_sub_overflow(imu.time_ns, window_.back().time_ns, &step) || step > window_ns) reset();
  }
  window_.push_back({imu.time_ns, imu.angular_velocity, imu.specific_force});
  add(window_.back(), 1);
  while (imu.time_ns - window_.front().time_ns > window_ns || window_.size() > kMaxSamples) {
    add(window_.pop_front(), -1);
  }
  // Sums that only ever gain and lose samples keep the rounding of all of them.
  if (++since_fresh_sums_ > 16 * window_.size()) {
    since_fresh_sums_ = 0;
    rate_sum_.setZero();
    force_sum_.setZero();
    rate_squares_ = force_squares_ = 0;
    for (std::size_t i = 0; i < window_.size(); ++i) add(window_[i], 1);
  }

  at_rest_ = false;
  if (!calm(gyroscope_bias, bias_sigma)) {
    calm_since_ns_ = kNoTime;
    return false;
  }
  const bool changed = calm_since_ns_ != kNoTime && ((mean_force_ - first_force_).norm() > options_.max_force_change ||
                                                     (mean_rate_ - first_rate_).norm() > options_.max_rate_change);
  if (calm_since_ns_ == kNoTime || changed) {
    calm_since_ns_ = imu.time_ns;
    first_force_ = mean_force_;
    first_rate_ = mean_rate_;
  }
  at_rest_ = to_seconds(imu.time_ns - calm_since_ns_) + options_.window_s >= options_.min_duration_s;
  return at_rest_;
}

void StandStillDetector::confirm_speed(double speed, double sigma) {
  if (!(speed > options_.min_speed + 3 * sigma)) return;  // false for NaN as well
  calm_since_ns_ = kNoTime;
  if (at_rest_) ++false_alarms_;
  at_rest_ = false;
  if (statistic_ < threshold_) threshold_ = kLearn * statistic_;  // false before the window is full
}

}  // namespace loc
