#include "libloc/sim/motion.hpp"

#include <cmath>

#include "libloc/core/check.hpp"

namespace loc {

void Motion::check_time(double time_s) const {
  require(std::isfinite(time_s) && time_s >= 0 && time_s <= duration_s(), "time_s", time_s,
          "must be in [0, " + to_text(duration_s()) + "], the duration of the motion");
}

}  // namespace loc
