#include "libloc/sim/camera.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

// Distance over depth, at the edge of the widest lens without fisheye that is of use.
constexpr double kFarthest = 6;

void require_share(const char* name, double value) {
  require(value >= 0 && value <= 1, name, value, "must be in [0, 1]");
}

}  // namespace

void CameraModel::check() const {
  require(rate_hz > 0 && rate_hz <= 1e5, "rate_hz", rate_hz, "must be in (0, 1e5]");
  require(start_time_ns != kNoTime, "start_time_ns: must be a time");
  require_not_negative("stamp_jitter_s", stamp_jitter_s);
  require_not_negative("sigma_px", sigma_px);
  require_not_negative("border_px", border_px);
  require_not_negative("min_depth_m", min_depth_m);
  require(max_depth_m > min_depth_m, "max_depth_m", max_depth_m, "must be greater than min_depth_m");
  require_not_negative("min_separation_px", min_separation_px);
  require(max_features >= 0, "max_features", max_features, "must not be negative");
  require_share("outlier_rate", outlier_rate);
  require_share("wrong_id_rate", wrong_id_rate);
  require_share("loss_rate", loss_rate);
  require_share("reappear_rate", reappear_rate);
  require_share("new_id_rate", new_id_rate);
}

CameraSimulator::CameraSimulator(const CameraModel& model, const CameraCalibration& calibration, Scene scene,
                                 Random random, std::int32_t camera_index)
    : model_((model.check(), model)),
      calibration_(calibration),
      camera_(calibration),
      scene_((scene.check(), std::move(scene))),
      camera_index_(camera_index),
      noise_(random.fork(0)),
      outliers_(random.fork(1)),
      identities_(random.fork(2)),
      tracking_(random.fork(3)),
      stamps_(random.fork(4)),
      tracks_(scene_.points.size()),
      in_view_(scene_.points.size()),
      next_id_(std::ssize(scene_.points)) {
  require(camera_index >= 0, "camera_index", camera_index, "must not be negative");
}

// Which points are seen, and where.
void CameraSimulator::look(const Pose3& T_world_camera) {
  const Pose3 T_camera_world = T_world_camera.inverse();
  const SightLines sight(scene_, T_world_camera.translation, kFarthest * model_.max_depth_m);
  const bool fisheye = calibration_.distortion_model == DistortionModel::kEquidistant;
  for (std::size_t i = 0; i < scene_.points.size(); ++i) {
    ObservationTruth& seen = in_view_[i];
    seen = {};
    const Eigen::Vector3d p = T_camera_world * scene_.points[i].position;
    const double range = fisheye ? p.norm() : p.z();
    if (!(range >= model_.min_depth_m && range <= model_.max_depth_m)) continue;
    const auto pixel = camera_.project(p);
    if (!pixel || !camera_.in_image(*pixel, model_.border_px)) continue;
    if (model_.occlusion && !sight.reach(scene_.points[i])) continue;
    seen.point = static_cast<std::int64_t>(i);
    seen.pixel_px = *pixel;
    seen.depth_m = p.z();
  }
}

void CameraSimulator::update_tracks() {
  std::vector<std::size_t> candidates;
  taken_.clear();
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    Track& track = tracks_[i];
    const bool seen = in_view_[i].point >= 0;
    if (track.status == Status::kTracked && (!seen || tracking_.uniform() < model_.loss_rate)) {
      track.status = Status::kLost;
    } else if (seen && (track.status == Status::kNew ||
                        (track.status == Status::kLost && tracking_.uniform() < model_.reappear_rate))) {
      candidates.push_back(i);
    }
    if (track.status == Status::kTracked) taken_.push_back(in_view_[i].pixel_px);
  }
  std::size_t room = candidates.size();
  if (model_.max_features > 0) {
    const auto limit = static_cast<std::size_t>(model_.max_features);
    room = std::min(room, limit - std::min(limit, taken_.size()));
  }
  fill_up(candidates, room);
}

bool CameraSimulator::has_space(const Eigen::Vector2d& pixel) const {
  const double square = model_.min_separation_px * model_.min_separation_px;
  return std::ranges::none_of(taken_, [&](const Eigen::Vector2d& p) { return (p - pixel).squaredNorm() < square; });
}

