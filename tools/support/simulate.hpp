// A simulated scenario written as a recording with its truth, or published as if it happened now.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "libloc/sim/scenario.hpp"
#include "tools/support/driver.hpp"
#include "tools/support/simulation_pictures.hpp"

namespace loc {

/// What the user asked for. Parameters are set in this order: the scenario's own, the file's, those given by name.
struct SimulateRequest {
  std::string scenario;  ///< empty: the file's
  std::string file;      ///< scenario file (io/scenario_yaml); empty: none
  std::optional<std::uint64_t> seed;
  std::optional<double> duration_s;
  std::vector<std::pair<std::string, std::string>> parameters;  ///< name, value
  std::string streams;                                          ///< "imu,odometry"; empty: the scenario's

  std::string out;     ///< folder, or LCM log (*.lcm, *.log)
  std::string tracks;  ///< tracks file of the first camera
  std::string rig;     ///< rig.yaml
  PictureRequest pictures;
};

struct SimulationPlan {
  Scenario scenario;
  std::uint64_t seed = 1;
};

/// @throws UsageError naming what is wrong, in a file with its line.
SimulationPlan plan_simulation(const SimulateRequest& request);

/// Writes what the request names. With a folder: DIR/mav0, DIR/rig.yaml, DIR/truth.tum, DIR/truth.csv,
/// DIR/scenario.yaml; with a log: the same names beside it, LOG.rig.yaml, ….
/// @return false when it was interrupted: nothing has been written then.
/// @throws DataError when something cannot be written; nothing has been written then either.
bool write_simulation(const SimulationPlan& plan, const SimulateRequest& request);

/// Publishes until the end or until asked to stop. @throws as Driver.
void publish_simulation(const SimulationPlan& plan, const SimulateRequest& request, DriverOptions options);

}  // namespace loc
