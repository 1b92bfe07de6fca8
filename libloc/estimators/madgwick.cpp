#include "libloc/estimators/madgwick.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

// A field of more is no field in any unit, and squares and products stay far from overflow.
constexpr double kMaxField = 1e6;
// Samples in a row on another time line that mean: the clock was set back.
constexpr int kSetBackAfter = 20;
// Part of the force's time constant over which the field is averaged at the start.
constexpr double kStartFieldMean = 0.2;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
// A direction needs a vector; in the unit of the sensor (m/s^2, T or any other that the user's magnetometer has).
constexpr double kMinForce = 1e-3;
constexpr double kMinField = 1e-12;
// Sine of the error below which a direction that points the wrong way counts as exactly opposite.
constexpr double kSaddle = 1e-6;
// Sine of the angle to gravity below which a magnetic field holds no heading.
constexpr double kMinHorizontalField = 0.02;

// q * Exp(theta) for the small angles of one step, without trigonometry; exact to 1e-13 below 0.5 rad.
Eigen::Quaterniond integrate(const Eigen::Quaterniond& q, const Eigen::Vector3d& theta) {
  const Eigen::Vector3d h = 0.5 * theta;
  const double h2 = h.squaredNorm();
  if (h2 > 0.0625) return q * so3::exp(theta);
  const double c = 1 - h2 * (1.0 / 2 - h2 * (1.0 / 24 - h2 * (1.0 / 720 - h2 / 40320)));
  const double s = 1 - h2 * (1.0 / 6 - h2 * (1.0 / 120 - h2 * (1.0 / 5040 - h2 / 362880)));
  return q * Eigen::Quaterniond(c, s * h.x(), s * h.y(), s * h.z());
}

// Exp(theta) * v for the small angles of one step; error |theta|^3/6 below 0.1 rad, none above.
Eigen::Vector3d rotate(const Eigen::Vector3d& theta, const Eigen::Vector3d& v) {
  if (theta.squaredNorm() > 0.01) return so3::exp(theta) * v;
  const Eigen::Vector3d first = theta.cross(v);
  return v + first + 0.5 * theta.cross(first);
}

// 1/sqrt by its series; the square root itself only when the norm is far off.
void normalise(Eigen::Quaterniond& q) {
  const double e = q.squaredNorm() - 1;
  q.coeffs() *= std::abs(e) < 1e-4 ? 1 - e * (0.5 - 0.375 * e) : 1 / std::sqrt(1 + e);
}

}  // namespace

const char* world_frame_name(WorldFrame frame) {
  switch (frame) {
    case WorldFrame::kEnu:
      return "ENU";
    case WorldFrame::kNwu:
      return "NWU";
    case WorldFrame::kNed:
      return "NED";
  }
  return "unknown";
}

