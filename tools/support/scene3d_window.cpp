#include "tools/support/scene3d_window.hpp"

#include <mrpt/gui/CDisplayWindow3D.h>

#include <cstdlib>
#include <stdexcept>

#include "tools/support/scene3d_drawing.hpp"
#include "tools/support/x_display.hpp"

namespace loc {

struct SceneWindow::Parts {
  SceneDrawing drawing;
  int width_px;
  int height_px;
  mrpt::gui::CDisplayWindow3D window;
  bool placed = false;

  Parts(const std::string& title, int width, int height)
      : width_px(width),
        height_px(height),
        window(title, static_cast<unsigned>(width), static_cast<unsigned>(height)) {}
};

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
  SceneEye eye = place_eye(scene, view, static_cast<double>(p.width_px) / p.height_px);
  const bool something = scene.body || !scene.trajectory.empty();
  if (!p.placed || view.mode == ViewMode::kFollow) {
    p.window.setCameraPointingToPoint(static_cast<float>(eye.target.x()), static_cast<float>(eye.target.y()),
                                      static_cast<float>(eye.target.z()));
    p.window.setCameraZoom(static_cast<float>(eye.distance));
    p.window.setCameraAzimuthDeg(static_cast<float>(eye.azimuth_deg));
    p.window.setCameraElevationDeg(static_cast<float>(eye.elevation_deg));
    p.placed = something;
  } else {
    float x = 0;
    float y = 0;
    float z = 0;
    p.window.getCameraPointingToPoint(x, y, z);
    eye.target = {x, y, z};
    eye.distance = p.window.getCameraZoom();
    eye.azimuth_deg = p.window.getCameraAzimuthDeg();
    eye.elevation_deg = p.window.getCameraElevationDeg();
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
