#include "libloc/sim/street.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libloc/core/check.hpp"
#include "libloc/sim/room.hpp"

namespace loc {
namespace {

constexpr double kLongestStreet = 20'000;  // [m]
constexpr double kRoadPiece = 6;           // [m]
constexpr double kSample = 1;              // [m]

// The path by its length: places a metre apart.
struct Line {
  std::vector<Eigen::Vector3d> places;
  double length() const { return kSample * static_cast<double>(places.size() - 1); }

  Eigen::Vector3d at(double s) const {
    const double x = std::clamp(s / kSample, 0.0, static_cast<double>(places.size() - 1));
    const auto i = std::min(static_cast<std::size_t>(x), places.size() - 2);
    return places[i] + (x - static_cast<double>(i)) * (places[i + 1] - places[i]);
  }
  // Horizontal unit vector along the path.
  Eigen::Vector3d along(double s) const {
    Eigen::Vector3d d = at(std::min(s + kSample, length())) - at(std::max(s - kSample, 0.0));
    d.z() = 0;
    return d.normalized();
  }
  static Eigen::Vector3d left_of(const Eigen::Vector3d& along) { return {-along.y(), along.x(), 0}; }
};

Line resampled(const std::vector<Eigen::Vector3d>& path, double extend) {
  std::vector<Eigen::Vector3d> corners;
  for (const Eigen::Vector3d& p : path) {
    require(p.allFinite(), "path: must be finite");
    // The direction of very short pieces is noise.
    if (corners.empty() || (p - corners.back()).head<2>().norm() > 1e-3) corners.push_back(p);
  }
  require(corners.size() >= 2, "path: must have two different places at least");
  if (extend > 0) {
    const auto beyond = [&](const Eigen::Vector3d& from, Eigen::Vector3d to) -> Eigen::Vector3d {
      to.z() = from.z();
      return from + extend * (from - to).normalized();
    };
    const Eigen::Vector3d first = beyond(corners.front(), corners[1]);
    const Eigen::Vector3d last = beyond(corners.back(), corners[corners.size() - 2]);
    corners.insert(corners.begin(), first);
    corners.push_back(last);
  }
  Line line;
  line.places.push_back(corners.front());
  double rest = kSample;  // to the next sample
  double total = 0;
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    const Eigen::Vector3d step = corners[i + 1] - corners[i];
    const double length = step.head<2>().norm();
    total += length;
    require(total <= kLongestStreet, "path: length", total, "must be at most 20 km");
    for (; rest <= length; rest += kSample) line.places.push_back(corners[i] + (rest / length) * step);
    rest -= length;
  }
  if (line.places.size() < 2) line.places.push_back(corners.back());
  return line;
}

// A house: bricks here and there, storeys of windows with panes of different brightness.
Texture house(const StreetModel& model, Random& random) {
  const double brightness = random.uniform(0.75, 1.3);
  const Colour wall = shade({random.uniform() < 0.5 ? std::uint8_t{150} : std::uint8_t{135}, 125, 115}, brightness);
  const double width = random.uniform(model.min_facade_m, model.max_facade_m);
  const double height = random.uniform(model.min_height_m, model.max_height_m);
  Texture texture = scattered_rectangles({width, height}, 0.35 * model.window_m, wall, random);
  texture.features.clear();  // windows cover some of them
  const Eigen::Array2d count = (Eigen::Array2d(width, height) / model.window_m).floor().max(1.0);
  const Eigen::Array2d pitch = Eigen::Array2d(width, height) / count;
  for (int row = 0; row < count.y(); ++row) {
    for (int column = 0; column < count.x(); ++column) {
      const double left = random.uniform(0.15, 0.25);
      const double bottom = random.uniform(0.15, 0.25);
      const double wide = random.uniform(0.45, 0.6);
      const double high = random.uniform(0.45, 0.6);
      const double pane = random.uniform(0.1, 0.9);
      const Eigen::Vector2d low = (pitch * (Eigen::Array2d(column, row) + Eigen::Array2d(left, bottom))).matrix();
      const Eigen::Vector2d size = (pitch * Eigen::Array2d(wide, high)).matrix();
      const Eigen::Vector2d top = low + size;
      texture.patches.push_back({low, top, {32, 34, 40}});
      const Eigen::Vector2d frame = 0.12 * size;
      texture.patches.push_back({low + frame, top - frame, shade({110, 125, 140}, 2 * pane)});
      const double bar = low.x() + random.uniform(0.35, 0.65) * size.x();
      texture.patches.push_back({{bar - 0.04 * size.x(), low.y()}, {bar + 0.04 * size.x(), top.y()}, {32, 34, 40}});
      texture.features.insert(texture.features.end(), {low, {top.x(), low.y()}, top, {low.x(), top.y()}});
    }
  }
  return texture;
}

// A piece of road: the dash of the middle line and the lines at both edges; x along the road, y to its left.
Texture road_piece(double width, Random& random) {
  Texture texture = scattered_rectangles({kRoadPiece, width}, 1, {85, 85, 88}, random);
  for (Patch& patch : texture.patches) patch.colour = shade({85, 85, 88}, random.uniform(0.85, 1.15));
  texture.features.clear();
  const Colour paint{225, 225, 220};
  const Eigen::Vector2d low(1.5, width / 2 - 0.08);
  const Eigen::Vector2d high(4.5, width / 2 + 0.08);
  texture.patches.push_back({low, high, paint});
  texture.patches.push_back({{0, 0.2}, {kRoadPiece, 0.35}, paint});
  texture.patches.push_back({{0, width - 0.35}, {kRoadPiece, width - 0.2}, paint});
  texture.features = {low, {high.x(), low.y()}, high, {low.x(), high.y()}};
  return texture;
}

double horizontal_distance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector2d ab = (b - a).head<2>();
  const Eigen::Vector2d ap = (p - a).head<2>();
  const double t = std::clamp(ap.dot(ab) / ab.squaredNorm(), 0.0, 1.0);
  return (ap - t * ab).norm();
}

