#include "libloc/io/target_yaml.hpp"

#include <cmath>
#include <limits>

#include "libloc/io/text_file.hpp"
#include "libloc/io/yaml_block.hpp"

namespace loc {
namespace {

int count_of(io::YamlBlock& block, const char* key) {
  const std::int64_t value = block.integer(key);
  if (value < 0 || value > std::numeric_limits<int>::max()) block.fail(key, "must be a count");
  return static_cast<int>(value);
}

}  // namespace

CalibrationTarget read_kalibr_target(const std::filesystem::path& path) {
  io::YamlBlock block = io::YamlBlock::load(path, false);
  CalibrationTarget target;
  const std::string type = block.text("target_type");
  if (type == "aprilgrid") {
    target.kind = TargetKind::kAprilGrid;
    target.columns = count_of(block, "tagCols");
    target.rows = count_of(block, "tagRows");
    target.size_m = block.number("tagSize");
    target.spacing = block.number("tagSpacing");
    if (block.has("codeOffset")) target.first_tag = count_of(block, "codeOffset");
  } else if (type == "checkerboard") {
    target.columns = count_of(block, "targetCols");
    target.rows = count_of(block, "targetRows");
    target.size_m = block.number("colSpacingMeters");
    const double rows = block.number("rowSpacingMeters");
    if (!(std::abs(rows - target.size_m) <= 1e-9 * std::abs(rows))) {
      block.fail("rowSpacingMeters", "is not colSpacingMeters: squares must be squares");
    }
  } else {
    block.fail("target_type", "is '" + type + "', must be aprilgrid or checkerboard");
  }
  block.finish();
  return io::as_data_error(path, [&] {
    target.check();
    return target;
  });
}

void write_kalibr_target(const std::filesystem::path& path, const CalibrationTarget& target) {
  target.check();
  std::string text;
  const auto line = [&](const char* key, double value) {
    text += std::string(key) + ": ";
    io::append_number(text, value);
    text += "\n";
  };
  if (target.kind == TargetKind::kAprilGrid) {
    text += "target_type: 'aprilgrid'\n";
    line("tagCols", target.columns);
    line("tagRows", target.rows);
    line("tagSize", target.size_m);
    line("tagSpacing", target.spacing);
    if (target.first_tag != 0) line("codeOffset", target.first_tag);
  } else {
    text += "target_type: 'checkerboard'\n";
    line("targetCols", target.columns);
    line("targetRows", target.rows);
    line("rowSpacingMeters", target.size_m);
    line("colSpacingMeters", target.size_m);
  }
  io::AtomicFile file(path);
  file.stream() << text;
  file.commit();
}

}  // namespace loc
