#include "libloc/io/scenario_yaml.hpp"

#include "libloc/core/check.hpp"
#include "libloc/io/text_file.hpp"
#include "libloc/io/yaml_block.hpp"
#include "libloc/sim/scenario_parameters.hpp"

namespace loc {
namespace {

constexpr const char* kFormat = "libloc-scenario-1";

}  // namespace

void ScenarioFile::apply(Scenario& scenario_to_change) const {
  for (const Parameter& p : parameters) {
    try {
      set_parameter(scenario_to_change, p.name, p.value);
    } catch (const std::invalid_argument& error) {
      throw DataError(p.where + ": " + error.what());
    }
  }
}

ScenarioFile read_scenario_file(const std::filesystem::path& path) {
  io::YamlBlock file = io::YamlBlock::load(path, false);
  if (file.has("format") && file.text("format") != kFormat) {
    file.fail("format", "must be " + std::string(kFormat));
  }
  ScenarioFile out;
  if (file.has("scenario")) out.scenario = file.text("scenario");
  if (file.has("seed")) {
    const std::int64_t seed = file.integer("seed");
    if (seed < 0) file.fail("seed", "must not be negative");
    out.seed = static_cast<std::uint64_t>(seed);
  }
  if (file.has("duration_s")) out.duration_s = file.number("duration_s");
  if (file.has("parameters")) {
    for (io::YamlBlock::Leaf& leaf : file.block("parameters").leaves()) {
      out.parameters.push_back({std::move(leaf.name), std::move(leaf.text), std::move(leaf.where)});
    }
  }
  file.finish();
  return out;
}

void write_scenario_file(const std::filesystem::path& path, const Scenario& scenario, std::uint64_t seed) {
  io::AtomicFile file(path);
  file.stream() << "format: " << kFormat << "\nscenario: " << scenario.name << "\nseed: " << seed
                << "\nduration_s: " << to_text(scenario.duration_s) << "\nparameters:\n";
  for (const ScenarioParameter& p : parameters(scenario)) {
    file.stream() << "  " << p.name << ": \"" << p.value << "\"  # " << p.unit << '\n';
  }
  file.commit();
}

}  // namespace loc
