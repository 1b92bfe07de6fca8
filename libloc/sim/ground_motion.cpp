#include "libloc/sim/ground_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "libloc/core/check.hpp"
#include "libloc/sim/quadrature.hpp"

namespace loc {
namespace {

constexpr double kQuarterTurn = 0.5 * std::numbers::pi;

// Shorter ones would have accelerations without bound.
void require_time(std::string_view name, double value) {
  require(std::isfinite(value) && value >= 1e-3, name, value, "must be finite and at least 1e-3");
}

TimeJet constant(double value) {
  return {value, 0, 0};
}

}  // namespace

GroundCourseOptions GroundCourseOptions::city_block() {
  GroundCourseOptions o;
  o.phases = {{3, 0, 0}, {5.75, 10, 0}, {5, 10, 0}, {3, 5, 0}, {4, 5, kQuarterTurn}, {2, 0, 0}};
  o.cycles = 4;
  return o;
}

GroundCourseOptions GroundCourseOptions::walk() {
  GroundCourseOptions o;
  o.start.z() = 1.6;
  o.phases = {{3, 0, 0},       {1.5, 1.4, 0},          {8, 1.4, 0}, {2.5, 1.4, -0.5}, {4, 1.4, 0},
              {2.5, 1.4, 0.5}, {5, 1.4, kQuarterTurn}, {1.5, 0, 0}};
  o.cycles = 4;
  return o;
}

void GroundCourseOptions::check() const {
  for (int i = 0; i < 3; ++i) require_finite("start[" + std::to_string(i) + "]", start[i]);
  require_finite("course_rad", course_rad);
  require_not_negative("speed_mps", speed_mps);
  require(!phases.empty(), "phases: there must be at least one");
  for (std::size_t i = 0; i < phases.size(); ++i) {
    const std::string name = "phases[" + std::to_string(i) + "].";
    require_time(name + "duration_s", phases[i].duration_s);
    require_not_negative(name + "speed_mps", phases[i].speed_mps);
    require_finite(name + "turn_rad", phases[i].turn_rad);
  }
  require(cycles >= 1 && cycles <= 100'000, "cycles", cycles, "must be in [1, 100000]");
  require(cycles == 1 || phases.back().speed_mps == speed_mps, "speed_mps of the last phase", phases.back().speed_mps,
          "must be that of the start, " + to_text(speed_mps) + ", when there are more cycles than one");
}

GroundCourse::GroundCourse(const GroundCourseOptions& options) {
  options.check();
  Begin begin = {0, options.start.head<2>(), options.course_rad, 0, options.speed_mps};
  for (int cycle = 0; cycle < options.cycles; ++cycle) {
    for (const GroundPhase& phase : options.phases) {
      const double end = begin.time_s + phase.duration_s;
      const Point last = point(begin, phase, end);
      phases_.push_back(phase);
      begins_.push_back(begin);
      begin = {end, {last.x.value, last.y.value}, begin.course + phase.turn_rad, last.distance.value, phase.speed_mps};
    }
  }
  begins_.push_back(begin);
}

GroundCourse::Point GroundCourse::point(const Begin& begin, const GroundPhase& phase, double time_s) const {
  const double change = phase.speed_mps - begin.speed;
  const auto speed_at = [&](const TimeJet& step) { return constant(begin.speed) + change * step; };
  const auto course_at = [&](const TimeJet& step) { return constant(begin.course) + phase.turn_rad * step; };
  const TimeJet step = smooth_step(time_s, begin.time_s, phase.duration_s);
  const double elapsed = time_s - begin.time_s;

  Point out;
  out.course = course_at(step);
  out.speed = speed_at(step);
  const double travelled =
      begin.speed * elapsed + change * smooth_step_integral(time_s, begin.time_s, phase.duration_s);
  out.distance = {begin.distance + travelled, out.speed.value, out.speed.rate};
  Eigen::Vector2d place = begin.place;
  if (phase.turn_rad == 0) {
    place += travelled * Eigen::Vector2d(std::cos(begin.course), std::sin(begin.course));
  } else {
    detail::integrate(elapsed, 2 * detail::panels_for(2 * phase.turn_rad), [&](double t, double weight) {
      const TimeJet inner = smooth_step(begin.time_s + t, begin.time_s, phase.duration_s);
      const double angle = course_at(inner).value;
      place += weight * speed_at(inner).value * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    });
  }
  const TimeJet velocity_x = out.speed * cos(out.course);
  const TimeJet velocity_y = out.speed * sin(out.course);
  out.x = {place.x(), velocity_x.value, velocity_x.rate};
  out.y = {place.y(), velocity_y.value, velocity_y.rate};
  return out;
}

GroundCourse::Point GroundCourse::at(double time_s) const {
  const auto after = std::upper_bound(begins_.begin() + 1, begins_.end() - 1, time_s,
                                      [](double t, const Begin& begin) { return t < begin.time_s; });
  const auto i = static_cast<std::size_t>(after - begins_.begin()) - 1;
  return point(begins_[i], phases_[i], time_s);
}

void CarOptions::check() const {
  course.check();
  double speed = course.speed_mps;
  for (std::size_t i = 0; i < course.phases.size(); ++i) {
    const GroundPhase& phase = course.phases[i];
    require(speed > 0 || phase.speed_mps > 0 || phase.turn_rad == 0, "phases[" + std::to_string(i) + "].turn_rad",
            phase.turn_rad, "a car cannot turn on the spot");
    speed = phase.speed_mps;
  }
}

CarMotion::CarMotion(const CarOptions& options)
    : height_((options.check(), options.course.start.z())), course_(options.course) {}

MotionState CarMotion::at(double time_s) const {
  check_time(time_s);
  const GroundCourse::Point p = course_.at(time_s);
  return motion_state(time_s, {p.x, p.y, constant(height_)}, RotationJet::about(2, p.course));
}

void PedestrianOptions::check() const {
  course.check();
  require_positive("step_length_m", step_length_m);
  require_positive("walking_speed_mps", walking_speed_mps);
  require_finite("bob_m", bob_m);
  require_finite("sway_m", sway_m);
  require_finite("nod_rad", nod_rad);
  require_finite("roll_rad", roll_rad);
  require_finite("head_turn_rad", head_turn_rad);
  require_time("head_turn_s", head_turn_s);
  require(std::isfinite(head_turn_period_s) && head_turn_period_s >= head_turn_s, "head_turn_period_s",
          head_turn_period_s, "must be finite and not less than head_turn_s");
}

PedestrianMotion::PedestrianMotion(const PedestrianOptions& options)
    : options_((options.check(), options)), course_(options.course) {}

TimeJet PedestrianMotion::head_turn(double time_s) const {
  const PedestrianOptions& o = options_;
  const double since = time_s - 0.5 * o.head_turn_period_s;
  const double count = std::floor(since / o.head_turn_period_s);
  const double x = (since - count * o.head_turn_period_s) / o.head_turn_s;
  if (count < 0 || x >= 1) return {};
  // 64 x^3 (1 - x)^3: two continuous derivatives at both ends.
  const TimeJet from_start = {x, 1 / o.head_turn_s, 0};
  const TimeJet product = from_start * (constant(1) - from_start);
  const double side = std::fmod(count, 2) == 0 ? 1 : -1;
  return side * 64 * o.head_turn_rad * (product * product * product);
}

MotionState PedestrianMotion::at(double time_s) const {
  check_time(time_s);
  const PedestrianOptions& o = options_;
  const GroundCourse::Point p = course_.at(time_s);
  const TimeJet gait = (1 / o.walking_speed_mps) * p.speed;
  const TimeJet step = (2 * std::numbers::pi / o.step_length_m) * p.distance;
  const TimeJet sway = o.sway_m * (gait * sin(0.5 * step));
  const TimeJet bob = o.bob_m * (gait * cos(step));
  const TimeJet nod = o.nod_rad * (gait * sin(step));
  const TimeJet roll = o.roll_rad * (gait * cos(0.5 * step));
  return motion_state(
      time_s, {p.x - sway * sin(p.course), p.y + sway * cos(p.course), constant(o.course.start.z()) + bob},
      RotationJet::about(2, p.course + head_turn(time_s)) * RotationJet::about(1, nod) * RotationJet::about(0, roll));
}

}  // namespace loc
