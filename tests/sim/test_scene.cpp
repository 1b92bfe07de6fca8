#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>

#include "libloc/geometry/so3.hpp"
#include "libloc/sim/calibration_target.hpp"
#include "libloc/sim/room.hpp"
#include "libloc/sim/scene.hpp"
#include "libloc/sim/street.hpp"
#include "tests/support/numeric_jacobian.hpp"

namespace loc {
namespace {

using test::near;

template <class F>
std::string message_of(const F& f) {
  try {
    f();
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return "";
}

std::array<double, 3> key(const ScenePoint& p) {
  return {p.position.x(), p.position.y(), p.position.z()};
}

/// The colour of a texture at a place.
Colour colour_at(const Texture& texture, const Eigen::Vector2d& p) {
  Colour colour = texture.background;
  for (const Patch& patch : texture.patches) {
    if ((p.array() > patch.low.array()).all() && (p.array() < patch.high.array()).all()) colour = patch.colour;
  }
  return colour;
}

/// A feature is a corner: the four fields around it are not the same, and not split by one straight line along an axis.
bool is_corner(const Texture& texture, const Eigen::Vector2d& p) {
  const double d = 1e-4;
  const Colour a = colour_at(texture, p + Eigen::Vector2d(-d, -d));
  const Colour b = colour_at(texture, p + Eigen::Vector2d(d, -d));
  const Colour c = colour_at(texture, p + Eigen::Vector2d(-d, d));
  const Colour e = colour_at(texture, p + Eigen::Vector2d(d, d));
  return !(a == b && c == e) && !(a == c && b == e);
}

bool inside(const Scene& scene, const ScenePoint& p) {
  const Face& face = scene.faces.at(static_cast<std::size_t>(p.face));
  const Eigen::Vector2d size = scene.textures.at(static_cast<std::size_t>(face.texture)).size;
  const Eigen::Vector3d d = p.position - face.origin;
  const double x = d.dot(face.right);
  const double y = d.dot(face.up);
  return std::abs(d.dot(face.normal())) < 1e-9 && x >= 0 && y >= 0 && x <= size.x() && y <= size.y();
}

void expect_sound(const Scene& scene) {
  EXPECT_NO_THROW(scene.check());
  for (const ScenePoint& p : scene.points) ASSERT_TRUE(inside(scene, p));
  for (const Texture& texture : scene.textures) {
    for (const Eigen::Vector2d& f : texture.features) ASSERT_TRUE(is_corner(texture, f)) << f.transpose();
  }
}

TEST(Scene, RoomHasFeaturesOnItsSixWallsAndAllAreSeenFromInside) {
  const Scene room = box_room({.size_m = {8, 6, 3}, .cell_m = 0.5}, Random(3));
  expect_sound(room);
  EXPECT_EQ(room.faces.size(), 6U);
  EXPECT_EQ(room.points.size(), 2U * (16 * 6 + 12 * 6 + 16 * 12));
  for (const Eigen::Vector3d& eye : {Eigen::Vector3d(0, 0, 1.5), Eigen::Vector3d(-3.9, 2.9, 0.1)}) {
    const SightLines sight(room, eye, 100);
    for (const ScenePoint& p : room.points) EXPECT_TRUE(sight.reach(p));
  }
  // From outside every wall shows its back.
  const SightLines outside(room, {20, 1, 1}, 100);
  EXPECT_EQ(std::ranges::count_if(room.points, [&](const ScenePoint& p) { return outside.reach(p); }),
            2 * (96 + 192) + 72);
}

TEST(Scene, TheSameSeedGivesTheSameScene) {
  const auto points = [](const Scene& scene) {
    std::vector<std::array<double, 3>> out;
    for (const ScenePoint& p : scene.points) out.push_back(key(p));
    return out;
  };
  const std::vector<Eigen::Vector3d> path{{0, 0, 0}, {80, 0, 0}};
  EXPECT_EQ(points(box_room({}, Random(3))), points(box_room({}, Random(3))));
  EXPECT_NE(points(box_room({}, Random(3))), points(box_room({}, Random(4))));
  EXPECT_EQ(points(street(path, {}, Random(3))), points(street(path, {}, Random(3))));
  EXPECT_NE(points(street(path, {}, Random(3))), points(street(path, {}, Random(4))));
}

TEST(Scene, AFaceHidesWhatIsBehindItAndOnlyFromItsFront) {
  Scene scene = Scene::of_points({{0, 5, 0}, {0, 0.5, 0}, {3, 5, 0}, {0, 2, 0}});
  scene.textures.push_back({.size = {2, 2}});
  // Its front looks towards -y.
  scene.add_face({.origin = {-1, 2, -1}, .right = {1, 0, 0}, .up = {0, 0, 1}});
  scene.textures[0].features = {{1, 1}};
  const auto seen = [&](const Eigen::Vector3d& eye) {
    const SightLines sight(scene, eye, 100);
    std::string text;
    for (const ScenePoint& p : scene.points) text += sight.reach(p) ? '1' : '0';
    return text;
  };
  EXPECT_EQ(seen({0, 0, 0}), "0111");
  EXPECT_EQ(seen({0, 9, 0}), "1111");    // the back is not there
  EXPECT_EQ(seen({1.5, 0, 0}), "0111");  // it is met at x = 0.9
  EXPECT_EQ(seen({4, 0, 0}), "1111");    // from (4,0) to (0,5) it meets the face at x = 2.4: beside it
}

TEST(Scene, FacadesStandAlongBothSidesOfAnyRoadAndNeverOnIt) {
  // An S of two bends, and a crossing of itself.
  std::vector<Eigen::Vector3d> path;
  for (int i = 0; i <= 300; ++i) {
    const double a = 0.02 * i;
    path.emplace_back(90 * std::sin(a), 60 * std::sin(2 * a), 0.3);
  }
  const StreetModel model;
  const Scene scene = street(path, model, Random(5));
  expect_sound(scene);
  int left = 0;
  int right = 0;
  const double reach = model.road_width_m / 2;
  for (const Face& face : scene.faces) {
    if (std::abs(face.up.z()) < 0.5) continue;  // road
    const Eigen::Vector2d size = scene.textures[static_cast<std::size_t>(face.texture)].size;
    double nearest = 1e9;
    std::size_t at = 0;
    for (std::size_t i = 0; i < path.size(); ++i) {
      for (double share = 0; share <= 1; share += 0.1) {
        const double d = (face.at({share * size.x(), 0}) - path[i]).head<2>().norm();
        if (d < nearest) {
          nearest = d;
          at = i;
        }
      }
    }
    EXPECT_GT(nearest, reach);
    if (nearest > reach + model.pavement_m + 1) continue;  // of the straight ends
    EXPECT_NEAR(face.origin.z(), 0.3, 1e-9);
    const Eigen::Vector3d along = path[std::min(at + 1, path.size() - 1)] - path[at > 0 ? at - 1 : 0];
    const Eigen::Vector3d to_face = face.at(size / 2) - path[at];
    EXPECT_LT(face.normal().dot(to_face), 0);  // looks at the road
    (along.cross(to_face).z() > 0 ? left : right) += 1;
  }
  EXPECT_GT(left, 15);
  EXPECT_GT(right, 15);
  const double length = 60.0;
  EXPECT_GT(static_cast<double>(scene.points.size()), length * 10);
}

TEST(Scene, CheckerboardHasItsCornersInOrder) {
  const CheckerboardModel model{.columns = 9, .rows = 6, .square_m = 0.04};
  const Scene board = checkerboard(model);
  expect_sound(board);
  ASSERT_EQ(board.points.size(), 54U);
  EXPECT_TRUE(near(board.points[0].position, Eigen::Vector3d::Zero(), 1e-15));
  EXPECT_TRUE(near(board.points[2 * 9 + 5].position, Eigen::Vector3d(0.2, 0.08, 0), 1e-15));
  EXPECT_TRUE(near(board.faces[0].normal(), Eigen::Vector3d::UnitZ(), 0));
}

TEST(Scene, AprilGridIsKalibrs) {
  const Scene grid = april_grid({});
  expect_sound(grid);
  ASSERT_EQ(grid.points.size(), 144U);
  // Corners as in the recordings made with Kalibr's 6x6 grid of 88 mm tags.
  const auto corner = [&](int tag, int k) { return grid.points[static_cast<std::size_t>(4 * tag + k)].position; };
  EXPECT_TRUE(near(corner(0, 2), Eigen::Vector3d(0.088, 0.088, 0), 1e-15));
  EXPECT_TRUE(near(corner(0, 3), Eigen::Vector3d(0, 0.088, 0), 1e-15));
  EXPECT_TRUE(near(corner(7, 1), Eigen::Vector3d(0.1144 + 0.088, 0.1144, 0), 1e-15));
  // Of the family: any two tags, however turned, differ in at least 11 cells.
  EXPECT_EQ(tag36h11_code(0), 0xd5d628584U);
  const auto turned = [](std::uint64_t code) {
    std::uint64_t out = 0;
    for (int y = 0; y < 6; ++y) {
      for (int x = 0; x < 6; ++x) out = out << 1 | (code >> (35 - (6 * (5 - x) + y)) & 1);
    }
    return out;
  };
  int nearest = 36;
  for (int i = 0; i < kTag36h11Count; ++i) {
    std::uint64_t code = tag36h11_code(i);
    for (int turn = 0; turn < 4; ++turn, code = turned(code)) {
      for (int j = 0; j < kTag36h11Count; ++j) {
        if (j == i && turn == 0) continue;
        nearest = std::min(nearest, std::popcount(code ^ tag36h11_code(j)));
      }
    }
  }
  EXPECT_EQ(nearest, 11);
}

TEST(Scene, ScenesAreAddedWithTheirFacesAndTextures) {
  Scene scene = box_room({}, Random(1));
  const std::size_t points = scene.points.size();
  const Pose3 T_world_target{so3::exp({1.2, -0.3, 0.5}), {1, 0.5, 1.5}};
  const Scene board = checkerboard({});
  EXPECT_EQ(scene.add(board, T_world_target), static_cast<std::int64_t>(points));
  expect_sound(scene);
  EXPECT_TRUE(near(scene.points.back().position, T_world_target * board.points.back().position, 1e-15));
  EXPECT_EQ(scene.points.back().face, 6);
  EXPECT_EQ(scene.faces.back().texture, 6);
}

TEST(Scene, WrongModelsAndScenesAreNamed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto contains = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  EXPECT_TRUE(contains(message_of([] { box_room({.size_m = {8, -1, 3}}, Random(1)); }), "size_m"));
  EXPECT_TRUE(contains(message_of([] { box_room({.cell_m = 0}, Random(1)); }), "cell_m = 0"));
  EXPECT_TRUE(contains(message_of([] { box_room({.cell_m = 1e-9}, Random(1)); }), "cell_m = 1e-09"));
  EXPECT_TRUE(contains(message_of([] { checkerboard({.columns = 1}); }), "columns = 1"));
  EXPECT_TRUE(contains(message_of([] { april_grid({.columns = 30, .rows = 20}); }), "last tag = 599"));
  EXPECT_TRUE(contains(message_of([] { april_grid({.spacing = 1}); }), "spacing = 1"));
  EXPECT_TRUE(contains(message_of([] { tag36h11_code(587); }), "tag = 587"));
  EXPECT_TRUE(contains(message_of([&] { Scene::of_points({{1, 2, nan}}); }), "points[0]"));
  EXPECT_TRUE(contains(message_of([] { street({{0, 0, 0}, {0, 0, 5}}, {}, Random(1)); }), "path"));
  EXPECT_TRUE(contains(message_of([&] { street({{0, 0, 0}, {nan, 0, 5}}, {}, Random(1)); }), "path"));
  EXPECT_TRUE(contains(message_of([] { street({{0, 0, 0}, {1e6, 0, 0}}, {}, Random(1)); }), "path: length"));
  EXPECT_TRUE(contains(message_of([] { street({{0, 0, 0}, {9, 0, 0}}, {.kinds = 0}, Random(1)); }), "kinds = 0"));
  Scene scene = checkerboard({});
  scene.faces[0].right *= 1.1;
  EXPECT_TRUE(contains(message_of([&] { scene.check(); }), "faces[0]"));
  EXPECT_TRUE(contains(message_of([&] { scene.add_face({.texture = 3}); }), "face.texture = 3"));
}

}  // namespace
}  // namespace loc
