// Whether a camera stands still, by its picture alone: the picture as a whole is where it was a second ago and longer.
// From frame to frame what creeps moves by less than can be seen, from second to second it does not: each picture is
// compared with an old one, the reference, which is taken anew whenever the picture has moved away from it.
// How far it moved is the largest of the medians of the features' moves along u, along v, away from the picture's
// centre and around it, so that the noise of single features does not count, and neither do things that pass by.
//
// From: features of the same identity. Not seen: a motion along which most of the scene stays where it is in the
// picture (an elevator that the camera looks at from within).
#pragma once

#include <array>
#include <vector>

#include "libloc/core/fifo.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

class PictureRest {
 public:
  /// @param centre_px of the picture: where the optical axis meets it
  /// @param still_px a picture that is nearer to the reference has not moved [px]
  /// @param still_s … and stands still when that holds for so long [s]
  PictureRest(Eigen::Vector2d centre_px, double still_px, double still_s);

  /// Forgets what was seen.
  void reset();
  /// A frame. @param time_ns its time on the IMU's clock, later than that of the frame before
  void see(const FeaturesMeasurement& frame, TimeNs time_ns);
  /// The picture stands still. @param now_ns on the IMU's clock: what was seen long before it says nothing.
  bool stands_still(TimeNs now_ns) const;
  /// Of frames that nobody has taken yet, from the one with that index on: none has moved away from the first one (by
  /// twice as much as above, since a body sways before the start). Fewer than three say nothing: false.
  /// The first one is the reference then, of that time on the IMU's clock.
  bool stood_still(const Fifo<FeaturesMeasurement>& frames, std::size_t first, TimeNs first_ns);

 private:
  double moved_px(const FeaturesMeasurement& frame);

  Eigen::Vector2d centre_px_;
  double still_px_;
  double still_s_;
  std::vector<FeatureObservation> picture_;  // of the last frame, by identity
  std::vector<FeatureObservation> reference_;
  TimeNs reference_ns_ = kNoTime;
  TimeNs picture_ns_ = kNoTime;
  std::array<std::vector<double>, 4> moves_;
};

}  // namespace loc
