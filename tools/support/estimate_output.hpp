// Files that estimates go to off line. The kind follows from the name: *.csv, *.tum (or *.txt), *.lcm (or *.log),
// *.gpx,
// *.kml, *.geojson.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "libloc/estimators/estimate.hpp"
#include "libloc/estimators/slam_frame.hpp"
#include "tools/support/geo_output.hpp"

namespace loc {

class EstimateOutput {
 public:
  EstimateOutput() = default;
  EstimateOutput(const EstimateOutput&) = delete;
  EstimateOutput& operator=(const EstimateOutput&) = delete;
  virtual ~EstimateOutput() = default;
  virtual void write(const Estimate& estimate) = 0;
  /// Only LCM logs hold what SLAM says of its frames, and its map. The others have the estimates of the frames that
  /// were completed by a start, after the write() of the first estimate and before the next: their times are before it.
  virtual void write_frame(const SlamFrame& /*frame*/) {}
  virtual void write_map(const Stamp& /*stamp*/, std::span<const SlamMapPoint> /*map*/) {}
  /// To be called at the end. @throws DataError when not everything could be written.
  virtual void finish() = 0;
};

/// @param method, world as in estimate_t @param geo for *.gpx, *.kml, *.geojson
/// @throws UsageError for another ending, DataError when the file cannot be written.
std::unique_ptr<EstimateOutput> open_estimate_output(const std::string& path, const std::string& method,
                                                     const std::string& world, const GeoOutputOptions& geo = {});

}  // namespace loc
