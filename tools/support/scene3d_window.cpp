#include "tools/support/scene3d_window.hpp"

#include <mrpt/gui/CDisplayWindow3D.h>

#include <optional>

#include "tools/support/scene3d_drawing.hpp"
#include "tools/support/x_display.hpp"

namespace loc {

struct SceneWindow::Parts {
  SceneDrawing drawing;
  int width_px;
  int height_px;
  mrpt::gui::CDisplayWindow3D window;
  std::optional<SceneEye> placed;  // as the window holds it

  Parts(const std::string& title, int width, int height)
      : width_px(width),
        height_px(height),
        window(title, static_cast<unsigned>(width), static_cast<unsigned>(height)) {}

  SceneEye eye_now() const {
    float x = 0;
    float y = 0;
    float z = 0;
    window.getCameraPointingToPoint(x, y, z);
    return {{x, y, z}, window.getCameraZoom(), window.getCameraAzimuthDeg(), window.getCameraElevationDeg()};
  }
  void place(const SceneEye& eye) {
    window.setCameraPointingToPoint(static_cast<float>(eye.target.x()), static_cast<float>(eye.target.y()),
                                    static_cast<float>(eye.target.z()));
    window.setCameraZoom(static_cast<float>(eye.distance));
    window.setCameraAzimuthDeg(static_cast<float>(eye.azimuth_deg));
    window.setCameraElevationDeg(static_cast<float>(eye.elevation_deg));
    placed = eye_now();
  }
};

namespace {

// Whether the mouse has left it where it was put.
bool same(const SceneEye& a, const SceneEye& b) {
  return a.target == b.target && a.distance == b.distance && a.azimuth_deg == b.azimuth_deg &&
         a.elevation_deg == b.elevation_deg;
}

}  // namespace

SceneWindow::SceneWindow(const std::string& title, int width_px, int height_px) {
  // MRPT waits for seconds, and says nothing, where there is none.
  require_x_display();
  parts_ = std::make_unique<Parts>(title, width_px, height_px);
  const mrpt::gui::CDisplayWindow3DLocker lock(parts_->window);
  parts_->window.get3DSceneAndLock() = parts_->drawing.scene();
  parts_->window.unlockAccess3DScene();
  parts_->window.setFOV(static_cast<float>(kEyeFieldOfViewDeg));
}

SceneWindow::~SceneWindow() = default;

void SceneWindow::show(const Scene3d& scene, const SceneView& view) {
  Parts& p = *parts_;
  SceneEye eye = p.eye_now();
  if (!p.placed || same(eye, *p.placed)) {
    eye = place_eye(scene, view, static_cast<double>(p.width_px) / p.height_px);
    p.place(eye);
  }
  {
    const mrpt::gui::CDisplayWindow3DLocker lock(p.window);
    p.drawing.show(scene, eye, p.width_px, p.height_px);
  }
  p.window.forceRepaint();
}

bool SceneWindow::open() const {
  return parts_->window.isOpen();
}

}  // namespace loc
