// A texture as pixels, whose mean over any rectangle is found in constant time (summed-area table; Crow 1984).
// Internal to the renderer.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "libloc/sim/scene.hpp"

namespace loc::detail {

class BoxTexture {
 public:
  /// @param texel_m side of a texel; 0: a 1500th of the longer side. @param channels 1 (brightness) or 3 (red,
  /// green, blue). @throws std::invalid_argument for more than 16 million texels.
  BoxTexture(const Texture& texture, double texel_m, int channels);

  /// Mean over the rectangle with this centre and these sides [m], cut at the texture's border; one value per channel.
  void mean(const Eigen::Vector2d& centre, const Eigen::Vector2d& sides, float* out) const;

 private:
  double sum(double x, double y, int channel) const;

  int width_;
  int height_;
  int channels_;
  Eigen::Vector2d texels_per_m_;
  // Of the texels left of and below: (width + 1) x (height + 1) x channels. Sums of bytes, exact.
  std::vector<std::uint32_t> sums_;
};

/// Brightness of a colour (ITU-R BT.601), 0 to 255.
double luma(const Colour& colour);

}  // namespace loc::detail
