// A video of features as the camera sees them: a dot for each with its identity and the way it came, on white or over
// the pictures of the camera. All dots have one size, because nothing about distance is known to whoever uses them.
// Source: Popov 2015 (see io/tracks.hpp), chapter 5. Needs no display.
//
//   FeatureVideo video("out.mp4", {.width_px = 752, .height_px = 480, .rate_hz = 20});
//   for (const SimulatedFrame& frame : frames) video.add(frame.measurement);
//   video.finish();
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "libloc/sensors/measurements.hpp"

namespace loc {

struct FeatureVideoOptions {
  int width_px = 0;  ///< of the camera's image
  int height_px = 0;
  double rate_hz = 20;     ///< of the video
  int tail_frames = 10;    ///< the way of so many frames is drawn; 0: none
  bool identities = true;  ///< written beside the dots
  int dot_radius_px = 3;

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// Draws one picture after the other; remembers where the features were.
class FeaturePainter {
 public:
  /// @throws std::invalid_argument as FeatureVideoOptions::check.
  explicit FeaturePainter(const FeatureVideoOptions& options);
  /// @param picture of the camera at that time, or null: white. @return BGR, with the time of the features.
  /// @throws std::invalid_argument for a picture of another size or a pixel that is not finite.
  ImageMeasurement draw(const FeaturesMeasurement& features, const ImageMeasurement* picture = nullptr);

 private:
  FeatureVideoOptions options_;
  std::map<std::int64_t, std::deque<Eigen::Vector2d>> tails_;
};

/// A file of pictures of one size, one after the other. The ending decides: .mp4 (H.264 where there is an encoder, else
/// MPEG-4), .avi (FFV1, without loss).
class VideoFile {
 public:
  /// @throws DataError when it cannot be written or the ending is another one; std::invalid_argument for sizes that are
  /// not positive and even, or a rate that is not positive.
  VideoFile(const std::filesystem::path& path, int width_px, int height_px, double rate_hz);
  VideoFile(VideoFile&&) noexcept;
  VideoFile& operator=(VideoFile&&) noexcept;
  ~VideoFile();

  /// @throws std::invalid_argument for another size.
  void add(const ImageMeasurement& image);
  /// Closes the file and opens it again: @throws DataError unless it holds as many pictures as were added. To be called
  /// at the end.
  void finish();
  /// Four letters, as the file names it.
  const std::string& codec() const;
  std::int64_t frames() const;

 private:
  struct Writer;
  std::unique_ptr<Writer> writer_;
};

/// Both together.
class FeatureVideo {
 public:
  FeatureVideo(const std::filesystem::path& path, const FeatureVideoOptions& options);
  void add(const FeaturesMeasurement& features, const ImageMeasurement* picture = nullptr) {
    file_.add(painter_.draw(features, picture));
  }
  void finish() { file_.finish(); }
  const VideoFile& file() const { return file_; }

 private:
  FeaturePainter painter_;
  VideoFile file_;
};

}  // namespace loc
