// Where measurements come from: a recording that is read, a sensor, the simulator. Programs pull from a source and know
// nothing else about it.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "libloc/core/named_count.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

class MeasurementSource {
 public:
  MeasurementSource() = default;
  MeasurementSource(const MeasurementSource&) = delete;
  MeasurementSource& operator=(const MeasurementSource&) = delete;
  virtual ~MeasurementSource() = default;

  /// The next measurement, in time order for a recording, in order of arrival for a sensor (then it waits for one).
  /// nullopt: the end, or stop() was called.
  /// @throws DataError naming file, line or byte, field and value, when the data cannot be read on.
  virtual std::optional<Measurement> next() = 0;

  /// Makes a waiting next() return; may be called from another thread. A recording never waits.
  virtual void stop() {}

  /// What was read and what was skipped, and why: {"imu.read", 6000}, {"imu.skipped.time_not_increasing", 2}.
  virtual NamedCounts counts() const = 0;
};

}  // namespace loc
