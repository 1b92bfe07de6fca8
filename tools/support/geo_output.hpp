// Estimates as a path on the Earth: *.gpx, *.kml, *.geojson (io/geo_export.hpp). Needs estimates whose world is tied to
// the Earth, by GPS or a given origin.
#pragma once

#include <memory>
#include <string>

#include "tools/support/cli_forward.hpp"

namespace loc {

class EstimateOutput;

struct GeoOutputOptions {
  double rate_hz = 10;         ///< points per second, of those that there are; 0: all
  std::string times = "unix";  ///< what the time of an estimate is: "unix", "gps" (time base gps), "none" of both
  double geoid_height = 0;     ///< GeoPath::geoid_height [m]

  /// @throws UsageError, std::invalid_argument naming the option.
  void check() const;
};

void add_geo_options(CLI::App& app, GeoOutputOptions& options);

/// Whether the ending is one of these formats.
bool is_geo_output(const std::string& path);

/// Its finish() writes the file. Estimates without position or origin are left out and told; a line is broken there, at
/// gaps of more than 10 s, where the clock goes back and where the estimator started anew. finish() @throws DataError
/// when no estimate was tied to the Earth.
/// @param name of the path @throws UsageError as check().
std::unique_ptr<EstimateOutput> open_geo_output(const std::string& path, const std::string& name,
                                                const GeoOutputOptions& options);

}  // namespace loc
