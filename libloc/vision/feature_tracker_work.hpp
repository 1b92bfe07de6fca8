// What a FeatureTracker holds, for its own sources.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "libloc/core/check.hpp"
#include "libloc/estimators/picture_rest.hpp"
#include "libloc/geometry/absolute_pose.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/vision/corner_detector.hpp"
#include "libloc/vision/feature_tracker.hpp"
#include "libloc/vision/map_search.hpp"
#include "libloc/vision/patch.hpp"

namespace loc {
namespace feature_tracker {

inline constexpr double kStillPx = 1;        // a picture that is nearer to where it was stands still …
inline constexpr double kStillTime = 1;      // … when it has been for so long [s]
inline constexpr double kFarthestAlign = 3;  // a place found otherwise is right to that [px]
inline constexpr double kBorder = kPatchHalf + 2;

struct Brightness {
  double mean = 0;
  double deviation = 0;
};
// Where a patch was cut, for its warp: the camera's pose then, in the filter's world.
struct Anchor {
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  Pose3 T_world_camera;
  bool has_pose = false;
};

struct Track {
  std::int64_t id = -1;
  ImagePatch patch;
  Anchor anchor;
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d last_px = Eigen::Vector2d::Zero();  // in the picture before
  bool seen = false;                                  // in this picture
  bool was_seen = false;                              // in the one before
  int age = 0;
  int unseen = 0;    // pictures since it was seen
  int rejected = 0;  // in a row
  bool in_map = false;
  TrackOrigin origin = TrackOrigin::kNew;
  double correlation = kUnknown;
  const SlamFeaturePrediction* expected = nullptr;
};

struct Avoided {
  Eigen::Vector2d pixel_px;
  std::int64_t until;
};

}  // namespace feature_tracker

struct FeatureTracker::Work {
  Work(const CameraCalibration& calibration, const FeatureTrackerOptions& given)
      : camera(calibration),
        options((given.check(), given)),
        rest(calibration.intrinsics_px.tail<2>(), feature_tracker::kStillPx, feature_tracker::kStillTime),
        map_search(camera) {
    require(calibration.width_px >= 64 && calibration.height_px >= 64,
            "camera: the picture is less than 64 pixels wide or high");
    // Half as many cells again as there are tracks: some have no corner.
    const double cell =
        std::sqrt(static_cast<double>(calibration.width_px) * calibration.height_px / (1.5 * given.max_tracks));
    corner_options.columns = std::max(2, static_cast<int>(std::lround(calibration.width_px / cell)));
    corner_options.rows = std::max(2, static_cast<int>(std::lround(calibration.height_px / cell)));
    corner_options.fast_threshold = given.fast_threshold;
    corner_options.min_strength = given.min_corner;
    corner_options.min_separation_px = given.min_separation_px;
  }

  Camera camera;
  FeatureTrackerOptions options;
  CornerOptions corner_options;
  cv::Mat gray;
  cv::Mat before_gray;
  feature_tracker::Brightness brightness;
  feature_tracker::Brightness before_brightness;
  std::vector<cv::Mat> pyramid;
  std::vector<cv::Mat> before_pyramid;
  // The picture before, with the exposure of this one.
  cv::Mat adjusted;
  std::vector<cv::Mat> adjusted_pyramid;
  bool is_adjusted = false;
  std::vector<feature_tracker::Track> tracks;
  std::int64_t next_id = 0;
  std::int64_t picture = 0;   // since the last reset
  std::int64_t pictures = 0;  // in all
  std::int64_t first_searched = 0;
  Pose3 T_world_before;  // camera, of the picture before
  bool has_before_pose = false;
  FeaturesMeasurement out;
  PictureRest rest;
  TimeNs rest_time_ns = kNoTime;
  int still_pictures = 0;  // in a row
  std::vector<TrackedFeature> tracked;
  FeatureTrackerTimes times;
  std::vector<feature_tracker::Avoided> avoided;
  MapSearch map_search;
  std::int64_t map_searches = 0;
  std::int64_t maps_found = 0;
  // Camera in the filter's world, where it is known; the warps of what is cut out now begin there.
  std::optional<Pose3> T_world_camera;
  // Room for one picture's work.
  std::vector<std::size_t> klt;
  std::vector<cv::Point2f> klt_from;
  std::vector<cv::Point2f> klt_to;
  std::vector<std::uint8_t> klt_status;
  std::vector<float> klt_error;
  std::vector<Eigen::Vector2d> taken;
  std::vector<Corner> corners;
  std::unordered_map<std::int64_t, const SlamFeaturePrediction*> by_id;
  std::vector<MapPatch> map_patches;
  std::vector<SightedPoint> sighted;
  struct Place {
    std::size_t track;
    PatchMatch match;
    bool fits = false;
  };
  std::vector<Place> found_places;
  cv::Mat half;
  std::int64_t searched = 0;
  std::int64_t tracked_klt = 0;
  std::int64_t cut_anew = 0;
  std::int64_t refound = 0;
  std::int64_t added = 0;
  std::int64_t lost = 0;
  std::int64_t moving = 0;
  std::int64_t exposure_steps = 0;
  std::int64_t blind = 0;

  GrayView view() const { return {gray.data, gray.cols, gray.rows, static_cast<int>(gray.step)}; }
  GrayView before_view() const {
    return {before_gray.data, before_gray.cols, before_gray.rows, static_cast<int>(before_gray.step)};
  }

  void take_picture(const ImageMeasurement& image);
  void take_prediction(const SlamPrediction* expected, const SlamPrediction* map);
  Eigen::Matrix2d warp_of(const feature_tracker::Track& track, const Pose3* now) const;
  bool search(feature_tracker::Track& track, const SlamPrediction* expected);
  Eigen::Vector2d guess_of(const feature_tracker::Track& track, const SlamPrediction* expected) const;
  void run_klt(const SlamPrediction* expected);
  void confirm(feature_tracker::Track& track, const Eigen::Vector2d& place, const SlamPrediction* expected);
  bool cut(feature_tracker::Track& track, const Eigen::Vector2d& place) const;
  std::optional<Pose3> pose_of_found(const Pose3& start);
  void find_in_map(const SlamPrediction& map);
  bool confirm_pose(const Pose3& pose);
  void remove_twins();
  double places_of(const SlamFeaturePrediction& there) const;
  bool is_blind() const;
  void forget_picture();
  void detect();
  void out_without(const ImageMeasurement& image);
  void give_out(const ImageMeasurement& image);
};

}  // namespace loc
