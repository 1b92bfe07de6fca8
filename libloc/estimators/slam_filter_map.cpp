// The map of the SLAM filter: what joins it, what changes its form, what leaves it.
#include <algorithm>
#include <cmath>

#include "libloc/core/check.hpp"
#include "libloc/estimators/slam_filter.hpp"

namespace loc {
namespace {

constexpr std::size_t kFewDepths = 5;   // fewer known depths say nothing about the others
constexpr double kDepthTime = 1.5;      // over which the usual depth is averaged [s]
constexpr double kMostDepthPart = 0.1;  // of one frame in it
constexpr double kKnownDepth = 0.3;     // relative deviation of a depth that counts as known
constexpr double kBehindSigmas = 3;     // so far below zero an inverse depth is an error, not noise

}  // namespace

void SlamFilter::add_known_landmarks() {
  for (const KnownLandmark& known : options_.landmarks) {
    SlamLandmark& landmark = landmarks_.emplace_back();
    landmark.id = known.id;
    landmark.known = true;
    landmark.point.converted = true;
    landmark.point.position = known.position;
    landmark.first = landmark.point;
    const Eigen::MatrixXd none = Eigen::MatrixXd::Zero(3, layout_.dim);
    const Eigen::Matrix3d cov = known.sigma * known.sigma * Eigen::Matrix3d::Identity();
    landmark.offset = covariance_.append(none, cov);
  }
}

void SlamFilter::remove_marked() {
  ranges_.clear();
  int removed = 0;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    SlamLandmark& landmark = landmarks_[i];
    const int dim = landmark.point.dim();
    if (marked_[i] != 0) {
      ranges_.push_back({landmark.offset, dim});
      removed += dim;
      continue;
    }
    landmark.offset -= removed;
    if (kept != i) landmarks_[kept] = landmark;
    ++kept;
  }
  frame_.counts.deleted += static_cast<std::int64_t>(landmarks_.size() - kept);
  landmarks_.resize(kept);
  covariance_.remove(ranges_);
}

void SlamFilter::delete_landmarks() {
  marked_.assign(landmarks_.size(), 0);
  bool any = false;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    const SlamLandmark& landmark = landmarks_[i];
    if (landmark.known) continue;
    if (waits_below_cover(landmark)) continue;
    bool leave = landmark.tries >= options_.map.delete_after_tries &&
                 landmark.hits < options_.map.delete_below_ratio * landmark.tries;
    if (!landmark.point.converted) {
      const int at = landmark.offset + kInverseDepth;
      const double sigma = std::sqrt(std::max(0.0, covariance_(at, at)));
      leave = leave || landmark.point.inverse_depth.inverse_depth < -kBehindSigmas * sigma;
    }
    marked_[i] = leave ? 1 : 0;
    any = any || leave;
  }
  if (any) remove_marked();
}

void SlamFilter::convert_landmarks() {
  if (options_.map.max_linearity_index <= 0) return;
  ranges_.clear();
  int removed = 0;
  for (SlamLandmark& landmark : landmarks_) {
    const int offset = landmark.offset;  // where it still is in the covariance
    landmark.offset -= removed;
    if (landmark.point.converted) continue;
    const int at = offset + kInverseDepth;
    const double sigma = std::sqrt(std::max(0.0, covariance_(at, at)));
    const InverseDepthPoint point = landmark.point.inverse_depth;
    if (!(linearity_index(point, sigma, frame_.camera_position) < options_.map.max_linearity_index)) continue;
    const bool first = options_.consistency == SlamConsistency::kFirstEstimate;
    InverseDepthPoint at_first = landmark.first.inverse_depth;
    at_first.inverse_depth = point.inverse_depth;
    covariance_.replace(offset, (first ? at_first : point).xyz_jacobian());
    landmark.point.converted = true;
    landmark.point.position = point.xyz();
    landmark.first.converted = true;
    landmark.first.position = at_first.xyz();
    ranges_.push_back({offset + 3, kInverseDepthDim - 3});
    removed += kInverseDepthDim - 3;
    ++frame_.counts.converted;
  }
  covariance_.remove(ranges_);
}

