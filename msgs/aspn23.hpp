// ASPN-23 messages to measurements; the rules are told in decode.hpp. Internal to decode.cpp.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "libloc/sensors/measurements.hpp"
#include "msgs/decode.hpp"

namespace loc::aspn23 {

enum class Type : std::uint8_t { kNone, kImu, kPosition, kPositionVelocityAttitude };

/// The type that the fingerprint belongs to.
Type type_of(std::int64_t fingerprint);

/// What the message holds: a pose by a reference when it has an attitude, otherwise a fix.
/// @throws DataError as convert_* below.
StreamKind kind_of(Type type, std::span<const std::uint8_t> data);

/// Divides integrated samples by their period.
class ImuConverter {
 public:
  /// @return nullopt: integrated, and the period is not known or not positive. @throws DataError for bad bytes.
  std::optional<ImuMeasurement> convert(std::span<const std::uint8_t> data);

 private:
  TimeNs last_time_ns_ = kNoTime;
  TimeNs last_period_ns_ = 0;
  std::int64_t last_sequence_ = -1;
};

/// @throws DataError for bad bytes, another reference frame than the geodetic one, or a covariance that does not fit.
GpsMeasurement convert_fix(Type type, std::span<const std::uint8_t> data);

/// Puts the reference into one east-north-up world with its origin at the first position.
class ReferenceConverter {
 public:
  ReferenceConverter();
  ReferenceConverter(ReferenceConverter&&) noexcept;
  ReferenceConverter& operator=(ReferenceConverter&&) noexcept;
  ~ReferenceConverter();

  /// @throws DataError as convert_fix.
  ReferenceMeasurement convert(std::span<const std::uint8_t> data);
  std::optional<GeodeticPoint> origin() const;

 private:
  struct World;
  std::unique_ptr<World> world_;
};

}  // namespace loc::aspn23
