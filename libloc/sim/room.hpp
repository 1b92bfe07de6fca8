// A box-shaped room seen from inside: four walls, floor and ceiling, each with its own texture of random rectangles.
// Frame: world with its origin in the middle of the floor, x and y along the walls, z up.
//
//   const Scene scene = box_room({.size_m = {8, 6, 3}}, Random(1));
#pragma once

#include <Eigen/Core>

#include "libloc/core/random.hpp"
#include "libloc/sim/scene.hpp"

namespace loc {

struct RoomModel {
  Eigen::Vector3d size_m{8, 6, 3};  ///< along x, y, z
  double cell_m = 0.5;              ///< one feature in a square of this side on every wall

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// @throws std::invalid_argument as RoomModel::check
Scene box_room(const RoomModel& model, Random random);

/// A texture of one rectangle in each cell, of random place, size and brightness; its four corners differ from what is
/// around them, one of them (the lower left) is the cell's feature.
/// @throws std::invalid_argument when size or cell is not positive.
Texture scattered_rectangles(const Eigen::Vector2d& size, double cell_m, const Colour& background, Random& random);

/// The colour brighter or darker by a factor.
Colour shade(const Colour& colour, double factor);

}  // namespace loc