// The median of what is known. A camera alone averages that of what it sees over time: what is known best is not what
// comes next (on a road it is far away), and its unit of lengths hangs on it; with an IMU, which makes metres of it,
// the latest is the best. Where nothing of what is known is seen, as after the camera was lost, what was usual counts:
// surroundings stay of one size.
double SlamFilter::usual_inverse_depth() {
  depths_.clear();
  for (const SlamLandmark& landmark : landmarks_) {
    const bool seen = landmark.last_measured_frame == frames_ && landmark.first_frame < frames_;
    if (!(layout_.inertial ? landmark.visible : seen)) continue;
    if (landmark.point.converted) {
      depths_.push_back(1 / (landmark.point.position - frame_.camera_position).norm());
      continue;
    }
    const int at = landmark.offset + kInverseDepth;
    const double rho = landmark.point.inverse_depth.inverse_depth;
    if (std::sqrt(std::max(0.0, covariance_(at, at))) < kKnownDepth * rho) depths_.push_back(rho);
  }
  const bool sees = frame_.counts.measured >= static_cast<std::int64_t>(kFewDepths);
  if (depths_.size() < kFewDepths || !sees) return std::exp(usual_log_inverse_depth_);  // NaN: none yet
  const auto middle = depths_.begin() + static_cast<std::ptrdiff_t>(depths_.size() / 2);
  std::nth_element(depths_.begin(), middle, depths_.end());
  const double now = std::log(*middle);
  if (usual_depth_ns_ == kNoTime) usual_log_inverse_depth_ = now;
  const double since = usual_depth_ns_ == kNoTime ? 0 : std::abs(apart_s(time_ns_, usual_depth_ns_));
  usual_log_inverse_depth_ += std::min(since / kDepthTime, kMostDepthPart) * (now - usual_log_inverse_depth_);
  usual_depth_ns_ = time_ns_;
  return layout_.inertial ? *middle : std::exp(usual_log_inverse_depth_);
}

bool SlamFilter::add_landmark(const FeatureObservation& observation, double inverse_depth, double sigma) {
  const double pixel_sigma = std::isfinite(frame_sigma_px_) ? frame_sigma_px_ : options_.sigma_px;
  const auto birth = make_feature(state_, layout_, camera_, observation.pixel_px, pixel_sigma, inverse_depth, sigma);
  if (!birth) return false;
  SlamLandmark& landmark = landmarks_.emplace_back();
  landmark = SlamLandmark{};
  landmark.id = observation.id;
  landmark.point.inverse_depth = birth->point;
  landmark.first = landmark.point;
  landmark.offset = covariance_.append(birth->head_jacobian.leftCols(layout_.dim), birth->noise_cov);
  landmark.tries = landmark.hits = 1;
  landmark.last_measured_ns = time_ns_;
  landmark.last_measured_frame = landmark.first_frame = frames_;
  landmark.visible = true;
  landmark.state = SlamFeatureState::kNew;
  landmark.predicted_px = observation.pixel_px;
  ++frame_.counts.added;
  return true;
}

// Who has not been measured for longest leaves, if anybody must.
void SlamFilter::make_room(int wanted) {
  const auto room = options_.map.max_features - static_cast<int>(landmarks_.size());
  int lack = wanted - room;
  if (lack <= 0) return;
  candidates_.clear();
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    const SlamLandmark& landmark = landmarks_[i];
    if (landmark.known || landmark.observation >= 0) continue;
    candidates_.push_back(static_cast<int>(i));
  }
  std::sort(candidates_.begin(), candidates_.end(), [&](int a, int b) {
    const SlamLandmark& x = landmarks_[static_cast<std::size_t>(a)];
    const SlamLandmark& y = landmarks_[static_cast<std::size_t>(b)];
    return std::pair(x.last_measured_frame, x.id) < std::pair(y.last_measured_frame, y.id);
  });
  marked_.assign(landmarks_.size(), 0);
  for (const int i : candidates_) {
    if (lack-- <= 0) break;
    marked_[static_cast<std::size_t>(i)] = 1;
  }
  remove_marked();
}

