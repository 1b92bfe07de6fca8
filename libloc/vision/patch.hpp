// A small piece of a picture by which a feature is found again: cut out where it was first seen, brought into the shape
// that it has in a later picture by an affine warp, looked for by normalised cross-correlation, and placed to a
// hundredth of a pixel by a Gauss-Newton fit of place, gain and offset of the brightness.
//   fit: I(x + p) = gain T(x) + offset over the patch, inverse compositional: the gradients are those of T, once
// Frames: pixel (0,0) is the centre of the top-left pixel. Source: S. Baker, I. Matthews, "Lucas-Kanade 20 years on: a
// unifying framework", IJCV 56, 2004 (inverse compositional fit); A. Davison, "Real-time simultaneous localisation and
// mapping with a single camera", ICCV 2003 (active search). Allocates nothing.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace loc {

/// A grey picture of 8 bits that somebody else holds.
struct GrayView {
  const std::uint8_t* data = nullptr;
  int width = 0;
  int height = 0;
  int stride = 0;  ///< bytes from row to row

  const std::uint8_t* row(int y) const { return data + static_cast<std::ptrdiff_t>(y) * stride; }
};

inline constexpr int kPatchHalf = 7;
inline constexpr int kPatchSize = 2 * kPatchHalf + 1;

/// A patch in the shape in which it is looked for, with its gradients.
struct WarpedPatch {
  static constexpr int kPixels = kPatchSize * kPatchSize;
  std::array<float, kPixels> value;  // less the mean
  std::array<float, kPixels> dx;
  std::array<float, kPixels> dy;
  float norm = 0;               ///< root of the sum of squares of value
  Eigen::Matrix2d information;  ///< sum of g g^T of the gradients, less what gain and offset take
  Eigen::Matrix4d solve;        ///< inverse of the normal matrix of (p, gain, offset)
};

/// What was seen around a feature when it was first seen, with room for warps.
class ImagePatch {
 public:
  static constexpr int kHalf = 22;

  /// @returns false, and holds nothing, for a place so near to the border that not even the patch itself fits.
  bool cut(const GrayView& image, const Eigen::Vector2d& pixel_px);
  bool empty() const { return half_ == 0; }
  /// What was cut, of 2 half + 1 pixels each way. @param middle_px is set to where the feature is in it
  GrayView view(Eigen::Vector2d& middle_px) const {
    const std::size_t first = static_cast<std::size_t>((kHalf - half_) * (kSize + 1));
    middle_px = offset_.array() + half_;
    return {&pixels_[first], 2 * half_ + 1, 2 * half_ + 1, kSize};
  }

  /// @param warp from offsets in the picture where it was cut to offsets in the one where it is looked for
  /// @returns false for a warp that reaches beyond what was cut, or is (nearly) singular, or for a patch without
  /// texture.
  bool warp(const Eigen::Matrix2d& warp, WarpedPatch& out) const;

 private:
  static constexpr int kSize = 2 * kHalf + 1;
  std::array<std::uint8_t, kSize * kSize> pixels_{};
  Eigen::Vector2d offset_ = Eigen::Vector2d::Zero();  // of the feature from the middle of pixels_
  int half_ = 0;                                      // so many pixels around the middle are there
};

struct PatchMatch {
  bool found = false;
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  double correlation = 0;  ///< normalised, in [-1, 1]
  double gain = 1;
  int iterations = 0;
};

/// Best whole pixel by normalised cross-correlation among those within sigmas of the middle, by covariance.
/// @param largest_px the ellipse is cut off there, in each direction
/// @returns found only when the patch fits into the picture somewhere in it.
PatchMatch search_patch(const WarpedPatch& patch, const GrayView& image, const Eigen::Vector2d& middle_px,
                        const Eigen::Matrix2d& covariance, double sigmas, int largest_px);

/// From a place that is right to a pixel or two. @returns found when it converged within the picture, at most
/// farthest_px away.
PatchMatch align_patch(const WarpedPatch& patch, const GrayView& image, const Eigen::Vector2d& start_px,
                       double farthest_px);

}  // namespace loc
