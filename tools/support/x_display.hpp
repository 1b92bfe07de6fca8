// Whether there is an X display to open windows on. A file of its own: X defines macros of everyday names.
#pragma once

namespace loc {

/// @throws std::runtime_error when DISPLAY is not set, or nothing answers there.
void require_x_display();

}  // namespace loc
