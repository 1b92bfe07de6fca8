// Finds a calibration target in a picture: its corners with their numbers, to a few hundredths of a pixel.
// From: one picture, sharp or not. Pixel (0,0) is the centre of the top-left pixel; numbers and frame of the target as
// in sensors/target.hpp.
//   checkerboard: the whole board must be seen (OpenCV: Duda and Frese 2018 where a quicker search finds nothing)
//   AprilGrid:    any part of at least two tags. The library apriltag (Wang and Olson 2016) finds closed outlines only,
//                 and Kalibr's small squares join the outlines of neighbours; so one tag that it finds, in a picture
//                 whose black was made thinner, is enough: the others are looked for where the grid must go on, and
//                 taken when their cells are right. Tags of other numbers, and single ones elsewhere, do not count.
// Corners are saddles of the brightness, refined with cv::cornerSubPix in a window that the next edge does not reach; a
// corner that moves when the window grows is left out.
// Without the library apriltag at build time AprilGrids cannot be found: see finds_april_grids().
//
//   const TargetDetector detector(parse_target("aprilgrid 6x6 0.088 0.3"), {});
//   const TargetDetection seen = detector.detect(image);
//   if (seen.view.corners.empty()) report(seen.reason);
#pragma once

#include <memory>
#include <string>

#include "libloc/sensors/measurements.hpp"
#include "libloc/sensors/target.hpp"

namespace loc {

struct TargetDetectorOptions {
  /// Also slower searches, of several times the time, where the quick ones find nothing: off for live video.
  bool thorough = true;
  int min_tags = 2;                   ///< AprilGrid: fewer are no grid; at most the tags of the target are asked for
  double min_contrast = 15;           ///< between black and white [grey levels]
  double max_disagreement_px = 0.35;  ///< of a corner refined in two windows: beyond, it is left out

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

struct TargetDetection {
  TargetView view;           ///< no corners: the target was not found
  std::string reason;        ///< why there are no corners, for a person; empty when there are
  int foreign_tags = 0;      ///< AprilGrid: tags of the family that are no part of the grid
  int corners_left_out = 0;  ///< not sharp enough to be placed
};

/// True when this build finds AprilGrids.
bool finds_april_grids();

/// Not for several threads at once.
class TargetDetector {
 public:
  /// @throws std::invalid_argument as check() of target and options, and for an AprilGrid where it cannot be found.
  TargetDetector(const CalibrationTarget& target, const TargetDetectorOptions& options);
  TargetDetector(TargetDetector&&) noexcept;
  TargetDetector& operator=(TargetDetector&&) noexcept;
  ~TargetDetector();

  /// @param image grey or colour. Any content is fine. @throws std::invalid_argument for an image whose data and size
  /// do not fit together, or JPEG, as view_of().
  TargetDetection detect(const ImageMeasurement& image) const;

  const CalibrationTarget& target() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace loc
