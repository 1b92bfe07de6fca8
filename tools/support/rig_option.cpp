#include "tools/support/rig_option.hpp"

#include "libloc/core/check.hpp"
#include "libloc/io/rig_yaml.hpp"
#include "tools/support/program.hpp"

namespace loc {

Rig load_rig(const std::string& path) {
  if (path.empty()) return {};
  try {
    return read_any_rig(path);
  } catch (const DataError& error) {
    throw UsageError(error.what());
  } catch (const std::invalid_argument& error) {
    throw UsageError(path + ": " + error.what());
  }
}

}  // namespace loc
