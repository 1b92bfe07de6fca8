// One filled message of every type, for tests of decoding and logs.
#pragma once

#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include "aspn23_lcm/measurement_IMU.hpp"
#include "aspn23_lcm/measurement_position.hpp"
#include "aspn23_lcm/measurement_position_velocity_attitude.hpp"
#include "libloc/sensors/measurements.hpp"
#include "loc/estimator_status_t.hpp"
#include "loc/map_points_t.hpp"
#include "loc/source_status_t.hpp"
#include "loc/statistics_t.hpp"
#include "loc/tracks_t.hpp"
#include "msgs/convert.hpp"

namespace loc {
using Bytes = std::vector<std::uint8_t>;
}

namespace loc::test {

template <class T>
Bytes encode(const T& m) {
  Bytes bytes(static_cast<std::size_t>(m.getEncodedSize()));
  if (m.encode(bytes.data(), 0, static_cast<int>(bytes.size())) != static_cast<int>(bytes.size())) {
    throw std::logic_error("the message could not be encoded");
  }
  return bytes;
}

template <class T>
T stamped(TimeNs time_ns = 1'700'000'000'123'456'789, std::int64_t sequence = 7) {
  T m{};
  m.time_ns = time_ns;
  m.host_time_ns = time_ns + 1'000'000;
  m.sequence = sequence;
  return m;
}

inline ImuMeasurement imu_sample(TimeNs time_ns = 1'700'000'000'123'456'789, std::int64_t sequence = 7) {
  auto m = stamped<ImuMeasurement>(time_ns, sequence);
  m.angular_velocity = {0.1, -0.2, 0.3};
  m.specific_force = {0.4, -0.5, 9.7};
  return m;
}
inline MagnetometerMeasurement magnetometer_sample() {
  auto m = stamped<MagnetometerMeasurement>();
  m.magnetic_field = {2e-5, -1e-6, -4e-5};
  return m;
}
inline ImageMeasurement image_sample() {
  auto m = stamped<ImageMeasurement>();
  m.camera = 1;
  m.width_px = 4;
  m.height_px = 2;
  m.row_stride_bytes = 5;
  m.format = PixelFormat::kGray;
  m.data = std::make_shared<const std::vector<std::uint8_t>>(std::vector<std::uint8_t>{1, 2, 3, 4, 0, 5, 6, 7, 8});
  return m;
}
inline GpsMeasurement gps_sample() {
  auto m = stamped<GpsMeasurement>();
  m.fix = GpsFixType::k3d;
  m.satellites = 9;
  m.latitude = 0.7;
  m.longitude = -1.4;
  m.altitude = 225;
  m.position_cov.setIdentity();
  m.velocity_enu = {1, 2, 3};
  m.velocity_cov.setIdentity();
  return m;
}
inline ReferenceMeasurement reference_sample() {
  auto m = stamped<ReferenceMeasurement>();
  m.q_world_body = Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5);
  m.position = {1, 2, 3};
  m.score = false;
  return m;
}

inline OdometryMeasurement odometry_sample() {
  auto m = stamped<OdometryMeasurement>();
  m.start_time_ns = m.time_ns - 100'000'000;
  m.position = {0.1, -0.2, 0.3};
  m.rotation = Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5);
  m.position_cov << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  m.orientation_cov << -1, -2, -3, -4, -5, -6, -7, -8, -9;
  return m;
}
inline FeaturesMeasurement features_sample() {
  auto m = stamped<FeaturesMeasurement>();
  m.camera = 2;
  m.sigma_px = 0.7;
  m.features = {{11, {1.5, 2.5}}, {7, {-3.25, 480.125}}};
  return m;
}

