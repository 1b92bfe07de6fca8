// Motions of simple shape that go on for ever, all quantities smooth: rest, circle, figure eight, and a sensor moved by
// hand. Cars and pedestrians: ground_motion.hpp. Frames: world ENU; body x forward, y left, z up.
#pragma once

#include <array>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/sim/motion.hpp"
#include "libloc/sim/time_jet.hpp"

namespace loc {

struct RestOptions {
  Pose3 T_world_body;
  void check() const;  ///< @throws std::invalid_argument naming the field and its value.
};

class RestMotion : public Motion {
 public:
  explicit RestMotion(const RestOptions& options = {});
  double duration_s() const override;
  MotionState at(double time_s) const override;

 private:
  RestOptions options_;
};

/// Horizontal, with constant speed; body x along the circle.
struct CircleOptions {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< in world [m]
  double radius_m = 10;
  double speed_mps = 5;        ///< positive: counter-clockwise seen from above; negative: clockwise
  double start_angle_rad = 0;  ///< of the place at time 0, from x (east) towards y
  void check() const;          ///< @throws std::invalid_argument naming the field and its value.
};

class CircleMotion : public Motion {
 public:
  explicit CircleMotion(const CircleOptions& options = {});
  double duration_s() const override;
  MotionState at(double time_s) const override;

 private:
  CircleOptions options_;
};

/// x = length/2 sin(u), y = width/2 sin(2u), z = height/2 sin(u) with u = 2 pi t / period, from the centre; yaw along
/// the path, no pitch and no bank.
struct FigureEightOptions {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< in world [m]
  double length_m = 40;
  double width_m = 20;
  double height_m = 0;
  double period_s = 30;
  void check() const;  ///< @throws std::invalid_argument naming the field and its value.
};

class FigureEightMotion : public Motion {
 public:
  explicit FigureEightMotion(const FigureEightOptions& options = {});
  double duration_s() const override;
  MotionState at(double time_s) const override;

 private:
  FigureEightOptions options_;
};

/// A sensor that is shaken and turned by hand, about a mean pose: each of six axes is a sum of sines, one in each of
/// kSines equal parts of the logarithm of the band, with frequencies and phases drawn at random. All axes are excited,
/// as the calibration of a camera with an IMU asks for; a switch stops an axis and leaves the others as they were.
struct HandHeldOptions {
  static constexpr int kSines = 5;
  Pose3 T_world_mean;
  double angular_rate_rms = 0.9;  ///< of the vector with all three axes on [rad/s]; exact for small angles
  double acceleration_rms = 1.5;  ///< of the vector with all three axes on [m/s^2]
  double lowest_hz = 0.3;
  double highest_hz = 2.0;
  double scale = 1;                                  ///< multiplies all amplitudes
  std::array<bool, 3> rotates = {true, true, true};  ///< about x, y, z of the mean pose
  std::array<bool, 3> moves = {true, true, true};    ///< along x, y, z of the mean pose
  void check() const;                                ///< @throws std::invalid_argument naming the field and its value.
};

class HandHeldMotion : public Motion {
 public:
  HandHeldMotion(const HandHeldOptions& options, Random random);
  double duration_s() const override;
  MotionState at(double time_s) const override;

 private:
  struct Sine {
    double amplitude = 0;
    double angular_rate = 0;
    double phase = 0;
  };
  using Axis = std::array<Sine, HandHeldOptions::kSines>;
  static TimeJet sum(const Axis& axis, double time_s);

  HandHeldOptions options_;
  std::array<Axis, 3> rotation_{};
  std::array<Axis, 3> translation_{};
};

}  // namespace loc