// Houses on one side (1: left, -1: right of the path).
void add_houses(Scene& scene, const Line& line, double side, const StreetModel& model, Random& random) {
  const double offset = side * (model.road_width_m / 2 + model.pavement_m);
  const auto kerb = [&](double s) -> Eigen::Vector3d { return line.at(s) + offset * Line::left_of(line.along(s)); };
  double s = 0;
  while (s < line.length()) {
    const auto kind = static_cast<std::int32_t>(random.uniform(0, model.kinds));
    const double gap = random.uniform(0, model.largest_gap_m);
    const double width = scene.textures[static_cast<std::size_t>(kind)].size.x();
    const Eigen::Vector3d from = kerb(s);
    double end = s + 0.25;
    while (end < line.length() && (kerb(end) - from).head<2>().norm() < width) end += 0.25;
    if (end >= line.length()) return;
    Eigen::Vector3d along = kerb(end) - from;
    along.z() = 0;
    along.normalize();
    const Eigen::Vector3d to = from + width * along;
    const bool on_road = std::ranges::any_of(line.places, [&](const Eigen::Vector3d& p) {
      return horizontal_distance(p, from, to) < model.road_width_m / 2 + 0.25 * model.pavement_m;
    });
    // Its front looks at the road: on the right side its right is backwards.
    if (!on_road) scene.add_face({side > 0 ? from : to, side * along, Eigen::Vector3d::UnitZ(), kind});
    s = end + gap;
  }
}

}  // namespace

void StreetModel::check() const {
  require_positive("road_width_m", road_width_m);
  require_positive("pavement_m", pavement_m);
  require(min_facade_m >= 1 && min_facade_m <= max_facade_m && std::isfinite(max_facade_m), "min_facade_m",
          min_facade_m, "must be at least 1 and at most max_facade_m");
  require(min_height_m >= 1 && min_height_m <= max_height_m && std::isfinite(max_height_m), "min_height_m",
          min_height_m, "must be at least 1 and at most max_height_m");
  require_not_negative("largest_gap_m", largest_gap_m);
  require(window_m >= 0.3 && std::isfinite(window_m), "window_m", window_m, "must be at least 0.3, and finite");
  require_not_negative("extend_m", extend_m);
  require(kinds >= 1 && kinds <= 1000, "kinds", kinds, "must be 1 to 1000");
}

std::vector<Eigen::Vector3d> sampled_path(const Motion& motion, double spacing, double height) {
  require_positive("spacing_m", spacing);
  require_finite("height_m", height);
  const double duration = motion.duration_s();
  require(std::isfinite(duration), "motion: must have an end");
  std::vector<Eigen::Vector3d> path;
  const auto place = [&](const MotionState& state) {
    const Eigen::Vector3d& p = state.T_world_body.translation;
    path.emplace_back(p.x(), p.y(), height);
  };
  double t = 0;
  while (t < duration) {
    const MotionState state = motion.at(t);
    place(state);
    // A body at rest, or slow, is asked again soon.
    t += std::clamp(spacing / std::max(state.velocity.head<2>().norm(), 1e-3), 0.02, 0.5);
  }
  place(motion.at(duration));
  return path;
}

Scene street(const std::vector<Eigen::Vector3d>& path, const StreetModel& model, Random random) {
  model.check();
  const Line line = resampled(path, model.extend_m);
  Scene scene;
  for (int i = 0; i < model.kinds; ++i) scene.textures.push_back(house(model, random));
  scene.textures.push_back(road_piece(model.road_width_m, random));
  const auto road = static_cast<std::int32_t>(model.kinds);

  add_houses(scene, line, 1, model, random);
  add_houses(scene, line, -1, model, random);
  for (double s = 0; s + kRoadPiece < line.length(); s += kRoadPiece) {
    const Eigen::Vector3d along = line.along(s + kRoadPiece / 2);
    const Eigen::Vector3d left = Line::left_of(along);
    scene.add_face({line.at(s) - model.road_width_m / 2 * left, along, left, road});
  }
  return scene;
}

}  // namespace loc
