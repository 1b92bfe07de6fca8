// A trajectory: poses over time. Plain data; what reads, writes and evaluates trajectories shares it.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "libloc/core/time.hpp"
#include "libloc/geometry/pose3.hpp"

namespace loc {

struct Trajectory {
  std::vector<TimeNs> times_ns;  ///< increasing
  std::vector<Pose3> poses;      ///< T_world_body, one for each time

  std::size_t size() const { return times_ns.size(); }
  bool empty() const { return times_ns.empty(); }
  void push_back(TimeNs time_ns, const Pose3& pose);

  /// @throws DataError naming the trajectory, the index and the value, unless there is one pose for each time, times
  /// increase, poses are finite and quaternions have norm 1 (to 1e-6).
  void check(std::string_view name) const;
};

/// Pose at a time between two samples: translation linear, rotation along the shortest arc (slerp).
/// @returns nullopt outside the trajectory (nothing is extrapolated).
std::optional<Pose3> interpolate(const Trajectory& trajectory, TimeNs time_ns);

/// Index of the sample that is nearest in time, the earlier of two that are equally near.
/// @throws std::invalid_argument when empty.
std::size_t nearest_index(const std::vector<TimeNs>& times_ns, TimeNs time_ns);

}  // namespace loc
