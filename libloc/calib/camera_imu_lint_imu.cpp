// What the IMU's samples say about themselves.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "libloc/calib/camera_imu_lint_detail.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"

namespace loc::calib {
namespace {

using Eigen::Vector3d;

constexpr double kGravity = 9.80665;
constexpr double kLeastRate = 50;        // [Hz]
constexpr double kHopelessRate = 20;     // [Hz]
constexpr double kRateTolerance = 0.05;  // against the nominal one
constexpr double kFewLost = 0.01;        // share of the samples: no harm
constexpr double kShortGap = 0.1;        // [s]
constexpr double kMuchHeld = 0.2;        // share of the readings that are the one before
constexpr double kSomeHeld = 0.05;
// At the end of a range a reading stays the same to the last bit for several samples, far from where it mostly is.
// The smallest ranges on the market are 125 deg/s and 2 g.
constexpr double kSmallestRange = 1.9;   // [rad/s], [g]
constexpr std::size_t kLeastRun = 3;     // samples
constexpr std::size_t kLongRun = 10;     // that one run of is enough
constexpr std::size_t kLeastInRuns = 6;  // otherwise, in two runs or more
constexpr double kFarInSteps = 100;      // of the readings' resolution, from the median
// Norm of the specific force over gravity: a waved rig's median is near 1.
constexpr double kLeastGravity = 0.7;
constexpr double kMostGravity = 1.5;
constexpr double kSteadyNorm = 0.6;  // tenth percentile over the median, where gravity is in it

void look_at_stamps(std::span<const ImuMeasurement> imu, const std::vector<std::size_t>& fine, const StreamTimes& times,
                    double nominal_hz, std::vector<CameraImuFinding>& out) {
  const auto n = static_cast<double>(fine.size());
  if (times.steps_back > 0) {
    out.push_back({Verdict::kWarn, "imu.time_back",
                   "The IMU's times step back " + count_of(times.steps_back, "time") + ", by up to " +
                       number(times.longest_back_s) + " s " + at_time(times.back_at_s) + ": " +
                       count_of(times.behind, "sample") + " of " + std::to_string(fine.size()) +
                       " are not later than one before them and cannot be used."});
  }
  std::int64_t twice = 0;
  for (std::size_t i = 1; i < fine.size(); ++i) {
    const ImuMeasurement& a = imu[fine[i - 1]];
    const ImuMeasurement& b = imu[fine[i]];
    if (a.time_ns == b.time_ns && a.angular_velocity == b.angular_velocity && a.specific_force == b.specific_force) {
      ++twice;
    }
  }
  const auto severity = [&](std::int64_t count) {
    return static_cast<double>(count) > kFewLost * n ? Verdict::kWarn : Verdict::kFair;
  };
  if (twice > 0) {
    out.push_back({severity(twice), "imu.duplicated",
                   count_of(twice, "IMU sample") + " of " + std::to_string(fine.size()) +
                       " came twice (same time, same readings): the second ones are not used. Was something recorded "
                       "through two channels?"});
  }
  if (const std::int64_t coarse = times.same_time - twice; coarse > 0) {
    out.push_back({severity(coarse), "imu.same_time",
                   count_of(coarse, "IMU sample") + " of " + std::to_string(fine.size()) +
                       " have the time of the one before but other readings: the clock that stamps them is too "
                       "coarse, or stamps them in batches. They are not used."});
  }
  if (times.step_s <= 0) return;
  const double rate = 1 / times.step_s;
  if (rate < kLeastRate) {
    out.push_back({rate < kHopelessRate ? Verdict::kRefused : Verdict::kWarn, "imu.rate_low",
                   "The IMU delivers " + number(rate) +
                       " samples a second: take at least 100, better 200, or "
                       "quick motion is lost between them."});
  }
  if (nominal_hz > 0 && std::abs(rate / nominal_hz - 1) > kRateTolerance) {
    out.push_back({Verdict::kWarn, "imu.rate_not_nominal",
                   "The IMU delivers " + number(rate) + " samples a second, not the " + number(nominal_hz) +
                       " of the rig: are samples lost, or times in another unit?"});
  }
  if (times.gaps > 0) {
    const bool harmless = times.longest_gap_s < kShortGap && times.missing < kFewLost;
    out.push_back({harmless ? Verdict::kFair : Verdict::kWarn, "imu.gaps",
                   "The IMU's stream has " + count_of(times.gaps, "gap") + ", the longest of " +
                       number(times.longest_gap_s) + " s " + at_time(times.gap_at_s) + "; about " +
                       percent(times.missing) + " of its samples are missing."});
  }
}

void look_at_held(Triad& triad, double rate_hz, std::vector<CameraImuFinding>& out) {
  std::size_t held = 0;
  for (std::size_t i = 1; i < triad.values.size(); ++i) {
    if (triad.values[i] == triad.values[i - 1]) ++held;
  }
  const std::size_t steps = triad.values.size() - 1;
  triad.constant = held == steps;
  if (triad.constant) {
    const Vector3d& v = triad.values[0];
    out.push_back({Verdict::kRefused, "imu.constant",
                   "The " + triad.name + " never changes: all " + std::to_string(triad.values.size()) +
                       " readings are (" + number(v.x()) + ", " + number(v.y()) + ", " + number(v.z()) + ")."});
    return;
  }
  const double share = static_cast<double>(held) / static_cast<double>(steps);
  if (share > kSomeHeld) {
    out.push_back({share > kMuchHeld ? Verdict::kWarn : Verdict::kFair, "imu.held",
                   percent(share) + " of the " + triad.name +
                       "'s readings are the one before to the last bit: it delivers about " +
                       number(rate_hz * (1 - share)) + " new ones a second and is read " + number(rate_hz) +
                       " times. Read it as often as it measures."});
  }
}

// Readings that equal the axis's extreme, in runs.
struct Runs {
  std::size_t count = 0;
  std::size_t samples = 0;
  std::size_t longest = 0;
  std::size_t longest_at = 0;
};

Runs runs_at(const std::vector<Vector3d>& values, int axis, double extreme) {
  Runs out;
  for (std::size_t i = 0; i < values.size();) {
    std::size_t end = i;
    while (end < values.size() && values[end][axis] == extreme) ++end;
    const std::size_t run = end - i;
    if (run >= kLeastRun) {
      ++out.count;
      out.samples += run;
      if (run > out.longest) {
        out.longest = run;
        out.longest_at = i;
      }
    }
    i = std::max(end, i + 1);
  }
  return out;
}

void look_at_saturation(const Triad& triad, const std::vector<double>& at_s, std::vector<CameraImuFinding>& out) {
  std::string where;
  Runs worst;
  std::size_t samples = 0;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> sorted;
    for (const Vector3d& v : triad.values) sorted.push_back(v[axis]);
    std::ranges::sort(sorted);
    const double middle = sorted[sorted.size() / 2];
    double resolution = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < sorted.size(); ++i) {
      if (sorted[i] > sorted[i - 1]) resolution = std::min(resolution, sorted[i] - sorted[i - 1]);
    }
    for (const double extreme : {sorted.front(), sorted.back()}) {
      if (std::abs(extreme) < kSmallestRange || std::abs(extreme - middle) < kFarInSteps * resolution) continue;
      const Runs runs = runs_at(triad.values, axis, extreme);
      const bool cut = runs.longest >= kLongRun || (runs.count >= 2 && runs.samples >= kLeastInRuns);
      if (!cut) continue;
      where += (where.empty() ? "" : ", ") + std::string(1, "xyz"[axis]) + " at " + to_text(extreme, 5);
      samples += runs.samples;
      if (runs.longest > worst.longest) worst = runs;
    }
  }
  if (samples == 0) return;
  out.push_back({Verdict::kWarn, "imu.saturated",
                 "The " + triad.name + " comes to the end of its range (" + where + " " + triad.unit + "), in " +
                     std::to_string(samples) + " readings, the longest time " + at_time(at_s[worst.longest_at]) +
                     ". Move more gently, or set a larger range."});
}

