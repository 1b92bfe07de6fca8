#include "tools/support/x_display.hpp"

#include <X11/Xlib.h>

#include <cstdlib>
#include <stdexcept>
#include <string>

namespace loc {

void require_x_display() {
  const char* name = std::getenv("DISPLAY");
  const std::string instead = " (pictures without a display: --png FILE)";
  if (name == nullptr || *name == '\0')
    throw std::runtime_error("no display for a window: DISPLAY is not set" + instead);
  Display* display = ::XOpenDisplay(nullptr);
  if (display == nullptr) {
    throw std::runtime_error("no display for a window: nothing answers at DISPLAY=" + std::string(name) + instead);
  }
  ::XCloseDisplay(display);
}

}  // namespace loc
