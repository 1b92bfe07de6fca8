// Boards for the calibration of cameras, as a scene: checkerboard, and the grid of AprilTags that Kalibr uses.
// Frame: target has its origin at the first corner, x right, y up, z out of the board; all corners have z = 0. The
// points of the scene are the corners, in the order of their numbers.
//   checkerboard: corner = row * columns + column, inner corners only, from the lower left one
//   AprilGrid:    corner = 4 * tag + k, k = 0 lower left, 1 lower right, 2 upper right, 3 upper left of the black
//   border;
//                 tag 0 is the lower left one, tags count along x first
// Source of the tags: Wang and Olson 2016, family tag36h11; of the grid: Kalibr's calibration targets.
//
//   scene.add(april_grid({}), T_world_target);
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "libloc/sim/scene.hpp"

namespace loc {

struct CheckerboardModel {
  int columns = 9;         ///< inner corners along x
  int rows = 6;            ///< inner corners along y
  double square_m = 0.04;  ///< side of a square

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

struct AprilGridModel {
  int columns = 6;       ///< tags along x
  int rows = 6;          ///< tags along y
  double tag_m = 0.088;  ///< side of a tag, black border included
  double spacing = 0.3;  ///< space between tags, as a share of tag_m
  int first_tag = 0;     ///< number of the lower left tag in the family
  /// Small black squares between the tags, which make every tag's corner one of four fields, as on Kalibr's boards.
  /// Detectors that look for closed outlines (AprilTag 3) miss tags with them.
  bool corner_squares = true;

  /// @throws std::invalid_argument naming the field and its value; also for more tags than the family has.
  void check() const;
};

/// Tags in the family tag36h11.
inline constexpr int kTag36h11Count = 587;

/// The 36 cells of a tag, row by row from the upper left one, first cell in the highest bit; 1 is white.
/// @throws std::invalid_argument when there is no such tag.
std::uint64_t tag36h11_code(int tag);

/// @throws std::invalid_argument as the model's check().
Scene checkerboard(const CheckerboardModel& model);
Scene april_grid(const AprilGridModel& model);

}  // namespace loc
