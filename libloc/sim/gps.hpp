// Simulated GPS receiver: position and velocity of its antenna in WGS 84, with white and with slowly changing errors.
//   position error = white + Gauss-Markov (atmosphere, reflections), in east, north, up
//   velocity error = white
// Frames: the motion's world is east, north, up of an origin (geometry/geodesy.hpp).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/core/time.hpp"
#include "libloc/geometry/geodesy.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sim/motion.hpp"
#include "libloc/sim/noise.hpp"

namespace loc {

struct GpsModel {
  double rate_hz = 1;
  double sigma_horizontal = 2;           ///< [m], white, east and north each
  double sigma_vertical = 4;             ///< [m], white
  double coloured_sigma_horizontal = 0;  ///< [m], Gauss-Markov part, east and north each
  double coloured_sigma_vertical = 0;    ///< [m]
  double coloured_time_s = 300;          ///< its time constant
  bool with_velocity = true;
  double sigma_velocity_horizontal = 0.1;                     ///< [m/s], white, east and north each
  double sigma_velocity_vertical = 0.2;                       ///< [m/s]
  Eigen::Vector3d antenna_in_body = Eigen::Vector3d::Zero();  ///< lever arm [m]
  double latency_s = 0;                                       ///< arrival after the time of validity
  double stamp_delay_s = 0;                                   ///< time stamps are later than validity by this
  std::vector<TimeInterval> outages;                          ///< no fix
  GpsFixType fix = GpsFixType::k3d;
  std::int32_t satellites = 9;
  GeodeticPoint origin{0.7610, 0.0251, 150};             ///< of the motion's world
  TimeNs start_gps_time_ns = 1'400'000'000'000'000'000;  ///< GPS time of the motion's start

  static GpsModel single();  ///< the defaults, with part of the error coloured: a consumer's receiver
  static GpsModel rtk();     ///< fixed ambiguities: 1 cm and 2 cm, 5 Hz

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

struct GpsTruth {
  Eigen::Vector3d coloured_error = Eigen::Vector3d::Zero();  ///< of the last epoch [m], east, north, up
};

class GpsSimulator {
 public:
  /// @throws as GpsModel::check
  GpsSimulator(const GpsModel& model, Random random);

  /// The next epoch; nullopt in an outage. Called for every epoch, in outages too. time_ns is since the start of the
  /// motion, plus stamp_delay; host_time_ns is the arrival. The covariances told are those of the errors, white and
  /// coloured together.
  /// @throws std::invalid_argument when the time does not increase.
  std::optional<GpsMeasurement> measure(const MotionState& state);

  const GpsModel& model() const { return model_; }
  const GpsTruth& truth() const { return truth_; }

 private:
  GpsModel model_;
  LocalFrame frame_;
  Random position_;
  Random velocity_;
  GaussMarkov coloured_;
  GpsTruth truth_;
  std::optional<double> last_time_s_;
};

}  // namespace loc
