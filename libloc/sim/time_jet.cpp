#include "libloc/sim/time_jet.hpp"

#include <algorithm>
#include <cmath>

namespace loc {

TimeJet sin(const TimeJet& angle) {
  const double s = std::sin(angle.value);
  const double c = std::cos(angle.value);
  return {s, c * angle.rate, c * angle.acceleration - s * angle.rate * angle.rate};
}

TimeJet cos(const TimeJet& angle) {
  const double s = std::sin(angle.value);
  const double c = std::cos(angle.value);
  return {c, -s * angle.rate, -s * angle.acceleration - c * angle.rate * angle.rate};
}

TimeJet sine(double t, double amplitude, double angular_rate, double phase) {
  return amplitude * sin(TimeJet{angular_rate * t + phase, angular_rate, 0});
}

TimeJet smooth_step(double t, double begin, double duration) {
  const double x = std::clamp((t - begin) / duration, 0.0, 1.0);
  const double y = 1 - x;
  return {x * x * x * (10 + x * (-15 + 6 * x)), 30 * x * x * y * y / duration,
          60 * x * y * (y - x) / (duration * duration)};
}

double smooth_step_integral(double t, double begin, double duration) {
  const double x = std::clamp((t - begin) / duration, 0.0, 1.0);
  return duration * x * x * x * x * (2.5 + x * (-3 + x));
}

RotationJet RotationJet::about(int axis, const TimeJet& angle) {
  RotationJet out;
  const TimeJet half = 0.5 * angle;
  out.wxyz[0] = cos(half);
  out.wxyz.at(static_cast<std::size_t>(axis) + 1) = sin(half);
  return out;
}

RotationJet RotationJet::constant(const Eigen::Quaterniond& q) {
  return {{TimeJet{q.w(), 0, 0}, TimeJet{q.x(), 0, 0}, TimeJet{q.y(), 0, 0}, TimeJet{q.z(), 0, 0}}};
}

RotationJet operator*(const RotationJet& a, const RotationJet& b) {
  const auto& [aw, ax, ay, az] = a.wxyz;
  const auto& [bw, bx, by, bz] = b.wxyz;
  return {{aw * bw - ax * bx - ay * by - az * bz, aw * bx + ax * bw + ay * bz - az * by,
           aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw}};
}

MotionState motion_state(double time_s, const std::array<TimeJet, 3>& position, const RotationJet& R_world_body) {
  const auto& [w, x, y, z] = R_world_body.wxyz;
  const Eigen::Quaterniond q(w.value, x.value, y.value, z.value);
  const Eigen::Quaterniond rate(w.rate, x.rate, y.rate, z.rate);
  const Eigen::Quaterniond acceleration(w.acceleration, x.acceleration, y.acceleration, z.acceleration);
  MotionState state;
  state.time_s = time_s;
  state.T_world_body.rotation = q.normalized();
  for (int i = 0; i < 3; ++i) {
    const TimeJet& p = position[static_cast<std::size_t>(i)];
    state.T_world_body.translation[i] = p.value;
    state.velocity[i] = p.rate;
    state.acceleration[i] = p.acceleration;
  }
  // q' = q (0, w) / 2; in the second derivative q'* q' is a pure number, so that its vector part is that of q* q''.
  state.angular_velocity = 2 * (q.conjugate() * rate).vec();
  state.angular_acceleration = 2 * (q.conjugate() * acceleration).vec();
  return state;
}

}  // namespace loc
