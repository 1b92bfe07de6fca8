// Draws a Scene3d with MRPT's OpenGL: into pictures without a display (EGL; in software where there is no graphics
// card), and for a window (scene3d_window.hpp). What is drawn: trajectory blue (red where the estimator was lost),
// reference green, GPS orange, the body's axes with the ellipsoid of three deviations of its position, the camera's
// frustum, the points of the map with theirs (features that are still inverse depths: the shape that this has in
// space), a grid, the picture with its features in a corner, text.
#pragma once

#include <filesystem>
#include <memory>

#include "libloc/sensors/measurements.hpp"
#include "tools/support/scene3d.hpp"

namespace mrpt::opengl {
class COpenGLScene;
}

namespace loc {

class SceneDrawing {
 public:
  SceneDrawing();
  SceneDrawing(const SceneDrawing&) = delete;
  SceneDrawing& operator=(const SceneDrawing&) = delete;
  ~SceneDrawing();

  /// Changes the objects to show this. @param width_px, height_px of the picture or window
  void show(const Scene3d& scene, const SceneEye& eye, int width_px, int height_px);
  /// Objects stay the same ones from show() to show(): a window draws them in a thread of its own.
  const std::shared_ptr<mrpt::opengl::COpenGLScene>& scene() const;
  /// For MRPT's program SceneViewer3D. @throws DataError when it cannot be written.
  void save(const std::filesystem::path& path) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Pictures of one size, without a display.
class SceneCamera3d {
 public:
  /// @throws std::runtime_error saying what is missing when there is no EGL; std::invalid_argument for a size that is
  /// not 64 to 8192.
  SceneCamera3d(int width_px, int height_px);
  SceneCamera3d(const SceneCamera3d&) = delete;
  SceneCamera3d& operator=(const SceneCamera3d&) = delete;
  ~SceneCamera3d();

  /// @return BGR
  ImageMeasurement take(const SceneDrawing& drawing);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace loc
