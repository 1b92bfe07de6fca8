// What makes tracks of pictures for SLAM, as the programs see it: without OpenCV, so that those which have tracks
// already do without it.
#pragma once

#include <memory>

#include "libloc/core/named_count.hpp"
#include "libloc/estimators/slam_frame.hpp"
#include "libloc/estimators/slam_prediction.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

class PictureFrontEnd {
 public:
  virtual ~PictureFrontEnd() = default;

  /// @param expected of this picture @returns the picture's features, until the next call; nullptr for a picture that
  /// is of no use (a damaged JPEG, another size than the camera's): counted and logged.
  virtual const FeaturesMeasurement* track(const ImageMeasurement& image, const SlamPrediction& expected) = 0;
  /// What became of the features.
  virtual void learn(const SlamFrame& frame) = 0;
  virtual void reset() = 0;
  virtual NamedCounts counts() const = 0;
};

/// The tracker of libloc/vision. Only in programs with OpenCV. @throws std::invalid_argument for a wrong calibration.
std::unique_ptr<PictureFrontEnd> make_picture_front_end(const CameraCalibration& camera);

}  // namespace loc
