#include "msgs/slam_file.hpp"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <ostream>
#include <span>
#include <vector>

#include "libloc/core/check.hpp"
#include "libloc/io/slam_yaml.hpp"
#include "libloc/io/text_file.hpp"
#include "loc/slam_state_t.hpp"
#include "msgs/decode.hpp"

namespace loc {
namespace {

constexpr std::string_view kMagic = "LOCSLAM1";
constexpr std::size_t kHeadBytes = 8 + 8 + 4;
constexpr std::uint64_t kLargestMessage = std::uint64_t{1} << 30;
constexpr std::size_t kPointNumbers = 11;

template <class Vector>
void numbers_to(const Vector& v, double* out) {
  std::copy(v.data(), v.data() + v.size(), out);
}
void wxyz_to(const Eigen::Quaterniond& q, double* out) {
  numbers_to(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()), out);
}
Eigen::Vector3d vector_from(const double* in) {
  return {in[0], in[1], in[2]};
}
// Not normalised: what was saved comes back bit for bit.
Eigen::Quaterniond quaternion_from(const double* in, const char* name) {
  Eigen::Quaterniond q(in[0], in[1], in[2], in[3]);
  if (!(std::abs(q.norm() - 1) < 1e-6)) throw DataError(std::string(name) + ": norm " + to_text(q.norm()));
  return q;
}

std::vector<double> point_to(const SlamPoint& point) {
  std::vector<double> out(kPointNumbers);
  numbers_to(point.inverse_depth.anchor, out.data());
  wxyz_to(point.inverse_depth.frame, out.data() + 3);
  out[7] = point.inverse_depth.inverse_depth;
  numbers_to(point.position, out.data() + 8);
  return out;
}

SlamPoint point_from(bool converted, const std::vector<double>& in, const char* name) {
  SlamPoint point;
  point.converted = converted;
  point.inverse_depth.anchor = vector_from(in.data());
  point.inverse_depth.frame = quaternion_from(in.data() + 3, name);
  point.inverse_depth.inverse_depth = in[7];
  point.position = vector_from(in.data() + 8);
  return point;
}

void camera_to(const CameraCalibration& camera, slam_state_t& out) {
  out.camera_name = camera.name;
  out.width_px = camera.width_px;
  out.height_px = camera.height_px;
  numbers_to(camera.intrinsics_px, out.intrinsics_px);
  out.distortion_model = static_cast<std::int8_t>(camera.distortion_model);
  numbers_to(camera.distortion, out.distortion);
  numbers_to(camera.T_body_camera.translation, out.camera_position);
  wxyz_to(camera.T_body_camera.rotation, out.camera_wxyz);
  out.time_offset_s = camera.time_offset_s;
  out.rate_hz = camera.rate_hz;
}

CameraCalibration camera_from(const slam_state_t& m) {
  if (m.distortion_model < slam_state_t::DISTORTION_NONE || m.distortion_model > slam_state_t::DISTORTION_EQUIDISTANT) {
    throw DataError("distortion_model = " + std::to_string(m.distortion_model) + " is not known");
  }
  CameraCalibration camera;
  camera.name = m.camera_name;
  camera.width_px = m.width_px;
  camera.height_px = m.height_px;
  camera.intrinsics_px = Eigen::Map<const Eigen::Vector4d>(m.intrinsics_px);
  camera.distortion_model = static_cast<DistortionModel>(m.distortion_model);
  camera.distortion = Eigen::Map<const Eigen::Vector4d>(m.distortion);
  camera.T_body_camera = {quaternion_from(m.camera_wxyz, "camera_wxyz"), vector_from(m.camera_position)};
  camera.time_offset_s = m.time_offset_s;
  camera.rate_hz = m.rate_hz;
  camera.check();
  return camera;
}

slam_state_t to_message(const SlamSnapshot& snapshot, const SlamOptions& options) {
  slam_state_t out{};
  out.time_ns = snapshot.time_ns;
  out.inertial = options.motion == SlamMotion::kInertial ? 1 : 0;
  out.options = slam_options_text(options);
  camera_to(options.camera, out);
  const SlamState& state = snapshot.state;
  wxyz_to(state.q_world_body, out.q_world_body_wxyz);
  numbers_to(state.position, out.position);
  numbers_to(state.velocity, out.velocity);
  numbers_to(state.gyroscope_bias, out.gyroscope_bias);
  numbers_to(state.accelerometer_bias, out.accelerometer_bias);
  numbers_to(state.angular_velocity, out.angular_velocity);
  numbers_to(state.T_body_camera.translation, out.estimated_camera_position);
  wxyz_to(state.T_body_camera.rotation, out.estimated_camera_wxyz);
  out.estimated_time_offset_s = state.time_offset_s;
  out.size = static_cast<std::int32_t>(snapshot.landmarks.size());
  for (const SlamLandmark& landmark : snapshot.landmarks) {
    out.feature_id.push_back(landmark.id);
    out.known.push_back(landmark.known ? 1 : 0);
    out.tries.push_back(landmark.tries);
    out.hits.push_back(landmark.hits);
    out.measured.push_back(landmark.measured);
    out.last_measured_ns.push_back(landmark.last_measured_ns);
    out.last_visible_ns.push_back(landmark.last_measured_ns);
    out.converted.push_back(landmark.point.converted ? 1 : 0);
    out.point.push_back(point_to(landmark.point));
    out.first_converted.push_back(landmark.first.converted ? 1 : 0);
    out.first_point.push_back(point_to(landmark.first));
  }
  const Eigen::MatrixXd& p = snapshot.covariance;
  out.dim = static_cast<std::int32_t>(p.rows());
  for (Eigen::Index i = 0; i < p.rows(); ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) out.covariance.push_back(p(i, j));
  }
  out.covariance_size = static_cast<std::int32_t>(out.covariance.size());
  return out;
}

