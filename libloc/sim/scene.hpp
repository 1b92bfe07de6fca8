// What a simulated camera looks at: points worth tracking, and flat textured faces for pictures of the same scene.
// A texture is a list of rectangles of one colour, painted one over the other; its features are corners that stay
// visible, so that the points of a scene are corners of its pictures.
// Frames: world (z up). A face: x right, y up, z out of its front towards who looks at it; seen from behind it is
// neither drawn nor does it hide anything.
//
//   Scene scene = box_room({}, Random(1));                       // sim/room, sim/street, sim/calibration_target
//   const SightLines sight(scene, eye, 100);
//   if (sight.reach(scene.points[i])) ...
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "libloc/geometry/pose3.hpp"

namespace loc {

/// Red, green, blue, 0 to 255.
using Colour = std::array<std::uint8_t, 3>;

/// A rectangle of one colour in a texture.
struct Patch {
  Eigen::Vector2d low;   ///< lower left corner, in the face's axes [m]
  Eigen::Vector2d high;  ///< upper right corner
  Colour colour{};
};

struct Texture {
  Eigen::Vector2d size = Eigen::Vector2d::Ones();  ///< width and height [m]
  Colour background{128, 128, 128};
  std::vector<Patch> patches{};             ///< later ones cover earlier ones
  std::vector<Eigen::Vector2d> features{};  ///< corners of patches [m]
};

/// A texture at a place in world, in true size.
struct Face {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< lower left corner [m]
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();  ///< unit vector
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();     ///< unit vector, orthogonal to right
  std::int32_t texture = 0;                          ///< index in Scene::textures

  Eigen::Vector3d normal() const { return right.cross(up); }
  Eigen::Vector3d at(const Eigen::Vector2d& p) const { return origin + p.x() * right + p.y() * up; }
};

struct ScenePoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< in world [m]
  std::int32_t face = -1;                              ///< that it lies on; -1: none, it is seen from everywhere
};

struct Scene {
  std::vector<ScenePoint> points;  ///< the index is the identity of a feature
  std::vector<Face> faces;
  std::vector<Texture> textures;
  Colour sky{170, 190, 215};
  Colour ground{95, 95, 85};

  /// A scene of points alone, as io/points reads them.
  static Scene of_points(const std::vector<Eigen::Vector3d>& positions);

  /// Adds a face and a point for each feature of its texture. @return index of the first of these points.
  /// @throws std::invalid_argument when there is no such texture.
  std::int64_t add_face(const Face& face);
  /// Adds another scene whole, moved: T_world_other takes its coordinates to this one's. @return index of its first
  /// point.
  std::int64_t add(const Scene& other, const Pose3& T_world_other);

  /// @throws std::invalid_argument naming what is wrong: not finite, axes that are no unit vectors at right angles, an
  /// index out of range, a texture without size.
  void check() const;
};

/// Which points of a scene can be seen from one place. Made anew for each place; the scene must not change meanwhile.
class SightLines {
 public:
  /// @param range_m no point farther away will be asked for.
  SightLines(const Scene& scene, const Eigen::Vector3d& eye, double range_m);

  /// True when no face stands between the eye and the point, and the point's own face is seen from its front.
  bool reach(const ScenePoint& point) const;

 private:
  // A face whose front is seen, with the eye in its axes.
  struct Front {
    std::int32_t face = 0;
    Eigen::Vector3d origin, right, up, normal;
    Eigen::Vector3d eye;  // along right, up, normal [m]
    Eigen::Vector2d size;
  };
  const Scene& scene_;
  Eigen::Vector3d eye_;
  std::vector<Front> fronts_;
};

}  // namespace loc
