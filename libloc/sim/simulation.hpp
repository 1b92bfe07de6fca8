// Runs a scenario: measurements of all its sensors, one after the other, and the truth with them. The same scenario and
// seed give the same measurements, bit for bit; a change of one sensor leaves the others as they were.
//
//   Simulation simulation(make_scenario("street-car"), 7);
//   while (const auto m = simulation.next()) ...
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "libloc/core/named_count.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sim/motion.hpp"
#include "libloc/sim/scenario.hpp"

namespace loc {

struct SimulationOptions {
  enum class Order : std::uint8_t {
    kTime,    ///< of time stamps, as a recording is read
    kArrival  ///< of arrival at the host, as a log is written; late measurements come late
  };
  /// Measurements of equal time come as StreamMerger gives them: magnetometer, features, GPS, odometry, reference, IMU.
  Order order = Order::kTime;
};

/// What was true at the time of a reference measurement. A sensor's figures are those of its last sample up to then.
struct SimulationTruth {
  TimeNs time_ns = kNoTime;
  MotionState state;
  /// In body axes, of readings that were corrected with the rig: what an estimator is to find.
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Constant(kUnknown);      ///< [rad/s]
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Constant(kUnknown);  ///< [m/s^2]
  double odometry_scale = kUnknown;                                          ///< [unit/m]
  Eigen::Vector3d odometry_drift = Eigen::Vector3d::Constant(kUnknown);      ///< [unit]
  Eigen::Vector3d gps_error = Eigen::Vector3d::Constant(kUnknown);           ///< coloured part, east, north, up [m]
};

/// What was true of a frame of features.
struct FrameTruth {
  double time_s = kUnknown;                    ///< of the exposure, since the start of the motion
  Pose3 T_world_camera;                        ///< at that time
  std::vector<ObservationTruth> observations;  ///< of each feature, in the measurement's order
};

class Simulation {
 public:
  /// @throws std::invalid_argument as Scenario::check
  Simulation(const Scenario& scenario, std::uint64_t seed, const SimulationOptions& options = {});
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;
  ~Simulation();

  /// nullopt at the end.
  std::optional<Measurement> next();
  /// Of the reference measurement that next() gave last.
  const SimulationTruth& truth() const;
  /// Of the features that next() gave last.
  const FrameTruth& frame() const;
  /// What the cameras look at; without points when they are switched off.
  const Scene& world() const;
  /// Share of the duration that has been simulated, in [0, 1].
  double progress() const;
  /// Of each stream what was made, lost on the way, or left out by the sensor (outage): {"imu.made", 6000},
  /// {"imu.lost", 2}, {"gps.none", 10}; and "imu.saturated".
  NamedCounts counts() const;
  const Scenario& scenario() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// A whole run. @throws std::invalid_argument as Simulation.
struct SimulatedRecording {
  std::vector<Measurement> measurements;  ///< in order of time
  std::vector<SimulationTruth> truth;     ///< one for each reference measurement
  NamedCounts counts;
};
SimulatedRecording simulate(const Scenario& scenario, std::uint64_t seed, const SimulationOptions& options = {});

}  // namespace loc
