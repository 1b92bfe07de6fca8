// What was simulated, as a file: the name of the scenario, seed, duration, and every parameter. loc-simulate writes it
// beside each recording, and makes the same recording from it again.
//
//   format: libloc-scenario-1     # optional, likewise all that follows
//   scenario: street-car
//   seed: 7
//   duration_s: 60
//   parameters:                   # names and values: sim/scenario_parameters.hpp; nested or with points
//     imu.sampling: interval-mean
//     gps:
//       outages: [[20, 30]]
//       antenna_in_body: [0.5, 0, 1.2]
//
// A key that is not known is an error.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "libloc/sim/scenario.hpp"

namespace loc {

struct ScenarioFile {
  struct Parameter {
    std::string name;
    std::string value;
    std::string where;  ///< "file:line"
  };
  std::optional<std::string> scenario;
  std::optional<std::uint64_t> seed;
  std::optional<double> duration_s;
  std::vector<Parameter> parameters;

  /// Sets the parameters. @throws DataError naming file, line, parameter and value.
  void apply(Scenario& scenario) const;
};

/// @throws DataError naming file, line, key and value.
ScenarioFile read_scenario_file(const std::filesystem::path& path);

/// All parameters of the scenario. @throws DataError when it cannot be written.
void write_scenario_file(const std::filesystem::path& path, const Scenario& scenario, std::uint64_t seed);

}  // namespace loc
