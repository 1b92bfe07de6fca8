// The sources of open_source.hpp, and those that need OpenCV besides: camera, video, images, euroc with pictures. Not
// in loc_tools: OpenCV makes a process start slowly.
#pragma once

#include <memory>

#include "tools/support/open_source.hpp"

namespace loc {

/// @throws as open_source; CameraError for a camera that cannot be opened.
std::unique_ptr<MeasurementSource> open_source_with_images(const SourceSpec& spec);

}  // namespace loc
