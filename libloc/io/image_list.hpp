// Which pictures a recording of files has, and when each was taken: nothing is decoded here (vision/image_source.hpp
// does that). Forms: a camera of an EuRoC / ASL recording (mav0/cam0/data.csv: time in ns and name, the files in
// mav0/cam0/data), a list of times and names (rgb.txt of the TUM RGB-D benchmark, times.txt of KITTI), and a folder of
// pictures whose names are numbers (with a rate) or times (with a unit).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "libloc/core/named_count.hpp"
#include "libloc/core/time.hpp"

namespace loc {

struct ImageListEntry {
  TimeNs time_ns = kNoTime;
  std::filesystem::path file;
};

struct ImageList {
  std::vector<ImageListEntry> entries;  ///< times increase
  /// What was left out: {"image.skipped.time_not_increasing", 1}, {"image.skipped.no_line_end", 1}; and gaps in the
  /// numbers of the names: {"image.missing_numbers", 2}.
  NamedCounts counts;
};

/// Whether a folder has pictures in it (by their endings). False for what is no folder.
bool is_image_folder(const std::filesystem::path& folder);

/// Where the cameras of an EuRoC recording are: cam0, cam1, … as far as they have a data.csv.
/// @param folder the one that holds mav0, or mav0 itself. @return their numbers, ascending.
std::vector<std::int32_t> euroc_cameras(const std::filesystem::path& folder);

/// The pictures of one camera of an EuRoC recording.
/// @throws DataError naming file, line and value.
ImageList list_euroc_images(const std::filesystem::path& folder, std::int32_t camera);

/// Lines of `time name` or `time,name`; names are beside the list (or in its folder data), # begins a comment. Where no
/// line has a name, the pictures of the folder are taken in the order of their names, one for each time.
/// @param unit of the times: ns, us, ms, s; empty: as the heading says it ("#timestamp [ns]"), otherwise s
/// @throws DataError naming file, line and value: nothing in it, not a time, a name here and none there, times and
/// pictures of different number.
ImageList read_image_list(const std::filesystem::path& list, const std::filesystem::path& folder,
                          const std::string& unit = {});

/// Pictures that a camera took at a constant rate, by the last number in their names: 2 comes before 10. Where numbers
/// are missing there is a gap in time, too, and it is counted. Numbers may count by another step than 1, the smallest
/// between two neighbours, if all fit it. Names without numbers are taken one after the other.
/// @param rate_hz of the pictures @param first_time_ns of the first picture
/// @throws DataError when there are no pictures or their numbers do not fit a step; std::invalid_argument for a rate
/// that is not positive.
ImageList list_images_at_rate(const std::filesystem::path& folder, double rate_hz, TimeNs first_time_ns = 0);

/// Pictures whose names are their times, as 1403636584763555584.png (ns) or 1305031102.175304.png (s).
/// @param unit ns, us, ms, s @throws DataError naming the file whose name is none.
ImageList list_images_by_name(const std::filesystem::path& folder, const std::string& unit);

}  // namespace loc
