#include "libloc/sim/room.hpp"

#include <algorithm>
#include <cmath>

#include "libloc/core/check.hpp"

namespace loc {

void RoomModel::check() const {
  require(size_m.allFinite() && size_m.minCoeff() > 0, "size_m: must be positive and finite");
  require_positive("cell_m", cell_m);
  require(size_m.maxCoeff() / cell_m <= 1000, "cell_m", cell_m, "must be at least a thousandth of the room");
}

Colour shade(const Colour& colour, double factor) {
  Colour out{};
  std::ranges::transform(colour, out.begin(), [&](std::uint8_t c) {
    return static_cast<std::uint8_t>(std::clamp(std::lround(factor * c), 0L, 255L));
  });
  return out;
}

Texture scattered_rectangles(const Eigen::Vector2d& size, double cell, const Colour& background, Random& random) {
  require(size.allFinite() && size.minCoeff() > 0, "size: must be positive and finite");
  require_positive("cell_m", cell);
  Texture texture;
  texture.size = size;
  texture.background = background;
  const Eigen::Array2d count = (size.array() / cell).round().max(1.0);
  const Eigen::Array2d pitch = size.array() / count;
  for (int row = 0; row < count.y(); ++row) {
    for (int column = 0; column < count.x(); ++column) {
      // Within its cell, so that no other one covers its corners.
      const double left = random.uniform(0.08, 0.5);
      const double bottom = random.uniform(0.08, 0.5);
      const double width = random.uniform(0.2, 0.42);
      const double height = random.uniform(0.2, 0.42);
      // Never near the background's own brightness.
      const double step = random.uniform(0.35, 0.75);
      const double factor = random.uniform() < 0.5 ? 1 - step : 1 + step;
      const double tint = random.uniform(0.9, 1.1);
      const Eigen::Vector2d low = ((Eigen::Array2d(column, row) + Eigen::Array2d(left, bottom)) * pitch).matrix();
      const Eigen::Vector2d high = low + (Eigen::Array2d(width, height) * pitch).matrix();
      Colour colour = shade(background, factor);
      colour[0] = shade(colour, tint)[0];
      texture.patches.push_back({low, high, colour});
      texture.features.push_back(low);
    }
  }
  return texture;
}

Scene box_room(const RoomModel& model, Random random) {
  model.check();
  Scene scene;
  const Eigen::Vector3d s = model.size_m;
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  struct Wall {
    Eigen::Vector3d origin, right, up;  // right x up points into the room
    Eigen::Vector2d size;
    Colour colour;
  };
  const Eigen::Vector3d h(s.x() / 2, s.y() / 2, 0);
  const std::array<Wall, 6> walls{{{{-h.x(), h.y(), 0}, x, z, {s.x(), s.z()}, {150, 140, 120}},
                                   {{h.x(), -h.y(), 0}, -x, z, {s.x(), s.z()}, {120, 140, 150}},
                                   {{h.x(), h.y(), 0}, -y, z, {s.y(), s.z()}, {140, 150, 120}},
                                   {{-h.x(), -h.y(), 0}, y, z, {s.y(), s.z()}, {150, 120, 130}},
                                   {{-h.x(), -h.y(), 0}, x, y, {s.x(), s.y()}, {110, 100, 90}},
                                   {{-h.x(), h.y(), s.z()}, x, -y, {s.x(), s.y()}, {160, 160, 160}}}};
  for (const Wall& wall : walls) {
    scene.textures.push_back(scattered_rectangles(wall.size, model.cell_m, wall.colour, random));
    scene.add_face({wall.origin, wall.right, wall.up, static_cast<std::int32_t>(scene.textures.size() - 1)});
  }
  return scene;
}

}  // namespace loc
