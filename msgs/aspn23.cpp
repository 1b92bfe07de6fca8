#include "msgs/aspn23.hpp"

#include <GeographicLib/LocalCartesian.hpp>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "aspn23_lcm/measurement_IMU.hpp"
#include "aspn23_lcm/measurement_position.hpp"
#include "aspn23_lcm/measurement_position_velocity_attitude.hpp"
#include "libloc/core/check.hpp"
#include "msgs/decode_generated.hpp"

namespace loc::aspn23 {
namespace {

using aspn23_lcm::measurement_IMU;
using aspn23_lcm::measurement_position;
using aspn23_lcm::measurement_position_velocity_attitude;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t kHeaderBytes = 1 + 3 * 8 + 4;
constexpr std::int64_t kTimeBytes = 1 + 8;
constexpr std::int64_t kIntegrityBytes = 1 + 1 + 8;

void walk_tail(wire::Walker& w) {
  w.matrix(w.int16(), 8);
  w.skip(1);
  w.array(w.int32(), 8);
  w.array(w.int16(), kIntegrityBytes);
}
void walk(wire::Walker& w, const measurement_IMU&) {
  w.skip(1 + kHeaderBytes + kTimeBytes + 1 + 6 * 8);
  w.array(w.int16(), kIntegrityBytes);
}
void walk(wire::Walker& w, const measurement_position&) {
  w.skip(1 + kHeaderBytes + kTimeBytes + 1 + 3 * 8);
  walk_tail(w);
}
void walk(wire::Walker& w, const measurement_position_velocity_attitude&) {
  w.skip(1 + kHeaderBytes + kTimeBytes + 1 + 10 * 8);
  walk_tail(w);
}

template <class T>
T decode(std::span<const std::uint8_t> data) {
  return decode_generated<T>(data, [](wire::Walker& w, const T& empty) { walk(w, empty); });
}

template <class Message>
void stamp_from(const Message& m, Stamp& stamp) {
  if (m.time_of_validity.elapsed_nsec == kNoTime) {
    throw DataError(std::string(Message::getTypeName()) + ".time_of_validity = INT64_MIN: must have a time");
  }
  stamp.time_ns = m.time_of_validity.elapsed_nsec;
  const auto& h = m.header;
  // A sender that leaves the header empty does not count.
  const bool counted = h.vendor_id != 0 || h.device_id != 0 || h.context_id != 0 || h.sequence_id != 0;
  stamp.sequence = counted ? h.sequence_id : -1;
}

// Terms of a position, position-velocity or position-velocity-attitude message, with their covariance. Terms that were
// not measured are NaN in both.
struct Terms {
  std::array<double, 6> value{kNan, kNan, kNan, kNan, kNan, kNan};  // latitude, longitude, altitude; north, east, down
  Eigen::Matrix<double, 9, 9> cov = Eigen::Matrix<double, 9, 9>::Constant(kNan);
};

template <class Message>
Terms terms_of(const Message& m, const std::vector<double>& values, bool attitude) {
  const std::string name = Message::getTypeName();
  if (m.reference_frame != Message::REFERENCE_FRAME_GEODETIC) {
    throw DataError(name + ".reference_frame = " + std::to_string(m.reference_frame) + ": only 1 (geodetic) is read");
  }
  Terms terms;
  std::vector<int> measured;
  for (std::size_t i = 0; i < values.size(); ++i) {
    terms.value[i] = values[i];
    if (!std::isnan(values[i])) measured.push_back(static_cast<int>(i));
  }
  if (attitude) measured.insert(measured.end(), {6, 7, 8});
  if (static_cast<std::size_t>(m.num_meas) != measured.size()) {
    throw DataError(name + ".num_meas = " + std::to_string(m.num_meas) + ": " + std::to_string(measured.size()) +
                    " terms hold a value");
  }
  for (std::size_t i = 0; i < measured.size(); ++i) {
    for (std::size_t j = 0; j < measured.size(); ++j) terms.cov(measured[i], measured[j]) = m.covariance[i][j];
  }
  if (!std::isnan(values[0]) && !(std::abs(values[0]) <= std::numbers::pi / 2)) {
    throw DataError(name + ": latitude = " + to_text(values[0]) + " rad: must be in [-pi/2, pi/2]");
  }
  if (!std::isnan(values[1]) && !(std::abs(values[1]) <= 2 * std::numbers::pi)) {
    throw DataError(name + ": longitude = " + to_text(values[1]) + " rad: must be in [-2 pi, 2 pi]");
  }
  return terms;
}

bool has_attitude(const measurement_position_velocity_attitude& m) {
  return !std::isnan(m.quaternion[0]);
}

Terms terms_of(const measurement_position_velocity_attitude& m) {
  return terms_of(m, {m.p1, m.p2, m.p3, m.v1, m.v2, m.v3}, has_attitude(m));
}

void fix_from(const Terms& terms, GpsMeasurement& fix) {
  fix.latitude = terms.value[0];
  fix.longitude = terms.value[1];
  fix.altitude = terms.value[2];
  if (std::isfinite(fix.latitude) && std::isfinite(fix.longitude)) {
    fix.fix = std::isfinite(fix.altitude) ? GpsFixType::k3d : GpsFixType::k2d;
  }
  // Swapping rows by hand keeps NaN where it is: a product would spread it.
  const std::array<int, 3> from{1, 0, 2};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const int k = from[static_cast<std::size_t>(i)];
      const int l = from[static_cast<std::size_t>(j)];
      const double sign = (i == 2) == (j == 2) ? 1.0 : -1.0;  // down to up turns the mixed terms of a velocity
      fix.position_cov(i, j) = terms.cov(k, l);
      fix.velocity_cov(i, j) = sign * terms.cov(3 + k, 3 + l);
    }
  }
  fix.velocity_enu = {terms.value[4], terms.value[3], -terms.value[5]};
}

