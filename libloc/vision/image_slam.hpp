// SLAM from pictures: a front end (feature_tracker.hpp) and an estimator (mono_slam.hpp, inertial_slam.hpp) that tells
// it where to look. The estimator itself sees tracks, never a picture.
//
//   ImageSlam<InertialSlam> slam(slam_options_for_images(options));
//   for (const Measurement& m : measurements) slam.process(m);    // pictures, IMU, in the order of their times
#pragma once

#include "libloc/core/check.hpp"
#include "libloc/estimators/inertial_slam.hpp"
#include "libloc/estimators/mono_slam.hpp"
#include "libloc/vision/feature_tracker.hpp"

namespace loc {

/// A tracker gives identities of its own, which are nobody's that is known beforehand.
/// @throws std::invalid_argument for options with landmarks.
inline void check_landmarks(const SlamOptions& options) {
  require(options.landmarks.empty(), "landmarks: their identities mean nothing to a front end that finds its own");
}

template <class Slam>
class ImageSlam {
 public:
  /// @throws std::invalid_argument as the estimator's and FeatureTrackerOptions::check.
  explicit ImageSlam(const SlamOptions& options, const FeatureTrackerOptions& front_end = {})
      : slam_((check_landmarks(options), options)),
        tracker_(options.camera, front_end),
        camera_(options.camera_index) {}

  // Estimator concept. Pictures of other cameras, and tracks, are not for it.
  /// @throws std::invalid_argument for a picture of another size than the camera's, or a JPEG that is not decoded.
  bool process(const Measurement& measurement) {
    if (std::holds_alternative<FeaturesMeasurement>(measurement)) return false;
    const auto* image = std::get_if<ImageMeasurement>(&measurement);
    if (image == nullptr) {
      const bool is_new = slam_.process(measurement);
      learn();
      return is_new;
    }
    if (image->camera != camera_) return false;
    slam_.predict_frame(image->time_ns, prediction_);
    features_ = tracker_.track(*image, &prediction_);
    const bool is_new = slam_.process(features_);
    if constexpr (std::is_same_v<Slam, MonoSlam>) {
      if (is_new) tracker_.learn(slam_.frame());
    } else {
      learn();
    }
    return is_new;
  }
  Estimate estimate() const { return slam_.estimate(); }
  NamedCounts counts() const {
    NamedCounts out = slam_.counts();
    for (NamedCount& count : tracker_.counts()) out.push_back(std::move(count));
    return out;
  }
  void reset() {
    slam_.reset();
    tracker_.reset();
  }

  /// The end of a recording: frames that wait for the IMU are taken, see InertialSlam::finish. A camera alone has none.
  bool finish() {
    if constexpr (std::is_same_v<Slam, MonoSlam>) {
      return false;
    } else {
      const bool is_new = slam_.finish();
      learn();
      return is_new;
    }
  }

  const Slam& slam() const { return slam_; }
  const FeatureTracker& tracker() const { return tracker_; }
  /// What the last picture's features were looked for by, and what was found.
  const SlamPrediction& prediction() const { return prediction_; }
  const FeaturesMeasurement& features() const { return std::get<FeaturesMeasurement>(features_); }

 private:
  void learn() {
    if constexpr (!std::is_same_v<Slam, MonoSlam>) {
      for (const SlamFrame& frame : slam_.frames()) tracker_.learn(frame);
    }
  }

  Slam slam_;
  FeatureTracker tracker_;
  std::int32_t camera_;
  SlamPrediction prediction_;
  Measurement features_ = FeaturesMeasurement{};
};

static_assert(Estimator<ImageSlam<MonoSlam>>);
static_assert(Estimator<ImageSlam<InertialSlam>>);

}  // namespace loc
