// What a recording tells about the clock that stamped it, against the clock of the arrivals: skew, how late arrivals
// are, what happened to the clocks, and whether that is good enough to start a live clock model with.
#pragma once

#include <span>

#include "libloc/core/quality.hpp"
#include "libloc/sensors/clock.hpp"

namespace loc {

struct ClockCalibrationResult {
  double skew_ppm = 0;        ///< seconds of the host per second of the device, less 1; mean after the warm-up
  double skew_sigma_ppm = 0;  ///< of a skew met in use: of its estimate, and of its wandering within the recording
  double skew_min_ppm = 0;    ///< within the recording, after the warm-up
  double skew_max_ppm = 0;
  TimeNs offset_ns = 0;      ///< host - device, minimum delay included, at the last sample
  double sigma_ns = 0;       ///< of a time put on the host's clock, root mean square after the warm-up
  double jitter_rms_ns = 0;  ///< lateness of arrivals above the line
  double jitter_median_ns = 0;
  double jitter_p90_ns = 0;
  double jitter_p99_ns = 0;
  double jitter_max_ns = 0;
  double duration_s = 0;  ///< from the first arrival to the last
  double rate_hz = 0;     ///< by the median step of device time
  std::int64_t epochs = 0;
  ClockCounts counts;
  Quality quality;
};

/// @param device_times_ns stamps in the order of arrival. @param host_times_ns arrivals, as many.
/// @throws std::invalid_argument when the sizes differ or an option is out of range. A recording that says too little
/// is refused in the result's quality.
ClockCalibrationResult calibrate_clock(std::span<const TimeNs> device_times_ns, std::span<const TimeNs> host_times_ns,
                                       const ClockModelOptions& options = {});

}  // namespace loc
