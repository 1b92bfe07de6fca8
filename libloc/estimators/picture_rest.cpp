#include "libloc/estimators/picture_rest.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace loc {
namespace {

constexpr std::size_t kUsualFeatures = 1000;  // of a frame; more take memory once
constexpr std::size_t kFewestStill = 5;       // features that tell whether the picture stands still
constexpr double kStillAtStart = 2;           // times as much may a body sway before the start
constexpr double kPictureIsOld = 0.5;         // says nothing of now [s]

}  // namespace

PictureRest::PictureRest(Eigen::Vector2d centre_px, double still_px, double still_s)
    : centre_px_(std::move(centre_px)), still_px_(still_px), still_s_(still_s) {
  picture_.reserve(kUsualFeatures);
  reference_.reserve(kUsualFeatures);
  for (std::vector<double>& moves : moves_) moves.reserve(kUsualFeatures);
}

void PictureRest::reset() {
  reference_.clear();
  reference_ns_ = picture_ns_ = kNoTime;
}

// Since the reference. NaN when too few features are in both.
double PictureRest::moved_px(const FeaturesMeasurement& frame) {
  picture_.assign(frame.features.begin(), frame.features.end());
  std::sort(picture_.begin(), picture_.end(),
            [](const FeatureObservation& a, const FeatureObservation& b) { return a.id < b.id; });
  for (std::vector<double>& moves : moves_) moves.clear();
  auto other = reference_.begin();
  for (const FeatureObservation& feature : picture_) {
    while (other != reference_.end() && other->id < feature.id) ++other;
    if (other == reference_.end()) break;
    if (other->id != feature.id || !feature.pixel_px.allFinite() || !other->pixel_px.allFinite()) continue;
    const Eigen::Vector2d move = feature.pixel_px - other->pixel_px;
    const Eigen::Vector2d out = (other->pixel_px - centre_px_).normalized();
    moves_[0].push_back(move.x());
    moves_[1].push_back(move.y());
    moves_[2].push_back(out.dot(move));
    moves_[3].push_back(out.x() * move.y() - out.y() * move.x());
  }
  if (moves_[0].size() < kFewestStill) return kUnknown;
  double most = 0;
  for (std::vector<double>& moves : moves_) {
    const auto middle = moves.begin() + static_cast<std::ptrdiff_t>(moves.size() / 2);
    std::nth_element(moves.begin(), middle, moves.end());
    most = std::max(most, std::abs(*middle));
  }
  return most;
}

void PictureRest::see(const FeaturesMeasurement& frame, TimeNs time_ns) {
  picture_ns_ = time_ns;
  if (moved_px(frame) < still_px_) return;
  reference_.swap(picture_);
  reference_ns_ = time_ns;
}

bool PictureRest::stands_still(TimeNs now_ns) const {
  return reference_ns_ != kNoTime && to_seconds(picture_ns_ - reference_ns_) >= still_s_ &&
         to_seconds(now_ns - picture_ns_) < kPictureIsOld;
}

bool PictureRest::stood_still(const Fifo<FeaturesMeasurement>& frames, std::size_t first, TimeNs first_ns) {
  reset();
  if (frames.size() < first + 3) return false;
  moved_px(frames[first]);
  reference_.swap(picture_);
  for (std::size_t i = first + 1; i < frames.size(); ++i) {
    if (moved_px(frames[i]) < kStillAtStart * still_px_) continue;
    reset();
    return false;
  }
  reference_ns_ = picture_ns_ = first_ns;
  return true;
}

}  // namespace loc