void look_at_gravity(const Triad& triad, std::vector<CameraImuFinding>& out) {
  std::vector<double> norms;
  for (const Vector3d& v : triad.values) norms.push_back(v.stableNorm());
  const double size = quantile(norms, 0.5);
  const double steady = size > 0 ? quantile(norms, 0.1) / size : 0;
  if (size > kLeastGravity * kGravity && size < kMostGravity * kGravity) return;
  const std::string figures = "the median size of its readings is " + number(size) + ", gravity is 9.81 m/s^2";
  const auto about = [&](double unit) {
    return size > kLeastGravity * unit && size < kMostGravity * unit && steady > kSteadyNorm;
  };
  const auto refuse = [&](const std::string& code, const std::string& text) {
    out.push_back({Verdict::kRefused, code, text});
  };
  if (about(1)) {
    refuse("imu.accelerometer_unit", "The accelerometer seems to be in g: " + figures + ". Multiply by 9.80665.");
  } else if (about(1000)) {
    refuse("imu.accelerometer_unit", "The accelerometer seems to be in thousandths of g or in cm/s^2: " + figures +
                                         ". Multiply by 0.00980665 or 0.01.");
  } else if (size < kLeastGravity * kGravity && steady < kSteadyNorm) {
    refuse("imu.gravity_removed", "The accelerometer lacks gravity: " + figures +
                                      ". Record the specific force, not the linear acceleration that some drivers "
                                      "compute from it.");
  } else {
    refuse("imu.accelerometer_unit", "The accelerometer's unit is not m/s^2: " + figures + ".");
  }
}

}  // namespace

