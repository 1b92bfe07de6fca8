// Corners of a picture, spread over it: at most one for each cell that is free, the strongest first. FAST finds
// candidates, the smaller eigenvalue of Shi and Tomasi judges them.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "libloc/vision/patch.hpp"

namespace loc {

struct Corner {
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  double strength = 0;  ///< smaller eigenvalue of the mean of g g^T over 7 x 7 pixels [brightness^2/px^2]
};

struct CornerOptions {
  int most = 100;
  int columns = 14;  ///< cells
  int rows = 9;
  int fast_threshold = 12;
  double min_strength = 60;
  int border_px = kPatchHalf + 3;
  double min_separation_px = 14;  ///< from the places given, and from each other

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// Smaller eigenvalue around a pixel at least 4 from the border.
double corner_strength(const GrayView& image, int x, int y);

/// @param taken places of the features that are there already; cells with one of them are left out
/// @param out replaced @throws std::invalid_argument as CornerOptions::check.
void find_corners(const GrayView& image, std::span<const Eigen::Vector2d> taken, const CornerOptions& options,
                  std::vector<Corner>& out);

}  // namespace loc
