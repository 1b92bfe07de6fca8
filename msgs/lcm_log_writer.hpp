// A recording written as an LCM log, with the messages of live streams on their default channels: all of a
// measurement is in it. The log's time stamps are the times of arrival.
#pragma once

#include <filesystem>
#include <memory>

#include "libloc/io/recording_writer.hpp"

namespace loc {

/// Measurements are written in the order in which they come. An ImageMeasurement must have its data.
/// @param path must not exist @throws DataError for a file that is there already or cannot be made.
std::unique_ptr<RecordingWriter> create_lcm_log(const std::filesystem::path& path);

}  // namespace loc
