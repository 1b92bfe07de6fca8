// What the 3-D viewer shows, as plain data, and from where it is looked at. Knows neither LCM nor OpenGL: the recorder
// (scene3d_recorder.hpp) fills it, the drawing (scene3d_drawing.hpp) draws it.
// Frames: world as of the estimates, z up; lengths in its unit (metres, unless the estimator does not know the scale).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "libloc/core/time.hpp"
#include "libloc/estimators/slam_frame.hpp"
#include "libloc/geometry/pose3.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

struct TrackPoint {
  TimeNs time_ns = kNoTime;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  bool begins = false;    ///< is not joined to the one before: a new start
  bool doubtful = false;  ///< the estimator said that it was lost
};

/// A feature that is still an inverse depth along the ray on which it was first seen.
struct SceneRay {
  Eigen::Vector3d anchor = Eigen::Vector3d::Zero();  ///< where the camera was
  double inverse_depth = 0;                          ///< [1/m]
  double sigma_inverse_depth = 0;                    ///< [1/m]
};

struct ScenePoint {
  std::int64_t id = -1;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Matrix3d position_cov = Eigen::Matrix3d::Zero();
  bool in_use = false;          ///< measured in the newest frame
  std::optional<SceneRay> ray;  ///< none: a point with a Gaussian error, or it is not known where the ray began
};

struct SceneCamera {
  Pose3 T_world_camera;
  /// How far it sees to the left, right, top and bottom: tangents of the angles, positive.
  Eigen::Vector4d tangents{0.82, 0.82, 0.52, 0.52};
};

struct Scene3d {
  std::vector<TrackPoint> trajectory;
  std::vector<TrackPoint> reference;  ///< in world: aligned
  std::vector<Eigen::Vector3d> gps;   ///< in world
  std::optional<Pose3> body;          ///< T_world_body, the newest
  Eigen::Matrix3d position_cov = Eigen::Matrix3d::Constant(kUnknown);
  std::optional<SceneCamera> camera;
  std::vector<ScenePoint> points;
  std::optional<ImageMeasurement> picture;  ///< BGR
  std::vector<SlamFeature> features;        ///< to be drawn into the picture
  std::vector<std::string> lines;           ///< time, status, figures
  std::vector<std::string> warnings;        ///< shown in red
  std::string reference_note;               ///< "aligned, 0.12 m", for the legend
  std::string gps_note;
  bool metric = true;  ///< lengths are metres
};

enum class ViewMode {
  kFree,    ///< all of the trajectory, from azimuth and elevation
  kTop,     ///< all of it from above, north (y) upwards
  kFollow,  ///< the camera from behind
};

struct SceneView {
  ViewMode mode = ViewMode::kFree;
  double azimuth_deg = -60;   ///< where the eye is, seen from what is looked at: 0 is along x, 90 along y
  double elevation_deg = 40;  ///< of the eye above the horizon
  double zoom = 1;            ///< 2: from half as far

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// Where the eye is: it looks at target; z of the world is up in the picture.
struct SceneEye {
  Eigen::Vector3d target = Eigen::Vector3d::Zero();
  double distance = 10;
  double azimuth_deg = 0;
  double elevation_deg = 0;

  Eigen::Vector3d position() const;
  /// x right, y down, z forward in the picture. Straight from above (90 deg) up is away from where the azimuth points.
  Pose3 T_world_eye() const;
};

inline constexpr double kEyeFieldOfViewDeg = 30;  ///< vertical
/// The camera's picture lies in the lower right corner of what is drawn: this share of its width.
inline constexpr double kPictureShare = 0.34;

/// The eye from which the scene fills a picture of this shape: trajectory, reference, GPS, body, and those points of
/// the map whose place is known to a fifth of their distance from the camera or better. Where there is a picture of the
/// camera, they are left of it or above it.
/// @param aspect width / height
/// @throws std::invalid_argument as SceneView::check
SceneEye place_eye(const Scene3d& scene, const SceneView& view, double aspect);

/// Pixel of a point of world in a picture of that size; nullopt behind the eye.
std::optional<Eigen::Vector2d> project(const SceneEye& eye, const Eigen::Vector3d& point, int width_px, int height_px);

/// 1, 2 or 5 times a power of ten, near length: width of the grid's squares.
double round_length(double length);

}  // namespace loc