constexpr double kDegrees = 180 / std::numbers::pi;
// No sensor integrates for longer: what is farther apart is a gap.
constexpr TimeNs kLongestPeriodNs = 1'000'000'000;

// Axes north, east, down in axes east, north, up.
Eigen::Matrix3d R_enu_ned() {
  Eigen::Matrix3d m;
  m << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  return m;
}

}  // namespace

Type type_of(std::int64_t fingerprint) {
  if (fingerprint == measurement_IMU::getHash()) return Type::kImu;
  if (fingerprint == measurement_position::getHash()) return Type::kPosition;
  if (fingerprint == measurement_position_velocity_attitude::getHash()) return Type::kPositionVelocityAttitude;
  return Type::kNone;
}

StreamKind kind_of(Type type, std::span<const std::uint8_t> data) {
  if (type == Type::kImu) return StreamKind::kImu;
  if (type == Type::kPosition) return StreamKind::kGps;
  return has_attitude(decode<measurement_position_velocity_attitude>(data)) ? StreamKind::kReference : StreamKind::kGps;
}

std::optional<ImuMeasurement> ImuConverter::convert(std::span<const std::uint8_t> data) {
  const auto m = decode<measurement_IMU>(data);
  ImuMeasurement out;
  stamp_from(m, out);
  out.specific_force = {m.meas_accel[0], m.meas_accel[1], m.meas_accel[2]};
  out.angular_velocity = {m.meas_gyro[0], m.meas_gyro[1], m.meas_gyro[2]};
  if (m.imu_type == measurement_IMU::IMU_TYPE_SAMPLED) return out;
  if (m.imu_type != measurement_IMU::IMU_TYPE_INTEGRATED) {
    throw DataError("measurement_IMU.imu_type = " + std::to_string(m.imu_type) + ": must be 0 or 1");
  }

  const bool later = last_time_ns_ != kNoTime && out.time_ns > last_time_ns_;
  // Unsigned, because times that are garbage may be farther apart than an int64 holds.
  const auto since_last_ns = static_cast<std::uint64_t>(out.time_ns) - static_cast<std::uint64_t>(last_time_ns_);
  const std::int64_t step = m.header.sequence_id - last_sequence_;
  const bool next_in_row = (step == 1 || step == 0) && since_last_ns <= kLongestPeriodNs;
  if (later && next_in_row) last_period_ns_ = static_cast<TimeNs>(since_last_ns);
  last_time_ns_ = out.time_ns;
  last_sequence_ = m.header.sequence_id;
  if (!later || last_period_ns_ == 0) return std::nullopt;
  out.specific_force /= to_seconds(last_period_ns_);
  out.angular_velocity /= to_seconds(last_period_ns_);
  return out;
}

