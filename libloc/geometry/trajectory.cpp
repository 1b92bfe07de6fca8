#include "libloc/geometry/trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

// Unsigned: the difference of two times may not fit into a TimeNs.
std::uint64_t distance(TimeNs a, TimeNs b) {
  return a > b ? static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b)
               : static_cast<std::uint64_t>(b) - static_cast<std::uint64_t>(a);
}

}  // namespace

void Trajectory::push_back(TimeNs time_ns, const Pose3& pose) {
  times_ns.push_back(time_ns);
  poses.push_back(pose);
}

void Trajectory::check(std::string_view name) const {
  const std::string prefix = std::string(name) + ": ";
  if (times_ns.size() != poses.size()) {
    throw DataError(prefix + std::to_string(times_ns.size()) + " times, but " + std::to_string(poses.size()) +
                    " poses");
  }
  for (std::size_t i = 0; i < size(); ++i) {
    const std::string where = prefix + "pose " + std::to_string(i) + ": ";
    if (times_ns[i] == kNoTime) throw DataError(where + "has no time");
    if (i > 0 && times_ns[i] <= times_ns[i - 1]) {
      throw DataError(where + "its time " + format_seconds(times_ns[i]) + " is not after the one before, " +
                      format_seconds(times_ns[i - 1]));
    }
    if (!poses[i].translation.allFinite()) throw DataError(where + "its translation is not finite");
    const double norm = poses[i].rotation.norm();
    // The comparison is false for NaN.
    if (!(std::abs(norm - 1) < 1e-6)) {
      throw DataError(where + "its quaternion has norm " + to_text(norm) + ": must be 1");
    }
  }
}

std::optional<Pose3> interpolate(const Trajectory& trajectory, TimeNs time_ns) {
  const std::vector<TimeNs>& times = trajectory.times_ns;
  const auto next = std::lower_bound(times.begin(), times.end(), time_ns);
  if (next == times.end()) return std::nullopt;
  const auto i = static_cast<std::size_t>(next - times.begin());
  if (*next == time_ns) return trajectory.poses[i];
  if (i == 0) return std::nullopt;
  const double share =
      static_cast<double>(distance(time_ns, times[i - 1])) / static_cast<double>(distance(times[i], times[i - 1]));
  const Pose3& a = trajectory.poses[i - 1];
  const Pose3& b = trajectory.poses[i];
  return Pose3{a.rotation.slerp(share, b.rotation).normalized(),
               a.translation + share * (b.translation - a.translation)};
}

std::size_t nearest_index(const std::vector<TimeNs>& times_ns, TimeNs time_ns) {
  require(!times_ns.empty(), "nearest_index: no times");
  const auto next = std::lower_bound(times_ns.begin(), times_ns.end(), time_ns);
  if (next == times_ns.begin()) return 0;
  const auto i = static_cast<std::size_t>(next - times_ns.begin());
  if (next == times_ns.end()) return i - 1;
  return distance(times_ns[i], time_ns) < distance(time_ns, times_ns[i - 1]) ? i : i - 1;
}

}  // namespace loc