SlamFile from_message(const slam_state_t& m) {
  SlamFile out;
  out.motion = m.inertial != 0 ? SlamMotion::kInertial : SlamMotion::kConstantVelocity;
  out.options = m.options;
  out.camera = camera_from(m);
  SlamSnapshot& snapshot = out.snapshot;
  if (m.time_ns == kNoTime) throw DataError("time_ns = INT64_MIN: the state has no time");
  snapshot.time_ns = m.time_ns;
  SlamState& state = snapshot.state;
  state.q_world_body = quaternion_from(m.q_world_body_wxyz, "q_world_body_wxyz");
  state.position = vector_from(m.position);
  state.velocity = vector_from(m.velocity);
  state.gyroscope_bias = vector_from(m.gyroscope_bias);
  state.accelerometer_bias = vector_from(m.accelerometer_bias);
  state.angular_velocity = vector_from(m.angular_velocity);
  state.T_body_camera = {quaternion_from(m.estimated_camera_wxyz, "estimated_camera_wxyz"),
                         vector_from(m.estimated_camera_position)};
  state.time_offset_s = m.estimated_time_offset_s;

  int features_dim = 0;
  for (std::size_t i = 0; i < m.feature_id.size(); ++i) {
    SlamLandmark& landmark = snapshot.landmarks.emplace_back();
    landmark.id = m.feature_id[i];
    landmark.known = m.known[i] != 0;
    landmark.tries = m.tries[i];
    landmark.hits = m.hits[i];
    landmark.measured = m.measured[i];
    landmark.last_measured_ns = m.last_measured_ns[i];
    landmark.point = point_from(m.converted[i] != 0, m.point[i], "point");
    landmark.first = point_from(m.first_converted[i] != 0, m.first_point[i], "first_point");
    features_dim += landmark.point.dim();
  }
  const std::int64_t dim = m.dim;
  // Of the body; with the camera's place (6) or its clock (1), where they are estimated.
  const std::int64_t more = dim - features_dim - (m.inertial != 0 ? kInertialDim : kAngularVelocity + 3);
  const bool head_fits = more == 0 || more == 1 || more == 6 || more == 7;
  if (!head_fits || m.covariance_size != dim * (dim + 1) / 2) {
    throw DataError("dim = " + std::to_string(dim) + " does not fit " + std::to_string(m.covariance_size) +
                    " numbers of the covariance and features of " + std::to_string(features_dim));
  }
  int offset = static_cast<int>(dim) - features_dim;
  for (SlamLandmark& landmark : snapshot.landmarks) {
    landmark.offset = offset;
    offset += landmark.point.dim();
  }
  snapshot.covariance.resize(dim, dim);
  std::size_t next = 0;
  for (Eigen::Index i = 0; i < dim; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      snapshot.covariance(i, j) = snapshot.covariance(j, i) = m.covariance[next++];
    }
  }
  if (!snapshot.covariance.allFinite()) throw DataError("covariance: is not finite");
  return out;
}

