// Those who move on level ground: a car, and a pedestrian who carries the sensor. Both follow a course given as phases:
// in each the speed and the heading change smoothly (smooth_step) to their new values. Position, the integral of speed
// times direction, is a quadrature exact to rounding; all else is closed form. Velocity, acceleration, angular velocity
// and angular acceleration are continuous everywhere. Frames: world ENU; body x forward, y left, z up.
#pragma once

#include <vector>

#include "libloc/sim/motion.hpp"
#include "libloc/sim/time_jet.hpp"

namespace loc {

struct GroundPhase {
  double duration_s = 0;
  double speed_mps = 0;  ///< at its end; not negative
  double turn_rad = 0;   ///< in all, positive to the left
};

struct GroundCourseOptions {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();  ///< in world [m]
  double course_rad = 0;                            ///< at the start, from x (east) towards y
  double speed_mps = 0;                             ///< at the start
  std::vector<GroundPhase> phases;
  int cycles = 1;  ///< all phases so many times; more than one: the last speed must be the first

  /// Round a block, 91 s: four equal sides with standstill, acceleration to 10 m/s, constant speed, a left turn at
  /// 5 m/s. Ends where it began.
  static GroundCourseOptions city_block();
  /// Round a square on foot, 112 s: each side with a pause, 1.4 m/s, a gentle bend to the right and back, a left turn.
  static GroundCourseOptions walk();
  void check() const;  ///< @throws std::invalid_argument naming index and value.
};

/// Where the phases lead.
class GroundCourse {
 public:
  struct Point {
    TimeJet x, y;      ///< in world [m]
    TimeJet course;    ///< [rad]
    TimeJet distance;  ///< travelled [m]
    TimeJet speed;     ///< [m/s]
  };

  /// @throws as GroundCourseOptions::check
  explicit GroundCourse(const GroundCourseOptions& options);
  double duration_s() const { return begins_.back().time_s; }
  Point at(double time_s) const;

 private:
  struct Begin {
    double time_s = 0;
    Eigen::Vector2d place = Eigen::Vector2d::Zero();
    double course = 0;
    double distance = 0;
    double speed = 0;
  };
  Point point(const Begin& begin, const GroundPhase& phase, double time_s) const;

  std::vector<GroundPhase> phases_;
  std::vector<Begin> begins_;  // one more than phases: the last is the end
};

/// Exactly at rest (zero velocity and rate) in phases that begin and end with speed zero.
struct CarOptions {
  GroundCourseOptions course = GroundCourseOptions::city_block();
  void check() const;  ///< @throws std::invalid_argument naming index and value: also when it turns on the spot.
};

class CarMotion : public Motion {
 public:
  explicit CarMotion(const CarOptions& options = {});
  double duration_s() const override { return course_.duration_s(); }
  MotionState at(double time_s) const override;

 private:
  double height_;
  GroundCourse course_;
};

/// The gait goes with the distance: one bob a step, one sway in two steps, both in proportion to the speed, so that it
/// fades out at pauses. Nods and rolls of the head go with them. The head turns now and then to the left and right,
/// also while standing.
struct PedestrianOptions {
  GroundCourseOptions course = GroundCourseOptions::walk();
  double step_length_m = 0.74;
  double walking_speed_mps = 1.4;  ///< at which the following amplitudes hold
  double bob_m = 0.02;             ///< vertical
  double sway_m = 0.015;           ///< to the sides
  double nod_rad = 0.015;          ///< pitch
  double roll_rad = 0.02;
  double head_turn_rad = 0.6;     ///< largest angle of the glances; 0: none
  double head_turn_s = 2.5;       ///< how long a glance takes
  double head_turn_period_s = 7;  ///< from one to the next; the first begins after half of it
  void check() const;             ///< @throws std::invalid_argument naming field, index and value.
};

class PedestrianMotion : public Motion {
 public:
  explicit PedestrianMotion(const PedestrianOptions& options = {});
  double duration_s() const override { return course_.duration_s(); }
  MotionState at(double time_s) const override;

 private:
  TimeJet head_turn(double time_s) const;

  PedestrianOptions options_;
  GroundCourse course_;
};

}  // namespace loc
