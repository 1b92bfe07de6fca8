#include "libloc/sim/scene.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

// A point so close to a face lies on it [m].
constexpr double kOnFace = 1e-4;

std::string item(const char* name, std::size_t i) {
  return std::string(name) + "[" + std::to_string(i) + "]";
}

}  // namespace

Scene Scene::of_points(const std::vector<Eigen::Vector3d>& positions) {
  Scene scene;
  scene.points.reserve(positions.size());
  for (const Eigen::Vector3d& p : positions) scene.points.push_back({p, -1});
  scene.check();
  return scene;
}

std::int64_t Scene::add_face(const Face& face) {
  require(face.texture >= 0 && face.texture < std::ssize(textures), "face.texture", face.texture,
          "there is no such texture");
  const std::int64_t first = std::ssize(points);
  const auto index = static_cast<std::int32_t>(faces.size());
  faces.push_back(face);
  for (const Eigen::Vector2d& p : textures[static_cast<std::size_t>(face.texture)].features) {
    points.push_back({face.at(p), index});
  }
  return first;
}

std::int64_t Scene::add(const Scene& other, const Pose3& T_world_other) {
  const std::int64_t first_point = std::ssize(points);
  const auto first_face = static_cast<std::int32_t>(faces.size());
  const auto first_texture = static_cast<std::int32_t>(textures.size());
  textures.insert(textures.end(), other.textures.begin(), other.textures.end());
  for (Face face : other.faces) {
    face.origin = T_world_other * face.origin;
    face.right = T_world_other.rotation * face.right;
    face.up = T_world_other.rotation * face.up;
    face.texture += first_texture;
    faces.push_back(face);
  }
  for (const ScenePoint& p : other.points) {
    points.push_back({T_world_other * p.position, p.face < 0 ? -1 : p.face + first_face});
  }
  return first_point;
}

SightLines::SightLines(const Scene& scene, const Eigen::Vector3d& eye, double range) : scene_(scene), eye_(eye) {
  for (std::size_t i = 0; i < scene.faces.size(); ++i) {
    const Face& face = scene.faces[i];
    const Eigen::Vector2d& size = scene.textures[static_cast<std::size_t>(face.texture)].size;
    const Eigen::Vector3d normal = face.normal();
    const Eigen::Vector3d from = eye - face.origin;
    const Eigen::Vector3d local(from.dot(face.right), from.dot(face.up), from.dot(normal));
    const bool near = (eye - face.at(size / 2)).norm() < range + size.norm() / 2;
    if (local.z() <= 0 || !near) continue;
    fronts_.push_back({static_cast<std::int32_t>(i), face.origin, face.right, face.up, normal, local, size});
  }
}

bool SightLines::reach(const ScenePoint& point) const {
  if (point.face >= 0) {
    const Face& own = scene_.faces[static_cast<std::size_t>(point.face)];
    if ((eye_ - own.origin).dot(own.normal()) <= 0) return false;
  }
  return std::ranges::none_of(fronts_, [&](const Front& front) {
    const Eigen::Vector3d from = point.position - front.origin;
    const double height = from.dot(front.normal);
    if (height > -kOnFace || front.face == point.face) return false;
    const double share = front.eye.z() / (front.eye.z() - height);  // of the way at which the face is met
    const double x = front.eye.x() + share * (from.dot(front.right) - front.eye.x());
    const double y = front.eye.y() + share * (from.dot(front.up) - front.eye.y());
    return x >= 0 && y >= 0 && x <= front.size.x() && y <= front.size.y();
  });
}

void Scene::check() const {
  for (std::size_t i = 0; i < textures.size(); ++i) {
    const Texture& t = textures[i];
    require(t.size.allFinite() && t.size.minCoeff() > 0, item("textures", i) + ".size: must be positive and finite");
    for (const Patch& patch : t.patches) {
      require(patch.low.allFinite() && patch.high.allFinite(), item("textures", i) + ".patches: must be finite");
    }
    for (const Eigen::Vector2d& f : t.features) {
      require(f.allFinite(), item("textures", i) + ".features: must be finite");
    }
  }
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const Face& f = faces[i];
    require(f.origin.allFinite(), item("faces", i) + ".origin: must be finite");
    // The comparisons are false for NaN.
    const bool axes =
        std::abs(f.right.norm() - 1) < 1e-6 && std::abs(f.up.norm() - 1) < 1e-6 && std::abs(f.right.dot(f.up)) < 1e-6;
    require(axes, item("faces", i) + ": right and up must be unit vectors at right angles");
    require(f.texture >= 0 && f.texture < std::ssize(textures), item("faces", i) + ".texture", f.texture,
            "there is no such texture");
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    require(points[i].position.allFinite(), item("points", i) + ": must be finite");
    require(points[i].face >= -1 && points[i].face < std::ssize(faces), item("points", i) + ".face", points[i].face,
            "there is no such face");
  }
}

}  // namespace loc
