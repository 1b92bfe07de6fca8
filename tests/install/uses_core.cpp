// A user's program with the core alone.
#include <cmath>
#include <cstdio>

#include "libloc/core/time.hpp"
#include "libloc/eval/trajectory_error.hpp"
#include "libloc/geometry/so3.hpp"

int main() {
  loc::Trajectory reference;
  loc::Trajectory estimate;
  const loc::Pose3 moved{loc::so3::exp({0.1, 0.2, 0.3}), {1, 2, 3}};
  for (int i = 0; i < 20; ++i) {
    const double s = 0.3 * i;
    const loc::Pose3 pose{loc::so3::exp({0, 0, s}), {std::cos(s), std::sin(s), 0.1 * s}};
    reference.push_back(i, pose);
    estimate.push_back(i, moved * pose);
  }
  const loc::AbsoluteError error = loc::absolute_error(estimate, reference);
  std::printf("%s s: %.3g m\n", loc::format_seconds(1).c_str(), error.translation.rmse);
  return error.translation.rmse < 1e-12 && error.rotation.rmse < 1e-12 ? 0 : 1;
}