WorldFrame parse_world_frame(std::string_view name) {
  std::string upper(name);
  std::transform(upper.begin(), upper.end(), upper.begin(),
                 [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
  for (const WorldFrame frame : {WorldFrame::kEnu, WorldFrame::kNwu, WorldFrame::kNed}) {
    if (upper == world_frame_name(frame)) return frame;
  }
  throw std::invalid_argument("world frame '" + std::string(name) + "': must be ENU, NWU or NED");
}

MadgwickOptions MadgwickOptions::report() {
  return {};
}

MadgwickOptions MadgwickOptions::robust() {
  MadgwickOptions options;
  options.beta = 0.02;
  options.soft_gradient = 0.1;  // with beta: time constant 0.1 / (2 * 0.02) = 2.5 s near the truth
  options.gradient_phase = 0.5;
  options.accelerometer_time_constant_s = 1.5;
  options.start_time_s = 5;
  options.rest_bias = true;
  options.motion_bias = true;
  options.magnetic_rejection = true;
  options.magnetometer_heading_only = true;
  options.magnetometer_weight = 0.25;  // time constant 10 s: a field indoors is worth less than a good gyroscope
  return options;
}

MadgwickOptions MadgwickOptions::preset(std::string_view name) {
  if (name == "report") return report();
  if (name == "robust") return robust();
  throw std::invalid_argument("madgwick preset '" + std::string(name) + "': must be report or robust");
}

void MadgwickOptions::check() const {
  require_not_negative("beta", beta);
  require(alpha > 1, "alpha", alpha, "must be greater than 1 (infinity: the final form of the report)");
  require_not_negative("soft_gradient", soft_gradient);
  require(gradient_phase >= 0 && gradient_phase <= 1, "gradient_phase", gradient_phase, "must be in [0, 1]");
  require_not_negative("magnetometer_weight", magnetometer_weight);
  require_not_negative("accelerometer_time_constant_s", accelerometer_time_constant_s);
  require_not_negative("start_time_s", start_time_s);
  require_positive("rest_max_angular_velocity", rest_max_angular_velocity);
  require_positive("rest_max_force_change", rest_max_force_change);
  require_positive("rest_min_duration_s", rest_min_duration_s);
  require_positive("rest_low_pass_s", rest_low_pass_s);
  require_positive("rest_bias_cutoff_hz", rest_bias_cutoff_hz);
  require_not_negative("motion_bias_start_sigma", motion_bias_start_sigma);
  require_not_negative("motion_bias_walk", motion_bias_walk);
  require_positive("motion_bias_noise", motion_bias_noise);
  require_positive("rest_bias_sigma", rest_bias_sigma);
  require_positive("max_gyroscope_bias", max_gyroscope_bias);
  require_positive("magnetic_norm_tolerance", magnetic_norm_tolerance);
  require_positive("magnetic_dip_tolerance", magnetic_dip_tolerance);
  require_positive("magnetic_reference_time_s", magnetic_reference_time_s);
  require_positive("magnetic_max_rejection_s", magnetic_max_rejection_s);
  require_positive("max_angular_velocity", max_angular_velocity);
  require_positive("max_specific_force", max_specific_force);
  require_positive("max_heading_age_s", max_heading_age_s);
  require_positive("max_gap_s", max_gap_s);
  require_positive("max_magnetometer_age_s", max_magnetometer_age_s);
}

double beta_from_gyro(const ImuNoise& noise, double bias_residual, double scale_error, double max_rate, double dt_s) {
  require_not_negative("bias_residual", bias_residual);
  require_not_negative("scale_error", scale_error);
  require_not_negative("max_rate", max_rate);
  const double white = discretise(noise, dt_s).sigma_angular_velocity;
  return std::sqrt(0.75) * std::hypot(white, bias_residual, scale_error * max_rate);
}

MadgwickFilter::MadgwickFilter(const MadgwickOptions& options)
    : options_(options),
      up_z_(options.world == WorldFrame::kNed ? -1 : 1),
      north_axis_(options.world == WorldFrame::kEnu ? 1 : 0),
      cos_dip_tolerance_(std::cos(options.magnetic_dip_tolerance)) {
  correction_time_s_ = options.beta > 0 ? 0.5 * options.soft_gradient / options.beta : kInfinity;
  bias_variance_.setConstant(options.motion_bias_start_sigma * options.motion_bias_start_sigma);
  options_.check();
}

void MadgwickFilter::reset() {
  const MadgwickCounts counts = counts_;
  *this = MadgwickFilter(options_);
  counts_ = counts;
}

MadgwickFilter::TimeLine::Verdict MadgwickFilter::TimeLine::judge(TimeNs time) {
  if (time > last) {
    refused_in_a_row = 0;
    last = time;
    return Verdict::kNext;
  }
  refused_in_a_row = refused_in_a_row > 0 && time > refused ? refused_in_a_row + 1 : 1;
  refused = time;
  if (refused_in_a_row < kSetBackAfter) return Verdict::kNotIncreasing;
  refused_in_a_row = 0;
  last = time;
  return Verdict::kSetBack;
}

std::uint32_t MadgwickFilter::skip(std::uint32_t reason) {
  // The state stays. The next estimate says that something was skipped before it.
  skipped_status_ |= reason;
  status_ = reason | (initialised_ ? 0U : static_cast<std::uint32_t>(kInitialising));
  return status_;
}

void MadgwickFilter::forget_field() {
  field_sample_time_ = kNoTime;
  field_judged_time_ = kNoTime;
  field_disturbed_ = false;
}

std::uint32_t MadgwickFilter::update(const MagnetometerMeasurement& magnetometer) {
  const Eigen::Vector3d& field = magnetometer.magnetic_field;
  const auto refuse = [this](std::int64_t& count, std::uint32_t reason) {
    ++count;
    skipped_status_ |= reason;
    return reason;
  };
  const double norm2 = field.squaredNorm();
  if (!(norm2 <= kMaxField * kMaxField)) {
    return field.allFinite() ? refuse(counts_.magnetometer_out_of_range, kOutOfRange)
                             : refuse(counts_.magnetometer_not_finite, kNotFinite);
  }
  const TimeLine::Verdict verdict = field_time_line_.judge(magnetometer.time_ns);
  if (verdict == TimeLine::Verdict::kNotIncreasing) {
    return refuse(counts_.magnetometer_time_not_increasing, kTimeNotIncreasing);
  }
  if (verdict == TimeLine::Verdict::kSetBack) forget_field();
  ++counts_.magnetometer;
  field_norm_ = std::sqrt(norm2);
  field_ = field_norm_ > kMinField ? Eigen::Vector3d(field / field_norm_) : Eigen::Vector3d::Zero();
  field_sample_time_ = magnetometer.time_ns;
  field_time_ = magnetometer.time_ns;
  return 0;
}

void MadgwickFilter::start(const ImuMeasurement& imu) {
  // TRIAD without the magnetometer: the shortest rotation that brings the specific force up. The heading follows with
  // the first magnetometer sample.
  q_ = Eigen::Quaterniond::FromTwoVectors(imu.specific_force, Eigen::Vector3d(0, 0, up_z_));
  force_world_ = q_ * imu.specific_force;
  force_time_s_ = 0;
  elapsed_s_ = 0;
  force_lag_R_ = correction_lag_R_ = q_.toRotationMatrix();
  rest_rate_ = imu.angular_velocity;
  rest_force_ = imu.specific_force;
  calm_s_ = 0;
  initialised_ = true;
  heading_known_ = false;
  since_field_s_ = 0;
}

void MadgwickFilter::detect_rest(const Eigen::Vector3d& rate, const Eigen::Vector3d& force, double dt) {
  const double k = dt / (options_.rest_low_pass_s + dt);
  rest_rate_ += k * (rate - rest_rate_);
  rest_force_ += k * (force - rest_force_);
  const double max_rate = options_.rest_max_angular_velocity;
  const double max_force = options_.rest_max_force_change;
  const bool calm = (rate - rest_rate_).squaredNorm() < max_rate * max_rate &&
                    (force - rest_force_).squaredNorm() < max_force * max_force &&
                    rest_rate_.cwiseAbs().maxCoeff() < options_.max_gyroscope_bias;
  if (!calm) {
    calm_s_ = 0;
    return;
  }
  calm_s_ += dt;
  if (calm_s_ < options_.rest_min_duration_s) return;
  status_ |= kAtRest;
  // A mean over all rest so far, until that is longer than the low-pass remembers.
  rest_total_s_ += dt;
  const double memory = 1 / (2 * std::numbers::pi * options_.rest_bias_cutoff_hz);
  bias_ += dt / std::min(rest_total_s_, memory + dt) * (rest_rate_ - bias_);
  bias_known_ = true;
  bias_variance_ = bias_variance_.cwiseMin(options_.rest_bias_sigma * options_.rest_bias_sigma);
}

void MadgwickFilter::update_motion_bias(const Eigen::Vector3d& tilt_rate, const Eigen::Matrix3d& R, double dt) {
  // A gyroscope that reads too much by b makes the attitude turn by R b, and the correction turns back: late by the
  // low-pass of the force and by its own time constant. The same two lags on R give the measurement's matrix:
  // tilt_rate = -lagged(R) b + noise. (VQF filters R for the same reason: Laidig and Seel, 2023.)
  force_lag_R_ += dt / (options_.accelerometer_time_constant_s + dt) * (R - force_lag_R_);
  correction_lag_R_ += dt / (correction_time_s_ + dt) * (force_lag_R_ - correction_lag_R_);
  if (elapsed_s_ < options_.start_time_s || correction_time_s_ == kInfinity || (status_ & kAccelerometerIgnored) != 0) {
    return;  // the correction says nothing about the gyroscope
  }
  const double walk = options_.motion_bias_walk;
  const double noise = options_.motion_bias_noise;
  const auto H = correction_lag_R_.topRows<2>();
  const Eigen::Vector3d gain = bias_variance_ / (noise * noise + dt * bias_variance_.maxCoeff());
  bias_ -= dt * gain.cwiseProduct(H.transpose() * tilt_rate.head<2>());
  bias_ = bias_.cwiseMax(-options_.max_gyroscope_bias).cwiseMin(options_.max_gyroscope_bias);
  const Eigen::Vector3d seen = H.colwise().squaredNorm().transpose();
  bias_variance_ +=
      dt * (Eigen::Vector3d::Constant(walk * walk) - gain.cwiseProduct(bias_variance_).cwiseProduct(seen));
  // Known once the deviation has fallen to half of what it was.
  const double start = options_.motion_bias_start_sigma;
  if (bias_variance_.maxCoeff() < 0.25 * start * start) bias_known_ = true;
}

bool MadgwickFilter::agrees(const FieldMean& mean, const FieldMean& sample) const {
  return std::abs(sample.norm - mean.norm) <= options_.magnetic_norm_tolerance * mean.norm &&
         sample.cos_dip * mean.cos_dip + sample.sin_dip * mean.sin_dip >= cos_dip_tolerance_;
}

void MadgwickFilter::follow(FieldMean& mean, const FieldMean& sample, double dt) const {
  // A mean at first, a low-pass later.
  const double k = mean.norm == 0 ? 1 : dt / (std::min(mean.seen_s, options_.magnetic_reference_time_s) + dt);
  mean.norm += k * (sample.norm - mean.norm);
  mean.sin_dip += k * (sample.sin_dip - mean.sin_dip);
  mean.cos_dip += k * (sample.cos_dip - mean.cos_dip);
  mean.seen_s = std::min(mean.seen_s + dt, options_.magnetic_max_rejection_s);
}

bool MadgwickFilter::magnetic_field_disturbed(double sin_dip, double cos_dip, double dt) {
  const FieldMean sample{field_norm_, sin_dip, cos_dip, 0};
  if (elapsed_s_ < options_.accelerometer_time_constant_s)
    reference_.seen_s = 0;  // the tilt is too uncertain for a mean
  if (reference_.norm == 0 || elapsed_s_ < options_.start_time_s || agrees(reference_, sample)) {
    follow(reference_, sample, dt);
    rejected_s_ = std::max(0.0, rejected_s_ - dt);
    return false;
  }
  if (!agrees(candidate_, sample)) candidate_ = {};
  follow(candidate_, sample, dt);
  rejected_s_ += dt;
  const bool waited_out = rejected_s_ >= options_.magnetic_max_rejection_s;
  if (candidate_.seen_s < reference_.seen_s && !waited_out) return true;
  reference_ = candidate_;
  if (waited_out) reference_.seen_s = options_.magnetic_max_rejection_s;  // or what is never steady goes on for ever
  candidate_ = {};
  rejected_s_ = 0;
  return false;
}

bool MadgwickFilter::carry_field(double dt) {
  if (field_sample_time_ == kNoTime) return false;
  TimeNs age = 0;
  if (__builtin_sub_overflow(last_.time_ns, field_sample_time_, &age) ||
      std::abs(to_seconds(age)) > options_.max_magnetometer_age_s) {
    return false;
  }
  if (field_time_ != last_.time_ns) {
    // Seen from the body, the world turns backwards. The last step's rate stands for the whole time since the sample.
    const double elapsed = field_time_ == field_sample_time_ ? to_seconds(last_.time_ns - field_time_) : dt;
    field_ = rotate(-elapsed * rate_, field_);
    field_time_ = last_.time_ns;
  }
  return true;
}

void MadgwickFilter::turn_to_north() {
  const Eigen::Vector3d field = q_ * field_;
  if (std::hypot(field.x(), field.y()) < kMinHorizontalField) return;
  const double heading =
      options_.world == WorldFrame::kEnu ? std::atan2(field.x(), field.y()) : std::atan2(-field.y(), field.x());
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()));
  q_ = turn * q_;
  force_world_ = turn * force_world_;
  force_lag_R_ = turn * force_lag_R_;
  correction_lag_R_ = turn * correction_lag_R_;
  heading_known_ = true;
}

