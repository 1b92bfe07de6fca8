#include "libloc/sim/motion.hpp"

#include <cmath>
#include <string>

#include "libloc/core/check.hpp"

namespace loc {

void require_rigid(std::string_view name, const Pose3& pose) {
  require(pose.translation.allFinite(), std::string(name) + ": the translation must be finite");
  require(std::abs(pose.rotation.norm() - 1) < 1e-6, std::string(name) + ": norm of the rotation", pose.rotation.norm(),
          "must be 1");
}

void Motion::check_time(double time_s) const {
  require(std::isfinite(time_s) && time_s >= 0 && time_s <= duration_s(), "time_s", time_s,
          "must be in [0, " + to_text(duration_s()) + "], the duration of the motion");
}

}  // namespace loc
