// A calibration target and what a camera sees of it: plain structs for vision/target_detector (finds the corners),
// calib/camera_intrinsics (uses them), io/target_yaml (files of Kalibr) and sim/calibration_target (draws them).
// Frame target: origin at corner 0, x right and y up on the board, z out of it towards the viewer; all corners z = 0.
//   checkerboard: inner corners only, id = row * columns + column, rows from the lower left corner upwards
//   AprilGrid:    Kalibr's grid of AprilTags 36h11 with small black squares between them; tag numbers from the lower
//                 left tag along x, id = 4 * tag + k, k = 0 lower left, 1 lower right, 2 upper right, 3 upper left of
//                 the tag's black border. tag counts from 0 whatever first_tag is.
// A checkerboard looks the same after half a turn when columns + rows is even (and after a quarter when they are
// equal): corner 0 may then be another corner from one picture to the next. Otherwise corner 0 is an end at which the
// square in the corner of the board is black, so the ids are the same in all pictures.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "libloc/core/time.hpp"

namespace loc {

enum class TargetKind : std::uint8_t { kCheckerboard, kAprilGrid };

struct CalibrationTarget {
  TargetKind kind = TargetKind::kCheckerboard;
  int columns = 9;             ///< inner corners along x; tags along x
  int rows = 6;                ///< inner corners along y; tags along y
  double size_m = 0.025;       ///< side of a square; of a tag with its black border
  double spacing = 0.3;        ///< AprilGrid: space between two tags as a share of size_m
  std::int32_t first_tag = 0;  ///< AprilGrid: number of the lower left tag in the family

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
  int corner_count() const;
  /// Place of a corner in target [m]. @throws std::invalid_argument when there is no such corner.
  Eigen::Vector3d corner(int id) const;
  /// True when every picture of it can be told from one that is turned by half a turn.
  bool has_direction() const;
};

/// "checkerboard 9x6 0.025", "aprilgrid 6x6 0.088 0.3", or with the number of the first tag behind: "aprilgrid 6x6
/// 0.088 0.3 100". Lengths in metres. @throws std::invalid_argument naming the word that cannot be read.
CalibrationTarget parse_target(const std::string& text);
/// What parse_target() reads.
std::string target_text(const CalibrationTarget& target);

struct TargetCorner {
  std::int32_t id = 0;
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
};

/// One picture of the target: each corner at most once, in order of id.
struct TargetView {
  TimeNs time_ns = kNoTime;
  std::vector<TargetCorner> corners;

  /// @throws std::invalid_argument for a corner that the target has not, that comes twice, or that is not finite.
  void check(const CalibrationTarget& target) const;
};

}  // namespace loc
