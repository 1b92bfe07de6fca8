// The one place where generated decoders of package loc are called.
#include "libloc/core/check.hpp"
#include "loc/clock_t.hpp"
#include "loc/estimate_t.hpp"
#include "loc/estimator_status_t.hpp"
#include "loc/fusion_t.hpp"
#include "loc/gps_fix_t.hpp"
#include "loc/image_t.hpp"
#include "loc/imu_t.hpp"
#include "loc/magnetometer_t.hpp"
#include "loc/map_points_t.hpp"
#include "loc/odometry_t.hpp"
#include "loc/reference_t.hpp"
#include "loc/slam_frame_t.hpp"
#include "loc/slam_state_t.hpp"
#include "loc/source_status_t.hpp"
#include "loc/statistics_t.hpp"
#include "loc/tracks_t.hpp"
#include "msgs/decode.hpp"
#include "msgs/decode_generated.hpp"

namespace loc {
namespace {

constexpr std::int64_t kStampBytes = 3 * 8;

// Only the lengths matter: one function for each type that has any, in the order of its .lcm file.
void walk(wire::Walker& w, const clock_t&) {
  w.skip(8);
  for (int i = 0; i < 4; ++i) w.string();
  w.skip(9 * 8 + 1);
}
void walk(wire::Walker& w, const estimate_t&) {
  w.skip(kStampBytes + 8);
  w.string();
  w.string();
  w.skip(2 * 4 + (4 + 5 * 3) * 8);
  w.matrix(w.int32(), 8);
}
void walk(wire::Walker& w, const estimator_status_t&) {
  w.skip(2 * 8);
  w.string();
  w.skip(4 + 1);
  const std::int64_t size = w.int32();
  for (std::int64_t i = 0; i < size && w.ok(); ++i) w.string();
  w.array(size, 8);
}
void walk(wire::Walker& w, const image_t&) {
  w.skip(kStampBytes + 8 + 5 * 4);
  w.array(w.int32(), 1);
}
void walk(wire::Walker& w, const map_points_t&) {
  w.skip(kStampBytes);
  w.array(w.int32(), 8 + 3 * 8 + 9 * 8);
}
void walk(wire::Walker& w, const slam_frame_t&) {
  w.skip(kStampBytes + 4 + 1 + 8 + 9 * 4 + 3 * 8 + 4 + 7 * 8);
  w.array(w.int32(), 8 + 1 + 1 + 11 * 8);
}
void walk(wire::Walker& w, const slam_state_t&) {
  w.skip(8 + 1);
  w.string();
  w.string();
  w.skip(2 * 4 + 4 * 8 + 1 + 4 * 8 + 7 * 8 + 2 * 8);
  w.skip((4 + 5 * 3 + 7 + 1) * 8);
  w.array(w.int32(), 6 * 8 + 3 + 22 * 8);
  w.skip(4);
  w.array(w.int32(), 8);
}
void walk(wire::Walker& w, const source_status_t&) {
  w.skip(8);
  w.string();
  w.skip(1);
  const std::int64_t streams = w.int32();
  for (std::int64_t i = 0; i < streams && w.ok(); ++i) w.string();
  w.array(streams, 8);
  w.string();
}
void walk(wire::Walker& w, const statistics_t&) {
  w.skip(8);
  w.string();
  w.skip(4);
  const std::int64_t size = w.int32();
  for (std::int64_t i = 0; i < size && w.ok(); ++i) w.string();
  w.array(size, 8);
}
void walk(wire::Walker& w, const tracks_t&) {
  w.skip(kStampBytes + 4 + 8);
  w.array(w.int32(), 3 * 8);
}
// The others have a fixed size, which the generated code knows.
template <class T>
void walk(wire::Walker& w, const T& empty) {
  w.skip(empty.getEncodedSize() - 8);
}

}  // namespace

template <class T>
T decode_message(std::span<const std::uint8_t> data) {
  return decode_generated<T>(data, [](wire::Walker& w, const T& empty) { walk(w, empty); });
}

template clock_t decode_message<clock_t>(std::span<const std::uint8_t>);
template estimate_t decode_message<estimate_t>(std::span<const std::uint8_t>);
template estimator_status_t decode_message<estimator_status_t>(std::span<const std::uint8_t>);
template fusion_t decode_message<fusion_t>(std::span<const std::uint8_t>);
template gps_fix_t decode_message<gps_fix_t>(std::span<const std::uint8_t>);
template image_t decode_message<image_t>(std::span<const std::uint8_t>);
template imu_t decode_message<imu_t>(std::span<const std::uint8_t>);
template magnetometer_t decode_message<magnetometer_t>(std::span<const std::uint8_t>);
template map_points_t decode_message<map_points_t>(std::span<const std::uint8_t>);
template odometry_t decode_message<odometry_t>(std::span<const std::uint8_t>);
template reference_t decode_message<reference_t>(std::span<const std::uint8_t>);
template slam_frame_t decode_message<slam_frame_t>(std::span<const std::uint8_t>);
template slam_state_t decode_message<slam_state_t>(std::span<const std::uint8_t>);
template source_status_t decode_message<source_status_t>(std::span<const std::uint8_t>);
template statistics_t decode_message<statistics_t>(std::span<const std::uint8_t>);
template tracks_t decode_message<tracks_t>(std::span<const std::uint8_t>);

}  // namespace loc
