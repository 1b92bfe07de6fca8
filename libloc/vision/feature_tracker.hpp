// From pictures to tracks: which feature is where in which picture. Works alone, and better with the expectation of a
// SLAM filter, which it knows only as SlamPrediction.
//
// One picture:
//   1. expected to a few pixels: its patch, warped as the expected pose says, is looked for inside the ellipse of the
//      prediction (normalised cross-correlation) and then placed to a fraction of a pixel (active search, patch.hpp)
//   2. expected worse than that, or not at all: pyramidal Lucas-Kanade from the last picture, started at the
//   prediction;
//      then placed by the patch as in 1, so that a feature does not creep away from what it was. A patch that no longer
//      looks like the feature is cut anew where the feature is now.
//   3. features of the map that were lost or come back into view: as 1, with a stricter correlation
//   4. where the estimator is lost: the map in all of the picture (map_search.hpp), then each feature of it where that
//      pose says; all of it counts as seen that fits together, and nothing when too little does
//   5. corners in cells of the picture that have none (FAST, then the smaller eigenvalue of Shi and Tomasi)
// A picture in which nothing is found, neither tracks nor corners, counts as one that did not come: the next one goes
// on from the picture before it. What the filter rejects several times in a row is taken for something that moves by
// itself: its track ends, and for a while no new one begins there. A change of exposure is taken out before 2; 1 and 3
// do not feel it. Frames: pixels as in patch.hpp, distorted, as the camera sees them. Identities are never used twice.
// Not thread safe. Source: J. Shi, C. Tomasi, "Good features to track", CVPR 1994; E. Rosten, T. Drummond, "Machine
// learning for high-speed corner detection", ECCV 2006; J.-Y. Bouguet, "Pyramidal implementation of the Lucas Kanade
// feature tracker", 2000; A. Davison et al., "MonoSLAM", PAMI 29, 2007 (active search). Uses OpenCV for 2 and FAST.
#pragma once

#include <cstdint>
#include <memory>

#include "libloc/core/named_count.hpp"
#include "libloc/estimators/slam_frame.hpp"
#include "libloc/estimators/slam_prediction.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sensors/rig.hpp"

namespace loc {

struct FeatureTrackerOptions {
  int max_tracks = 100;           ///< in one picture
  double min_separation_px = 14;  ///< of a new feature from the others
  int fast_threshold = 12;        ///< of the brightness, for a corner to be looked at
  double min_corner = 60;         ///< smaller eigenvalue of the mean of g g^T over 7 x 7 pixels [brightness^2/px^2]
  int klt_window_px = 21;         ///< odd
  int klt_levels = 4;             ///< of the pyramid, the picture itself included
  double min_correlation = 0.8;   ///< of a patch with the picture, for a track to go on
  double min_refind_correlation = 0.88;  ///< for one that was lost
  double search_sigmas = 3;              ///< size of the ellipse in which is searched
  double direct_below_px = 4;            ///< larger deviation of the prediction: Lucas-Kanade first (2.)
  double max_search_px = 10;             ///< larger deviation of the prediction: not searched for (3.)
  double max_warp = 2.5;                 ///< by which a patch may be stretched or shrunk before it is cut anew
  int drop_after_rejected = 4;           ///< times in a row by the filter
  int avoid_frames = 20;                 ///< for so long no new track begins where something moved
  double avoid_radius_px = 25;           ///< and so far around
  double exposure_step = 0.04;           ///< relative change of the mean brightness that is taken out
  /// Deviation of a coordinate, errors that last included, which tracks say of themselves. While the picture stands
  /// still the same errors come again and again: the n-th picture says sqrt(n) times as much. NaN: nothing is said.
  double sigma_px = 1;

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

enum class TrackOrigin : std::uint8_t {
  kNew = 0,       ///< a corner of this picture
  kSearched = 1,  ///< 1.
  kTracked = 2,   ///< 2.
  kCutAnew = 3,   ///< 2., the old patch did not look like it any more
  kRefound = 4    ///< 3.
};

/// What happened to one feature of the last picture, for display.
struct TrackedFeature {
  std::int64_t id = -1;
  TrackOrigin origin = TrackOrigin::kNew;
  double correlation = kUnknown;
  int age = 0;  ///< pictures in which it was seen before
};

/// Of the last picture.
struct FeatureTrackerTimes {
  double pyramid_s = 0;
  double search_s = 0;
  double klt_s = 0;
  double detect_s = 0;
  double total_s = 0;
};

class FeatureTracker {
 public:
  /// @throws std::invalid_argument as FeatureTrackerOptions::check and CameraCalibration::check.
  FeatureTracker(const CameraCalibration& camera, const FeatureTrackerOptions& options = {});
  FeatureTracker(FeatureTracker&&) noexcept;
  FeatureTracker& operator=(FeatureTracker&&) noexcept;
  ~FeatureTracker();

  /// @param image grey, BGR or RGB of 8 bits, of the camera's size @param expected of this picture, or null
  /// @returns the features of this picture, with its stamp; valid until the next call.
  /// @throws std::invalid_argument for another size or format.
  const FeaturesMeasurement& track(const ImageMeasurement& image, const SlamPrediction* expected = nullptr);

  /// What became of the features: those that were rejected time and again are dropped.
  void learn(const SlamFrame& frame);

  /// Forgets all tracks; identities go on.
  void reset();

  /// Beside the features of the last picture, in the same order.
  const std::vector<TrackedFeature>& last() const;
  const FeatureTrackerTimes& times() const;
  /// "tracks.searched", "tracks.klt", "tracks.cut_anew", "tracks.refound", "tracks.new", "tracks.lost",
  /// "tracks.moving", "map.searched" (pictures in which the map was looked for everywhere), "map.found", "pictures",
  /// "pictures.exposure_steps", "pictures.blind" (nothing in them).
  NamedCounts counts() const;
  const FeatureTrackerOptions& options() const;

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace loc
