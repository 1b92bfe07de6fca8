#include "msgs/convert.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

template <class Message>
void stamp_to(const Stamp& stamp, Message& m) {
  m.time_ns = stamp.time_ns;
  m.host_time_ns = stamp.host_time_ns;
  m.sequence = stamp.sequence;
}

void require_time(std::int64_t time_ns, const char* type, const char* what) {
  if (time_ns == kNoTime) throw DataError(std::string(type) + ".time_ns = INT64_MIN: " + what + " must have a time");
}

template <class Message>
void stamp_from(const Message& m, const char* type, Stamp& stamp) {
  require_time(m.time_ns, type, "a measurement");
  stamp.time_ns = m.time_ns;
  stamp.host_time_ns = m.host_time_ns;
  stamp.sequence = m.sequence;
}

template <class Vector>
void vector_to(const Vector& v, double* out) {
  std::copy(v.data(), v.data() + v.size(), out);
}

Eigen::Vector3d vector_from(const double* in) {
  return {in[0], in[1], in[2]};
}

void matrix_to(const Eigen::Matrix3d& m, double (*out)[3]) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out[i][j] = m(i, j);
  }
}

Eigen::Matrix3d matrix_from(const double (*in)[3]) {
  Eigen::Matrix3d m;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) m(i, j) = in[i][j];
  }
  return m;
}

void quaternion_to(const Eigen::Quaterniond& q, double* wxyz) {
  wxyz[0] = q.w();
  wxyz[1] = q.x();
  wxyz[2] = q.y();
  wxyz[3] = q.z();
}

Eigen::Quaterniond quaternion_from(const double* wxyz) {
  return {wxyz[0], wxyz[1], wxyz[2], wxyz[3]};
}

// What a program sent is kept to the last bit; what was rounded on its way is normalised.
Eigen::Quaterniond unit_quaternion_from(const double* wxyz, const char* field) {
  constexpr double kRounded = 1e-2;
  constexpr double kExact = 1e-9;
  Eigen::Quaterniond q = quaternion_from(wxyz);
  const double off = std::abs(q.norm() - 1);
  if (!(off <= kRounded)) throw DataError(std::string(field) + ": norm = " + to_text(q.norm()) + ": must be 1");
  if (off > kExact) q.normalize();
  return q;
}

// NaN passes: what the receiver did not say.
void require_angle(const char* field, double value, double largest, const char* range) {
  if (std::abs(value) > largest) {
    throw DataError(std::string(field) + " = " + to_text(value) + ": must be in radians, " + range);
  }
}

[[noreturn]] void reject(const char* field, std::int64_t value, const char* rule) {
  throw DataError(std::string(field) + " = " + std::to_string(value) + ": " + rule);
}

}  // namespace

imu_t to_message(const ImuMeasurement& m) {
  imu_t out{};
  stamp_to(m, out);
  vector_to(m.angular_velocity, out.angular_velocity);
  vector_to(m.specific_force, out.specific_force);
  return out;
}

magnetometer_t to_message(const MagnetometerMeasurement& m) {
  magnetometer_t out{};
  stamp_to(m, out);
  vector_to(m.magnetic_field, out.magnetic_field);
  return out;
}

image_t to_message(const ImageMeasurement& m) {
  image_t out{};
  stamp_to(m, out);
  out.exposure_ns = m.exposure_ns;
  out.camera = m.camera;
  out.width = m.width_px;
  out.height = m.height_px;
  out.row_stride = m.row_stride_bytes;
  out.pixelformat = static_cast<std::int32_t>(m.format);
  if (m.data) out.data = *m.data;
  out.size = static_cast<std::int32_t>(out.data.size());
  return out;
}

gps_fix_t to_message(const GpsMeasurement& m) {
  gps_fix_t out{};
  stamp_to(m, out);
  out.gps_time_ns = m.gps_time_ns;
  out.fix_type = static_cast<std::int8_t>(m.fix);
  out.satellites = m.satellites;
  out.latitude = m.latitude;
  out.longitude = m.longitude;
  out.altitude = m.altitude;
  matrix_to(m.position_cov, out.position_cov);
  vector_to(m.velocity_enu, out.velocity_enu);
  matrix_to(m.velocity_cov, out.velocity_cov);
  return out;
}

reference_t to_message(const ReferenceMeasurement& m) {
  reference_t out{};
  stamp_to(m, out);
  quaternion_to(m.q_world_body, out.q_world_body_wxyz);
  vector_to(m.position, out.position);
  vector_to(m.velocity, out.velocity);
  out.score = m.score ? 1 : 0;
  return out;
}

