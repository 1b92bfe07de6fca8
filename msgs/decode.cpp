#include "msgs/decode.hpp"

#include <algorithm>
#include <map>
#include <string>

#include "libloc/core/check.hpp"
#include "msgs/aspn23.hpp"
#include "msgs/convert.hpp"
#include "msgs/wire.hpp"

namespace loc {
namespace {

constexpr std::array<StreamKind, kStreamKinds> kKinds{
    StreamKind::kImu,       StreamKind::kMagnetometer, StreamKind::kImage,   StreamKind::kGps,
    StreamKind::kReference, StreamKind::kOdometry,     StreamKind::kFeatures};

std::size_t index_of(StreamKind kind) {
  return static_cast<std::size_t>(kind);
}

// The stream that a type of package loc belongs to.
std::optional<StreamKind> loc_kind(std::int64_t fingerprint) {
  if (fingerprint == imu_t::getHash()) return StreamKind::kImu;
  if (fingerprint == magnetometer_t::getHash()) return StreamKind::kMagnetometer;
  if (fingerprint == image_t::getHash()) return StreamKind::kImage;
  if (fingerprint == gps_fix_t::getHash()) return StreamKind::kGps;
  if (fingerprint == reference_t::getHash()) return StreamKind::kReference;
  if (fingerprint == odometry_t::getHash()) return StreamKind::kOdometry;
  if (fingerprint == tracks_t::getHash()) return StreamKind::kFeatures;
  return std::nullopt;
}

Measurement decode_loc(StreamKind kind, std::span<const std::uint8_t> data) {
  switch (kind) {
    case StreamKind::kImu:
      return from_message(decode_message<imu_t>(data));
    case StreamKind::kMagnetometer:
      return from_message(decode_message<magnetometer_t>(data));
    case StreamKind::kImage:
      return from_message(decode_message<image_t>(data));
    case StreamKind::kGps:
      return from_message(decode_message<gps_fix_t>(data));
    case StreamKind::kReference:
      return from_message(decode_message<reference_t>(data));
    case StreamKind::kOdometry:
      return from_message(decode_message<odometry_t>(data));
    case StreamKind::kFeatures:
      return from_message(decode_message<tracks_t>(data));
  }
  throw DataError("no such stream");
}

bool carries(aspn23::Type type, StreamKind kind) {
  switch (type) {
    case aspn23::Type::kNone:
      return false;
    case aspn23::Type::kImu:
      return kind == StreamKind::kImu;
    case aspn23::Type::kPosition:
      return kind == StreamKind::kGps;
    case aspn23::Type::kPositionVelocityAttitude:
      return kind == StreamKind::kGps || kind == StreamKind::kReference;
  }
  return false;
}

}  // namespace

void DecodeOptions::check() const {
  for (const StreamKind a : kKinds) {
    for (const StreamKind b : kKinds) {
      const std::string& channel = channels[index_of(a)];
      if (a < b && !channel.empty() && channel == channels[index_of(b)]) {
        throw std::invalid_argument("channel " + channel + " is named for two streams, " + stream_name(a) + " and " +
                                    stream_name(b));
      }
    }
  }
}

struct MeasurementDecoder::State {
  DecodeOptions options;
  std::array<std::string, kStreamKinds> found;  // channels that were recognised by their type
  aspn23::ImuConverter imu;
  aspn23::ReferenceConverter reference;
  std::map<std::string, std::int64_t> skipped;

  // The stream that a channel belongs to by its name.
  std::optional<StreamKind> named(std::string_view channel) const {
    for (const StreamKind kind : kKinds) {
      const std::string& name = options.channels[index_of(kind)];
      if (!name.empty() && name == channel) return kind;
    }
    for (const StreamKind kind : kKinds) {
      if (options.channels[index_of(kind)].empty() && channel == default_channel(kind)) return kind;
    }
    return std::nullopt;
  }

  std::optional<StreamKind> recognised(std::string_view channel) const {
    for (const StreamKind kind : kKinds) {
      if (!found[index_of(kind)].empty() && found[index_of(kind)] == channel) return kind;
    }
    return std::nullopt;
  }

  // The stream in a message on a channel that nothing is known about.
  static std::optional<StreamKind> by_type(std::int64_t fingerprint, std::span<const std::uint8_t> data) {
    if (const auto kind = loc_kind(fingerprint)) return kind;
    const aspn23::Type type = aspn23::type_of(fingerprint);
    if (type == aspn23::Type::kNone || type == aspn23::Type::kPosition) return std::nullopt;
    return aspn23::kind_of(type, data);
  }

  std::optional<Measurement> convert(StreamKind kind, std::span<const std::uint8_t> data) {
    const std::int64_t fingerprint = wire::fingerprint(data);
    const aspn23::Type type = aspn23::type_of(fingerprint);
    if (!carries(type, kind)) return decode_loc(kind, data);
    if (kind == StreamKind::kGps) return aspn23::convert_fix(type, data);
    if (kind == StreamKind::kReference) return reference.convert(data);
    auto sample = imu.convert(data);
    if (!sample) {
      ++skipped["imu.skipped.no_period"];
      return std::nullopt;
    }
    return *sample;
  }
};

MeasurementDecoder::MeasurementDecoder(DecodeOptions options) : state_(std::make_unique<State>()) {
  options.check();
  state_->options = std::move(options);
}
MeasurementDecoder::MeasurementDecoder(MeasurementDecoder&&) noexcept = default;
MeasurementDecoder& MeasurementDecoder::operator=(MeasurementDecoder&&) noexcept = default;
MeasurementDecoder::~MeasurementDecoder() = default;

std::optional<Measurement> MeasurementDecoder::decode(std::string_view channel, std::span<const std::uint8_t> data,
                                                      TimeNs receive_time_ns) {
  State& s = *state_;
  try {
    std::optional<StreamKind> kind = s.named(channel);
    if (!kind) kind = s.recognised(channel);
    const bool is_known = kind.has_value();
    if (!kind) kind = State::by_type(wire::fingerprint(data), data);
    if (!kind) return std::nullopt;

    std::string& found = s.found[index_of(*kind)];
    const bool taken = !s.options.channels[index_of(*kind)].empty() || !found.empty();
    if (!is_known && taken) {
      ++s.skipped[std::string(stream_name(*kind)) + ".skipped.other_channel"];
      return std::nullopt;
    }
    std::optional<Measurement> measurement = s.convert(*kind, data);
    // Only a message that could be decoded makes its channel the stream's. Those of cameras may come on several.
    if (!has_camera(*kind)) found = channel;
    if (measurement && stamp_of(*measurement).host_time_ns == kNoTime) {
      stamp_of(*measurement).host_time_ns = receive_time_ns;
    }
    return measurement;
  } catch (const DataError& error) {
    throw DataError("channel " + std::string(channel) + ": " + error.what());
  }
}

NamedCounts MeasurementDecoder::counts() const {
  NamedCounts counts;
  for (const auto& [name, value] : state_->skipped) counts.push_back({name, value});
  return counts;
}

std::int64_t MeasurementDecoder::skipped() const {
  std::int64_t sum = 0;
  for (const auto& [name, value] : state_->skipped) sum += value;
  return sum;
}

std::optional<GeodeticPoint> MeasurementDecoder::origin() const {
  return state_->reference.origin();
}

}  // namespace loc
