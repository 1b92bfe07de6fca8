#include "libloc/eval/trajectory_error.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

void check_pair(const Trajectory& estimate, const Trajectory& reference) {
  require(estimate.size() == reference.size(), "estimate has " + std::to_string(estimate.size()) +
                                                   " poses, reference " + std::to_string(reference.size()) +
                                                   ": associate() them first");
  estimate.check("estimate");
  reference.check("reference");
  if (estimate.empty()) throw DataError("trajectories without poses");
}

std::vector<Eigen::Vector3d> positions_of(const Trajectory& trajectory) {
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(trajectory.size());
  for (const Pose3& pose : trajectory.poses) positions.push_back(pose.translation);
  return positions;
}

TimeNs absolute_difference(TimeNs a, TimeNs b) {
  TimeNs result = 0;
  if (__builtin_sub_overflow(std::max(a, b), std::min(a, b), &result)) return std::numeric_limits<TimeNs>::max();
  return result;
}

struct Pair {
  std::size_t from;
  std::size_t to;
  TimeNs difference;
};

// For each time of `from` the nearest of `to`, in order.
std::vector<Pair> nearest_pairs(const std::vector<TimeNs>& from, const std::vector<TimeNs>& to, TimeNs max_difference) {
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const std::size_t k = nearest_index(to, from[i]);
    const TimeNs difference = absolute_difference(from[i], to[k]);
    if (difference <= max_difference) pairs.push_back({i, k, difference});
  }
  return pairs;
}

// Of neighbours with one partner, keeps the nearest; the earlier of two equally near.
std::int64_t keep_one_to_one(std::vector<Pair>& pairs) {
  std::vector<Pair> kept;
  for (const Pair& pair : pairs) {
    if (kept.empty() || kept.back().to != pair.to) {
      kept.push_back(pair);
    } else if (pair.difference < kept.back().difference) {
      kept.back() = pair;
    }
  }
  const auto dropped = static_cast<std::int64_t>(pairs.size() - kept.size());
  pairs = std::move(kept);
  return dropped;
}

// Length along the trajectory from each pose to the next: [ns] or [m]. Nanoseconds are exact as doubles.
std::vector<double> steps_along(const Trajectory& trajectory, DeltaUnit unit) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    if (unit == DeltaUnit::kSeconds) {
      steps.push_back(static_cast<double>(absolute_difference(trajectory.times_ns[i], trajectory.times_ns[i - 1])));
    } else {
      steps.push_back((trajectory.poses[i].translation - trajectory.poses[i - 1].translation).norm());
    }
  }
  return steps;
}

using IndexPairs = std::vector<std::pair<std::size_t, std::size_t>>;

IndexPairs pairs_by_index(std::size_t size, std::size_t delta, bool all_pairs) {
  IndexPairs pairs;
  for (std::size_t i = 0; i + delta < size; i += all_pairs ? 1 : delta) pairs.emplace_back(i, i + delta);
  return pairs;
}

// End to end: a piece ends with the first pose at which it is delta long.
IndexPairs consecutive_pairs(const std::vector<double>& steps, double delta) {
  IndexPairs pairs;
  std::size_t start = 0;
  double length = 0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    length += steps[i];
    if (length < delta) continue;
    pairs.emplace_back(start, i + 1);
    start = i + 1;
    length = 0;
  }
  return pairs;
}

// From each pose to the one that is nearest to delta away; of equals, the earliest.
IndexPairs all_pairs_near(const std::vector<double>& steps, double delta, double tolerance) {
  std::vector<double> lengths(steps.size() + 1, 0.0);
  std::partial_sum(steps.begin(), steps.end(), lengths.begin() + 1);
  IndexPairs pairs;
  for (std::size_t i = 0; i + 1 < lengths.size(); ++i) {
    const auto error_of = [&](double length) { return std::abs(length - lengths[i] - delta); };
    // Lengths never decrease: the nearest is on one side of where delta would be.
    const auto begin = lengths.begin() + static_cast<std::ptrdiff_t>(i) + 1;
    auto best = std::lower_bound(begin, lengths.end(), lengths[i] + delta);
    if (best == lengths.end() || (best != begin && error_of(*std::prev(best)) <= error_of(*best))) {
      best = std::lower_bound(begin, lengths.end(), *std::prev(best));
    }
    if (error_of(*best) > tolerance) continue;
    pairs.emplace_back(i, static_cast<std::size_t>(best - lengths.begin()));
  }
  return pairs;
}

const char* unit_name(DeltaUnit unit) {
  switch (unit) {
    case DeltaUnit::kFrames:
      return "frames";
    case DeltaUnit::kSeconds:
      return "s";
    case DeltaUnit::kMetres:
      return "m";
  }
  return "";
}

}  // namespace

ErrorStatistics error_statistics(std::span<const double> errors) {
  require(!errors.empty(), "error_statistics: no errors");
  ErrorStatistics s;
  s.count = static_cast<std::int64_t>(errors.size());
  for (const double e : errors) {
    require_finite("error", e);
    s.sse += e * e;
  }
  s.rmse = root_mean_square(errors);
  s.mean = mean(errors);
  s.median = quantile(errors, 0.5);
  s.min = *std::min_element(errors.begin(), errors.end());
  s.max = *std::max_element(errors.begin(), errors.end());
  double sum = 0;
  for (const double e : errors) sum += (e - s.mean) * (e - s.mean);
  s.std = std::sqrt(sum / static_cast<double>(errors.size()));
  return s;
}

