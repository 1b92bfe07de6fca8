// msgs/: what Python needs to know about the LCM types; it packs and unpacks them with its own generated package loc.
#include <pybind11/stl.h>

#include <array>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "bindings.hpp"
#include "loc/clock_t.hpp"
#include "loc/estimator_status_t.hpp"
#include "loc/map_points_t.hpp"
#include "loc/slam_frame_t.hpp"
#include "loc/slam_state_t.hpp"
#include "loc/source_status_t.hpp"
#include "loc/statistics_t.hpp"
#include "loc/tracks_t.hpp"
#include "msgs/convert.hpp"
#include "msgs/decode.hpp"

namespace locpy {
namespace {

namespace py = pybind11;

struct TypeEntry {
  const char* name;
  std::int64_t fingerprint;
  void (*check)(std::span<const std::uint8_t>);
};

template <class T>
TypeEntry entry() {
  return {T::getTypeName(), T::getHash(),
          [](std::span<const std::uint8_t> data) { static_cast<void>(loc::decode_message<T>(data)); }};
}

const std::array<TypeEntry, 16>& types() {
  static const std::array<TypeEntry, 16> all = {entry<loc::imu_t>(),        entry<loc::magnetometer_t>(),
                                                entry<loc::image_t>(),      entry<loc::gps_fix_t>(),
                                                entry<loc::reference_t>(),  entry<loc::estimate_t>(),
                                                entry<loc::tracks_t>(),     entry<loc::map_points_t>(),
                                                entry<loc::statistics_t>(), entry<loc::source_status_t>(),
                                                entry<loc::clock_t>(),      entry<loc::odometry_t>(),
                                                entry<loc::fusion_t>(),     entry<loc::slam_frame_t>(),
                                                entry<loc::slam_state_t>(), entry<loc::estimator_status_t>()};
  return all;
}

std::optional<std::string> message_type(const py::bytes& bytes) {
  const auto text = static_cast<std::string_view>(bytes);
  const std::span data(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  if (data.size() < 8) return std::nullopt;
  std::uint64_t fingerprint = 0;
  for (std::size_t i = 0; i < 8; ++i) fingerprint = (fingerprint << 8U) | data[i];
  for (const TypeEntry& type : types()) {
    if (static_cast<std::uint64_t>(type.fingerprint) != fingerprint) continue;
    type.check(data);
    return type.name;
  }
  return std::nullopt;
}

}  // namespace

void bind_msgs(py::module_& m) {
  m.def(
      "message_type", &message_type, py::arg("data"),
      "Name of the type of package loc whose encoded message this is, \"imu_t\"; None for other types. DataError when "
      "the bytes are not exactly one message of that type.");
  m.def(
      "message_fingerprints",
      [] {
        std::map<std::string, std::uint64_t> out;
        for (const TypeEntry& type : types()) out[type.name] = static_cast<std::uint64_t>(type.fingerprint);
        return out;
      },
      "Fingerprint of each LCM type of package loc, as the C++ library has it.");
  m.attr("ESTIMATE_CHANNEL") = loc::kEstimateChannel;
  m.attr("FUSION_CHANNEL") = loc::kFusionChannel;
  m.attr("STATISTICS_CHANNEL") = loc::kStatisticsChannel;
  m.attr("SOURCE_STATUS_CHANNEL") = loc::kSourceStatusChannel;
  m.attr("IMU_CHANNEL") = loc::default_channel(loc::StreamKind::kImu);
  m.attr("MAGNETOMETER_CHANNEL") = loc::default_channel(loc::StreamKind::kMagnetometer);
  m.attr("IMAGE_CHANNEL") = loc::default_channel(loc::StreamKind::kImage);
  m.attr("GPS_CHANNEL") = loc::default_channel(loc::StreamKind::kGps);
  m.attr("ODOMETRY_CHANNEL") = loc::default_channel(loc::StreamKind::kOdometry);
  m.attr("TRACKS_CHANNEL") = loc::default_channel(loc::StreamKind::kFeatures);
  m.attr("REFERENCE_CHANNEL") = loc::default_channel(loc::StreamKind::kReference);
}

}  // namespace locpy