std::uint32_t checksum(std::span<const std::uint8_t> bytes) {
  return static_cast<std::uint32_t>(::crc32_z(::crc32_z(0, nullptr, 0), bytes.data(), bytes.size()));
}

void append_big_endian(std::string& out, std::uint64_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) out += static_cast<char>(value >> (8 * i) & 0xff);
}
std::uint64_t big_endian(std::span<const std::uint8_t> bytes) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes) value = value << 8U | byte;
  return value;
}

std::vector<std::uint8_t> read_bytes(const std::filesystem::path& path) {
  if (!std::filesystem::exists(io::status_of(path))) throw DataError(path.string() + ": no such file");
  const std::uint64_t size = io::size_of(path);
  if (size > kLargestMessage + kHeadBytes) throw DataError(path.string() + ": larger than such a file can be");
  std::vector<std::uint8_t> bytes(size);
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!file) throw DataError(path.string() + ": cannot be read");
  return bytes;
}

}  // namespace

void save_slam(const std::filesystem::path& path, const SlamSnapshot& snapshot, const SlamOptions& options) {
  require(snapshot.time_ns != kNoTime, "snapshot: has no time, the filter has not started");
  require(snapshot.covariance.rows() == snapshot.covariance.cols(), "snapshot: the covariance is not square");
  const slam_state_t message = to_message(snapshot, options);
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  if (message.encode(bytes.data(), 0, static_cast<int>(bytes.size())) != static_cast<int>(bytes.size())) {
    throw DataError(path.string() + ": the state could not be encoded");
  }
  std::string head(kMagic);
  append_big_endian(head, bytes.size(), 8);
  append_big_endian(head, checksum(bytes), 4);
  io::AtomicFile file(path);
  file.stream() << head;
  file.stream().write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  file.commit();
}

SlamFile load_slam(const std::filesystem::path& path) {
  const std::vector<std::uint8_t> bytes = read_bytes(path);
  const std::span<const std::uint8_t> all(bytes);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::string_view family = kMagic.substr(0, kMagic.size() - 1);
  if (!text.starts_with(family)) throw DataError(path.string() + ": is no saved state of SLAM");
  if (!text.starts_with(kMagic)) {
    throw DataError(path.string() + ": has format " + std::string(text.substr(0, 8)) + ", " + std::string(kMagic) +
                    " can be read");
  }
  if (bytes.size() < kHeadBytes) throw DataError(path.string() + ": cut within its first bytes");
  const std::uint64_t size = big_endian(all.subspan(8, 8));
  const auto message = all.subspan(kHeadBytes);
  if (message.size() != size) {
    throw DataError(path.string() + ": holds " + std::to_string(message.size()) + " bytes of " + std::to_string(size) +
                    (message.size() < size ? ": it was cut" : ": something was added"));
  }
  if (checksum(message) != big_endian(all.subspan(16, 4))) {
    throw DataError(path.string() + ": the checksum does not match: it was changed");
  }
  try {
    return from_message(decode_message<slam_state_t>(message));
  } catch (const DataError& error) {
    throw DataError(path.string() + ": " + error.what());
  } catch (const std::invalid_argument& error) {
    throw DataError(path.string() + ": " + error.what());
  }
}

std::string why_not_restorable(const SlamFile& file, const SlamOptions& options) {
  if (file.motion != options.motion) {
    return file.motion == SlamMotion::kInertial ? "it was made with an IMU" : "it was made without an IMU";
  }
  const CameraCalibration& a = file.camera;
  const CameraCalibration& b = options.camera;
  const auto differ = [](double x, double y) { return std::abs(x - y) > 1e-6 * std::max(std::abs(x), std::abs(y)); };
  if (a.width_px != b.width_px || a.height_px != b.height_px) return "the picture has another size";
  if (a.distortion_model != b.distortion_model) return "the camera has another distortion model";
  for (Eigen::Index i = 0; i < 4; ++i) {
    if (differ(a.intrinsics_px[i], b.intrinsics_px[i])) return "the camera has other intrinsics";
    if (std::abs(a.distortion[i] - b.distortion[i]) > 1e-9) return "the camera has another distortion";
  }
  if ((a.T_body_camera.translation - b.T_body_camera.translation).norm() > 1e-6 ||
      a.T_body_camera.rotation.angularDistance(b.T_body_camera.rotation) > 1e-6) {
    return "the camera sits elsewhere in the body";
  }
  return {};
}

}  // namespace loc
