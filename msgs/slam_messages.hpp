// SLAM's frames and maps as messages. from_message() throws DataError, naming the field and its value, for what no
// filter can have sent (a size that does not match, a time that is not set, a state that is not known).
#pragma once

#include <span>

#include "libloc/estimators/slam_frame.hpp"
#include "loc/map_points_t.hpp"
#include "loc/slam_frame_t.hpp"

namespace loc {

slam_frame_t to_message(const SlamFrame& frame);
/// Its estimate stays empty, but for time and kScaleUnknown: that is another message.
SlamFrame from_message(const slam_frame_t& m);

/// Points whose place is not finite (as far as infinity, within their uncertainty) are left out.
/// @param stamp of the estimate
map_points_t to_message(const Stamp& stamp, std::span<const SlamMapPoint> map);

inline constexpr const char* kSlamFrameChannel = "LOC_SLAM_FRAME";
inline constexpr const char* kMapChannel = "LOC_MAP";

}  // namespace loc
