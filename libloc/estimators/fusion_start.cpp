#include "libloc/estimators/fusion_start.hpp"

#include <algorithm>
#include <cmath>

#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr std::size_t kMaxSamples = 200'000;
constexpr double kMinGravity = 0.5;      // part of gravity that the mean force must have
constexpr double kMinHorizontal = 0.02;  // sine of the angle between a field and the vertical

Eigen::Vector3d mean_rate(const std::vector<ImuMeasurement>& samples) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const ImuMeasurement& imu : samples) sum += imu.angular_velocity;
  return sum / static_cast<double>(samples.size());
}

}  // namespace

void FusionStartOptions::check() const {
  require_positive("start.duration_s", duration_s);
  require_positive("start.max_gap_s", max_gap_s);
  require_positive("start.moving_acceleration_sigma", moving_acceleration_sigma);
  require_positive("start.moving_velocity_sigma", moving_velocity_sigma);
  require_positive("start.still_velocity_sigma", still_velocity_sigma);
  require_positive("start.tilt_sigma_floor", tilt_sigma_floor);
  require_positive("start.still_bias_sigma_floor", still_bias_sigma_floor);
  require_positive("start.position_sigma", position_sigma);
  if (heading) require_finite("start.heading", *heading);
  require_positive("start.heading_sigma", heading_sigma);
  require_finite("start.magnetic_declination", magnetic_declination);
  require_positive("start.magnetic_heading_sigma", magnetic_heading_sigma);
}

FusionStart::FusionStart(const FusionStartOptions& options, const StandStillOptions& rest, const ImuNoise& noise,
                         double gravity)
    : options_(options), rest_(rest), noise_(noise), gravity_(gravity) {
  options_.check();
  rest_.check();
  noise_.check();
  require_positive("gravity", gravity);
  // All of it must be rest.
  rest_.window_s = std::min(rest_.window_s, options_.duration_s);
  rest_.min_duration_s = rest_.window_s;
}

void FusionStart::reset() {
  samples_.clear();
  fields_.clear();
  over_ = false;
}

bool FusionStart::push(const ImuMeasurement& imu) {
  if (over_) return true;
  if (!samples_.empty()) {
    if (imu.time_ns <= samples_.back().time_ns) return false;
    TimeNs step = 0;
    const bool overflow = __builtin_sub_overflow(imu.time_ns, samples_.back().time_ns, &step);
    if (overflow || to_seconds(step) > options_.max_gap_s || samples_.size() == kMaxSamples) {
      ++repeated_;
      reset();
    }
  }
  samples_.push_back(imu);
  if (to_seconds(imu.time_ns - samples_.front().time_ns) < options_.duration_s || samples_.size() < 3) return false;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  for (const ImuMeasurement& one : samples_) force += one.specific_force;
  if (force.norm() < kMinGravity * gravity_ * static_cast<double>(samples_.size())) {
    ++repeated_;
    reset();
    return false;
  }
  over_ = true;
  return true;
}

void FusionStart::push(const MagnetometerMeasurement& magnetometer) {
  if (over_ || !magnetometer.magnetic_field.allFinite() || fields_.size() == kMaxSamples) return;
  fields_.push_back(magnetometer);
}

bool FusionStart::look_for_rest() const {
  StandStillDetector detector(rest_, noise_, gravity_);
  bool still = false;
  for (const ImuMeasurement& imu : samples_) {
    const bool was_full = std::isfinite(detector.statistic());
    still = detector.update(imu, Eigen::Vector3d::Zero(), noise_.gyroscope_bias_sigma);
    if (was_full && !still) return false;
  }
  return still;
}

// Attitude of the body at each sample in its axes at the first.
std::vector<Eigen::Quaterniond> FusionStart::turns(const Eigen::Vector3d& bias) const {
  std::vector<Eigen::Quaterniond> out{Eigen::Quaterniond::Identity()};
  for (std::size_t i = 1; i < samples_.size(); ++i) {
    const double dt = to_seconds(samples_[i].time_ns - samples_[i - 1].time_ns);
    const Eigen::Vector3d rate = 0.5 * (samples_[i].angular_velocity + samples_[i - 1].angular_velocity) - bias;
    out.push_back(so3::boxplus(out.back(), dt * rate));
  }
  return out;
}

