#include "tools/support/rig_option.hpp"

#include "libloc/core/check.hpp"
#include "libloc/io/rig_yaml.hpp"
#include "tools/support/log.hpp"
#include "tools/support/program.hpp"

namespace loc {

Rig load_rig(const std::string& path) {
  if (path.empty()) return {};
  try {
    Rig rig = read_any_rig(path);
    for (const RigDoubt& doubt : doubts(rig)) {
      log_warning(R"(event=rig_quality file="{}" block={} verdict={} reason="{}")", path, doubt.block,
                  verdict_name(doubt.verdict), doubt.text);
    }
    return rig;
  } catch (const DataError& error) {
    throw UsageError(error.what());
  } catch (const std::invalid_argument& error) {
    throw UsageError(path + ": " + error.what());
  }
}

}  // namespace loc
