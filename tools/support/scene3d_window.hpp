// A window that shows a SceneDrawing; the mouse turns, shifts and zooms. Needs X; MRPT runs it in a thread of its own.
#pragma once

#include <memory>
#include <string>

#include "tools/support/scene3d.hpp"

namespace loc {

class SceneWindow {
 public:
  /// @throws std::runtime_error at once when there is no display, or it does not answer.
  SceneWindow(const std::string& title, int width_px, int height_px);
  SceneWindow(const SceneWindow&) = delete;
  SceneWindow& operator=(const SceneWindow&) = delete;
  ~SceneWindow();

  /// @param view from where it is looked at, until the user moves the mouse
  void show(const Scene3d& scene, const SceneView& view);
  /// False once the user has closed it.
  bool open() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace loc
