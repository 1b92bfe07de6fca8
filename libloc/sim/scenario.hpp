// Scenarios: a motion, the sensors that ride on it and the world around them, as one plain struct. Named ones are ready
// to use; every model in them may be changed before a Simulation (simulation.hpp) runs it.
// Motion and world belong to the scenario: the seed of a run changes the sensors' errors only.
// Frames: world ENU, body = IMU, x forward, y left, z up.
//
//   Scenario scenario = make_scenario("street-car");
//   scenario.gps.outages = {{20, 30}};
//   Simulation simulation(scenario, 7);
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "libloc/core/time.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sensors/rig.hpp"
#include "libloc/sim/camera.hpp"
#include "libloc/sim/gps.hpp"
#include "libloc/sim/imu.hpp"
#include "libloc/sim/magnetometer.hpp"
#include "libloc/sim/motion.hpp"
#include "libloc/sim/scene.hpp"
#include "libloc/sim/stream_clock.hpp"
#include "libloc/sim/visual_odometry.hpp"

namespace loc {

/// Which streams a scenario has.
struct ScenarioStreams {
  bool imu = true;
  bool magnetometer = true;
  bool odometry = true;
  bool gps = true;
  bool features = true;
  bool reference = true;
};

/// A camera with its tracker.
struct ScenarioCamera {
  CameraCalibration calibration;  ///< as the camera truly is; the rig tells it
  CameraModel model;              ///< its start_time_ns is not used
  StreamClockModel clock;
  double latency_s = 0;  ///< arrival after the exposure
};

struct Scenario {
  std::string name;
  std::string description;  ///< one sentence
  std::shared_ptr<const Motion> motion;
  double duration_s = 60;                            ///< at most that of the motion
  TimeNs start_time_ns = 1'700'000'000'000'000'000;  ///< of time 0 of the motion; since 1970, UTC
  ScenarioStreams streams;

  ImuModel imu;
  StreamClockModel imu_clock;
  MagnetometerModel magnetometer;
  StreamClockModel magnetometer_clock;
  VisualOdometryModel odometry;
  StreamClockModel odometry_clock;
  GpsModel gps;
  StreamClockModel gps_clock;
  std::vector<ScenarioCamera> cameras;
  std::function<Scene()> world;    ///< makes what the cameras look at; called when it is needed
  double reference_rate_hz = 100;  ///< of the truth, on true time

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
  /// What a careful calibration of the sensors would give: the streams that are switched on.
  Rig rig() const;
};

struct ScenarioInfo {
  std::string name;
  std::string description;
};
/// The named scenarios.
const std::vector<ScenarioInfo>& scenario_list();

/// @param duration_s NaN: 60 s. A car and a pedestrian go round again for as long as is asked.
/// @throws std::invalid_argument for a name that is not known (naming those that are), a duration that is not positive
/// or longer than the motion.
Scenario make_scenario(const std::string& name, double duration_s = kUnknown);

}  // namespace loc
