#include "libloc/estimators/attitude_check.hpp"

#include <algorithm>
#include <cmath>

#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {

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
  begin_ns_ = last_ns_ = compared_ns_ = kNoTime;
  difference_.setZero();
  averaged_s_ = 0;
}

void AttitudeCheck::see(const Measurement& measurement) {
  const bool made = filter_.process(measurement);
  if (!made || kind_of(measurement) != StreamKind::kImu) return;
  last_ns_ = stamp_of(measurement).time_ns;
  const bool anew = (filter_.status() & (kReinitialised | kInitialising)) != 0;
  if (anew || begin_ns_ == kNoTime || last_ns_ < begin_ns_) {
    begin_ns_ = last_ns_;
    compared_ns_ = kNoTime;
    averaged_s_ = 0;
    difference_.setZero();
  }
}

bool AttitudeCheck::settled(const Estimate& estimate) const {
  return (estimate.valid & kValidOrientation) != 0 && estimate.time_ns == last_ns_ &&
         to_seconds(last_ns_ - begin_ns_) >= options_.start_s;
}

std::uint32_t AttitudeCheck::compare(const Estimate& estimate) {
  if (settled(estimate)) {
    const double dt = compared_ns_ == kNoTime ? 0 : std::max(0.0, to_seconds(estimate.time_ns - compared_ns_));
    compared_ns_ = estimate.time_ns;
    averaged_s_ = std::min(averaged_s_ + dt, options_.average_s);
    // The vertical that the accelerometers say, in the estimate's world.
    const Eigen::Vector3d up_in_body = filter_.orientation().inverse() * Eigen::Vector3d::UnitZ();
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
  constexpr std::uint32_t kNoField = kMagnetometerMissing | kMagnetometerDisturbed | kMagnetometerIgnored;
  if (!settled(estimate) || (filter_.status() & kNoField) != 0) return std::nullopt;
  const Estimate other = filter_.estimate();
  if ((other.valid & kValidHeading) == 0) return std::nullopt;
  // Both turn the same body; what lies between their worlds is a turn about the vertical, but for errors of the tilt.
  return so3::heading(other.q_world_body * estimate.q_world_body.inverse());
}

}  // namespace loc