Eigen::Vector3d MadgwickFilter::gravity_gradient(const Eigen::Matrix3d& R, const Eigen::Vector3d& force, double dt) {
  if (options_.accelerometer_time_constant_s > 0) {
    // A mean at first, so that the first sample does not weigh for a whole time constant.
    force_time_s_ = std::min(force_time_s_ + dt, options_.accelerometer_time_constant_s);
    if (dt > 0) force_world_ += dt / (force_time_s_ + dt) * (R * force - force_world_);
  } else {
    force_world_ = R * force;
  }
  const double norm2 = force_world_.squaredNorm();
  if (norm2 < kMinForce * kMinForce) {  // the mean of a fall
    ++counts_.accelerometer_ignored;
    status_ |= kAccelerometerIgnored;
    return Eigen::Vector3d::Zero();
  }
  // measured x true, where true is z
  const Eigen::Vector3d up = up_z_ / std::sqrt(norm2) * force_world_;
  const double sine2 = up.x() * up.x() + up.y() * up.y();
  if (up.z() < 0 && sine2 < kSaddle * kSaddle) return Eigen::Vector3d::UnitX();
  return {up.y(), -up.x(), 0};
}

Eigen::Vector3d MadgwickFilter::magnetic_gradient(const Eigen::Matrix3d& R, const Eigen::Vector3d& field_body) {
  const Eigen::Vector3d field = R * field_body;
  const double horizontal = std::sqrt(field.x() * field.x() + field.y() * field.y());
  if (horizontal < kMinHorizontalField) {  // also when the field is zero
    ++counts_.magnetometer_ignored;
    status_ |= kMagnetometerIgnored;
    return Eigen::Vector3d::Zero();
  }
  if (options_.magnetic_rejection) {
    if (field_judged_time_ != field_sample_time_) {
      // Once per sample, however many IMU steps use it.
      const double elapsed = field_judged_time_ == kNoTime ? 0 : to_seconds(field_sample_time_ - field_judged_time_);
      field_judged_time_ = field_sample_time_;
      field_disturbed_ =
          magnetic_field_disturbed(field.z(), horizontal, std::min(elapsed, options_.max_magnetometer_age_s));
    }
    if (field_disturbed_) {
      ++counts_.magnetometer_disturbed;
      status_ |= kMagnetometerDisturbed;
      return Eigen::Vector3d::Zero();
    }
  }
  since_field_s_ = 0;
  // measured x reference, the reference being the measured field turned about the vertical until it points north
  // (report, equations 45, 46).
  const bool north_is_y = north_axis_ == 1;
  const double north = north_is_y ? field.y() : field.x();
  const double sine = (north_is_y ? field.x() : -field.y());  // of the heading error, times horizontal
  const double weight = options_.magnetometer_weight;
  if (options_.magnetometer_heading_only) {
    // Facing south the sine shrinks again; pull with full strength, one way or the other.
    return {0, 0, weight * (north < 0 ? std::copysign(1.0, sine) : sine / horizontal)};
  }
  const double z = field.z();
  const bool on_saddle = north < 0 && std::abs(sine) < kSaddle * horizontal;
  return weight * Eigen::Vector3d(z * (north_is_y ? field.y() - horizontal : field.y()),
                                  z * (north_is_y ? -field.x() : horizontal - field.x()),
                                  horizontal * (on_saddle ? horizontal : sine));
}