odometry_t to_message(const OdometryMeasurement& m) {
  odometry_t out{};
  stamp_to(m, out);
  out.start_time_ns = m.start_time_ns;
  vector_to(m.position, out.position);
  quaternion_to(m.rotation, out.q_wxyz);
  matrix_to(m.position_cov, out.position_cov);
  matrix_to(m.orientation_cov, out.orientation_cov);
  return out;
}

tracks_t to_message(const FeaturesMeasurement& m) {
  tracks_t out{};
  stamp_to(m, out);
  out.camera = m.camera;
  out.sigma_px = m.sigma_px;
  out.size = static_cast<std::int32_t>(m.features.size());
  for (const FeatureObservation& feature : m.features) {
    out.feature_id.push_back(feature.id);
    out.u_px.push_back(feature.pixel_px.x());
    out.v_px.push_back(feature.pixel_px.y());
  }
  return out;
}

estimate_t to_message(const Estimate& e, const std::string& method, const std::string& world) {
  estimate_t out{};
  out.time_ns = e.time_ns;
  out.host_time_ns = e.host_time_ns;
  out.sequence = e.sequence;
  out.publish_time_ns = kNoTime;
  out.method = method;
  out.world = world;
  out.valid = static_cast<std::int32_t>(e.valid);
  out.status = static_cast<std::int32_t>(e.status);
  quaternion_to(e.q_world_body, out.q_world_body_wxyz);
  vector_to(e.position, out.position);
  vector_to(e.velocity, out.velocity);
  vector_to(e.angular_velocity, out.angular_velocity);
  vector_to(e.gyroscope_bias, out.gyroscope_bias);
  vector_to(e.accelerometer_bias, out.accelerometer_bias);
  out.covariance_dim = e.covariance_dim;
  out.covariance.assign(static_cast<std::size_t>(e.covariance_dim),
                        std::vector<double>(static_cast<std::size_t>(e.covariance_dim)));
  for (int i = 0; i < e.covariance_dim; ++i) {
    for (int j = 0; j < e.covariance_dim; ++j) {
      out.covariance[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] = e.covariance(i, j);
    }
  }
  return out;
}

std::optional<fusion_t> to_fusion_message(const Estimate& e) {
  if ((e.valid & kValidScale) == 0 && std::isnan(e.origin.latitude)) return std::nullopt;
  fusion_t out{};
  out.time_ns = e.time_ns;
  out.host_time_ns = e.host_time_ns;
  out.sequence = e.sequence;
  out.scale = e.scale;
  out.scale_sigma = e.scale_sigma;
  out.origin_latitude = e.origin.latitude;
  out.origin_longitude = e.origin.longitude;
  out.origin_altitude = e.origin.altitude;
  return out;
}

clock_t to_message(const ClockLine& line) {
  clock_t out{};
  out.input_ref_ns = line.input_ref_ns;
  out.output_ref_ns = line.output_ref_ns;
  out.skew = line.skew;
  out.sigma_ns = line.sigma_ns;
  out.sigma_skew = line.sigma_skew;
  out.skew_walk = line.skew_walk;
  out.valid_from_ns = line.valid_from_ns;
  out.valid_to_ns = line.valid_to_ns;
  return out;
}

ImuMeasurement from_message(const imu_t& m) {
  ImuMeasurement out;
  stamp_from(m, "imu_t", out);
  out.angular_velocity = vector_from(m.angular_velocity);
  out.specific_force = vector_from(m.specific_force);
  return out;
}

MagnetometerMeasurement from_message(const magnetometer_t& m) {
  MagnetometerMeasurement out;
  stamp_from(m, "magnetometer_t", out);
  out.magnetic_field = vector_from(m.magnetic_field);
  return out;
}

ImageMeasurement from_message(const image_t& m) {
  ImageMeasurement out;
  stamp_from(m, "image_t", out);
  if (m.width <= 0) reject("image_t.width", m.width, "must be positive");
  if (m.height <= 0) reject("image_t.height", m.height, "must be positive");
  if (m.size < 0 || static_cast<std::size_t>(m.size) != m.data.size()) {
    reject("image_t.size", m.size, "must be the number of bytes");
  }
  std::int64_t bytes_per_pixel = 0;
  switch (static_cast<PixelFormat>(m.pixelformat)) {
    case PixelFormat::kGray:
      bytes_per_pixel = 1;
      break;
    case PixelFormat::kBgr:
    case PixelFormat::kRgb:
      bytes_per_pixel = 3;
      break;
    case PixelFormat::kMjpeg:
      break;
    default:
      reject("image_t.pixelformat", m.pixelformat, "must be GREY, BGR3, RGB3 or MJPG");
  }
  if (bytes_per_pixel > 0) {
    if (m.row_stride < m.width * bytes_per_pixel) reject("image_t.row_stride", m.row_stride, "is less than one row");
    const std::int64_t need = static_cast<std::int64_t>(m.row_stride) * (m.height - 1) + m.width * bytes_per_pixel;
    if (m.size < need) reject("image_t.size", m.size, "is less than the rows of the picture take");
  } else if (m.size == 0) {
    reject("image_t.size", m.size, "must be positive");
  }
  if (m.camera < 0) reject("image_t.camera", m.camera, "must not be negative");
  if (m.exposure_ns < 0) reject("image_t.exposure_ns", m.exposure_ns, "must not be negative");
  out.camera = m.camera;
  out.width_px = m.width;
  out.height_px = m.height;
  out.row_stride_bytes = m.row_stride;
  out.format = static_cast<PixelFormat>(m.pixelformat);
  out.exposure_ns = m.exposure_ns;
  out.data = std::make_shared<const std::vector<std::uint8_t>>(m.data);
  return out;
}

