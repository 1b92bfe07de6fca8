#include "libloc/sim/box_texture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "libloc/core/check.hpp"

namespace loc::detail {
namespace {

constexpr double kMostTexels = 16e6;  // 255 times as much still fits into 32 bits
constexpr double kDefaultTexels = 1500;
constexpr double kSmallestSide = 0.05;  // [texel] of a rectangle: below, differences of sums lose their digits

std::array<float, 3> channels_of(const Colour& colour, int channels) {
  if (channels == 1) return {static_cast<float>(luma(colour)), 0, 0};
  return {static_cast<float>(colour[0]), static_cast<float>(colour[1]), static_cast<float>(colour[2])};
}

// A texel that a patch covers in part.
struct Partial {
  std::size_t texel;
  std::int32_t patch;
};

// Paints patch after patch in order, exactly: what is seen of each in a texel counts by its area. (Mixing one after the
// other would leave seams between patches that touch each other.)
class Painter {
 public:
  Painter(const Texture& texture, const Eigen::Vector2d& texels_per_m, int width, int height, int channels)
      : width_(width), height_(height), channels_(channels), whole_(count(width, height), -1) {
    colours_.push_back(channels_of(texture.background, channels));
    for (const Patch& patch : texture.patches) {
      colours_.push_back(channels_of(patch.colour, channels));
      low_.emplace_back(patch.low.cwiseProduct(texels_per_m));
      high_.emplace_back(patch.high.cwiseProduct(texels_per_m));
      lay(static_cast<std::int32_t>(low_.size()) - 1);
    }
    std::ranges::sort(parts_, [](const Partial& a, const Partial& b) {
      return a.texel != b.texel ? a.texel < b.texel : a.patch < b.patch;
    });
  }

  std::vector<std::uint8_t> bytes() const {
    const auto channels = static_cast<std::size_t>(channels_);
    std::vector<std::uint8_t> out(whole_.size() * channels);
    std::size_t next = 0;
    for (std::size_t i = 0; i < whole_.size(); ++i) {
      std::array<float, 3> colour = colour_of(whole_[i]);
      const std::size_t first = next;
      while (next < parts_.size() && parts_[next].texel == i) ++next;
      if (next > first) colour = mixed(i, std::span(parts_).subspan(first, next - first));
      for (std::size_t c = 0; c < channels; ++c)
        out[i * channels + c] = static_cast<std::uint8_t>(std::lround(colour.at(c)));
    }
    return out;
  }

 private:
  static std::size_t count(int width, int height) {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }

  // @param patch -1: the background
  const std::array<float, 3>& colour_of(std::int32_t patch) const {
    return colours_[static_cast<std::size_t>(std::int64_t{patch} + 1)];
  }

  void lay(std::int32_t patch) {
    const Eigen::Vector2d low = low_[static_cast<std::size_t>(patch)].cwiseMax(0.0);
    const Eigen::Vector2d high = high_[static_cast<std::size_t>(patch)].cwiseMin(Eigen::Vector2d(width_, height_));
    for (int y = static_cast<int>(low.y()); y < high.y(); ++y) {
      for (int x = static_cast<int>(low.x()); x < high.x(); ++x) {
        const std::size_t texel =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
        const bool whole = low.x() <= x && low.y() <= y && high.x() >= x + 1 && high.y() >= y + 1;
        if (whole) {
          whole_[texel] = patch;
        } else {
          parts_.push_back({texel, patch});
        }
      }
    }
  }

  // The texel is cut along every edge in it; each piece has the colour of the last patch over it.
  std::array<float, 3> mixed(std::size_t texel, std::span<const Partial> parts) const {
    const std::size_t row = texel / static_cast<std::size_t>(width_);
    const auto x = static_cast<double>(texel - row * static_cast<std::size_t>(width_));
    const auto y = static_cast<double>(row);
    std::vector<double> xs{x, x + 1};
    std::vector<double> ys{y, y + 1};
    for (const Partial& part : parts) {
      const auto p = static_cast<std::size_t>(part.patch);
      for (const double edge : {low_[p].x(), high_[p].x()}) xs.push_back(std::clamp(edge, x, x + 1));
      for (const double edge : {low_[p].y(), high_[p].y()}) ys.push_back(std::clamp(edge, y, y + 1));
    }
    std::ranges::sort(xs);
    std::ranges::sort(ys);
    std::array<float, 3> sum{};
    for (std::size_t i = 0; i + 1 < xs.size(); ++i) {
      for (std::size_t j = 0; j + 1 < ys.size(); ++j) {
        const double area = (xs[i + 1] - xs[i]) * (ys[j + 1] - ys[j]);
        if (area <= 0) continue;
        const Eigen::Vector2d middle((xs[i] + xs[i + 1]) / 2, (ys[j] + ys[j + 1]) / 2);
        std::int32_t top = whole_[texel];
        for (const Partial& part : parts) {
          const auto p = static_cast<std::size_t>(part.patch);
          const bool over = (middle.array() > low_[p].array()).all() && (middle.array() < high_[p].array()).all();
          if (over) top = std::max(top, part.patch);
        }
        const std::array<float, 3>& colour = colour_of(top);
        for (std::size_t c = 0; c < 3; ++c) sum.at(c) += static_cast<float>(area) * colour.at(c);
      }
    }
    return sum;
  }

