#include "libloc/sim/shape_motion.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr double kForEver = std::numeric_limits<double>::infinity();
constexpr double kShortestTime = 1e-3;  // [s]
constexpr double kLowestHz = 1e-6;
constexpr double kTwoPi = 2 * std::numbers::pi;

void require_finite_point(std::string_view name, const Eigen::Vector3d& point) {
  for (int i = 0; i < 3; ++i) require_finite(std::string(name) + "[" + std::to_string(i) + "]", point[i]);
}

}  // namespace

void RestOptions::check() const {
  require_rigid("T_world_body", T_world_body);
}

RestMotion::RestMotion(const RestOptions& options) : options_((options.check(), options)) {}

double RestMotion::duration_s() const {
  return kForEver;
}

MotionState RestMotion::at(double time_s) const {
  check_time(time_s);
  MotionState state;
  state.time_s = time_s;
  state.T_world_body = options_.T_world_body;
  return state;
}

void CircleOptions::check() const {
  require_finite_point("center", center);
  require_positive("radius_m", radius_m);
  require_finite("speed_mps", speed_mps);
  require_finite("square of speed_mps / radius_m", std::pow(speed_mps / radius_m, 2));
  require_finite("start_angle_rad", start_angle_rad);
}

CircleMotion::CircleMotion(const CircleOptions& options) : options_((options.check(), options)) {}

double CircleMotion::duration_s() const {
  return kForEver;
}

MotionState CircleMotion::at(double time_s) const {
  check_time(time_s);
  const CircleOptions& o = options_;
  const double rate = o.speed_mps / o.radius_m;
  const TimeJet angle = {o.start_angle_rad + rate * time_s, rate, 0};
  const double quarter = std::copysign(0.5 * std::numbers::pi, o.speed_mps);
  return motion_state(time_s,
                      {TimeJet{o.center.x(), 0, 0} + o.radius_m * cos(angle),
                       TimeJet{o.center.y(), 0, 0} + o.radius_m * sin(angle), TimeJet{o.center.z(), 0, 0}},
                      RotationJet::about(2, angle + TimeJet{quarter, 0, 0}));
}

void FigureEightOptions::check() const {
  require_finite_point("center", center);
  require_positive("length_m", length_m);
  require_positive("width_m", width_m);
  require_finite("height_m", height_m);
  require(std::isfinite(period_s) && period_s >= kShortestTime, "period_s", period_s, "must be finite, at least 1e-3");
}

FigureEightMotion::FigureEightMotion(const FigureEightOptions& options) : options_((options.check(), options)) {}

double FigureEightMotion::duration_s() const {
  return kForEver;
}

MotionState FigureEightMotion::at(double time_s) const {
  check_time(time_s);
  const FigureEightOptions& o = options_;
  const double rate = kTwoPi / o.period_s;
  const TimeJet x = sine(time_s, 0.5 * o.length_m, rate, 0);
  const TimeJet y = sine(time_s, 0.5 * o.width_m, 2 * rate, 0);
  const TimeJet z = sine(time_s, 0.5 * o.height_m, rate, 0);
  // Of a sine the third derivative is the first times minus the square of its rate.
  const double x_jerk = -rate * rate * x.rate;
  const double y_jerk = -4 * rate * rate * y.rate;
  const double speed2 = x.rate * x.rate + y.rate * y.rate;  // never zero: x and y do not turn back at the same time
  const double turn = x.rate * y.acceleration - y.rate * x.acceleration;
  TimeJet yaw;
  yaw.value = std::atan2(y.rate, x.rate);
  yaw.rate = turn / speed2;
  yaw.acceleration = (x.rate * y_jerk - y.rate * x_jerk) / speed2 -
                     2 * turn * (x.rate * x.acceleration + y.rate * y.acceleration) / (speed2 * speed2);
  return motion_state(
      time_s, {TimeJet{o.center.x(), 0, 0} + x, TimeJet{o.center.y(), 0, 0} + y, TimeJet{o.center.z(), 0, 0} + z},
      RotationJet::about(2, yaw));
}

void HandHeldOptions::check() const {
  require_rigid("T_world_mean", T_world_mean);
  require_not_negative("angular_rate_rms", angular_rate_rms);
  require_not_negative("acceleration_rms", acceleration_rms);
  require(lowest_hz >= kLowestHz, "lowest_hz", lowest_hz, "must be at least 1e-6");
  require(std::isfinite(highest_hz) && highest_hz > lowest_hz, "highest_hz", highest_hz,
          "must be finite and greater than lowest_hz");
  require_not_negative("scale", scale);
}

HandHeldMotion::HandHeldMotion(const HandHeldOptions& options, Random random) : options_((options.check(), options)) {
  // Every sine carries the same share of the rate's (acceleration's) power.
  const double share = std::sqrt(2.0 / (3 * HandHeldOptions::kSines)) * options.scale;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    Random own = random.fork(axis);
    const bool turns = axis < 3;
    Axis& sines = turns ? rotation_[axis] : translation_[axis - 3];
    const bool on = turns ? options.rotates[axis] : options.moves[axis - 3];
    for (int k = 0; k < HandHeldOptions::kSines; ++k) {
      const double place = (k + own.uniform()) / HandHeldOptions::kSines;
      Sine& sine = sines[static_cast<std::size_t>(k)];
      sine.angular_rate = kTwoPi * options.lowest_hz * std::pow(options.highest_hz / options.lowest_hz, place);
      sine.phase = own.uniform(0, kTwoPi);
      if (!on) continue;
      const double w = sine.angular_rate;
      sine.amplitude = share * (turns ? options.angular_rate_rms / w : options.acceleration_rms / (w * w));
    }
  }
}

double HandHeldMotion::duration_s() const {
  return kForEver;
}

TimeJet HandHeldMotion::sum(const Axis& axis, double time_s) {
  TimeJet out;
  for (const Sine& s : axis) out = out + sine(time_s, s.amplitude, s.angular_rate, s.phase);
  return out;
}

MotionState HandHeldMotion::at(double time_s) const {
  check_time(time_s);
  const Pose3& mean = options_.T_world_mean;
  const std::array<TimeJet, 3> d = {sum(translation_[0], time_s), sum(translation_[1], time_s),
                                    sum(translation_[2], time_s)};
  const Eigen::Matrix3d R = mean.rotation.toRotationMatrix();
  std::array<TimeJet, 3> position;
  for (int i = 0; i < 3; ++i) {
    position[static_cast<std::size_t>(i)] =
        TimeJet{mean.translation[i], 0, 0} + R(i, 0) * d[0] + R(i, 1) * d[1] + R(i, 2) * d[2];
  }
  return motion_state(time_s, position,
                      RotationJet::constant(mean.rotation) * RotationJet::about(2, sum(rotation_[2], time_s)) *
                          RotationJet::about(1, sum(rotation_[1], time_s)) *
                          RotationJet::about(0, sum(rotation_[0], time_s)));
}

}  // namespace loc
