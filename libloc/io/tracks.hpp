// Tracks of features as a text file: rows of four numbers, `frame feature dimension value`, separated by blanks or
// tabs. frame counts the pictures, feature is an identity that lasts from frame to frame, dimension is 0 for u and 1
// for v, value is that coordinate in pixels as the camera measured it ((0,0) is the centre of the top-left pixel).
// Source: Popov, "Monocular simultaneous location and mapping based on recursive filtering", St. Petersburg 2015, 4.1.
// What the source leaves open is defined so:
//   comments             # begins one, anywhere in a line; blank lines are ignored
//   carriage returns, byte order mark   are taken off
//   order of the rows    does not matter; given are frames and features in ascending order. Rows that come after one of
//   a
//                        later frame are counted ("tracks.out_of_order")
//   frame, feature       whole numbers from 0 to 2^53, in any notation (7, 7.0, 7.0e+00); others are an error
//   dimension            0 or 1; another one is an error
//   value                a finite number; nan, infinity and words are an error
//   other than 4 columns, u without v or v without u    an error
//   a row that repeats frame, feature and dimension     an error, whatever its value
//   last line without line end   may have been cut: it is not used, and counted ("tracks.skipped.no_line_end"). If the
//   row
//                        before it lacks its other dimension then, it is left out too ("tracks.skipped.cut_feature")
//   no row at all        an error
// A frame without features leaves no trace in such a file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "libloc/core/named_count.hpp"
#include "libloc/core/time.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

struct TrackFrame {
  std::int64_t frame = 0;
  std::vector<FeatureObservation> features;  ///< ascending identities
};

struct TracksFile {
  std::vector<TrackFrame> frames;  ///< ascending, those that have features
  NamedCounts counts;              ///< {"tracks.frames", n}, {"tracks.read", features}, and what the head names
};

/// @throws DataError naming file, line and value, see above.
TracksFile read_tracks(const std::filesystem::path& path);

/// Every number reads back as the same double.
/// @throws DataError when the file cannot be written; std::invalid_argument for frames that do not ascend from 0 on, an
/// identity that is negative or comes twice in a frame, a pixel that is not finite.
void write_tracks(const std::filesystem::path& path, std::span<const TrackFrame> frames);

/// What a tracks file does not say.
struct TracksClock {
  double rate_hz = 20;       ///< of the frames
  TimeNs start_time_ns = 0;  ///< of frame 0
  double sigma_px = 1;       ///< deviation of one coordinate
  std::int32_t camera = 0;   ///< index in the rig

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// time_ns = start + frame / rate, sequence = frame. @throws std::invalid_argument as TracksClock::check, and for a
/// time out of range.
std::vector<FeaturesMeasurement> to_measurements(std::span<const TrackFrame> frames, const TracksClock& clock);

/// One frame for each measurement of one camera that has features; its number is the measurement's sequence, or its
/// place in the list when none has a sequence. Features come out in ascending order.
/// @throws std::invalid_argument when sequences do not ascend, or some measurements have one and some not.
std::vector<TrackFrame> to_track_frames(std::span<const FeaturesMeasurement> measurements);

}  // namespace loc