  int width_;
  int height_;
  int channels_;
  std::vector<std::array<float, 3>> colours_;  // background first
  std::vector<Eigen::Vector2d> low_, high_;    // of the patches [texel]
  std::vector<std::int32_t> whole_;            // last patch that covers all of a texel; -1: none
  std::vector<Partial> parts_;
};

}  // namespace

double luma(const Colour& colour) {
  return 0.299 * colour[0] + 0.587 * colour[1] + 0.114 * colour[2];
}

BoxTexture::BoxTexture(const Texture& texture, double texel_m, int channels) : channels_(channels) {
  const double texel = texel_m > 0 ? texel_m : texture.size.maxCoeff() / kDefaultTexels;
  const Eigen::Array2d count = (texture.size.array() / texel).ceil();
  require(count.prod() <= kMostTexels, "texel_m", texel, "a texture would have more than 16 million texels");
  width_ = static_cast<int>(count.x());
  height_ = static_cast<int>(count.y());
  texels_per_m_ = (count / texture.size.array()).matrix();

  const auto stride = static_cast<std::size_t>(width_) * static_cast<std::size_t>(channels);
  const std::vector<std::uint8_t> texels = Painter(texture, texels_per_m_, width_, height_, channels).bytes();
  const std::size_t sum_stride = stride + static_cast<std::size_t>(channels);
  sums_.assign(sum_stride * static_cast<std::size_t>(height_ + 1), 0);
  for (int y = 0; y < height_; ++y) {
    const std::uint8_t* row = &texels[static_cast<std::size_t>(y) * stride];
    const std::uint32_t* below = &sums_[static_cast<std::size_t>(y) * sum_stride];
    std::uint32_t* out = &sums_[static_cast<std::size_t>(y + 1) * sum_stride];
    std::array<std::uint32_t, 3> left{};
    for (std::size_t i = 0; i < stride; ++i) {
      std::uint32_t& sum = left.at(i % static_cast<std::size_t>(channels));
      sum += row[i];
      out[i + static_cast<std::size_t>(channels)] = below[i + static_cast<std::size_t>(channels)] + sum;
    }
  }
}

// Of everything left of x and below y, in parts of texels.
double BoxTexture::sum(double x, double y, int channel) const {
  const int i = std::min(static_cast<int>(x), width_ - 1);
  const int j = std::min(static_cast<int>(y), height_ - 1);
  const double fx = x - i;
  const double fy = y - j;
  const std::size_t stride = static_cast<std::size_t>(width_ + 1) * static_cast<std::size_t>(channels_);
  const std::uint32_t* a =
      &sums_[static_cast<std::size_t>(j) * stride + static_cast<std::size_t>(i * channels_ + channel)];
  const std::uint32_t* b = a + stride;
  const double low = a[0] + fx * (a[channels_] - a[0]);
  const double high = b[0] + fx * (b[channels_] - b[0]);
  return low + fy * (high - low);
}

void BoxTexture::mean(const Eigen::Vector2d& centre, const Eigen::Vector2d& sides, float* out) const {
  const Eigen::Vector2d c = centre.cwiseProduct(texels_per_m_);
  const Eigen::Vector2d half = 0.5 * sides.cwiseProduct(texels_per_m_).cwiseMax(kSmallestSide);
  // A centre on the border itself keeps a rectangle of some size.
  const double x0 = std::clamp(c.x() - half.x(), 0.0, width_ - kSmallestSide / 2);
  const double y0 = std::clamp(c.y() - half.y(), 0.0, height_ - kSmallestSide / 2);
  const double x1 = std::clamp(c.x() + half.x(), x0 + kSmallestSide / 2, static_cast<double>(width_));
  const double y1 = std::clamp(c.y() + half.y(), y0 + kSmallestSide / 2, static_cast<double>(height_));
  const double area = (x1 - x0) * (y1 - y0);
  for (int k = 0; k < channels_; ++k) {
    const double total = sum(x1, y1, k) - sum(x0, y1, k) - sum(x1, y0, k) + sum(x0, y0, k);
    out[k] = static_cast<float>(total / area);
  }
}

}  // namespace loc::detail
