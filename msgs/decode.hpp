// From the bytes of an LCM message to a measurement, the same for live messages and for logs. The bytes may be
// anything: every length in them is checked before it is used.
//
// Which channel carries what: a stream that the options name comes from that channel only. Otherwise the default
// channel (default_channel()) and, as types are recognised by their fingerprint, also any other one: the first channel
// that carries a stream keeps it (images and features: every channel, the camera's index tells them apart), the default
// channel takes it over when it appears; what other channels send of the same stream is skipped and counted.
//
// Types: those of package loc, and of ASPN-23 (package aspn23_lcm, the open standard of the pntOS recordings):
//  - measurement_IMU: integrated samples (delta v, delta theta over the period that ends at the time of validity) are
//    divided by the time since the sample before; the first one has no period and is skipped. After a jump of
//    sequence_id the period before is used, because the integral covers one period only. Axes stay those of the sensor,
//    which ASPN-23 defines by the mounting, mostly forward-right-down: then specific force at rest is about -9.81 in z.
//  - measurement_position_velocity_attitude, geodetic: with attitude it is a ReferenceMeasurement, without a
//    GpsMeasurement (fix type 3-D: the message does not tell more).
//  - measurement_position, geodetic: a GpsMeasurement without velocity; only from a channel that the options name,
//    because recordings often carry the same fix once more with its velocity.
// ASPN-23 gives north-east-down; here world is east-north-up. The world of ReferenceMeasurement is the tangent plane at
// origin(), the first position of the reference; orientation and velocity are turned into it as well.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "libloc/core/named_count.hpp"
#include "libloc/geometry/geodesy.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

/// A message of type T (loc::imu_t, loc::estimate_t and the other types of package loc), decoded from all of data.
/// @throws DataError naming the type, when the fingerprint is another one, a length in it is impossible or the size is
/// not the message's.
template <class T>
T decode_message(std::span<const std::uint8_t> data);

struct DecodeOptions {
  /// Channel of each StreamKind; empty: as told above.
  std::array<std::string, kStreamKinds> channels;

  /// @throws std::invalid_argument when two kinds have the same channel.
  void check() const;
};

class MeasurementDecoder {
 public:
  explicit MeasurementDecoder(DecodeOptions options = {});
  MeasurementDecoder(MeasurementDecoder&&) noexcept;
  MeasurementDecoder& operator=(MeasurementDecoder&&) noexcept;
  ~MeasurementDecoder();

  /// The measurement in one message.
  /// @param receive_time_ns arrival at the host, for types that do not carry it
  /// @return nullopt when there is none for us in it: another type, or a sample that counts() says was skipped.
  /// @throws DataError naming channel, type, field and value: garbage, a cut message or a wrong type on a channel of
  /// ours. The decoder stays usable.
  std::optional<Measurement> decode(std::string_view channel, std::span<const std::uint8_t> data,
                                    TimeNs receive_time_ns = kNoTime);

  /// What was skipped without being wrong: {"imu.skipped.no_period", 1}, {"imu.skipped.other_channel", 12}.
  NamedCounts counts() const;
  /// Sum of counts().
  std::int64_t skipped() const;

  /// Where the world of the ASPN-23 reference has its origin; nullopt before the first position.
  std::optional<GeodeticPoint> origin() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace loc
