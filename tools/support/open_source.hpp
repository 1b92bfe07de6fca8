// The sources that can be named on a command line.
#pragma once

#include <memory>
#include <string>

#include "libloc/io/csv.hpp"
#include "libloc/io/source.hpp"
#include "msgs/decode.hpp"

namespace loc {

struct SourceSpec {
  std::string kind;  ///< "euroc", "lcm-log", "csv", "broad"
  std::string path;
  CsvOptions csv;        ///< for csv
  DecodeOptions decode;  ///< for lcm-log: channels
};

/// Kind of a recording by its looks: a folder is euroc, *.csv csv, *.mat broad, all else lcm-log.
std::string guess_source_kind(const std::string& path);

/// @throws UsageError for an unknown kind or a path that does not exist, DataError as the reader of that kind.
std::unique_ptr<MeasurementSource> open_source(const SourceSpec& spec);

/// An output must not replace the recording that is being read, by whatever name it is reached.
/// @throws UsageError naming both when they are one file.
void refuse_to_overwrite(const std::string& recording, const std::string& output);

}  // namespace loc