inline estimate_t estimate_message() {
  estimate_t m{};
  m.time_ns = 3;
  m.method = "madgwick";
  m.world = "ENU";
  m.covariance_dim = 3;
  m.covariance = {{1, 2, 3}, {2, 5, 6}, {3, 6, 9}};
  return m;
}
inline tracks_t tracks_message() {
  tracks_t m{};
  m.size = 2;
  m.feature_id = {4, 5};
  m.u_px = {1.5, 2.5};
  m.v_px = {3.5, 4.5};
  return m;
}
inline map_points_t map_points_message() {
  map_points_t m{};
  m.size = 1;
  m.point_id = {4};
  m.position = {{1, 2, 3}};
  m.position_cov = {{1, 0, 0, 0, 1, 0, 0, 0, 1}};
  return m;
}
inline statistics_t statistics_message() {
  statistics_t m{};
  m.program = "loc-driver";
  m.size = 2;
  m.name = {"imu.dropped", ""};
  m.value = {1, 2};
  return m;
}
inline clock_t clock_message() {
  clock_t m = to_message(ClockLine{.input_ref_ns = 1'700'000'000'000'000'001,
                                   .output_ref_ns = 1'384'000'000'000'000'002,
                                   .skew = -2e-5,
                                   .sigma_ns = 900,
                                   .sigma_skew = 1e-8,
                                   .skew_walk = 1.5e-8,
                                   .valid_from_ns = 1'699'999'880'000'000'000,
                                   .valid_to_ns = 1'700'000'600'000'000'000});
  m.time_ns = 1'700'000'000'500'000'000;
  m.source = "loc-driver 1234";
  m.input_clock = "host";
  m.output_clock = "gps";
  m.epoch = 3;
  m.quality = clock_t::QUALITY_PULSES;
  return m;
}
inline source_status_t source_status_message() {
  source_status_t m{};
  m.source = "recording";
  m.streams = 1;
  m.stream_name = {"imu"};
  m.published = {12};
  m.message = "end";
  return m;
}

inline estimator_status_t estimator_status_message() {
  estimator_status_t m{};
  m.method = "inertial-slam";
  m.size = 2;
  m.condition = {"no GPS", "lost"};
  m.since_s = {1.5, 0.25};
  return m;
}

/// Integrated over 10 ms: 0.01 rad/s about x, 9.8 m/s^2 upwards in forward-right-down axes.
inline aspn23_lcm::measurement_IMU aspn_imu(TimeNs time_ns, std::int32_t sequence) {
  aspn23_lcm::measurement_IMU m{};
  m.header.vendor_id = 1;
  m.header.sequence_id = sequence;
  m.time_of_validity.elapsed_nsec = time_ns;
  m.imu_type = aspn23_lcm::measurement_IMU::IMU_TYPE_INTEGRATED;
  m.meas_gyro[0] = 0.01 * 0.01;
  m.meas_accel[2] = -9.8 * 0.01;
  return m;
}

/// At 45 deg north, 1 rad east; forward is north, level, unless changed.
inline aspn23_lcm::measurement_position_velocity_attitude aspn_pva(TimeNs time_ns, bool attitude) {
  aspn23_lcm::measurement_position_velocity_attitude m{};
  m.header.vendor_id = 1;
  m.header.sequence_id = 3;
  m.time_of_validity.elapsed_nsec = time_ns;
  m.reference_frame = aspn23_lcm::measurement_position_velocity_attitude::REFERENCE_FRAME_GEODETIC;
  m.p1 = std::numbers::pi / 4;
  m.p2 = 1;
  m.p3 = 100;
  m.v1 = 1;  // north
  m.v2 = 2;  // east
  m.v3 = 3;  // down
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (double& x : m.quaternion) x = attitude ? 0 : nan;
  if (attitude) m.quaternion[0] = 1;
  m.num_meas = attitude ? 9 : 6;
  const auto n = static_cast<std::size_t>(m.num_meas);
  m.covariance.assign(n, std::vector<double>(n));
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j)
      m.covariance[i][j] = i == j ? 10.0 + static_cast<double>(i) : 0.1 * static_cast<double>(i + j);
  }
  return m;
}

}  // namespace loc::test
