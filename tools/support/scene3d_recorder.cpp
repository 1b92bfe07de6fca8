#include "tools/support/scene3d_recorder.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <set>
#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/geometry/alignment.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/vision/image_codec.hpp"
#include "loc/estimator_status_t.hpp"
#include "msgs/convert.hpp"
#include "msgs/slam_messages.hpp"

namespace loc {
namespace {

constexpr const char* kEstimatorStatusChannel = "LOC_ESTIMATOR_STATUS";
constexpr std::size_t kPictures = 8;
constexpr std::size_t kMaxAnchors = 20'000;
constexpr double kStatusHoldsS = 3;             // it is sent once a second
constexpr TimeNs kMaxSpacing = 60'000'000'000;  // of a track's points
constexpr TimeNs kPairedWithin = 300'000'000;   // of GPS and reference with the trajectory, on both sides

bool is_used(SlamFeatureState state) {
  return state == SlamFeatureState::kMeasured || state == SlamFeatureState::kRescued || state == SlamFeatureState::kNew;
}

// What of an estimate's status a person should see; an estimator_status_t says more.
std::vector<std::string> warnings_of(std::uint32_t status) {
  constexpr std::array kWords = {std::pair{kLost, "lost"},
                                 std::pair{kNoImages, "no images"},
                                 std::pair{kNoImu, "no IMU"},
                                 std::pair{kNoGps, "no GPS"},
                                 std::pair{kFewFeatures, "few features"},
                                 std::pair{kCalibrationDoubtful, "calibration doubtful"},
                                 std::pair{kTiltDoubtful, "tilt doubtful"}};
  std::vector<std::string> out;
  for (const auto& [bit, word] : kWords) {
    if ((status & bit) != 0) out.emplace_back(word);
  }
  return out;
}

// Positions of the trajectory at the times of a track, where both are known.
struct Pairs {
  std::vector<Eigen::Vector3d> track;
  std::vector<Eigen::Vector3d> trajectory;
};

Pairs pair_up(const std::vector<TrackPoint>& track, const std::vector<TrackPoint>& trajectory) {
  Pairs out;
  for (const TrackPoint& p : track) {
    const auto after = std::lower_bound(trajectory.begin(), trajectory.end(), p.time_ns,
                                        [](const TrackPoint& q, TimeNs time) { return q.time_ns < time; });
    if (after == trajectory.end() || after == trajectory.begin()) continue;
    const auto before = after - 1;
    if (after->begins || after->doubtful) continue;
    if (time_between(before->time_ns, after->time_ns) > kPairedWithin) continue;
    const double share = to_seconds(p.time_ns - before->time_ns) / to_seconds(after->time_ns - before->time_ns);
    out.track.push_back(p.position);
    out.trajectory.push_back(before->position + share * (after->position - before->position));
  }
  return out;
}

std::optional<Alignment> lay_over(const std::vector<TrackPoint>& track, const std::vector<TrackPoint>& trajectory,
                                  bool metric) {
  const Pairs pairs = pair_up(track, trajectory);
  if (pairs.track.empty()) return std::nullopt;
  const Alignment out =
      align_points(pairs.track, pairs.trajectory, metric ? AlignmentMode::kYaw : AlignmentMode::kSim3);
  if (!out.ok()) return std::nullopt;
  return out;
}

}  // namespace

void SceneRecorder::Track::add(const TrackPoint& point, std::size_t max_points) {
  TrackPoint added = point;
  if (!points.empty()) {
    const TimeNs step = time_between(points.back().time_ns, point.time_ns);
    if (step < 0) added.begins = true;
    if (!added.begins && !(added.doubtful && !points.back().doubtful) && step < spacing_ns) return;
  }
  points.push_back(added);
  if (points.size() <= max_points) return;
  // Every second one, whatever it is: stamps of two sources that take turns begin anew with every point.
  std::size_t kept = 0;
  bool begins = false;
  for (std::size_t i = 0; i < points.size(); ++i) {
    begins = begins || points[i].begins;
    if (i % 2 != 0 && i + 1 != points.size()) continue;
    points[kept] = points[i];
    points[kept++].begins = std::exchange(begins, false);
  }
  points.resize(kept);
  spacing_ns = std::min(2 * spacing_ns, kMaxSpacing);
}

SceneRecorder::SceneRecorder(SceneRecorderOptions options) : options_(std::move(options)), decoder_(options_.decode) {
  if (options_.calibration) options_.calibration->check();
}

void SceneRecorder::take(std::string_view channel, std::span<const std::uint8_t> data, TimeNs receive_time_ns) {
  try {
    if (channel == options_.estimate_channel) {
      take_estimate(data);
    } else if (channel == kSlamFrameChannel) {
      take_frame(data);
    } else if (channel == kMapChannel) {
      take_map(data);
    } else if (channel == kFusionChannel) {
      take_fusion(data);
    } else if (channel == kEstimatorStatusChannel) {
      const auto m = decode_message<estimator_status_t>(data);
      conditions_ = m.condition;
      conditions_time_ns_ = m.measurement_time_ns;
    } else {
      take_measurement(channel, data, receive_time_ns);
    }
  } catch (const std::exception&) {
    ++counts_["undecodable:" + std::string(channel)];
  }
}

std::vector<std::string> SceneRecorder::channels() const {
  std::vector<std::string> out = {options_.estimate_channel, kSlamFrameChannel, kMapChannel, kFusionChannel,
                                  kEstimatorStatusChannel};
  for (const StreamKind kind : {StreamKind::kImage, StreamKind::kGps, StreamKind::kReference}) {
    const std::string& named = options_.decode.channels[static_cast<std::size_t>(kind)];
    out.push_back(named.empty() ? default_channel(kind) : named);
  }
  return out;
}

// False for a message that is to be left out.
bool SceneRecorder::follow(TimeNs time_ns) {
  switch (guard_.judge(time_ns)) {
    case StampGuard::Verdict::kGood:
      return true;
    case StampGuard::Verdict::kInstead:
      ++counts_["time.skipped.far_off"];
      trajectory_.points.clear();
      time_ns_ = first_time_ns_ = kNoTime;
      return true;
    case StampGuard::Verdict::kJumped:
      ++counts_["time.jumped"];
      return true;
    case StampGuard::Verdict::kFarOff:
      break;
  }
  ++counts_["time.skipped.far_off"];
  return false;
}

void SceneRecorder::advance(TimeNs time_ns) {
  time_ns_ = time_ns;
  if (first_time_ns_ == kNoTime) first_time_ns_ = time_ns;
}

void SceneRecorder::take_estimate(std::span<const std::uint8_t> data) {
  const auto message = decode_message<estimate_t>(data);
  Estimate newest = from_message(message);
  ++counts_["estimates"];
  if (!follow(newest.time_ns)) return;
  const Estimate before = std::exchange(estimate_, std::move(newest));
  if (time_ns_ != kNoTime && before.time_ns != kNoTime && estimate_.time_ns < before.time_ns) {
    ++counts_["time.stepped_back"];
  }
  pose_before_.reset();
  if ((before.valid & kValidPosition) != 0 && before.q_world_body.coeffs().allFinite() && before.position.allFinite()) {
    pose_before_ = Pose3{before.q_world_body, before.position};
  }
  unknown_scale_before_ = (before.status & kScaleUnknown) != 0;
  method_ = message.method;
  advance(estimate_.time_ns);
  if ((estimate_.valid & kValidPosition) == 0 || !estimate_.position.allFinite()) return;
  trajectory_.add({estimate_.time_ns, estimate_.position, (estimate_.status & kReinitialised) != 0,
                   (estimate_.status & kLost) != 0},
                  options_.max_track_points);
}

void SceneRecorder::take_fusion(std::span<const std::uint8_t> data) {
  const auto m = decode_message<fusion_t>(data);
  const GeodeticPoint origin{m.origin_latitude, m.origin_longitude, m.origin_altitude};
  if (!std::isfinite(origin.latitude + origin.longitude + origin.altitude)) {
    origin_.reset();
    return;
  }
  origin.check();
  const bool first = !origin_;
  origin_ = origin;
  if (!first || trajectory_.points.empty()) return;
  const bool metric = (estimate_.status & kScaleUnknown) == 0 && !unknown_scale_before_;
  if (metric && pose_before_ && estimate_.q_world_body.coeffs().allFinite() && estimate_.position.allFinite()) {
    move_into_world(Pose3{estimate_.q_world_body, estimate_.position} * pose_before_->inverse());
  } else {
    trajectory_.points.clear();
    anchors_.clear();
  }
}

void SceneRecorder::move_into_world(const Pose3& T_world_map) {
  for (TrackPoint& p : trajectory_.points) {
    if (p.time_ns < estimate_.time_ns) p.position = T_world_map * p.position;
  }
  for (auto& [id, anchor] : anchors_) anchor = T_world_map * anchor;
}

void SceneRecorder::take_frame(std::span<const std::uint8_t> data) {
  SlamFrame frame = from_message(decode_message<slam_frame_t>(data));
  ++counts_["frames"];
  if (!follow(frame.estimate.time_ns)) return;
  for (const SlamFeature& feature : frame.features) {
    if (feature.converted) {
      anchors_.erase(feature.id);
    } else if (feature.state == SlamFeatureState::kNew && frame.camera_position.allFinite()) {
      anchors_[feature.id] = frame.camera_position;
    }
  }
  // Identities grow: the first ones are the oldest.
  while (anchors_.size() > kMaxAnchors) anchors_.erase(anchors_.begin());
  if (time_ns_ == kNoTime || frame.estimate.time_ns > time_ns_) advance(frame.estimate.time_ns);
  frame_ = std::move(frame);
}

void SceneRecorder::take_map(std::span<const std::uint8_t> data) {
  const auto m = decode_message<map_points_t>(data);
  ++counts_["maps"];
  std::map<std::int64_t, MapPoint> map;
  for (std::size_t i = 0; i < m.point_id.size(); ++i) {
    const MapPoint point{Eigen::Vector3d(m.position[i].data()),
                         Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(m.position_cov[i].data())};
    if (point.position.allFinite() && point.covariance.allFinite()) {
      map.emplace(m.point_id[i], point);
    } else {
      ++counts_["map_points.skipped.not_finite"];
    }
  }
  std::set<std::int64_t> in_frame;
  if (frame_) {
    for (const SlamFeature& feature : frame_->features) in_frame.insert(feature.id);
  }
  std::erase_if(anchors_, [&](const auto& a) { return !map.contains(a.first) && !in_frame.contains(a.first); });
  map_ = std::move(map);
  const bool tied = origin_ && (estimate_.valid & kValidCovariance) != 0 && estimate_.covariance_dim >= 6;
  shared_cov_ = tied ? estimate_.covariance.block<3, 3>(3, 3).eval() : Eigen::Matrix3d::Zero().eval();
}

void SceneRecorder::take_measurement(std::string_view channel, std::span<const std::uint8_t> data,
                                     TimeNs receive_time_ns) {
  // The IMU is most of the messages, and nothing of it is shown.
  if (channel == default_channel(StreamKind::kImu)) return;
  const auto measurement = decoder_.decode(channel, data, receive_time_ns);
  if (!measurement) return;
  if (const auto* image = std::get_if<ImageMeasurement>(&*measurement)) {
    if (image->camera != options_.camera) return;
    ++counts_["pictures"];
    pictures_.push_back(*image);
    if (pictures_.size() > kPictures) pictures_.pop_front();
  } else if (const auto* fix = std::get_if<GpsMeasurement>(&*measurement)) {
    take_gps(*fix);
  } else if (const auto* reference = std::get_if<ReferenceMeasurement>(&*measurement)) {
    ++counts_["reference"];
    if (reference->position.allFinite()) {
      reference_.add({reference->time_ns, reference->position, false, false}, options_.max_track_points);
    }
  }
}

void SceneRecorder::take_gps(const GpsMeasurement& fix) {
  if (fix.fix < GpsFixType::k2d) return;
  const bool flat = !std::isfinite(fix.altitude);
  GeodeticPoint{fix.latitude, fix.longitude, flat ? 0 : fix.altitude}.check();
  gps_.add({fix.time_ns, {fix.latitude, fix.longitude, flat ? kUnknown : fix.altitude}, false, false},
           options_.max_track_points);
  ++counts_["gps"];
  if (flat) {
    ++counts_["gps.without_altitude"];
  } else if (!first_altitude_) {
    first_altitude_ = fix.altitude;
  }
}

Scene3d SceneRecorder::scene() const {
  Scene3d scene;
  const bool unknown_scale =
      (estimate_.status & kScaleUnknown) != 0 || (frame_ && (frame_->estimate.status & kScaleUnknown) != 0);
  scene.metric = !unknown_scale;
  scene.trajectory = trajectory_.points;
  if ((estimate_.valid & kValidOrientation) != 0) {
    const bool placed = (estimate_.valid & kValidPosition) != 0 && estimate_.position.allFinite();
    scene.body = Pose3{estimate_.q_world_body, placed ? estimate_.position : Eigen::Vector3d::Zero().eval()};
    if (placed && (estimate_.valid & kValidCovariance) != 0 && estimate_.covariance_dim >= 6) {
      scene.position_cov = estimate_.covariance.block<3, 3>(3, 3);
    }
  }
  if (frame_ && frame_->camera == options_.camera && frame_->camera_position.allFinite() &&
      frame_->q_world_camera.coeffs().allFinite()) {
    scene.camera.emplace();
    scene.camera->T_world_camera = {frame_->q_world_camera, frame_->camera_position};
    if (options_.calibration) {
      const CameraCalibration& c = *options_.calibration;
      const Eigen::Vector4d& f = c.intrinsics_px;
      scene.camera->tangents << (f[2] + 0.5) / f[0], (c.width_px - 0.5 - f[2]) / f[0], (f[3] + 0.5) / f[1],
          (c.height_px - 0.5 - f[3]) / f[1];
    }
  }
  add_points(scene);
  add_reference(scene);
  add_gps(scene);
  add_picture(scene);
  add_text(scene);
  return scene;
}

void SceneRecorder::add_points(Scene3d& scene) const {
  std::set<std::int64_t> used;
  if (frame_) {
    for (const SlamFeature& feature : frame_->features) {
      if (is_used(feature.state)) used.insert(feature.id);
    }
  }
  for (const auto& [id, point] : map_) {
    const Eigen::Matrix3d covariance = point.covariance - shared_cov_;
    ScenePoint out{id, point.position, covariance, used.contains(id), {}};
    if (const auto anchor = anchors_.find(id); anchor != anchors_.end()) {
      const Eigen::Vector3d ray = point.position - anchor->second;
      const double distance = ray.norm();
      if (distance > 0) {
        // The covariance is that of the inverse depth, taken to a point by its derivative, 1 / rho^2.
        const double sigma = std::sqrt(std::max(0.0, ray.dot(covariance * ray))) / distance;
        out.ray = SceneRay{anchor->second, 1 / distance, sigma / (distance * distance)};
      }
    }
    scene.points.push_back(out);
  }
}

void SceneRecorder::add_reference(Scene3d& scene) const {
  if (reference_.points.empty()) return;
  const auto laid = lay_over(reference_.points, trajectory_.points, scene.metric);
  if (!laid) {
    scene.reference_note = "cannot be laid over the trajectory yet";
    return;
  }
  scene.reference_note = fmt::format("aligned, {:.3g} {} RMS", laid->rms_residual, scene.metric ? "m" : "units");
  // Only as far as the trajectory goes: what comes later is not known yet to the estimator.
  for (TrackPoint p : reference_.points) {
    if (p.time_ns < trajectory_.points.front().time_ns || p.time_ns > time_ns_) continue;
    p.position = *laid * p.position;
    scene.reference.push_back(p);
  }
}

void SceneRecorder::add_gps(Scene3d& scene) const {
  if (gps_.points.empty()) return;
  const double height = origin_ ? origin_->altitude : first_altitude_.value_or(0);
  const Eigen::Vector3d& first = gps_.points.front().position;
  const GeodeticPoint zero = origin_.value_or(GeodeticPoint{first.x(), first.y(), height});
  const Eigen::Matrix3d R_local_earth = R_earth_enu(zero).transpose();
  const Eigen::Vector3d zero_in_earth = earth_from_geodetic(zero);
  std::vector<TrackPoint> local = gps_.points;
  for (TrackPoint& p : local) {
    const double altitude = std::isfinite(p.position.z()) ? p.position.z() : height;
    p.position = R_local_earth * (earth_from_geodetic({p.position.x(), p.position.y(), altitude}) - zero_in_earth);
  }
  if (origin_) {
    scene.gps_note = "as measured";
    for (const TrackPoint& p : local) scene.gps.push_back(p.position);
    return;
  }
  const auto laid = lay_over(local, trajectory_.points, scene.metric);
  if (!laid) {
    scene.gps_note = "cannot be laid over the trajectory yet";
    return;
  }
  scene.gps_note = fmt::format("aligned, {:.3g} {} RMS", laid->rms_residual, scene.metric ? "m" : "units");
  for (const TrackPoint& p : local) scene.gps.push_back(*laid * p.position);
}

void SceneRecorder::add_picture(Scene3d& scene) const {
  const ImageMeasurement* picture = pictures_.empty() ? nullptr : &pictures_.back();
  if (frame_ && frame_->camera == options_.camera) {
    for (const ImageMeasurement& p : pictures_) {
      if (p.sequence != frame_->sequence) continue;
      picture = &p;
      scene.features = frame_->features;
    }
  }
  if (picture == nullptr) return;
  try {
    scene.picture = decode_image(*picture, PixelFormat::kBgr);
  } catch (const std::exception&) {
    scene.features.clear();
    scene.warnings.emplace_back("the picture is damaged");
  }
}

void SceneRecorder::add_text(Scene3d& scene) const {
  if (time_ns_ == kNoTime) {
    scene.lines.emplace_back("no estimate yet");
    return;
  }
  scene.lines.push_back(fmt::format("t = {:.2f} s  {}", to_seconds(time_between(first_time_ns_, time_ns_)), method_));
  const char* unit = scene.metric ? "m" : "units";
  if (scene.position_cov.allFinite()) {
    scene.lines.push_back(
        fmt::format("position sigma {:.3g} {}", std::sqrt(std::max(0.0, scene.position_cov.trace())), unit));
  }
  if (frame_) {
    scene.lines.push_back(fmt::format("map {}  seen {}  used {}  rejected {}", frame_->counts.map,
                                      frame_->counts.visible, frame_->counts.measured, frame_->counts.rejected));
    if (std::isfinite(frame_->reprojection_after_px)) {
      scene.lines.push_back(fmt::format("reprojection {:.2f} px", frame_->reprojection_after_px));
    }
  }
  if (!scene.metric) scene.lines.emplace_back("scale unknown: lengths in a unit of their own");
  const bool status_holds = conditions_time_ns_ != kNoTime &&
                            std::abs(to_seconds(time_between(conditions_time_ns_, time_ns_))) < kStatusHoldsS;
  std::vector<std::string> words = status_holds ? conditions_ : warnings_of(estimate_.status);
  scene.warnings.insert(scene.warnings.begin(), words.begin(), words.end());
}

NamedCounts SceneRecorder::counts() const {
  NamedCounts out;
  for (const auto& [name, value] : counts_) out.push_back({name, value});
  for (const NamedCount& count : decoder_.counts()) out.push_back(count);
  return out;
}

std::int64_t SceneRecorder::undecodable() const {
  std::int64_t out = 0;
  for (const auto& [name, value] : counts_) {
    if (name.starts_with("undecodable:")) out += value;
  }
  return out;
}

}  // namespace loc
