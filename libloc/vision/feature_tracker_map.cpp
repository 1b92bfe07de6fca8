// FeatureTracker where the estimator is lost: the map in all of the picture.
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "libloc/vision/feature_tracker_work.hpp"

namespace loc {

using namespace feature_tracker;

namespace {

constexpr double kGuidedPx = 4;             // deviation of a place by a pose that was found anew [px]
constexpr double kFittingPx = 3;            // a feature that is where that pose says [px]
constexpr std::size_t kFewestFitting = 10;  // for such a pose to be believed
constexpr double kFittingPart = 0.6;        // of what looks right

}  // namespace

// By what is seen of the map. nullopt when it does not fit together.
std::optional<Pose3> FeatureTracker::Work::pose_of_found(const Pose3& start) {
  sighted.clear();
  for (const Track& track : tracks) {
    if (!track.seen || track.expected == nullptr || !track.expected->placed) continue;
    const auto ray = camera.unproject(track.pixel_px);
    if (ray) sighted.push_back({track.expected->point / track.expected->weight, *ray});
  }
  if (sighted.size() < kFewestFitting) return std::nullopt;
  AbsolutePoseOptions narrowing;
  narrowing.last_width = 0.5 * kFittingPx / camera.intrinsics_px().head<2>().minCoeff();
  narrowing.min_fitting = kFittingPart;
  return absolute_pose(sighted, start, narrowing);
}

// The features where that pose says: enough of them, and these are the ones that are seen.
bool FeatureTracker::Work::confirm_pose(const Pose3& pose) {
  const Pose3 T_camera_world = pose.inverse();
  found_places.clear();
  const int farthest = static_cast<int>(std::ceil(options.search_sigmas * kGuidedPx));
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const Track& track = tracks[i];
    if (track.expected == nullptr) continue;
    const auto there = camera.project(T_camera_world.rotation * track.expected->point +
                                      track.expected->weight * T_camera_world.translation);
    WarpedPatch patch;
    if (!there || !camera.in_image(*there, kBorder) || !track.patch.warp(warp_of(track, &pose), patch)) continue;
    const PatchMatch coarse = search_patch(patch, view(), *there, kGuidedPx * kGuidedPx * Eigen::Matrix2d::Identity(),
                                           options.search_sigmas, farthest);
    if (!coarse.found || coarse.correlation < 0.6 * options.min_refind_correlation) continue;
    const PatchMatch fine = align_patch(patch, view(), coarse.pixel_px, kFarthestAlign);
    if (fine.found && fine.correlation >= options.min_refind_correlation)
      found_places.push_back({.track = i, .match = fine});
  }
  sighted.clear();
  for (const Place& place : found_places) {
    const SlamFeaturePrediction& feature = *tracks[place.track].expected;
    const auto ray = camera.unproject(place.match.pixel_px);
    if (ray && feature.placed) sighted.push_back({feature.point / feature.weight, *ray});
  }
  if (sighted.size() < kFewestFitting) return false;
  const double focal_px = camera.intrinsics_px().head<2>().minCoeff();
  AbsolutePoseOptions narrowing;
  narrowing.first_width = 2 * options.search_sigmas * kGuidedPx / focal_px;
  narrowing.last_width = 0.5 * kFittingPx / focal_px;
  narrowing.min_fitting = kFittingPart;
  const auto better = absolute_pose(sighted, pose, narrowing);
  if (!better) return false;
  const Pose3 to_camera = better->inverse();
  std::size_t fitting = 0;
  for (Place& place : found_places) {
    const SlamFeaturePrediction& feature = *tracks[place.track].expected;
    const auto there = camera.project(to_camera.rotation * feature.point + feature.weight * to_camera.translation);
    place.fits = there && (*there - place.match.pixel_px).norm() < kFittingPx;
    fitting += place.fits && feature.placed ? 1 : 0;
  }
  if (fitting < kFewestFitting) return false;
  for (Track& track : tracks) {
    if (track.in_map) track.seen = false;
  }
  for (const Place& place : found_places) {
    if (!place.fits) continue;
    Track& track = tracks[place.track];
    track.seen = true;
    track.pixel_px = place.match.pixel_px;
    track.correlation = place.match.correlation;
    track.origin = TrackOrigin::kRefound;
  }
  T_world_camera = *better;
  return true;
}

// The estimator is lost: in all of the picture, unless the tracks that are left agree on a pose.
void FeatureTracker::Work::find_in_map(const SlamPrediction& map) {
  ++map_searches;
  auto pose = pose_of_found(map.T_world_camera);
  if (!pose || !confirm_pose(*pose)) {
    map_patches.clear();
    for (const Track& track : tracks) {
      if (track.expected == nullptr || !track.expected->placed) continue;
      map_patches.push_back({&track.patch, track.expected->point / track.expected->weight});
    }
    if (pyramid.size() > 2) {
      half = pyramid[2];  // every second one is of derivatives
    } else {
      cv::pyrDown(gray, half);
    }
    const GrayView half_view{half.data, half.cols, half.rows, static_cast<int>(half.step)};
    pose = map_search.find(view(), half_view, map_patches, map.T_world_camera, map_searches);
    if (!pose || !confirm_pose(*pose)) return;
  }
  ++maps_found;
}

}  // namespace loc