GpsMeasurement convert_fix(Type type, std::span<const std::uint8_t> data) {
  GpsMeasurement fix;
  if (type == Type::kPosition) {
    const auto m = decode<measurement_position>(data);
    stamp_from(m, fix);
    fix_from(terms_of(m, {m.term1, m.term2, m.term3}, false), fix);
  } else {
    const auto m = decode<measurement_position_velocity_attitude>(data);
    stamp_from(m, fix);
    fix_from(terms_of(m), fix);
  }
  return fix;
}

struct ReferenceConverter::World {
  std::optional<GeographicLib::LocalCartesian> plane;
};

ReferenceConverter::ReferenceConverter() : world_(std::make_unique<World>()) {}
ReferenceConverter::ReferenceConverter(ReferenceConverter&&) noexcept = default;
ReferenceConverter& ReferenceConverter::operator=(ReferenceConverter&&) noexcept = default;
ReferenceConverter::~ReferenceConverter() = default;

ReferenceMeasurement ReferenceConverter::convert(std::span<const std::uint8_t> data) {
  const auto m = decode<measurement_position_velocity_attitude>(data);
  ReferenceMeasurement out;
  stamp_from(m, out);
  const Terms terms = terms_of(m);
  const Eigen::Quaterniond q_ned_body(m.quaternion[0], m.quaternion[1], m.quaternion[2], m.quaternion[3]);
  if (has_attitude(m) && !(std::abs(q_ned_body.norm() - 1) <= 1e-2)) {
    throw DataError("measurement_position_velocity_attitude.quaternion: norm = " + to_text(q_ned_body.norm()) +
                    ": must be 1");
  }

  // Axes east-north-up at the place of the vehicle, in those at the origin.
  Eigen::Matrix3d R_world_enu = Eigen::Matrix3d::Identity();
  out.position.setConstant(kNan);
  if (std::isfinite(terms.value[0]) && std::isfinite(terms.value[1]) && std::isfinite(terms.value[2])) {
    const double latitude_deg = terms.value[0] * kDegrees;
    const double longitude_deg = terms.value[1] * kDegrees;
    if (!world_->plane) world_->plane.emplace(latitude_deg, longitude_deg, terms.value[2]);
    std::vector<double> rotation(9);
    world_->plane->Forward(latitude_deg, longitude_deg, terms.value[2], out.position.x(), out.position.y(),
                           out.position.z(), rotation);
    for (int i = 0; i < 9; ++i) R_world_enu(i / 3, i % 3) = rotation[static_cast<std::size_t>(i)];
  }
  const Eigen::Matrix3d R_world_ned = R_world_enu * R_enu_ned();
  out.q_world_body = Eigen::Quaterniond(R_world_ned) * q_ned_body.normalized();
  out.velocity = R_world_ned * Eigen::Vector3d(terms.value[3], terms.value[4], terms.value[5]);
  return out;
}

std::optional<GeodeticPoint> ReferenceConverter::origin() const {
  if (!world_->plane) return std::nullopt;
  return GeodeticPoint{.latitude = world_->plane->LatitudeOrigin() / kDegrees,
                       .longitude = world_->plane->LongitudeOrigin() / kDegrees,
                       .altitude = world_->plane->HeightOrigin()};
}

}  // namespace loc::aspn23
