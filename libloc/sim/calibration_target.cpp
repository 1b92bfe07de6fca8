#include "libloc/sim/calibration_target.hpp"

#include <array>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr Colour kBlack{20, 20, 20};
constexpr Colour kWhite{235, 235, 235};

constexpr std::array<std::uint64_t, kTag36h11Count> kCodes{
#include "libloc/sim/tag36h11.inc"
};

// Texture and face of a board whose paper begins at low: the frame of the texture begins there too.
Scene board(Texture texture, const Eigen::Vector2d& low) {
  for (Patch& patch : texture.patches) {
    patch.low -= low;
    patch.high -= low;
  }
  for (Eigen::Vector2d& f : texture.features) f -= low;
  Scene scene;
  scene.textures.push_back(std::move(texture));
  scene.add_face({.origin = {low.x(), low.y(), 0}, .right = Eigen::Vector3d::UnitX(), .up = Eigen::Vector3d::UnitY()});
  return scene;
}

}  // namespace

void CheckerboardModel::check() const {
  require(columns >= 2 && columns <= 1000, "columns", columns, "must be 2 to 1000");
  require(rows >= 2 && rows <= 1000, "rows", rows, "must be 2 to 1000");
  require_positive("square_m", square_m);
}

void AprilGridModel::check() const {
  require(columns >= 1 && columns <= kTag36h11Count, "columns", columns, "must be positive");
  require(rows >= 1 && rows <= kTag36h11Count, "rows", rows, "must be positive");
  require_positive("tag_m", tag_m);
  require(spacing > 0 && spacing < 1, "spacing", spacing, "must be in (0, 1)");
  require(first_tag >= 0, "first_tag", first_tag, "must not be negative");
  require(first_tag + columns * rows <= kTag36h11Count, "last tag", first_tag + columns * rows - 1,
          "the family ends at 586");
}

std::uint64_t tag36h11_code(int tag) {
  require(tag >= 0 && tag < kTag36h11Count, "tag", tag, "must be 0 to 586");
  return kCodes.at(static_cast<std::size_t>(tag));
}

Scene checkerboard(const CheckerboardModel& model) {
  model.check();
  const double s = model.square_m;
  Texture texture;
  texture.background = kWhite;
  texture.size = Eigen::Vector2d(model.columns + 3, model.rows + 3) * s;
  for (int row = -1; row < model.rows; ++row) {
    for (int column = -1; column < model.columns; ++column) {
      const Eigen::Vector2d low(column * s, row * s);
      if ((row + column) % 2 == 0) texture.patches.push_back({low, low + Eigen::Vector2d(s, s), kBlack});
      if (row >= 0 && column >= 0) texture.features.push_back(low);
    }
  }
  return board(std::move(texture), {-2 * s, -2 * s});
}

Scene april_grid(const AprilGridModel& model) {
  model.check();
  const double a = model.tag_m;
  const double gap = model.spacing * a;
  const double pitch = a + gap;
  Texture texture;
  texture.background = kWhite;
  // A white border of two gaps: detectors want one outside the small squares at the corners.
  texture.size =
      Eigen::Vector2d(model.columns * pitch - gap, model.rows * pitch - gap) + Eigen::Vector2d(4 * gap, 4 * gap);
  for (int row = 0; row < model.rows; ++row) {
    for (int column = 0; column < model.columns; ++column) {
      const Eigen::Vector2d low(column * pitch, row * pitch);
      texture.patches.push_back({low, low + Eigen::Vector2d(a, a), kBlack});
      const std::uint64_t code = tag36h11_code(model.first_tag + row * model.columns + column);
      const double cell = a / 8;
      for (int bit = 0; bit < 36; ++bit) {
        if ((code >> (35 - bit) & 1) == 0) continue;
        const Eigen::Vector2d corner = low + cell * Eigen::Vector2d(1 + bit % 6, 6 - bit / 6);
        texture.patches.push_back({corner, corner + Eigen::Vector2d(cell, cell), kWhite});
      }
      for (const Eigen::Vector2d& k :
           {Eigen::Vector2d(0, 0), Eigen::Vector2d(a, 0), Eigen::Vector2d(a, a), Eigen::Vector2d(0, a)}) {
        texture.features.emplace_back(low + k);
      }
    }
  }
  for (int row = 0; row <= model.rows && model.corner_squares; ++row) {
    for (int column = 0; column <= model.columns; ++column) {
      const Eigen::Vector2d low(column * pitch - gap, row * pitch - gap);
      texture.patches.push_back({low, low + Eigen::Vector2d(gap, gap), kBlack});
    }
  }
  return board(std::move(texture), {-2 * gap, -2 * gap});
}

}  // namespace loc
