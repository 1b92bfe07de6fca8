// Pictures that are files, one after the other, as measurements: cameras of an EuRoC / ASL recording (alone or with its
// IMU and all else), a folder of numbered or time-stamped pictures, a list of times and names (see io/image_list.hpp).
//
//   auto source = open_euroc_images("MH_01_easy");
//   while (auto m = source->next()) if (auto* image = std::get_if<ImageMeasurement>(&*m)) …
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "libloc/io/euroc.hpp"
#include "libloc/io/image_list.hpp"
#include "libloc/io/source.hpp"

namespace loc {

struct ImageReadOptions {
  /// kGray or kBgr: what pictures are converted to. kMjpeg: JPEG files are given as they are stored, not decoded; other
  /// pictures grey or BGR as they are stored.
  PixelFormat format = PixelFormat::kGray;
  /// Why a picture was left out, as it happens.
  std::function<void(const std::string&)> on_skip = {};
  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// The pictures of a list, as one camera. sequence counts the list's entries, so that a picture that was left out is
/// seen as lost. A picture that is missing, damaged, or of another size than the first one is left out and counted
/// ("image.skipped.missing", "image.skipped.damaged", "image.skipped.other_size").
/// @param name for errors @param camera index of the camera in the rig
/// @throws DataError from next() when none of them could be read, naming the first and why.
std::unique_ptr<MeasurementSource> open_images(ImageList list, const std::string& name, std::int32_t camera = 0,
                                               const ImageReadOptions& options = {});

struct ImageFolderOptions {
  ImageReadOptions read = {};
  std::int32_t camera = 0;
  // One of these three; none of them: rgb.txt (TUM RGB-D) or times.txt in the folder.
  double rate_hz = 0;                     ///< numbered pictures: list_images_at_rate
  std::string name_unit = {};             ///< names that are times, in ns, us, ms, s: list_images_by_name
  std::filesystem::path times_file = {};  ///< read_image_list
  TimeNs first_time_ns = 0;               ///< with rate_hz
  std::string time_unit = {};             ///< of times_file; empty: see read_image_list
  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// @throws DataError as the functions named above, and when nothing says how the pictures are timed.
std::unique_ptr<MeasurementSource> open_image_folder(const std::filesystem::path& folder,
                                                     const ImageFolderOptions& options);

struct EurocImageOptions {
  ImageReadOptions read = {};
  EurocOptions other;                 ///< of the other streams
  bool read_other = true;             ///< False: pictures only.
  std::vector<std::int32_t> cameras;  ///< as numbered in the recording, which is their index in the rig; empty: all
};

/// An EuRoC recording with its pictures, all streams merged in time order; at equal times cameras first, then as
/// open_euroc. A recording without pictures is read, too.
/// @throws DataError as open_euroc and open_images; for a camera of `cameras` that the recording has not.
std::unique_ptr<MeasurementSource> open_euroc_images(const std::filesystem::path& folder,
                                                     const EurocImageOptions& options = {});

}  // namespace loc