std::uint32_t MadgwickFilter::update(const ImuMeasurement& imu) {
  const double max_rate = options_.max_angular_velocity;
  const double force2 = imu.specific_force.squaredNorm();
  // Both comparisons are false for NaN; the force's own limit comes below.
  if (!(imu.angular_velocity.squaredNorm() <= max_rate * max_rate && force2 < kInfinity)) {
    const bool finite = imu.angular_velocity.allFinite() && imu.specific_force.allFinite();
    ++(finite ? counts_.imu_out_of_range : counts_.imu_not_finite);
    return skip(finite ? kOutOfRange : kNotFinite);
  }
  std::uint32_t status = 0;
  double dt = 0;
  switch (imu_time_.judge(imu.time_ns)) {
    case TimeLine::Verdict::kNotIncreasing:
      ++counts_.imu_time_not_increasing;
      return skip(kTimeNotIncreasing);
    case TimeLine::Verdict::kSetBack:
      ++counts_.clock_set_back;
      initialised_ = false;
      status = kReinitialised;
      if (field_sample_time_ > imu.time_ns) forget_field();
      break;
    case TimeLine::Verdict::kNext:
      if (initialised_) {
        TimeNs dt_ns = 0;
        const bool overflow = __builtin_sub_overflow(imu.time_ns, last_.time_ns, &dt_ns);
        dt = to_seconds(dt_ns);
        if (overflow || dt > options_.max_gap_s) {
          ++counts_.gaps;
          initialised_ = false;
          status = kGap | kReinitialised;
          dt = 0;
        }
      }
      break;
  }
  const double max_force = options_.max_specific_force;
  const bool has_force = force2 > kMinForce * kMinForce && force2 <= max_force * max_force;
  if (!initialised_ && !has_force) {
    ++counts_.accelerometer_ignored;
    return skip(status | kAccelerometerIgnored);
  }
  last_ = imu;
  status_ = status | std::exchange(skipped_status_, 0U);
  ++counts_.imu;
  if (!initialised_) start(imu);
  const bool starting = elapsed_s_ < options_.start_time_s;
  if (elapsed_s_ < std::max(options_.start_time_s, options_.accelerometer_time_constant_s)) elapsed_s_ += dt;
  since_field_s_ += dt;
  if (options_.rest_bias && has_force) detect_rest(imu.angular_velocity, imu.specific_force, dt);
  rate_ = imu.angular_velocity - bias_;

  const bool has_field = carry_field(dt);
  if (!has_field) {
    status_ |= kMagnetometerMissing;
  } else if (!heading_known_) {
    turn_to_north();
  }
  const Eigen::Vector3d turn = dt * rate_;
  // Turning force and field by the part of the step before them spares a second attitude, and the time that it takes.
  const bool shifted = options_.gradient_phase > 0;
  const Eigen::Vector3d phase = options_.gradient_phase * turn;
  const Eigen::Matrix3d R = q_.toRotationMatrix();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  if (has_force) {
    gradient = gravity_gradient(R, shifted ? rotate(phase, imu.specific_force) : imu.specific_force, dt);
  } else {
    ++counts_.accelerometer_ignored;
    status_ |= kAccelerometerIgnored;
  }
  if (has_field) gradient += magnetic_gradient(R, shifted ? rotate(phase, field_) : field_);
  const double size = std::max(gradient.norm(), options_.soft_gradient);

  // weight / size * gradient is the report's gamma * mu * grad/|grad|; alpha -> infinity leaves beta * dt.
  Eigen::Quaterniond q = integrate(q_, turn);
  double weight = options_.beta * dt;
  if (!std::isinf(options_.alpha) && dt > 0) {
    const double mu = options_.alpha * 0.5 * turn.norm();
    const double gamma = mu + weight > 0 ? weight / (mu + weight) : 0;
    q.coeffs() = (1 - gamma) * q.coeffs() + gamma * q_.coeffs();
    weight = gamma * mu;
  }
  if (size > 0) {
    Eigen::Vector3d v = weight / size * gradient;
    if (starting && dt > 0) {
      // At first the tilt follows the averaged force and the heading a short mean of the field, so that a heading read
      // with a wrong tilt is soon forgotten; then the mean over all that comes goes on from there.
      const double force_time = options_.accelerometer_time_constant_s;
      const double averaged = std::max(0.0, elapsed_s_ - force_time);
      const double field_averaged = averaged + std::min(elapsed_s_, kStartFieldMean * force_time);
      const double tilt_gain = std::max(weight / size, 0.5 * dt / (averaged + dt));
      const double heading_gain =
          std::max(weight / size, 0.5 * dt / (field_averaged + dt) / std::max(options_.magnetometer_weight, 0.1));
      v = {tilt_gain * gradient.x(), tilt_gain * gradient.y(), heading_gain * gradient.z()};
    }
    if (options_.motion_bias && dt > 0) update_motion_bias(2 / dt * v, R, dt);
    // q + (0, v) * q
    q = Eigen::Quaterniond(
        q.w() - v.x() * q.x() - v.y() * q.y() - v.z() * q.z(), q.x() + v.x() * q.w() + v.y() * q.z() - v.z() * q.y(),
        q.y() + v.y() * q.w() + v.z() * q.x() - v.x() * q.z(), q.z() + v.z() * q.w() + v.x() * q.y() - v.y() * q.x());
    // The averaged force is kept in axes that only the gyroscope turns, written in world as world is now understood.
    if (options_.accelerometer_time_constant_s > 0) force_world_ += 2 * v.cross(force_world_);
  }
  normalise(q);
  q_ = q;
  return status_;
}

