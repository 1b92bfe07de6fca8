#include "libloc/vision/patch.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace loc {
namespace {

constexpr int kPixels = WarpedPatch::kPixels;
constexpr float kLeastDeviation = 3;  // of the brightness over a patch: less is noise
constexpr double kLeastDeterminant = 1e-2;
constexpr int kMostIterations = 12;
constexpr double kConverged = 0.005;  // step of the fit [px]
constexpr double kLongestStep = 2;    // of one iteration [px]

// A patch of the picture with its middle at this place, bilinear. The fraction is the same for all its pixels.
bool sample(const GrayView& image, const Eigen::Vector2d& middle_px, std::array<float, kPixels>& out) {
  const double left = std::floor(middle_px.x());
  const double top = std::floor(middle_px.y());
  if (!(left >= kPatchHalf && top >= kPatchHalf && left + kPatchHalf + 1 < image.width &&
        top + kPatchHalf + 1 < image.height)) {
    return false;
  }
  const auto fx = static_cast<float>(middle_px.x() - left);
  const auto fy = static_cast<float>(middle_px.y() - top);
  const float w00 = (1 - fx) * (1 - fy);
  const float w10 = fx * (1 - fy);
  const float w01 = (1 - fx) * fy;
  const float w11 = fx * fy;
  float* to = out.data();
  for (int y = 0; y < kPatchSize; ++y, to += kPatchSize) {
    const std::uint8_t* a = image.row(static_cast<int>(top) - kPatchHalf + y) + static_cast<int>(left) - kPatchHalf;
    const std::uint8_t* b = a + image.stride;
    for (int x = 0; x < kPatchSize; ++x) {
      to[x] = w00 * static_cast<float>(a[x]) + w10 * static_cast<float>(a[x + 1]) + w01 * static_cast<float>(b[x]) +
              w11 * static_cast<float>(b[x + 1]);
    }
  }
  return true;
}

// Sums of the patch at whole pixels: enough for the correlation with values that have no mean.
struct Sums {
  float product = 0;
  float deviation = 0;  // root of the sum of squares less the mean
};
Sums sums_at(const WarpedPatch& patch, const GrayView& image, int middle_x, int middle_y) {
  float product = 0;
  int sum = 0;
  int squares = 0;
  const float* t = patch.value.data();
  for (int y = 0; y < kPatchSize; ++y, t += kPatchSize) {
    const std::uint8_t* row = image.row(middle_y - kPatchHalf + y) + middle_x - kPatchHalf;
    for (int x = 0; x < kPatchSize; ++x) {
      const int v = row[x];
      product += t[x] * static_cast<float>(v);
      sum += v;
      squares += v * v;
    }
  }
  const double mean = static_cast<double>(sum) / kPixels;
  return {product, static_cast<float>(std::sqrt(std::max(0.0, squares - mean * sum)))};
}

}  // namespace

bool ImagePatch::cut(const GrayView& image, const Eigen::Vector2d& pixel_px) {
  half_ = 0;
  if (!pixel_px.allFinite()) return false;
  const double x = std::round(pixel_px.x());
  const double y = std::round(pixel_px.y());
  const double room = std::min(std::min(x, y), std::min(image.width - 1 - x, image.height - 1 - y));
  // One more than the patch on each side, for gradients and fractions.
  if (!(room >= kPatchHalf + 2)) return false;
  half_ = static_cast<int>(std::min(room, static_cast<double>(kHalf)));
  offset_ = {pixel_px.x() - x, pixel_px.y() - y};
  for (int row = -half_; row <= half_; ++row) {
    const std::uint8_t* from = image.row(static_cast<int>(y) + row) + static_cast<int>(x) - half_;
    std::copy(from, from + 2 * half_ + 1, &pixels_[static_cast<std::size_t>((row + kHalf) * kSize + kHalf - half_)]);
  }
  return true;
}