// Takes so many of the candidates, any of them that have space.
void CameraSimulator::fill_up(std::vector<std::size_t>& candidates, std::size_t room) {
  for (std::size_t k = 0; k < candidates.size() && room > 0; ++k) {
    const auto left = static_cast<double>(candidates.size() - k);
    std::swap(candidates[k], candidates[k + static_cast<std::size_t>(tracking_.uniform() * left)]);
    const std::size_t i = candidates[k];
    if (!has_space(in_view_[i].pixel_px)) continue;
    Track& track = tracks_[i];
    if (track.status == Status::kNew) {
      track.id = static_cast<std::int64_t>(i);
    } else if (tracking_.uniform() < model_.new_id_rate) {
      track.id = next_id_++;
    }
    track.status = Status::kTracked;
    taken_.push_back(in_view_[i].pixel_px);
    --room;
  }
}

void CameraSimulator::disturb(SimulatedFrame& frame) {
  std::vector<FeatureObservation>& features = frame.measurement.features;
  for (std::size_t k = 0; k < features.size(); ++k) {
    // A number is drawn whether it is used or not: what follows stays the same when a rate changes.
    const double draw = outliers_.uniform();
    const double u = outliers_.uniform(-0.5, camera_.width_px() - 0.5);
    const double v = outliers_.uniform(-0.5, camera_.height_px() - 0.5);
    if (draw >= model_.outlier_rate) continue;
    features[k].pixel_px = {u, v};
    frame.truth[k].outlier = true;
  }
  for (std::size_t k = 0; k < features.size(); ++k) {
    const double draw = identities_.uniform();
    const auto other = static_cast<std::size_t>(identities_.uniform() * static_cast<double>(features.size()));
    // A change makes two wrong ones.
    if (draw >= model_.wrong_id_rate / 2 || other == k) continue;
    std::swap(features[k].id, features[other].id);
  }
  for (std::size_t k = 0; k < features.size(); ++k) {
    frame.truth[k].wrong_id = features[k].id != tracks_[static_cast<std::size_t>(frame.truth[k].point)].id;
  }
}

SimulatedFrame CameraSimulator::observe(const MotionState& state) {
  require(std::isfinite(state.time_s) && state.time_s > last_time_s_, "time_s", state.time_s,
          "must be finite and increase from frame to frame");
  last_time_s_ = state.time_s;
  SimulatedFrame frame;
  frame.time_s = state.time_s;
  frame.T_world_camera = state.T_world_body * calibration_.T_body_camera;
  frame.measurement.time_ns = model_.start_time_ns + from_seconds(state.time_s - calibration_.time_offset_s +
                                                                  model_.stamp_jitter_s * stamps_.normal());
  frame.measurement.sequence = sequence_++;
  frame.measurement.camera = camera_index_;
  frame.measurement.sigma_px = model_.sigma_px;

  look(frame.T_world_camera);
  update_tracks();
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (tracks_[i].status != Status::kTracked) continue;
    // One statement each: the order in which arguments are evaluated is not specified.
    const double du = model_.sigma_px * noise_.normal();
    const double dv = model_.sigma_px * noise_.normal();
    const Eigen::Vector2d pixel = in_view_[i].pixel_px + Eigen::Vector2d(du, dv);
    if (!camera_.in_image(pixel)) continue;
    frame.measurement.features.push_back({tracks_[i].id, pixel});
    frame.truth.push_back(in_view_[i]);
  }
  disturb(frame);
  return frame;
}

std::vector<SimulatedFrame> simulate_camera(const Motion& motion, const CameraModel& model,
                                            const CameraCalibration& calibration, const Scene& scene, Random random,
                                            double duration_s) {
  CameraSimulator simulator(model, calibration, scene, random);
  const double duration = std::isnan(duration_s) ? motion.duration_s() : std::min(duration_s, motion.duration_s());
  require(std::isfinite(duration) && duration >= 0, "duration_s", duration,
          "must be given for a motion without end, and not negative");
  std::vector<SimulatedFrame> frames;
  for (std::int64_t i = 0;; ++i) {
    const double t = static_cast<double>(i) / model.rate_hz;
    if (t > duration) return frames;
    frames.push_back(simulator.observe(motion.at(t)));
  }
}

}  // namespace loc
