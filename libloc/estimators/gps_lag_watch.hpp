// Tells whether the stamps of GPS are of the time of the poses, by the shape of the way.
// From: horizontal fixes, and where the body was at their stamps by something that GPS does not steer: the map of SLAM,
// or an IMU integrated for some seconds (ImuReckoning). In a window of time
//   z_i = sum_k a_k t_i^k + r J p_i [+ s p_i] + d v_i + noise          J: a quarter turn, p and v about their means
// a: where the other way begins and how it drifts (order: 0 a place, 1 with a velocity, 2 with an acceleration),
// r and s: its heading and, where it is not known, its scale, d: what has to be added to the stamps. Least squares with
// Huber's weights; the deviation of d is that of the residuals, widened by their correlation from fix to fix. A body
// that goes straight on, or round in a steady circle, tells nothing of d, which its deviation then says. Windows follow
// each other without overlap; several must say the same.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "libloc/core/fifo.hpp"
#include "libloc/core/time.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

struct GpsLagWatchOptions {
  double window_s = 30;     ///< the shortest window; one with fewer than 12 fixes goes on
  int drift_order = 1;      ///< of the other way, see above; 0 to 2
  bool scale_known = true;  ///< of the other way
  double least_s = 0.25;    ///< of a doubt: d is that large, and …
  double least_sigmas = 5;  ///< … so many deviations from zero

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

class GpsLagWatch {
 public:
  /// @throws std::invalid_argument as GpsLagWatchOptions::check.
  explicit GpsLagWatch(const GpsLagWatchOptions& options = {});

  /// Places and velocity of the antenna, in one pair of horizontal axes. In the order of time; what is not is left out.
  /// @param fix by GPS [m] @param way by the other [m] @param velocity by the other [m/s]
  void see(TimeNs time_ns, const Eigen::Vector2d& fix, const Eigen::Vector2d& way, const Eigen::Vector2d& velocity);
  /// The other way jumps: what follows is another window. What was learnt stays.
  void break_off() { window_.clear(); }
  /// The next fix is the first one of a window: the other way may be begun anew before it.
  bool begins() const { return window_.empty(); }
  void reset();

  bool doubtful() const { return doubtful_; }
  /// What has to be added to the stamps of GPS, and its deviation; NaN before there are three windows. [s]
  double offset_s() const { return offset_s_; }
  double sigma_s() const { return sigma_s_; }

 private:
  static constexpr std::size_t kWindows = 30;
  struct Seen {
    TimeNs time_ns;
    Eigen::Vector2d fix, way, velocity;
  };
  struct Result {
    double offset_s;
    double sigma_s;
  };
  std::optional<Result> solve() const;
  void judge();

  GpsLagWatchOptions options_;
  std::vector<Seen> window_;
  std::array<Result, kWindows> results_{};
  std::size_t done_ = 0;
  bool doubtful_ = false;
  double offset_s_ = kUnknown;
  double sigma_s_ = kUnknown;
};

/// An IMU integrated from a state on, kept for some time back. Its errors of attitude, velocity and bias are those of
/// that state; within tens of seconds they are a drift of second order.
class ImuReckoning {
 public:
  struct Point {
    TimeNs time_ns = kNoTime;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    Eigen::Quaterniond q_world_body = Eigen::Quaterniond::Identity();
  };

  /// @param from where it begins @param gyroscope_bias, accelerometer_bias that are taken off
  void begin(const Point& from, const Eigen::Vector3d& gyroscope_bias, const Eigen::Vector3d& accelerometer_bias);
  void stop();
  bool running() const { return !points_.empty(); }
  /// @param gravity [m/s^2] The sample holds since the last one; a step of more than a second stops it.
  void step(const ImuMeasurement& imu, double gravity);
  /// Between two samples, linear, and a tenth of a second after the last one; nothing for other times.
  std::optional<Point> at(TimeNs time_ns) const;

 private:
  Fifo<Point> points_;
  Eigen::Vector3d gyroscope_bias_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d accelerometer_bias_ = Eigen::Vector3d::Zero();
};

}  // namespace loc