bool ImagePatch::warp(const Eigen::Matrix2d& warp, WarpedPatch& out) const {
  if (half_ == 0 || !warp.allFinite() || !(std::abs(warp.determinant()) > kLeastDeterminant)) return false;
  const Eigen::Matrix2d back = warp.inverse();
  constexpr int kBorder = kPatchHalf + 1;
  constexpr int kWide = 2 * kBorder + 1;
  // The corners tell whether all of it is there.
  const double reach_x = kBorder * (std::abs(back(0, 0)) + std::abs(back(0, 1))) + std::abs(offset_.x());
  const double reach_y = kBorder * (std::abs(back(1, 0)) + std::abs(back(1, 1))) + std::abs(offset_.y());
  if (!(reach_x < half_ && reach_y < half_)) return false;
  std::array<float, kWide * kWide> wide;
  for (int y = -kBorder; y <= kBorder; ++y) {
    for (int x = -kBorder; x <= kBorder; ++x) {
      const double px = back(0, 0) * x + back(0, 1) * y + offset_.x() + kHalf;
      const double py = back(1, 0) * x + back(1, 1) * y + offset_.y() + kHalf;
      const int ix = static_cast<int>(px);
      const int iy = static_cast<int>(py);
      const auto fx = static_cast<float>(px - ix);
      const auto fy = static_cast<float>(py - iy);
      const std::uint8_t* a = &pixels_[static_cast<std::size_t>(iy * kSize + ix)];
      const std::uint8_t* b = a + kSize;
      const float upper = static_cast<float>(a[0]) + fx * (static_cast<float>(a[1]) - static_cast<float>(a[0]));
      const float lower = static_cast<float>(b[0]) + fx * (static_cast<float>(b[1]) - static_cast<float>(b[0]));
      wide[static_cast<std::size_t>((y + kBorder) * kWide + x + kBorder)] = upper + fy * (lower - upper);
    }
  }
  float mean = 0;
  for (int y = 0; y < kPatchSize; ++y) {
    for (int x = 0; x < kPatchSize; ++x) {
      const float* at = &wide[static_cast<std::size_t>((y + 1) * kWide + x + 1)];
      const auto i = static_cast<std::size_t>(y * kPatchSize + x);
      out.value[i] = at[0];
      out.dx[i] = 0.5F * (at[1] - at[-1]);
      out.dy[i] = 0.5F * (at[kWide] - at[-kWide]);
      mean += at[0];
    }
  }
  mean /= kPixels;
  using Vector = Eigen::Matrix<float, kPixels, 1>;
  Eigen::Map<Vector> value(out.value.data());
  const Eigen::Map<Vector> dx(out.dx.data());
  const Eigen::Map<Vector> dy(out.dy.data());
  value.array() -= mean;
  out.norm = value.norm();
  if (!(out.norm > kLeastDeviation * kPatchSize)) return false;
  Eigen::Matrix4d normal;
  normal << dx.dot(dx), dx.dot(dy), dx.dot(value), dx.sum(),  //
      0, dy.dot(dy), dy.dot(value), dy.sum(),                 //
      0, 0, value.dot(value), 0,                              //
      0, 0, 0, kPixels;
  normal.triangularView<Eigen::StrictlyLower>() = normal.transpose();
  const Eigen::Matrix2d other = normal.bottomRightCorner<2, 2>().inverse();
  out.information =
      normal.topLeftCorner<2, 2>() - normal.topRightCorner<2, 2>() * other * normal.bottomLeftCorner<2, 2>();
  // Smallest curvature: along an edge nothing says where the patch is.
  const double half_trace = 0.5 * out.information.trace();
  const double least = half_trace - std::sqrt(std::max(0.0, half_trace * half_trace - out.information.determinant()));
  if (!(least > kPixels)) return false;
  bool invertible = false;
  normal.computeInverseWithCheck(out.solve, invertible);
  return invertible;
}

PatchMatch search_patch(const WarpedPatch& patch, const GrayView& image, const Eigen::Vector2d& middle_px,
                        const Eigen::Matrix2d& covariance, double sigmas, int largest_px) {
  PatchMatch best;
  if (!middle_px.allFinite() || !covariance.allFinite()) return best;
  const Eigen::Matrix2d information = covariance.inverse();
  const auto reach = [&](int axis) {
    return std::min(static_cast<double>(largest_px), std::ceil(sigmas * std::sqrt(covariance(axis, axis))));
  };
  const auto from = [&](double at, double by) {
    return std::max(static_cast<double>(kPatchHalf), std::round(at - by));
  };
  const auto to = [&](double at, double by, int size) {
    return std::min(size - 1.0 - kPatchHalf, std::round(at + by));
  };
  const double rx = reach(0);
  const double ry = reach(1);
  best.correlation = -1;
  for (double y = from(middle_px.y(), ry); y <= to(middle_px.y(), ry, image.height); ++y) {
    for (double x = from(middle_px.x(), rx); x <= to(middle_px.x(), rx, image.width); ++x) {
      const Eigen::Vector2d away(x - middle_px.x(), y - middle_px.y());
      // The pixel in the middle always counts.
      if (away.cwiseAbs().maxCoeff() > 0.5 && !(away.dot(information * away) <= sigmas * sigmas)) continue;
      const Sums sums = sums_at(patch, image, static_cast<int>(x), static_cast<int>(y));
      if (!(sums.deviation > kLeastDeviation * kPatchSize)) continue;
      const double correlation = sums.product / (patch.norm * sums.deviation);
      if (correlation > best.correlation) {
        best.correlation = correlation;
        best.pixel_px = {x, y};
        best.found = true;
      }
    }
  }
  return best;
}

PatchMatch align_patch(const WarpedPatch& patch, const GrayView& image, const Eigen::Vector2d& start_px,
                       double farthest_px) {
  using Vector = Eigen::Matrix<float, kPixels, 1>;
  const Eigen::Map<const Vector> value(patch.value.data());
  const Eigen::Map<const Vector> dx(patch.dx.data());
  const Eigen::Map<const Vector> dy(patch.dy.data());
  PatchMatch out;
  out.pixel_px = start_px;
  std::array<float, kPixels> seen;
  Eigen::Map<Vector> now(seen.data());
  double gain = 1;
  const auto judge = [&] {
    now.array() -= now.mean();
    const double deviation = now.norm();
    out.correlation = deviation > 0 ? value.dot(now) / (patch.norm * deviation) : 0.0;
    out.gain = value.dot(now) / (patch.norm * patch.norm);
  };
  for (out.iterations = 1; out.iterations <= kMostIterations; ++out.iterations) {
    if (!sample(image, out.pixel_px, seen)) return out;
    judge();
    // A negative or vanishing gain is another pattern.
    gain = out.gain;
    if (!(gain > 0.1)) return out;
    const Vector residual = now - static_cast<float>(gain) * value;
    const Eigen::Vector4d right(dx.dot(residual), dy.dot(residual), value.dot(residual), residual.sum());
    const Eigen::Vector2d step = (patch.solve.topRows<2>() * right) / gain;
    if (!step.allFinite() || step.norm() > kLongestStep) return out;
    out.pixel_px -= step;
    if (!((out.pixel_px - start_px).norm() <= farthest_px)) return out;
    if (step.norm() < kConverged) {
      out.found = true;
      return out;
    }
  }
  return out;
}

}  // namespace loc