GpsMeasurement from_message(const gps_fix_t& m) {
  GpsMeasurement out;
  stamp_from(m, "gps_fix_t", out);
  if (m.fix_type < gps_fix_t::FIX_NONE || m.fix_type > gps_fix_t::FIX_FIXED) {
    reject("gps_fix_t.fix_type", m.fix_type, "is not one of the fix types");
  }
  require_angle("gps_fix_t.latitude", m.latitude, std::numbers::pi / 2, "[-pi/2, pi/2]");
  require_angle("gps_fix_t.longitude", m.longitude, 2 * std::numbers::pi, "[-2 pi, 2 pi]");
  out.fix = static_cast<GpsFixType>(m.fix_type);
  out.satellites = m.satellites;
  out.gps_time_ns = m.gps_time_ns;
  out.latitude = m.latitude;
  out.longitude = m.longitude;
  out.altitude = m.altitude;
  out.position_cov = matrix_from(m.position_cov);
  out.velocity_enu = vector_from(m.velocity_enu);
  out.velocity_cov = matrix_from(m.velocity_cov);
  return out;
}

ReferenceMeasurement from_message(const reference_t& m) {
  ReferenceMeasurement out;
  stamp_from(m, "reference_t", out);
  const Eigen::Quaterniond q = quaternion_from(m.q_world_body_wxyz);
  out.q_world_body =
      q.coeffs().hasNaN() ? q : unit_quaternion_from(m.q_world_body_wxyz, "reference_t.q_world_body_wxyz");
  out.position = vector_from(m.position);
  out.velocity = vector_from(m.velocity);
  out.score = m.score != 0;
  return out;
}

OdometryMeasurement from_message(const odometry_t& m) {
  OdometryMeasurement out;
  stamp_from(m, "odometry_t", out);
  if (m.start_time_ns != kNoTime && m.start_time_ns >= m.time_ns) {
    reject("odometry_t.start_time_ns", m.start_time_ns, "must be before time_ns");
  }
  out.start_time_ns = m.start_time_ns;
  out.position = vector_from(m.position);
  const Eigen::Quaterniond q = quaternion_from(m.q_wxyz);
  out.rotation = q.coeffs().hasNaN() ? q : unit_quaternion_from(m.q_wxyz, "odometry_t.q_wxyz");
  out.position_cov = matrix_from(m.position_cov);
  out.orientation_cov = matrix_from(m.orientation_cov);
  return out;
}

FeaturesMeasurement from_message(const tracks_t& m) {
  FeaturesMeasurement out;
  stamp_from(m, "tracks_t", out);
  if (m.camera < 0) reject("tracks_t.camera", m.camera, "must not be negative");
  if (m.sigma_px < 0) {  // NaN: not known
    throw DataError("tracks_t.sigma_px = " + to_text(m.sigma_px) + ": must not be negative");
  }
  const auto size = static_cast<std::size_t>(m.size);
  if (m.size < 0 || m.feature_id.size() != size || m.u_px.size() != size || m.v_px.size() != size) {
    reject("tracks_t.size", m.size, "must be the number of features");
  }
  // A feature that is in two places at once would count twice as an observation of one point.
  std::vector<std::int64_t> ids = m.feature_id;
  std::ranges::sort(ids);
  const auto twice = std::ranges::adjacent_find(ids);
  if (twice != ids.end()) reject("tracks_t.feature_id", *twice, "comes twice in one frame");
  out.camera = m.camera;
  out.sigma_px = m.sigma_px;
  out.features.reserve(size);
  for (std::size_t i = 0; i < size; ++i) out.features.push_back({m.feature_id[i], {m.u_px[i], m.v_px[i]}});
  return out;
}