ImuLook look_at_imu(std::span<const ImuMeasurement> imu, double nominal_hz, std::vector<CameraImuFinding>& out) {
  ImuLook look;
  look.gyroscope = {"gyroscope", "rad/s", {}, false};
  look.accelerometer = {"accelerometer", "m/s^2", {}, false};
  std::vector<std::size_t> fine;
  std::vector<TimeNs> times;
  std::int64_t without_time = 0;
  std::int64_t not_finite = 0;
  std::size_t first_bad = 0;
  for (std::size_t i = 0; i < imu.size(); ++i) {
    if (imu[i].time_ns == kNoTime) {
      ++without_time;
    } else if (!imu[i].angular_velocity.allFinite() || !imu[i].specific_force.allFinite()) {
      if (++not_finite == 1) first_bad = i;
    } else {
      fine.push_back(i);
      times.push_back(imu[i].time_ns);
    }
  }
  const auto severity = [&](std::int64_t count) {
    return static_cast<double>(count) > kFewLost * static_cast<double>(imu.size()) ? Verdict::kWarn : Verdict::kFair;
  };
  if (not_finite > 0) {
    out.push_back({severity(not_finite), "imu.not_finite",
                   count_of(not_finite, "IMU sample") + " of " + std::to_string(imu.size()) +
                       " have readings that are no number, the first is sample " + std::to_string(first_bad) +
                       ": they are not used."});
  }
  if (without_time > 0) {
    out.push_back({severity(without_time), "imu.no_time",
                   count_of(without_time, "IMU sample") + " of " + std::to_string(imu.size()) +
                       " have no time: they are not used."});
  }
  look.times = look_at_times(times);
  if (look.times.in_order.size() < 2) {
    out.push_back({Verdict::kRefused, "imu.no_samples",
                   "Of " + count_of(static_cast<std::int64_t>(imu.size()), "IMU sample") + " " +
                       std::to_string(look.times.in_order.size()) + " can be used: there is nothing to calibrate."});
    look.times = {};
    return look;
  }
  look.first_ns = times[0];
  for (const std::size_t i : look.times.in_order) {
    look.gyroscope.values.push_back(imu[fine[i]].angular_velocity);
    look.accelerometer.values.push_back(imu[fine[i]].specific_force);
  }
  look_at_stamps(imu, fine, look.times, nominal_hz, out);
  for (Triad* triad : {&look.gyroscope, &look.accelerometer}) {
    look_at_held(*triad, 1 / look.times.step_s, out);
    if (!triad->constant) look_at_saturation(*triad, look.times.at_s, out);
  }
  if (!look.accelerometer.constant) look_at_gravity(look.accelerometer, out);
  return look;
}

}  // namespace loc::calib
