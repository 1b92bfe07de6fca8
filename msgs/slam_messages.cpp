#include "msgs/slam_messages.hpp"

#include <algorithm>
#include <limits>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

std::int32_t count_to(std::int64_t count) {
  return static_cast<std::int32_t>(std::min<std::int64_t>(count, std::numeric_limits<std::int32_t>::max()));
}

Eigen::Quaterniond quaternion_from(const double* wxyz) {
  return {wxyz[0], wxyz[1], wxyz[2], wxyz[3]};
}

template <class Vector>
void require_size(const Vector& values, std::int32_t size, const char* field) {
  if (size < 0 || values.size() != static_cast<std::size_t>(size)) {
    throw DataError("slam_frame_t.size = " + std::to_string(size) + ": there are " + std::to_string(values.size()) +
                    " of " + field);
  }
}

}  // namespace

slam_frame_t to_message(const SlamFrame& frame) {
  slam_frame_t out{};
  out.time_ns = frame.time_ns;
  out.host_time_ns = frame.host_time_ns;
  out.sequence = frame.sequence;
  out.camera = frame.camera;
  out.scale_known = (frame.estimate.status & kScaleUnknown) == 0 ? 1 : 0;
  out.time_spent_s = frame.time_spent_s;
  out.in_frame = count_to(frame.counts.in_frame);
  out.visible = count_to(frame.counts.visible);
  out.measured = count_to(frame.counts.measured);
  out.rescued = count_to(frame.counts.rescued);
  out.rejected = count_to(frame.counts.rejected);
  out.added = count_to(frame.counts.added);
  out.converted = count_to(frame.counts.converted);
  out.deleted = count_to(frame.counts.deleted);
  out.map_size = count_to(frame.counts.map);
  out.reprojection_before_px = frame.reprojection_before_px;
  out.reprojection_after_px = frame.reprojection_after_px;
  out.nis = frame.nis;
  out.nis_dim = frame.nis_dim;
  for (int i = 0; i < 3; ++i) out.camera_position[i] = frame.camera_position[i];
  const Eigen::Quaterniond& q = frame.q_world_camera;
  const Eigen::Vector4d wxyz(q.w(), q.x(), q.y(), q.z());
  for (int i = 0; i < 4; ++i) out.q_world_camera_wxyz[i] = wxyz[i];
  out.size = static_cast<std::int32_t>(frame.features.size());
  for (const SlamFeature& feature : frame.features) {
    out.feature_id.push_back(feature.id);
    out.feature_state.push_back(static_cast<std::int8_t>(feature.state));
    out.feature_converted.push_back(feature.converted ? 1 : 0);
    out.u_px.push_back(feature.pixel_px.x());
    out.v_px.push_back(feature.pixel_px.y());
    out.predicted_u_px.push_back(feature.predicted_px.x());
    out.predicted_v_px.push_back(feature.predicted_px.y());
    out.estimated_u_px.push_back(feature.estimated_px.x());
    out.estimated_v_px.push_back(feature.estimated_px.y());
    const Eigen::Matrix2d& s = feature.innovation_cov;
    out.innovation_cov.push_back({s(0, 0), s(0, 1), s(1, 1)});
    out.inverse_depth.push_back(feature.inverse_depth);
    out.sigma_inverse_depth.push_back(feature.sigma_inverse_depth);
  }
  return out;
}

SlamFrame from_message(const slam_frame_t& m) {
  if (m.time_ns == kNoTime) throw DataError("slam_frame_t.time_ns = INT64_MIN: a frame must have a time");
  require_size(m.feature_id, m.size, "feature_id");
  require_size(m.feature_state, m.size, "feature_state");
  require_size(m.feature_converted, m.size, "feature_converted");
  for (const auto* values : {&m.u_px, &m.v_px, &m.predicted_u_px, &m.predicted_v_px, &m.estimated_u_px,
                             &m.estimated_v_px, &m.inverse_depth, &m.sigma_inverse_depth}) {
    require_size(*values, m.size, "a feature's numbers");
  }
  require_size(m.innovation_cov, m.size, "innovation_cov");
  SlamFrame out;
  out.time_ns = m.time_ns;
  out.host_time_ns = m.host_time_ns;
  out.sequence = m.sequence;
  out.camera = m.camera;
  out.estimate.time_ns = m.time_ns;
  out.estimate.host_time_ns = m.host_time_ns;
  out.estimate.sequence = m.sequence;
  if (m.scale_known == 0) out.estimate.status = kScaleUnknown;
  out.time_spent_s = m.time_spent_s;
  out.counts = {.in_frame = m.in_frame,
                .visible = m.visible,
                .measured = m.measured,
                .rescued = m.rescued,
                .rejected = m.rejected,
                .added = m.added,
                .converted = m.converted,
                .deleted = m.deleted,
                .map = m.map_size};
  out.reprojection_before_px = m.reprojection_before_px;
  out.reprojection_after_px = m.reprojection_after_px;
  out.nis = m.nis;
  out.nis_dim = m.nis_dim;
  out.camera_position = Eigen::Map<const Eigen::Vector3d>(m.camera_position);
  out.q_world_camera = quaternion_from(m.q_world_camera_wxyz);
  for (std::size_t i = 0; i < m.feature_id.size(); ++i) {
    const std::int8_t state = m.feature_state[i];
    if (state < slam_frame_t::STATE_PREDICTED || state > slam_frame_t::STATE_NEW) {
      throw DataError("slam_frame_t.feature_state = " + std::to_string(state) + ": is not known");
    }
    if (m.innovation_cov[i].size() != 3) throw DataError("slam_frame_t.innovation_cov: must be three numbers each");
    SlamFeature& feature = out.features.emplace_back();
    feature.id = m.feature_id[i];
    feature.state = static_cast<SlamFeatureState>(state);
    feature.converted = m.feature_converted[i] != 0;
    feature.pixel_px = {m.u_px[i], m.v_px[i]};
    feature.predicted_px = {m.predicted_u_px[i], m.predicted_v_px[i]};
    feature.estimated_px = {m.estimated_u_px[i], m.estimated_v_px[i]};
    const auto& s = m.innovation_cov[i];
    feature.innovation_cov << s[0], s[1], s[1], s[2];
    feature.inverse_depth = m.inverse_depth[i];
    feature.sigma_inverse_depth = m.sigma_inverse_depth[i];
  }
  return out;
}

map_points_t to_message(const Stamp& stamp, std::span<const SlamMapPoint> map) {
  map_points_t out{};
  out.time_ns = stamp.time_ns;
  out.host_time_ns = stamp.host_time_ns;
  out.sequence = stamp.sequence;
  for (const SlamMapPoint& point : map) {
    if (!point.position.allFinite()) continue;
    out.point_id.push_back(point.id);
    out.position.push_back({point.position.x(), point.position.y(), point.position.z()});
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> cov = point.position_cov;
    out.position_cov.emplace_back(cov.data(), cov.data() + cov.size());
  }
  out.size = static_cast<std::int32_t>(out.point_id.size());
  return out;
}

}  // namespace loc
