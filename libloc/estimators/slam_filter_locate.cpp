// Is a frame one of the map, and is something before it? What comes before the map hides many features of it at once,
// side by side, and may move; what it shows itself looks like features, too.
#include <algorithm>
#include <cmath>

#include "libloc/estimators/slam_filter.hpp"

namespace loc {
namespace {

constexpr int kFewestFound = 3;     // features that hold a pose
constexpr int kFewestRefound = 8;   // and that do not agree by chance
constexpr double kFoundPart = 0.2;  // of those that are usually found
constexpr double kUsualPart = 0.1;  // of a frame in what is usual
constexpr int kKnownAfter = 15;     // measurements, after which a feature is one of those whose absence says something
constexpr double kLately = 2;       // the same, while it is there [s]
constexpr double kPatience = 5;     // with features below a cover [s]
constexpr int kFewestHidden = 4;    // at once, below a cover
constexpr double kSudden = 0.5;     // for so long: what they have in common came at once [s]
constexpr double kHiddenPart = 0.25;  // of those that are expected
constexpr double kCoverTime = 1;      // after which it may have gone [s]
constexpr double kSpeedTime = 2;      // over which the usual speed is averaged [s]
constexpr double kLongestDoubt = 30;  // [s] over which an unknown velocity is believed to last

}  // namespace

// While the map is looked for nothing joins it.
bool SlamFilter::looks_for_map() const {
  return found_frame_ >= 0 && strange_s_ < options_.relocate_s;
}

// As many as hardly agree by chance; fewer where there never are many.
int SlamFilter::fewest_to_find() const {
  return std::clamp(static_cast<int>(kFoundPart * usually_found_), kFewestFound, kFewestRefound);
}

void SlamFilter::forget_location() {
  found_ = true;
  lost_ = refound_ = false;
  found_frame_ = -1;
  found_ns_ = last_frame_ns_ = cover_ns_ = kNoTime;
  strange_s_ = usually_found_ = usual_speed_ = 0;
  left_frame_ = -1;
  usual_log_inverse_depth_ = kUnknown;
  usual_depth_ns_ = kNoTime;
}

void SlamFilter::lose() {
  lost_ = lost_ || found_frame_ >= 0;
}

// P of place and velocity grows as of a body that has had an unknown velocity since it was last found: less than the
// model's own acceleration makes of a camera that rests, more of one that drives.
void SlamFilter::doubt_motion() {
  const double since = std::min(to_seconds(time_ns_ - found_ns_), kLongestDoubt);
  const double variance = unknown_velocity_sigma() * unknown_velocity_sigma();
  Eigen::MatrixXd q = Eigen::MatrixXd::Zero(layout_.dim, layout_.dim);
  for (int i = 0; i < 3; ++i) {
    q(kVelocity + i, kVelocity + i) = variance;
    q(kPosition + i, kPosition + i) = variance * since * since;
    q(kPosition + i, kVelocity + i) = q(kVelocity + i, kPosition + i) = variance * since;
  }
  covariance_.propagate(Eigen::MatrixXd::Identity(layout_.dim, layout_.dim), q);
}

double SlamFilter::unknown_velocity_sigma() const {
  return std::max(options_.sigma_velocity, usual_speed_ / std::sqrt(3.0));
}

// Is the frame one of this map?
void SlamFilter::locate(const FeaturesMeasurement& frame) {
  int old = 0;  // that were there when the last frame was found
  int young = 0;
  int old_rejected = 0;
  int of_map_left = 0;
  for (const SlamLandmark& landmark : landmarks_) {
    const bool measured = landmark.state == SlamFeatureState::kMeasured || landmark.state == SlamFeatureState::kRescued;
    const bool is_old = landmark.first_frame <= found_frame_;
    if (is_old && landmark.observation >= 0 && landmark.state == SlamFeatureState::kRejected) ++old_rejected;
    if (measured) ++(is_old ? old : young);
    if (measured && left_frame_ >= 0 && landmark.first_frame <= left_frame_) ++of_map_left;
  }
  refound_ = false;
  const double since = last_frame_ns_ == kNoTime ? 0 : std::max(0.0, to_seconds(time_ns_ - last_frame_ns_));
  last_frame_ns_ = time_ns_;
  if (found_ns_ == kNoTime || found_ns_ > time_ns_) found_ns_ = time_ns_;  // the beginning; a clock that was set back
  const bool began = found_frame_ >= 0;
  const bool by_old = old >= fewest_to_find() && !(lost_ && old_rejected > old);
  // What came while nothing was found: surroundings that are new.
  const bool by_all = old + young >= kFewestFound && !looks_for_map();
  found_ = by_old || by_all || !began;
  if (by_old || by_all) {
    const bool linked = left_frame_ >= 0 && of_map_left >= fewest_to_find();
    if (linked) left_frame_ = -1;
    refound_ = (lost_ && by_old) || linked;
    if (refound_) ++times_refound_;
    if (lost_ && !by_old) {
      ++times_gone_on_;
      if (left_frame_ < 0) left_frame_ = found_frame_;
    }
    const double speed = state_.velocity.norm();
    const double part = found_frame_ < 0 ? 1 : std::min(1.0, since / kSpeedTime);
    usual_speed_ = std::hypot(std::sqrt(1 - part) * usual_speed_, std::sqrt(part) * speed);
    lost_ = false;
    found_frame_ = frames_;
    found_ns_ = time_ns_;
    strange_s_ = 0;
    usually_found_ += kUsualPart * (old + young - usually_found_);
    return;
  }
  if (!began) return;
  if (static_cast<int>(frame.features.size()) >= kFewestRefound) {
    strange_s_ += std::min(since, options_.lost_after_s);  // what a pause hid was not seen
  }
  if (!lost_ && to_seconds(time_ns_ - found_ns_) > options_.lost_after_s) {
    lost_ = true;
    if (!layout_.inertial) doubt_motion();
  }
  if (lost_) ++lost_frames_;
}

bool SlamFilter::is_young(const SlamLandmark& landmark) const {
  return landmark.first_frame >= 0 && frames_ - landmark.first_frame < options_.map.steer_after_frames;
}

// Known by now, expected, and not seen although it was seen lately.
bool SlamFilter::is_hidden(const SlamLandmark& landmark, double lately_s) const {
  return landmark.visible && landmark.measured >= kKnownAfter && landmark.observation < 0 &&
         landmark.last_measured_frame >= 0 && std::abs(to_seconds(time_ns_ - landmark.last_measured_ns)) < lately_s;
}

// Most of what is known around that place is hidden.
bool SlamFilter::is_covered(const Eigen::Vector2d& pixel_px) const {
  if (options_.map.cover_radius <= 0) return false;
  const double radius_px = options_.map.cover_radius * options_.camera.width_px;
  const double farthest = radius_px * radius_px;
  int hidden = 0;
  int seen = 0;
  for (const SlamLandmark& landmark : landmarks_) {
    if (!landmark.visible || !((landmark.predicted_px - pixel_px).squaredNorm() <= farthest)) continue;
    if (is_hidden(landmark, kPatience)) {
      ++hidden;
    } else if (landmark.measured >= kKnownAfter && landmark.last_measured_frame == frames_) {
      ++seen;
    }
  }
  return hidden > 0 && hidden >= seen;
}

// A feature that is hidden is none that failed.
bool SlamFilter::waits_below_cover(const SlamLandmark& landmark) const {
  return is_hidden(landmark, kPatience) && is_covered(landmark.predicted_px);
}

void SlamFilter::see_cover() {
  int hidden = 0;
  int seen = 0;
  for (const SlamLandmark& landmark : landmarks_) {
    if (is_hidden(landmark, below_cover() ? kLately : kSudden)) {
      ++hidden;
    } else if (landmark.visible && landmark.measured >= kKnownAfter && landmark.observation >= 0) {
      ++seen;
    }
  }
  if (hidden >= kFewestHidden && hidden > kHiddenPart * (hidden + seen)) cover_ns_ = time_ns_;
}

bool SlamFilter::below_cover() const {
  return cover_ns_ != kNoTime && std::abs(to_seconds(time_ns_ - cover_ns_)) <= kCoverTime;
}

}  // namespace loc