std::optional<double> FusionStart::magnetic_heading(const Eigen::Quaterniond& level,
                                                    const std::vector<Eigen::Quaterniond>& turns) const {
  Eigen::Vector3d field = Eigen::Vector3d::Zero();
  for (const MagnetometerMeasurement& m : fields_) {
    const auto after = std::ranges::upper_bound(samples_, m.time_ns, {}, &ImuMeasurement::time_ns);
    const auto index = std::max<std::ptrdiff_t>(0, after - samples_.begin() - 1);
    field += turns[static_cast<std::size_t>(index)] * m.magnetic_field;
  }
  const Eigen::Vector3d in_world = level * field;
  const double horizontal = std::hypot(in_world.x(), in_world.y());
  if (!(horizontal > kMinHorizontal * in_world.norm())) return std::nullopt;  // also for none at all
  return std::atan2(in_world.x(), in_world.y()) - options_.magnetic_declination;
}

FusionStartEstimate FusionStart::estimate(bool may_be_at_rest) const {
  require(over_, "FusionStart: the first samples are not there yet");
  return estimate_of(may_be_at_rest && look_for_rest(), 0);
}

FusionStartEstimate FusionStart::estimate_still(double sigma_rate) const {
  require(over_, "FusionStart: the first samples are not there yet");
  require_not_negative("sigma_rate", sigma_rate);
  return estimate_of(true, sigma_rate);
}

FusionStartEstimate FusionStart::estimate_of(bool at_rest, double sigma_rate) const {
  FusionStartEstimate out;
  out.time_ns = samples_.front().time_ns;
  out.at_rest = at_rest;
  if (out.at_rest) out.state.gyroscope_bias = mean_rate(samples_);

  // Averaged in axes that the gyroscope keeps, so that turning does not smear gravity.
  const std::vector<Eigen::Quaterniond> turn = turns(out.state.gyroscope_bias);
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < samples_.size(); ++i) up += turn[i] * samples_[i].specific_force;
  const Eigen::Quaterniond level = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
  double heading = 0;
  double heading_sigma = 0;
  if (options_.heading) {
    out.heading = HeadingSource::kGiven;
    heading = *options_.heading - so3::heading(level);
    heading_sigma = options_.heading_sigma;
  } else if (const auto magnetic = magnetic_heading(level, turn)) {
    out.heading = HeadingSource::kMagnetometer;
    heading = *magnetic;
    heading_sigma = options_.magnetic_heading_sigma;
  }
  const Eigen::Quaterniond q = Eigen::Quaterniond(Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ())) * level;
  out.state.q_world_body = q.normalized();

  const double acceleration = out.at_rest ? 0 : options_.moving_acceleration_sigma;
  const double tilt_sigma =
      std::hypot(options_.tilt_sigma_floor, std::hypot(noise_.accelerometer_bias_sigma, acceleration) / gravity_);
  const Eigen::Matrix3d R = out.state.q_world_body.toRotationMatrix();
  const auto square = [](double sigma) { return sigma * sigma; };
  const auto block = [&](int at, double sigma) {
    out.covariance.block<3, 3>(at, at) = square(sigma) * Eigen::Matrix3d::Identity();
  };
  out.covariance.setZero();
  const Eigen::Vector3d attitude(square(tilt_sigma), square(tilt_sigma), square(heading_sigma));
  out.covariance.block<3, 3>(kTheta, kTheta) = R.transpose() * attitude.asDiagonal() * R;
  block(kPosition, options_.position_sigma);
  block(kVelocity, out.at_rest ? options_.still_velocity_sigma : options_.moving_velocity_sigma);
  const double white = std::hypot(noise_.gyroscope_noise_density / std::sqrt(options_.duration_s), sigma_rate);
  block(kGyroscopeBias, out.at_rest ? std::hypot(options_.still_bias_sigma_floor, white) : noise_.gyroscope_bias_sigma);
  block(kAccelerometerBias, noise_.accelerometer_bias_sigma);
  return out;
}

}  // namespace loc
