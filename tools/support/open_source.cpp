#include "tools/support/open_source.hpp"

#include <filesystem>

#include "libloc/io/broad.hpp"
#include "libloc/io/euroc.hpp"
#include "msgs/lcm_log_source.hpp"
#include "tools/support/program.hpp"

namespace loc {

std::string guess_source_kind(const std::string& path) {
  if (std::filesystem::is_directory(path)) return "euroc";
  const std::string extension = std::filesystem::path(path).extension();
  if (extension == ".csv") return "csv";
  if (extension == ".mat") return "broad";
  return "lcm-log";
}

std::unique_ptr<MeasurementSource> open_source(const SourceSpec& spec) {
  std::error_code error;
  if (!std::filesystem::exists(spec.path, error)) throw UsageError("'" + spec.path + "' does not exist");
  if (spec.kind == "euroc") return open_euroc(spec.path);
  if (spec.kind == "csv") return open_csv(spec.path, spec.csv);
  if (spec.kind == "broad") return open_broad(spec.path);
  if (spec.kind == "lcm-log") return open_lcm_log(spec.path, {.decode = spec.decode});
  throw UsageError("source '" + spec.kind + "' is not euroc, lcm-log, csv or broad");
}

void refuse_to_overwrite(const std::string& recording, const std::string& output) {
  std::error_code error;
  if (std::filesystem::equivalent(recording, output, error) && !error) {
    throw UsageError(output + " is the recording itself (" + recording + "): the output needs another name");
  }
}

}  // namespace loc
