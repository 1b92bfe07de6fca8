// What the columns of a text recording are, from its heading line: the table in csv.hpp. Internal to io.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "libloc/io/csv.hpp"

namespace loc::io {

enum class Quantity : std::uint8_t {
  kTime,
  kAngularVelocity,
  kSpecificForce,
  kMagneticField,
  kOrientation,
  kPosition,
  kVelocity,
  kScore,
  kLatitudeLongitude,
  kAltitude,
  kGpsVelocity,
  kGpsSigma,
  kGpsVelocitySigma,
  kGpsFix,
  kSatellites,
  kOdometryStart,
  kOdometryPosition,
  kOdometryOrientation,
  kOdometryPositionSigma,
  kOdometryOrientationSigma,
  kUnused
};
inline constexpr std::size_t kQuantities = 21;
/// Columns that a quantity has when it is complete.
std::size_t axes_of(Quantity quantity);

struct Column {
  Quantity quantity = Quantity::kUnused;
  std::size_t axis = 0;    ///< x y z; orientation w x y z; latitude, longitude; east, north, up
  double to_si = 1;        ///< SI value of one unit; not for time
  int time_exponent = -9;  ///< A unit of time is 10^this seconds.
  std::string heading;     ///< as written, for messages
};

/// @param where "file:line", for messages
/// @throws DataError for a name or unit that is not known (naming those that are), a column that comes twice, a triad
/// that is not complete, no time.
std::vector<Column> parse_heading(std::string_view line, const std::string& where, const CsvOptions& options);

}  // namespace loc::io
