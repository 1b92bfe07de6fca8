#include "libloc/vision/corner_detector.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr int kWindowHalf = 3;
constexpr std::size_t kLookedAt = 6;  // of the candidates of one cell, by their response to FAST

}  // namespace

void CornerOptions::check() const {
  require(columns >= 1 && columns <= 10000, "columns", columns, "must be in [1, 10000]");
  require(rows >= 1 && rows <= 10000, "rows", rows, "must be in [1, 10000]");
  require(fast_threshold >= 1 && fast_threshold <= 254, "fast_threshold", fast_threshold, "must be in [1, 254]");
  require(border_px > kWindowHalf, "border_px", border_px, "must be 4 or more");
  require(min_separation_px >= 0, "min_separation_px", min_separation_px, "must not be negative");
}

double corner_strength(const GrayView& image, int x, int y) {
  int xx = 0;
  int xy = 0;
  int yy = 0;
  for (int row = y - kWindowHalf; row <= y + kWindowHalf; ++row) {
    const std::uint8_t* above = image.row(row - 1);
    const std::uint8_t* at = image.row(row);
    const std::uint8_t* below = image.row(row + 1);
    for (int column = x - kWindowHalf; column <= x + kWindowHalf; ++column) {
      const int gx = at[column + 1] - at[column - 1];
      const int gy = below[column] - above[column];
      xx += gx * gx;
      xy += gx * gy;
      yy += gy * gy;
    }
  }
  constexpr double kScale = 0.25 / ((2 * kWindowHalf + 1) * (2 * kWindowHalf + 1));
  const double half_trace = 0.5 * (xx + yy);
  const double half_difference = 0.5 * (xx - yy);
  return kScale * (half_trace - std::hypot(half_difference, static_cast<double>(xy)));
}

void find_corners(const GrayView& image, std::span<const Eigen::Vector2d> taken, const CornerOptions& options,
                  std::vector<Corner>& out) {
  options.check();
  out.clear();
  if (options.most <= 0) return;
  const double cell_width = static_cast<double>(image.width) / options.columns;
  const double cell_height = static_cast<double>(image.height) / options.rows;
  std::vector<char> occupied(static_cast<std::size_t>(options.columns * options.rows), 0);
  for (const Eigen::Vector2d& pixel : taken) {
    const int column = std::clamp(static_cast<int>(pixel.x() / cell_width), 0, options.columns - 1);
    const int row = std::clamp(static_cast<int>(pixel.y() / cell_height), 0, options.rows - 1);
    occupied[static_cast<std::size_t>(row * options.columns + column)] = 1;
  }
  const auto crowded = [&](const Eigen::Vector2d& pixel, const auto& others, const auto& place) {
    const double nearest = options.min_separation_px * options.min_separation_px;
    return std::any_of(others.begin(), others.end(),
                       [&](const auto& other) { return (place(other) - pixel).squaredNorm() < nearest; });
  };
  // OpenCV has no view of what must not be changed.
  const cv::Mat picture(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data),
                        static_cast<std::size_t>(image.stride));
  std::vector<cv::KeyPoint> found;
  constexpr int kFastBorder = 3;
  for (int row = 0; row < options.rows; ++row) {
    for (int column = 0; column < options.columns; ++column) {
      if (occupied[static_cast<std::size_t>(row * options.columns + column)] != 0) continue;
      const int left = std::max(static_cast<int>(column * cell_width), options.border_px) - kFastBorder;
      const int top = std::max(static_cast<int>(row * cell_height), options.border_px) - kFastBorder;
      const int right =
          std::min(static_cast<int>((column + 1) * cell_width), image.width - options.border_px) + kFastBorder;
      const int bottom =
          std::min(static_cast<int>((row + 1) * cell_height), image.height - options.border_px) + kFastBorder;
      if (right - left <= 2 * kFastBorder || bottom - top <= 2 * kFastBorder) continue;
      cv::FAST(picture(cv::Rect(left, top, right - left, bottom - top)), found, options.fast_threshold, true);
      const std::size_t looked_at = std::min(kLookedAt, found.size());
      std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(looked_at), found.end(),
                        [](const cv::KeyPoint& a, const cv::KeyPoint& b) { return a.response > b.response; });
      Corner best;
      for (std::size_t i = 0; i < looked_at; ++i) {
        const int x = left + static_cast<int>(found[i].pt.x);
        const int y = top + static_cast<int>(found[i].pt.y);
        const double strength = corner_strength(image, x, y);
        if (strength <= std::max(options.min_strength, best.strength)) continue;
        const Eigen::Vector2d pixel(x, y);
        if (crowded(pixel, taken, [](const Eigen::Vector2d& other) { return other; })) continue;
        best = {pixel, strength};
      }
      if (best.strength > 0) out.push_back(best);
    }
  }
  std::sort(out.begin(), out.end(), [](const Corner& a, const Corner& b) { return a.strength > b.strength; });
  // Neighbouring cells may have found the same spot.
  std::size_t kept = 0;
  for (std::size_t i = 0; i < out.size() && kept < static_cast<std::size_t>(options.most); ++i) {
    const std::span<const Corner> before(out.data(), kept);
    if (crowded(out[i].pixel_px, before, [](const Corner& other) { return other.pixel_px; })) continue;
    out[kept++] = out[i];
  }
  out.resize(kept);
}

}  // namespace loc
