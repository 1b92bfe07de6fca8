// The sources that can be named on a command line.
#pragma once

#include <memory>
#include <string>

#include "libloc/io/csv.hpp"
#include "libloc/io/eqvio.hpp"
#include "libloc/io/source.hpp"
#include "msgs/decode.hpp"
#include "tools/support/gps_source.hpp"
#include "tools/support/image_options.hpp"

namespace loc {

inline constexpr const char* kRawlog = "rawlog";

struct SourceSpec {
  /// "euroc", "lcm-log", "csv", "eqvio", "broad", "nmea"; live: "gps-serial", "gps-tcp", "gpsd". With OpenCV (see
  /// needs_vision): "video", "images"; live: "camera". With MRPT (io/rawlog.hpp): "rawlog"
  std::string kind;
  std::string path;      ///< file, folder, device, HOST:PORT
  CsvOptions csv;        ///< for csv
  EqvioOptions eqvio;    ///< for eqvio
  DecodeOptions decode;  ///< for lcm-log: channels
  LiveGpsOptions gps;    ///< for nmea (gps.fix) and the live ones; on_idle and on_trouble for camera, too
  int baud = 9600;       ///< for gps-serial
  ImageSpec images;      ///< for euroc, video, images, camera
};

/// A kind that is a sensor connected now, not a recording.
bool is_live(const std::string& source_kind);
/// A live GPS receiver.
bool is_receiver(const std::string& source_kind);
/// A source that only open_source_with_images() opens (open_image_source.hpp).
bool needs_vision(const SourceSpec& spec);

/// Kind of a recording by its looks: a folder is images when it holds pictures or a list of them and no EuRoC
/// recording, otherwise euroc; *.csv eqvio by its heading, otherwise csv; *.mat broad, *.rawlog rawlog, *.mp4 and the
/// like video,
/// *.nmea nmea, another file that has NMEA sentences within its first 4 kB nmea, all else lcm-log.
std::string guess_source_kind(const std::string& path);

/// @throws UsageError for an unknown kind or a path that does not exist, DataError as the reader of that kind,
/// GpsConnectionError when a live source cannot be reached.
std::unique_ptr<MeasurementSource> open_source(const SourceSpec& spec);

/// The rig that a recording brings along: eqvio's camera, unless spec.eqvio has one; cameras and IMU of euroc, as far
/// as their sensor.yaml are there; empty for all other kinds.
/// @throws as open_source.
Rig rig_of_source(const SourceSpec& spec);

/// An output must not replace the recording that is being read, by whatever name it is reached.
/// @throws UsageError naming both when they are one file.
void refuse_to_overwrite(const std::string& recording, const std::string& output);

}  // namespace loc