Estimate from_message(const estimate_t& m) {
  Estimate out;
  require_time(m.time_ns, "estimate_t", "an estimate");
  out.time_ns = m.time_ns;
  out.host_time_ns = m.host_time_ns;
  out.sequence = m.sequence;
  out.valid = static_cast<std::uint32_t>(m.valid);
  out.status = static_cast<std::uint32_t>(m.status);
  out.q_world_body = (out.valid & kValidOrientation) != 0
                         ? unit_quaternion_from(m.q_world_body_wxyz, "estimate_t.q_world_body_wxyz")
                         : quaternion_from(m.q_world_body_wxyz);
  out.position = vector_from(m.position);
  out.velocity = vector_from(m.velocity);
  out.angular_velocity = vector_from(m.angular_velocity);
  out.gyroscope_bias = vector_from(m.gyroscope_bias);
  out.accelerometer_bias = vector_from(m.accelerometer_bias);
  if (m.covariance_dim < 0 || m.covariance_dim > kMaxEstimateDim) {
    reject("estimate_t.covariance_dim", m.covariance_dim, "must be in [0, 15]");
  }
  if ((out.valid & kValidCovariance) != 0 && m.covariance_dim == 0) {
    reject("estimate_t.covariance_dim", 0, "must be positive, as the bit VALID_COVARIANCE is set");
  }
  // A message that was decoded has them; one that a program has put together may not.
  const auto dim = static_cast<std::size_t>(m.covariance_dim);
  const std::string expected = " where covariance_dim = " + std::to_string(dim);
  if (m.covariance.size() != dim) {
    throw DataError("estimate_t.covariance: " + std::to_string(m.covariance.size()) + " rows" + expected);
  }
  for (std::size_t i = 0; i < dim; ++i) {
    if (m.covariance[i].size() == dim) continue;
    throw DataError("estimate_t.covariance[" + std::to_string(i) + "]: " + std::to_string(m.covariance[i].size()) +
                    " values" + expected);
  }
  out.covariance_dim = m.covariance_dim;
  for (int i = 0; i < m.covariance_dim; ++i) {
    for (int j = 0; j < m.covariance_dim; ++j) {
      out.covariance(i, j) = m.covariance[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
    }
  }
  return out;
}

void add_message(const fusion_t& m, Estimate& e) {
  require_time(m.time_ns, "fusion_t", "an estimate");
  if (m.time_ns != e.time_ns) reject("fusion_t.time_ns", m.time_ns, "is not that of the estimate");
  if (m.sequence != e.sequence) reject("fusion_t.sequence", m.sequence, "is not that of the estimate");
  require_angle("fusion_t.origin_latitude", m.origin_latitude, std::numbers::pi / 2, "[-pi/2, pi/2]");
  require_angle("fusion_t.origin_longitude", m.origin_longitude, 2 * std::numbers::pi, "[-2 pi, 2 pi]");
  if (m.scale_sigma < 0) throw DataError("fusion_t.scale_sigma = " + to_text(m.scale_sigma) + ": must not be negative");
  e.scale = m.scale;
  e.scale_sigma = m.scale_sigma;
  e.origin = {m.origin_latitude, m.origin_longitude, m.origin_altitude};
}

ClockLine from_message(const clock_t& m) {
  const auto reject_value = [](const char* field, double value, const char* rule) {
    throw DataError(std::string("clock_t.") + field + " = " + to_text(value) + ": " + rule);
  };
  if (!(std::abs(m.skew) <= 0.1)) reject_value("skew", m.skew, "must be in [-0.1, 0.1]");
  const auto not_negative = [&](const char* field, double value) {
    if (!(std::isfinite(value) && value >= 0)) reject_value(field, value, "must not be negative, and finite");
  };
  not_negative("sigma_ns", m.sigma_ns);
  not_negative("sigma_skew", m.sigma_skew);
  not_negative("skew_walk", m.skew_walk);
  if (m.valid_to_ns < m.valid_from_ns) reject("clock_t.valid_to_ns", m.valid_to_ns, "is before valid_from_ns");
  if (m.quality < clock_t::QUALITY_LABELS || m.quality > clock_t::QUALITY_PULSES) {
    reject("clock_t.quality", m.quality, "is not one of the qualities");
  }
  return {m.input_ref_ns, m.output_ref_ns, m.skew,          m.sigma_ns,
          m.sigma_skew,   m.skew_walk,     m.valid_from_ns, m.valid_to_ns};
}

const char* default_channel(StreamKind kind) {
  switch (kind) {
    case StreamKind::kImu:
      return "LOC_IMU";
    case StreamKind::kMagnetometer:
      return "LOC_MAGNETOMETER";
    case StreamKind::kImage:
      return "LOC_IMAGE";
    case StreamKind::kGps:
      return "LOC_GPS";
    case StreamKind::kReference:
      return "LOC_REFERENCE";
    case StreamKind::kOdometry:
      return "LOC_ODOMETRY";
    case StreamKind::kFeatures:
      return "LOC_TRACKS";
  }
  return "LOC_UNKNOWN";
}

}  // namespace loc
