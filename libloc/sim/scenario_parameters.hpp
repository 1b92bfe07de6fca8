// The parameters of a scenario by name, for command lines, configuration files and Python:
// "imu.gyroscope.noise_density", "odometry.latency_s", "gps.outages", "streams.gps", …. Values are text, in SI and
// radians:
//   number           1.5e-3          (inf and nan too, where the model takes them)
//   switch           true, false
//   vector           0.5, 0, 1.2     one number fills all three; brackets are passed over
//   matrix           nine numbers, row by row; three: the diagonal; one: times the identity
//   intervals        20:30, 45:50    begin and end, of outages; empty: none
//   a name           point, interval-mean, increment
// A name that begins with "camera." is that of all cameras.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "libloc/sim/scenario.hpp"

namespace loc {

struct ScenarioParameter {
  std::string name;
  std::string value;  ///< as set_parameter() takes it
  std::string unit;   ///< "rad/s", or what the text is
};

/// All of them with their values.
std::vector<ScenarioParameter> parameters(const Scenario& scenario);

/// Range and consistency are Scenario::check's.
/// @throws std::invalid_argument naming parameter and value: not known (and which ones are alike), not of its form.
void set_parameter(Scenario& scenario, std::string_view name, std::string_view value);

}  // namespace loc
