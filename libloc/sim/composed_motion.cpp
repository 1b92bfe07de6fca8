#include "libloc/sim/composed_motion.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/sim/time_jet.hpp"

namespace loc {

MountedMotion::MountedMotion(std::shared_ptr<const Motion> body, const Pose3& T_body_sensor)
    : body_(std::move(body)), T_body_sensor_(T_body_sensor) {
  require(body_ != nullptr, "body must not be null");
  require_rigid("T_body_sensor", T_body_sensor);
}

MotionState MountedMotion::at(double time_s) const {
  const MotionState body = body_->at(time_s);
  const Eigen::Vector3d& arm = T_body_sensor_.translation;
  const Eigen::Vector3d& w = body.angular_velocity;
  const Eigen::Quaterniond& R_world_body = body.T_world_body.rotation;
  const Eigen::Quaterniond R_sensor_body = T_body_sensor_.rotation.conjugate();

  MotionState sensor;
  sensor.time_s = time_s;
  sensor.T_world_body = body.T_world_body * T_body_sensor_;
  sensor.velocity = body.velocity + R_world_body * w.cross(arm);
  sensor.acceleration =
      body.acceleration + R_world_body * (body.angular_acceleration.cross(arm) + w.cross(w.cross(arm)));
  sensor.angular_velocity = R_sensor_body * w;
  sensor.angular_acceleration = R_sensor_body * body.angular_acceleration;
  return sensor;
}

void RestFirstOptions::check() const {
  require_not_negative("rest_s", rest_s);
  require(std::isfinite(ease_s) && (ease_s == 0 || ease_s >= 1e-3), "ease_s", ease_s,
          "must be 0, or finite and at least 1e-3");
}

RestFirstMotion::RestFirstMotion(std::shared_ptr<const Motion> motion, const RestFirstOptions& options)
    : motion_(std::move(motion)), options_((options.check(), options)) {
  require(motion_ != nullptr, "motion must not be null");
  require(0.5 * options.ease_s <= motion_->duration_s(), "ease_s", options.ease_s,
          "must not be more than twice the duration of the motion, " + to_text(motion_->duration_s()));
  if (options.ease_s > 0) return;
  const MotionState start = motion_->at(0);
  require(start.velocity.isZero(0) && start.angular_velocity.isZero(0), "ease_s", options.ease_s,
          "must be positive: the motion does not begin at rest");
}

double RestFirstMotion::duration_s() const {
  return motion_->duration_s() + 0.5 * options_.ease_s + options_.rest_s;
}

RestFirstMotion::Clock RestFirstMotion::clock(double time_s) const {
  const double since = time_s - options_.rest_s;
  if (since <= 0) return {};
  if (since >= options_.ease_s) {
    // Rounding must not lead past the end.
    return {std::clamp(since - 0.5 * options_.ease_s, 0.0, motion_->duration_s()), 1, 0};
  }
  const TimeJet rate = smooth_step(since, 0, options_.ease_s);
  const double time = smooth_step_integral(since, 0, options_.ease_s);
  return {std::min(time, motion_->duration_s()), rate.value, rate.rate};
}

double RestFirstMotion::motion_time_s(double time_s) const {
  check_time(time_s);
  return clock(time_s).time_s;
}

MotionState RestFirstMotion::at(double time_s) const {
  check_time(time_s);
  const Clock clock = this->clock(time_s);
  MotionState state = motion_->at(clock.time_s);
  const double rate2 = clock.rate * clock.rate;
  state.time_s = time_s;
  state.acceleration = rate2 * state.acceleration + clock.acceleration * state.velocity;
  state.angular_acceleration = rate2 * state.angular_acceleration + clock.acceleration * state.angular_velocity;
  state.velocity *= clock.rate;
  state.angular_velocity *= clock.rate;
  return state;
}

}  // namespace loc
