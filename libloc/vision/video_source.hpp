// A video file as measurements, through OpenCV and FFmpeg. Times are the container's presentation times, so that a
// phone's varying rate is right; where it has none that increase, the frame rate tells. They count from the beginning
// of the file. Pixels are as they are stored, not turned by the tag that phones write: calibrate with pictures of the
// same kind. A damaged stretch of a compressed video is filled up by the decoder, which does not tell.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "libloc/io/source.hpp"

namespace loc {

struct VideoOptions {
  PixelFormat format = PixelFormat::kGray;  ///< kGray or kBgr
  std::int32_t camera = 0;                  ///< index of the camera in the rig
  TimeNs start_time_ns = 0;                 ///< of the beginning of the file, on the recording's clock
  double rate_hz = 0;                       ///< instead of the file's times; 0: as the file says
  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// counts(): "image.read"; "video.rotated_deg" when a tag says that the picture is to be turned for people;
/// "video.rate_varies" (1) when the times between frames differ by more than a tenth and 1 ms from their mean so far;
/// "video.times_from_rate", frames whose time is not the container's; "video.missing_at_end_ms", how much earlier than
/// the file announces its last frame ends (cut off, or damaged from there on).
/// @throws DataError naming the file when there is none, it is no video, or there is not one frame in it.
std::unique_ptr<MeasurementSource> open_video(const std::filesystem::path& path, const VideoOptions& options = {});

/// A video with the IMU (and what else) of another file, merged in time order.
/// @param other on the clock that VideoOptions::start_time_ns belongs to @param other_name for errors
/// @throws DataError as open_video, and from next() when the two do not overlap in time.
std::unique_ptr<MeasurementSource> open_video_with(const std::filesystem::path& path, const VideoOptions& options,
                                                   std::unique_ptr<MeasurementSource> other,
                                                   const std::string& other_name);

}  // namespace loc