bool MadgwickFilter::process(const Measurement& measurement) {
  if (const auto* imu = std::get_if<ImuMeasurement>(&measurement)) {
    const std::int64_t before = counts_.imu;
    update(*imu);
    return counts_.imu != before;
  }
  if (const auto* magnetometer = std::get_if<MagnetometerMeasurement>(&measurement)) update(*magnetometer);
  return false;
}

Estimate MadgwickFilter::estimate() const {
  Estimate estimate;
  estimate.time_ns = last_.time_ns;
  estimate.host_time_ns = last_.host_time_ns;
  estimate.sequence = last_.sequence;
  estimate.status = status_;
  if (initialised_) {
    estimate.valid |= kValidOrientation;
    estimate.q_world_body = q_;
    estimate.angular_velocity = rate_;
    if (heading_known_ && since_field_s_ < options_.max_heading_age_s) estimate.valid |= kValidHeading;
  }
  if (bias_known_) {
    estimate.valid |= kValidGyroscopeBias;
    estimate.gyroscope_bias = bias_;
  }
  return estimate;
}

NamedCounts MadgwickFilter::counts() const {
  return {{"imu.used", counts_.imu},
          {"imu.skipped.not_finite", counts_.imu_not_finite},
          {"imu.skipped.out_of_range", counts_.imu_out_of_range},
          {"imu.skipped.time_not_increasing", counts_.imu_time_not_increasing},
          {"imu.clock_set_back", counts_.clock_set_back},
          {"imu.gaps", counts_.gaps},
          {"imu.accelerometer_ignored", counts_.accelerometer_ignored},
          {"magnetometer.used", counts_.magnetometer},
          {"magnetometer.skipped.not_finite", counts_.magnetometer_not_finite},
          {"magnetometer.skipped.out_of_range", counts_.magnetometer_out_of_range},
          {"magnetometer.skipped.time_not_increasing", counts_.magnetometer_time_not_increasing},
          {"magnetometer.ignored", counts_.magnetometer_ignored},
          {"magnetometer.disturbed", counts_.magnetometer_disturbed}};
}

}  // namespace loc