void AssociationOptions::check() const {
  require(max_difference_ns >= 0, "max_difference_ns", static_cast<double>(max_difference_ns), "must not be negative");
}

Association associate(const Trajectory& estimate, const Trajectory& reference, const AssociationOptions& options) {
  options.check();
  estimate.check("estimate");
  reference.check("reference");
  if (estimate.empty()) throw DataError("estimate: no poses");
  if (reference.empty()) throw DataError("reference: no poses");

  std::vector<TimeNs> estimate_times = estimate.times_ns;
  for (TimeNs& t : estimate_times) {
    if (__builtin_add_overflow(t, options.estimate_time_offset_ns, &t)) {
      throw DataError("estimate: a time leaves the range with the time offset");
    }
  }
  const bool from_reference = !options.interpolate_reference && reference.size() < estimate.size();
  const std::vector<TimeNs>& from = from_reference ? reference.times_ns : estimate_times;
  const std::vector<TimeNs>& to = from_reference ? estimate_times : reference.times_ns;
  std::vector<Pair> pairs = nearest_pairs(from, to, options.max_difference_ns);

  Association result;
  result.without_partner = static_cast<std::int64_t>(from.size() - pairs.size());
  // Interpolated poses belong to one time each: nothing is used twice.
  if (options.one_to_one && !options.interpolate_reference) result.shared_partner = keep_one_to_one(pairs);
  for (const Pair& pair : pairs) {
    const std::size_t e = from_reference ? pair.to : pair.from;
    const std::size_t r = from_reference ? pair.from : pair.to;
    std::optional<Pose3> pose = reference.poses[r];
    if (options.interpolate_reference) pose = interpolate(reference, estimate_times[e]);
    if (!pose) {
      ++result.without_partner;
      continue;
    }
    result.estimate.push_back(estimate.times_ns[e], estimate.poses[e]);
    result.reference.push_back(options.interpolate_reference ? estimate_times[e] : reference.times_ns[r], *pose);
    result.estimate_index.push_back(e);
    result.reference_index.push_back(r);
  }
  if (result.estimate.empty()) {
    throw DataError("no pose of the estimate (" + format_seconds(estimate_times.front()) + " to " +
                    format_seconds(estimate_times.back()) + " s) is within " +
                    format_seconds(options.max_difference_ns) + " s of one of the reference (" +
                    format_seconds(reference.times_ns.front()) + " to " + format_seconds(reference.times_ns.back()) +
                    " s)");
  }
  return result;
}

AbsoluteError absolute_error(const Trajectory& estimate, const Trajectory& reference, AlignmentMode mode) {
  check_pair(estimate, reference);
  AbsoluteError result;
  result.alignment = align_points(positions_of(estimate), positions_of(reference), mode);
  if (!result.alignment.ok()) {
    throw DataError(std::string("alignment ") + alignment_name(mode) + " of " + std::to_string(estimate.size()) +
                    " poses: " + alignment_failure_text(result.alignment.failure));
  }
  result.times_ns = estimate.times_ns;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const Pose3 aligned = result.alignment * estimate.poses[i];
    result.translation_m.push_back((aligned.translation - reference.poses[i].translation).norm());
    result.rotation_rad.push_back(so3::angle_between(aligned.rotation, reference.poses[i].rotation));
  }
  result.translation = error_statistics(result.translation_m);
  result.rotation = error_statistics(result.rotation_rad);
  return result;
}

void RelativeErrorOptions::check() const {
  require_positive("delta", delta);
  require(unit != DeltaUnit::kFrames || delta == std::floor(delta), "delta", delta, "must be whole for frames");
  require_not_negative("relative_tolerance", relative_tolerance);
}

RelativeError relative_error(const Trajectory& estimate, const Trajectory& reference,
                             const RelativeErrorOptions& options) {
  options.check();
  check_pair(estimate, reference);
  IndexPairs pairs;
  if (options.unit == DeltaUnit::kFrames) {
    const double delta = std::min(options.delta, static_cast<double>(estimate.size()));
    pairs = pairs_by_index(estimate.size(), static_cast<std::size_t>(delta), options.all_pairs);
  } else {
    const auto steps = steps_along(options.pairs_from_reference ? reference : estimate, options.unit);
    const double delta =
        options.unit == DeltaUnit::kSeconds ? static_cast<double>(from_seconds(options.delta)) : options.delta;
    pairs = options.all_pairs ? all_pairs_near(steps, delta, delta * options.relative_tolerance)
                              : consecutive_pairs(steps, delta);
  }
  if (pairs.empty()) {
    throw DataError("no piece of " + to_text(options.delta) + " " + unit_name(options.unit) + " in " +
                    std::to_string(estimate.size()) + " poses");
  }
  RelativeError result;
  for (const auto& [i, j] : pairs) {
    const Pose3 reference_piece = reference.poses[i].inverse() * reference.poses[j];
    const Pose3 estimate_piece = estimate.poses[i].inverse() * estimate.poses[j];
    const Pose3 error = reference_piece.inverse() * estimate_piece;
    result.first.push_back(i);
    result.last.push_back(j);
    result.translation_m.push_back(error.translation.norm());
    result.rotation_rad.push_back(so3::log(error.rotation).norm());
  }
  result.translation = error_statistics(result.translation_m);
  result.rotation = error_statistics(result.rotation_rad);
  return result;
}

}  // namespace loc