void SlamFilter::add_landmarks(const FeaturesMeasurement& frame) {
  const SlamMapOptions& map = options_.map;
  const int found = static_cast<int>(frame_.counts.measured);
  int wanted = std::min(map.min_visible, map.max_measured) - found;
  if (found > 0) wanted = std::min(wanted, map.max_added);
  // Nobody leaves for those who do not come.
  const auto offered = std::count_if(by_id_.begin(), by_id_.end(), [&](const auto& entry) {
    return taken_[static_cast<std::size_t>(entry.second)] == 0;
  });
  wanted = std::min(wanted, static_cast<int>(offered));
  candidates_.clear();
  if (wanted <= 0) return;
  make_room(wanted);
  wanted = std::min(wanted, map.max_features - static_cast<int>(landmarks_.size()));

  const double usual = map.depth_from_neighbours ? usual_inverse_depth() : kUnknown;
  const double rho = std::isfinite(usual) ? usual : map.inverse_depth;
  const double sigma = map.sigma_inverse_depth * rho / map.inverse_depth;
  frame_sigma_px_ = sigma_px(frame);

  // Cell by cell, the emptiest first.
  const auto cell_of = [&](const Eigen::Vector2d& pixel) {
    const auto place = [](double at, int size, int cells) {
      return std::clamp(static_cast<int>((at + 0.5) / size * cells), 0, cells - 1);
    };
    const auto row = static_cast<std::size_t>(place(pixel.y(), camera_.height_px(), map.grid_rows));
    const auto column = static_cast<std::size_t>(place(pixel.x(), camera_.width_px(), map.grid_columns));
    return row * static_cast<std::size_t>(map.grid_columns) + column;
  };
  std::fill(cells_.begin(), cells_.end(), 0);
  for (const SlamLandmark& landmark : landmarks_) {
    if (landmark.observation >= 0) {
      ++cells_[cell_of(frame.features[static_cast<std::size_t>(landmark.observation)].pixel_px)];
    }
  }
  const double nearest = map.min_separation_px * map.min_separation_px;
  while (wanted > 0) {
    int best = -1;
    for (const auto& [id, index] : by_id_) {
      if (taken_[static_cast<std::size_t>(index)] != 0) continue;
      if (best < 0 || cells_[cell_of(frame.features[static_cast<std::size_t>(index)].pixel_px)] <
                          cells_[cell_of(frame.features[static_cast<std::size_t>(best)].pixel_px)]) {
        best = index;
      }
    }
    if (best < 0) break;
    taken_[static_cast<std::size_t>(best)] = 1;
    const FeatureObservation& feature = frame.features[static_cast<std::size_t>(best)];
    const bool crowded = std::any_of(landmarks_.begin(), landmarks_.end(), [&](const SlamLandmark& landmark) {
      return landmark.observation >= 0 &&
             (frame.features[static_cast<std::size_t>(landmark.observation)].pixel_px - feature.pixel_px)
                     .squaredNorm() < nearest;
    });
    if (crowded) continue;
    if (is_covered(feature.pixel_px)) continue;
    const auto expected = std::lower_bound(expected_.begin(), expected_.end(), feature.id,
                                           [](const ExpectedDepth& one, std::int64_t id) { return one.id < id; });
    const bool hint = expected != expected_.end() && expected->id == feature.id;
    if (!(hint ? add_landmark(feature, expected->inverse_depth, expected->sigma) : add_landmark(feature, rho, sigma))) {
      continue;
    }
    landmarks_.back().observation = best;
    ++cells_[cell_of(feature.pixel_px)];
    --wanted;
  }
}

std::vector<SlamMapPoint> SlamFilter::map() const {
  std::vector<SlamMapPoint> out;
  out.reserve(landmarks_.size());
  for (const SlamLandmark& landmark : landmarks_) {
    SlamMapPoint& point = out.emplace_back();
    point.id = landmark.id;
    point.converted = landmark.point.converted;
    point.measured = landmark.measured;
    point.last_measured_ns = landmark.last_measured_ns;
    point.landmark = landmark.known;
    if (point.converted) {
      point.position = landmark.point.position;
      covariance_.read(landmark.offset, landmark.offset, point.position_cov);
      continue;
    }
    point.inverse_depth = landmark.point.inverse_depth;
    covariance_.read(landmark.offset, landmark.offset, point.inverse_depth_cov);
    if (!(point.inverse_depth.inverse_depth > 0)) continue;
    point.position = point.inverse_depth.xyz();
    const auto jacobian = point.inverse_depth.xyz_jacobian();
    point.position_cov = jacobian * point.inverse_depth_cov * jacobian.transpose();
  }
  return out;
}

}  // namespace loc
