// Motions made of another motion: that of a sensor which is fixed to the body, and one that begins with rest. They hold
// the other motion shared, because the sensors of one body all do.
#pragma once

#include <memory>

#include "libloc/sim/motion.hpp"

namespace loc {

/// A sensor fixed to a moving body: its own pose, velocity and acceleration (lever arm included), its rates in its own
/// axes.
class MountedMotion : public Motion {
 public:
  /// @param body not null @throws std::invalid_argument unless the pose is finite and its rotation unit.
  MountedMotion(std::shared_ptr<const Motion> body, const Pose3& T_body_sensor);
  double duration_s() const override { return body_->duration_s(); }
  MotionState at(double time_s) const override;

 private:
  std::shared_ptr<const Motion> body_;
  Pose3 T_body_sensor_;
};

/// Estimators level themselves in the first second or so, and take the body to be at rest.
struct RestFirstOptions {
  double rest_s = 2;
  /// After the rest the motion's own time begins to run, with a rate that goes smoothly (smooth_step) from 0 to 1 in so
  /// long; by then half of it has passed in the motion. So a motion that begins with 10 m/s gets there without a jump.
  /// 0 only for motions that begin at rest.
  double ease_s = 2;
  void check() const;  ///< @throws std::invalid_argument naming the field and its value.
};

class RestFirstMotion : public Motion {
 public:
  /// @param motion not null @throws std::invalid_argument as check(); when the motion is shorter than half of ease_s,
  /// or ease_s is 0 and it does not begin at rest.
  explicit RestFirstMotion(std::shared_ptr<const Motion> motion, const RestFirstOptions& options = {});
  /// That of the motion, plus rest_s and half of ease_s.
  double duration_s() const override;
  MotionState at(double time_s) const override;
  /// The motion's own time at a time of this one; [0, duration_s()] of both correspond.
  double motion_time_s(double time_s) const;

 private:
  struct Clock {
    double time_s = 0;
    double rate = 0;
    double acceleration = 0;
  };
  Clock clock(double time_s) const;

  std::shared_ptr<const Motion> motion_;
  RestFirstOptions options_;
};

}  // namespace loc
