#include "libloc/estimators/attitude_check.hpp"

#include <algorithm>
#include <cmath>

#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr double kLongestHold = 1;  // of an estimate against the samples [s]

}  // namespace

void AttitudeCheckOptions::check() const {
  require_positive("average_s", average_s);
  require_positive("max_tilt", max_tilt);
  require_not_negative("deviations", deviations);
  require_not_negative("start_s", start_s);
  require_positive("heading_sigma", heading_sigma);
}

AttitudeCheck::AttitudeCheck(const AttitudeCheckOptions& options)
    : options_((options.check(), options)), filter_(MadgwickOptions::robust()) {}

void AttitudeCheck::reset() {
  filter_.reset();
  begin_ns_ = compared_ns_ = kNoTime;
  while (!opinions_.empty()) opinions_.drop_front();
  difference_.setZero();
  averaged_s_ = 0;
}

void AttitudeCheck::see(const Measurement& measurement) {
  const bool made = filter_.process(measurement);
  if (!made || kind_of(measurement) != StreamKind::kImu) return;
  const TimeNs now = stamp_of(measurement).time_ns;
  const bool anew = (filter_.status() & (kReinitialised | kInitialising)) != 0;
  if (anew || begin_ns_ == kNoTime || now < begin_ns_) {
    begin_ns_ = now;
    compared_ns_ = kNoTime;
    averaged_s_ = 0;
    difference_.setZero();
    while (!opinions_.empty()) opinions_.drop_front();
  }
  constexpr std::uint32_t kNoField = kMagnetometerMissing | kMagnetometerDisturbed | kMagnetometerIgnored;
  const bool north = (filter_.status() & kNoField) == 0 && (filter_.estimate().valid & kValidHeading) != 0;
  opinions_.push_back({now, filter_.orientation(), north});
  while (to_seconds(now - opinions_.front().time_ns) > kLongestHold) opinions_.drop_front();
}

const AttitudeCheck::Opinion* AttitudeCheck::at(const Estimate& estimate) const {
  if ((estimate.valid & kValidOrientation) == 0) return nullptr;
  for (std::size_t i = opinions_.size(); i > 0; --i) {
    const Opinion& opinion = opinions_[i - 1];
    if (opinion.time_ns > estimate.time_ns) continue;
    const bool settled = to_seconds(opinion.time_ns - begin_ns_) >= options_.start_s;
    return opinion.time_ns == estimate.time_ns && settled ? &opinion : nullptr;
  }
  return nullptr;
}

std::uint32_t AttitudeCheck::compare(const Estimate& estimate) {
  if (const Opinion* opinion = at(estimate)) {
    const double dt = compared_ns_ == kNoTime ? 0 : std::max(0.0, to_seconds(estimate.time_ns - compared_ns_));
    compared_ns_ = estimate.time_ns;
    averaged_s_ = std::min(averaged_s_ + dt, options_.average_s);
    // The vertical that the accelerometers say, in the estimate's world.
    const Eigen::Vector3d up_in_body = opinion->q_world_body.inverse() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d off = estimate.q_world_body * up_in_body - Eigen::Vector3d::UnitZ();
    const double share = averaged_s_ > 0 ? std::min(1.0, dt / averaged_s_) : 1;
    difference_ += share * (off - difference_);
  }
  if (averaged_s_ < options_.average_s) return 0;
  double allowed = options_.max_tilt;
  if ((estimate.valid & kValidCovariance) != 0) {
    const Eigen::Matrix3d R = estimate.q_world_body.toRotationMatrix();
    const Eigen::Matrix3d cov = R * estimate.covariance.topLeftCorner<3, 3>() * R.transpose();
    allowed = std::max(allowed, options_.deviations * std::sqrt(std::max(0.0, cov(0, 0) + cov(1, 1))));
  }
  return tilt() > allowed ? kTiltDoubtful : 0U;
}

std::optional<double> AttitudeCheck::heading_of_world(const Estimate& estimate) const {
  const Opinion* opinion = at(estimate);
  if (opinion == nullptr || !opinion->has_north) return std::nullopt;
  // Both turn the same body; what lies between their worlds is a turn about the vertical, but for errors of the tilt.
  return so3::heading(opinion->q_world_body * estimate.q_world_body.inverse());
}

}  // namespace loc
