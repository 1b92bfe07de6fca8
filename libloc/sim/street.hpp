// A street with facades on both sides and markings on the road, along any path (straight, or that of a simulated car).
// From: a path on the ground. Where a facade would stand on the road (bends, crossings), there is none.
// Frames: world, z up; the path gives the middle of the road.
//
//   const Scene scene = street(sampled_path(motion, 1.0, 0.0), {}, Random(1));
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/sim/motion.hpp"
#include "libloc/sim/scene.hpp"

namespace loc {

struct StreetModel {
  double road_width_m = 8;
  double pavement_m = 2.5;  ///< between road and facades
  double min_facade_m = 8;  ///< width of a house
  double max_facade_m = 16;
  double min_height_m = 6;
  double max_height_m = 14;
  double largest_gap_m = 2;  ///< between houses
  double window_m = 2.2;     ///< distance of windows, about; four features each
  double extend_m = 60;      ///< the street goes on straight so far before and beyond the path
  int kinds = 8;             ///< different houses; each comes again and again

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// Places of the body about spacing_m apart along its way, at a given height. For motions that end.
/// @throws std::invalid_argument when spacing is not positive or the motion has no end.
std::vector<Eigen::Vector3d> sampled_path(const Motion& motion, double spacing_m, double height_m);

/// @param path at least two different places [m]. @throws std::invalid_argument as StreetModel::check; for a path that
/// is too short, not finite, or longer than 20 km.
Scene street(const std::vector<Eigen::Vector3d>& path, const StreetModel& model, Random random);

}  // namespace loc
