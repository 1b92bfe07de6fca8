#include "libloc/estimators/mono_slam.hpp"

#include <algorithm>
#include <cmath>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

// Frames in a row on an earlier time line that mean: the clock was set back.
constexpr int kSetBackAfter = 10;
// What is unknown after longer is no less known: the numbers must stay such that one can calculate with them. [s]
constexpr double kLongestPause = 30;

Estimate no_estimate() {
  Estimate out;
  out.covariance.setConstant(kUnknown);
  out.status = kInitialising;
  return out;
}

}  // namespace

MonoSlam::MonoSlam(const SlamOptions& options) : filter_(options), estimate_(no_estimate()) {
  require(options.motion == SlamMotion::kConstantVelocity, "motion: MonoSlam has no IMU, InertialSlam does");
}

void MonoSlam::reset() {
  filter_.stop();
  estimate_ = no_estimate();
  next_status_ = 0;
  restored_ = false;
  set_back_in_a_row_ = 0;
}

void MonoSlam::restore(const SlamSnapshot& snapshot) {
  filter_.restore(snapshot);
  next_status_ = 0;
  set_back_in_a_row_ = 0;
  restored_ = true;
}

// What the body did meanwhile is known no better than at the start, or than its usual speed allows.
void MonoSlam::widen_after_gap(double pause_s) {
  pause_s = std::min(pause_s, kLongestPause);
  const SlamOptions& options = filter_.options();
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(filter_.layout().dim);
  const auto add = [&](int first, double sigma) { variance.segment<3>(first).array() += sigma * sigma; };
  const double sigma_velocity = filter_.unknown_velocity_sigma();
  add(kVelocity, sigma_velocity);
  add(kAngularVelocity, options.sigma_angular_velocity);
  add(kPosition, sigma_velocity * pause_s);
  add(kTheta, std::min(options.sigma_angular_velocity * pause_s, 3.0));
  filter_.widen(variance);
}

void MonoSlam::predict_frame(TimeNs time_ns, SlamPrediction& out) const {
  const bool known = filter_.started() && !restored_ && SlamFilter::is_usable(time_ns) && time_ns > filter_.time_ns() &&
                     to_seconds(time_ns - filter_.time_ns()) <= filter_.options().max_gap_s;
  if (known) {
    filter_.predict_frame(time_ns, out);
    return;
  }
  if (filter_.started() && !restored_ && SlamFilter::is_usable(time_ns) && time_ns > filter_.time_ns()) {
    filter_.predict_lost(time_ns, out);
    return;
  }
  out.time_ns = time_ns;
  out.valid = out.lost = false;
  out.features.clear();
}

bool MonoSlam::process(const Measurement& measurement) {
  const auto* frame = std::get_if<FeaturesMeasurement>(&measurement);
  return frame != nullptr && frame->camera == filter_.options().camera_index && process_frame(*frame);
}

bool MonoSlam::process_frame(const FeaturesMeasurement& frame) {
  if (!SlamFilter::is_usable(frame.time_ns)) {
    ++out_of_range_;
    next_status_ |= kOutOfRange;
    return false;
  }
  // The camera's clock is all that there is.
  if (!filter_.started()) {
    filter_.start(frame.time_ns);
    ++starts_;
  } else if (restored_) {
    filter_.set_time(frame.time_ns);
    widen_after_gap(filter_.options().max_gap_s);
  } else if (frame.time_ns <= filter_.time_ns()) {
    ++not_increasing_;
    next_status_ |= kTimeNotIncreasing;
    if (++set_back_in_a_row_ < kSetBackAfter) return false;
    filter_.set_time(frame.time_ns);
    widen_after_gap(filter_.options().max_gap_s);
    next_status_ |= kGap;
    ++gaps_;
  } else {
    const double pause = to_seconds(frame.time_ns - filter_.time_ns());
    if (pause > filter_.options().max_gap_s) {
      filter_.set_time(frame.time_ns);
      widen_after_gap(pause);
      next_status_ |= kGap;
      ++gaps_;
    } else {
      filter_.propagate(frame.time_ns);
    }
  }
  restored_ = false;
  set_back_in_a_row_ = 0;
  estimate_ = filter_.update(frame, next_status_).estimate;
  next_status_ = 0;
  ++used_;
  if (!filter_.healthy()) {
    // Nothing that was said is worth anything: what follows is another world.
    estimate_.valid = 0;
    filter_.stop();
    ++diverged_;
    next_status_ = kReinitialised;
  }
  return true;
}

NamedCounts MonoSlam::counts() const {
  NamedCounts out = {{"features.used", used_},
                     {"features.time_not_increasing", not_increasing_},
                     {"features.out_of_range", out_of_range_},
                     {"gaps", gaps_},
                     {"starts", starts_},
                     {"diverged", diverged_}};
  for (NamedCount& count : filter_.counts()) out.push_back(std::move(count));
  return out;
}

}  // namespace loc
