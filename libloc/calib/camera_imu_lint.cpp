#include "libloc/calib/camera_imu_lint.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>

#include "libloc/calib/camera_imu_lint_detail.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"

namespace loc {
namespace calib {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kGapSteps = 3;

// Turn rates. A handheld rig turns by some rad/s; no usual gyroscope measures more than 2000 deg/s = 35 rad/s.
constexpr double kLeastTurnRate = 0.1;     // [rad/s] median of the camera's, for a comparison
constexpr double kFastestTurn = 35;        // [rad/s]
constexpr double kUnlikelyTurn = 8;        // [rad/s] median
constexpr double kDegreesTolerance = 1.6;  // factor around 180 / pi
constexpr double kTurnTolerance = 3;

constexpr double kShortest = 5;  // [s]
constexpr double kShort = 15;
constexpr double kLeastShared = 0.5;  // of the shorter recording

// Densities beyond these belong to no MEMS sensor, nor to a better one. Source: ranges of data sheets.
struct DensityRange {
  const char* field;
  double ImuNoise::*member;
  double least;
  double most;
  const char* units;
};
constexpr std::array<DensityRange, 4> kDensityRanges{{
    {"gyroscope_noise_density", &ImuNoise::gyroscope_noise_density, 1e-6, 2e-2,
     "rad/s/sqrt(Hz); data sheets write mdps/sqrt(Hz) (1 is 1.7e-5) or deg/s/sqrt(Hz) (1 is 0.017)"},
    {"gyroscope_random_walk", &ImuNoise::gyroscope_random_walk, 1e-9, 2e-2, "rad/s^2/sqrt(Hz)"},
    {"accelerometer_noise_density", &ImuNoise::accelerometer_noise_density, 1e-5, 0.2,
     "m/s^2/sqrt(Hz); data sheets write ug/sqrt(Hz) (1 is 9.8e-6) or mg/sqrt(Hz) (1 is 0.0098)"},
    {"accelerometer_random_walk", &ImuNoise::accelerometer_random_walk, 1e-8, 0.2, "m/s^3/sqrt(Hz)"},
}};
// Between the density and what the quietest parts of the recording show. A filter in the sensor hides noise, vibration
// adds to it: hence far apart.
constexpr double kTooLarge = 20;
constexpr double kTooSmall = 0.01;
constexpr std::size_t kNoiseWindow = 32;  // samples
constexpr double kQuietest = 0.1;         // of the windows

// a - b [s], to the nanosecond unless they are centuries apart.
double after(TimeNs a, TimeNs b) {
  TimeNs difference = 0;
  return __builtin_sub_overflow(a, b, &difference) ? apart_s(a, b) : to_seconds(difference);
}

std::string fixed(double value, int decimals) {
  std::array<char, 400> buffer{};
  const auto result =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::fixed, decimals);
  return {buffer.data(), result.ptr};
}

// Mean turn rate over steps of that length, medians of the sizes.
double turn_rate_over(const ImuLook& imu, double step_s, double begin_s, double end_s) {
  std::vector<double> sizes;
  const std::vector<double>& at = imu.times.at_s;
  std::size_t i = static_cast<std::size_t>(std::ranges::lower_bound(at, begin_s) - at.begin());
  while (i < at.size() && at[i] <= end_s) {
    const double until = at[i] + step_s;
    Vector3d sum = Vector3d::Zero();
    int n = 0;
    for (; i < at.size() && at[i] < until; ++i, ++n) sum += imu.gyroscope.values[i];
    sizes.push_back(sum.stableNorm() / n);
  }
  return sizes.empty() ? 0 : quantile(sizes, 0.5);
}

// Where both clocks are the same and the rest lies apart, only what both have seen can be compared.
struct Shared {
  double begin_s;  // after the IMU's first sample
  double end_s;
  double length() const { return end_s - begin_s; }
};
Shared shared_of(const ImuLook& imu, const CameraLook& camera) {
  return {std::max(0.0, apart_s(camera.first_ns, imu.first_ns)),
          std::min(imu.times.span_s(), apart_s(camera.last_ns, imu.first_ns))};
}

void look_at_turns(const ImuLook& imu, std::span<const CameraRecording> cameras, std::span<const CameraLook> looks,
                   std::vector<CameraImuFinding>& out) {
  const std::string code = "imu.gyroscope_unit";
  std::vector<double> sizes;
  for (const Vector3d& v : imu.gyroscope.values) sizes.push_back(v.stableNorm());
  const double middle = quantile(sizes, 0.5);
  const double large = quantile(sizes, 0.99);
  const std::string sizes_text = "median size " + number(middle) + ", 1 % of the readings above " + number(large);
  for (std::size_t c = 0; c < looks.size(); ++c) {
    const CameraLook& look = looks[c];
    if (look.turn_rate < kLeastTurnRate) continue;
    Shared shared = shared_of(imu, look);
    const bool together = shared.length() > kShort;
    if (!together) shared = {0, imu.times.span_s()};
    const double ratio = turn_rate_over(imu, look.turn_step_s, shared.begin_s, shared.end_s) / look.turn_rate;
    const std::string figures = "the gyroscope's readings are " + number(ratio) + " times the turn rates of " +
                                cameras[c].camera.name + " (median " + number(look.turn_rate) + " rad/s)";
    if (ratio * kDegree > 1 / kDegreesTolerance && ratio * kDegree < kDegreesTolerance) {
      out.push_back({Verdict::kRefused, code,
                     "The gyroscope seems to be in deg/s: " + figures + ", and 180/pi is 57.3. Convert it to rad/s."});
      return;
    }
    // Without a common clock, the one may hold rests that the other has not.
    if (together && (ratio > kTurnTolerance || ratio < 1 / kTurnTolerance)) {
      out.push_back({Verdict::kWarn, code,
                     "The gyroscope does not turn as much as the camera: " + figures +
                         ". Check its unit (rad/s), and that both recordings are of the same motion."});
      return;
    }
    if (together) return;
  }
  if (large > kFastestTurn) {
    out.push_back({Verdict::kRefused, code,
                   "The gyroscope reads more than a hand can turn (" + sizes_text +
                       ") and rad/s are wanted: it seems to be in deg/s."});
  } else if (middle > kUnlikelyTurn) {
    out.push_back({Verdict::kWarn, code,
                   "The gyroscope's readings are large for rad/s (" + sizes_text + "): are they in deg/s?"});
  }
}

// White noise that the quietest parts leave room for: third differences take out what moves smoothly.
double quiet_deviation(const std::vector<Vector3d>& values) {
  std::vector<double> squares;
  for (std::size_t begin = 0; begin + kNoiseWindow <= values.size(); begin += kNoiseWindow) {
    double sum = 0;
    for (std::size_t i = begin + 3; i < begin + kNoiseWindow; ++i) {
      sum += (values[i] - 3 * values[i - 1] + 3 * values[i - 2] - values[i - 3]).squaredNorm();
    }
    squares.push_back(sum / (3.0 * (kNoiseWindow - 3) * 20));  // 1 + 9 + 9 + 1
  }
  return squares.empty() ? 0 : std::sqrt(quantile(squares, kQuietest));
}

void compare_noise(const std::string& field, double density, const Triad& triad, double step_s,
                   std::vector<CameraImuFinding>& out) {
  const double seen = quiet_deviation(triad.values) * std::sqrt(step_s);
  if (triad.constant || !(seen > 0)) return;
  const std::string figures = field + " is " + to_text(density, 3) +
                              ", but the quietest tenth of the recording shows " + to_text(seen, 2) + " " + triad.unit +
                              "/sqrt(Hz)";
  if (density > kTooLarge * seen) {
    out.push_back({Verdict::kWarn, "noise.too_large",
                   figures + ": " + number(density / seen) +
                       " times less. Check its unit, and that it is a density and "
                       "not the deviation of a sample."});
  } else if (density < kTooSmall * seen) {
    out.push_back({Verdict::kWarn, "noise.too_small",
                   figures + ": " + number(seen / density) +
                       " times more. Check its unit, and whether something "
                       "vibrates."});
  }
}

}  // namespace

std::string count_of(std::int64_t n, const std::string& what) {
  return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

std::string number(double value) {
  const double size = std::abs(value);
  if (!(size >= 1 && size < 1e9)) return to_text(value, 3);
  std::string text = fixed(value, size < 10 ? 2 : size < 100 ? 1 : 0);
  if (text.find('.') != std::string::npos) text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text;
}

std::string percent(double share) {
  return number(100 * share) + " %";
}

std::string at_time(double t_s) {
  return "at " + fixed(t_s, 2) + " s";
}

StreamTimes look_at_times(std::span<const TimeNs> times) {
  StreamTimes out;
  if (times.empty()) return out;
  TimeNs latest = times[0];
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double since = after(times[i], times[0]);
    if (i > 0 && times[i] < times[i - 1]) {
      ++out.steps_back;
      const double back = after(times[i - 1], times[i]);
      if (back > out.longest_back_s) {
        out.longest_back_s = back;
        out.back_at_s = since + back;
      }
    }
    if (i > 0 && times[i] <= latest) {
      (times[i] == times[i - 1] ? out.same_time : out.behind) += 1;
      continue;
    }
    latest = times[i];
    out.in_order.push_back(i);
    out.at_s.push_back(since);
  }
  std::vector<double> steps;
  for (std::size_t i = 1; i < out.at_s.size(); ++i) steps.push_back(out.at_s[i] - out.at_s[i - 1]);
  if (steps.empty()) return out;
  out.step_s = quantile(steps, 0.5);
  double lost = 0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (steps[i] <= kGapSteps * out.step_s) continue;
    ++out.gaps;
    lost += std::round(steps[i] / out.step_s) - 1;
    if (steps[i] > out.longest_gap_s) {
      out.longest_gap_s = steps[i];
      out.gap_at_s = out.at_s[i];
    }
  }
  out.missing = lost / (lost + static_cast<double>(out.at_s.size()));
  return out;
}

void look_at_both(const ImuLook& imu, std::span<const CameraRecording> cameras, std::span<const CameraLook> looks,
                  std::vector<CameraImuFinding>& out) {
  if (imu.times.at_s.size() < 2) return;
  if (!imu.gyroscope.constant) look_at_turns(imu, cameras, looks, out);
  for (std::size_t c = 0; c < looks.size(); ++c) {
    const CameraLook& look = looks[c];
    if (look.first_ns == kNoTime) continue;
    const std::string& name = cameras[c].camera.name;
    const double seen = after(look.last_ns, look.first_ns);
    const double felt = imu.times.span_s();
    const double length = std::min(seen, felt);
    if (length < kShort) {
      out.push_back({length < kShortest ? Verdict::kWarn : Verdict::kFair, "recording.short",
                     name + ": the recording is short, " + number(seen) + " s with the target and " + number(felt) +
                         " s of IMU: record for a minute."});
    }
    const double shared = shared_of(imu, look).length();
    if (shared <= 0) {
      const double apart = apart_s(look.first_ns, imu.first_ns);
      out.push_back({Verdict::kOk, "clocks.apart",
                     name + ": its pictures begin " + fixed(std::abs(apart), 1) + " s " +
                         (apart > 0 ? "after" : "before") +
                         " the IMU's first sample and share no time with it: the clocks differ, and the offset will "
                         "be found from the motion."});
    } else if (shared < kLeastShared * length) {
      out.push_back({Verdict::kFair, "clocks.little_overlap",
                     name + ": pictures and IMU samples share only " + number(shared) + " s of " + number(length) +
                         " s, if their clocks are the same."});
    }
  }
}

void look_at_noise(const ImuNoise& noise, const ImuLook& imu, std::vector<CameraImuFinding>& out) {
  bool odd = false;
  for (const DensityRange& range : kDensityRanges) {
    const double value = noise.*range.member;
    const std::string figure = std::string(range.field) + " = " + to_text(value, 3);
    if (value == 0) {
      odd = true;
      out.push_back({Verdict::kRefused, "noise.zero",
                     figure + ": no sensor is free of noise, and what the others may say hangs on it."});
    } else if (value < range.least || value > range.most) {
      odd = true;
      out.push_back({Verdict::kWarn, "noise.unit",
                     figure + " is implausible (usual: " + to_text(range.least) + " to " + to_text(range.most) +
                         "): the unit is " + range.units + "."});
    }
  }
  if (odd) return;
  const ImuNoise usual;
  if (noise.gyroscope_noise_density == usual.gyroscope_noise_density &&
      noise.accelerometer_noise_density == usual.accelerometer_noise_density) {
    out.push_back({Verdict::kFair, "noise.default",
                   "The noise densities are the defaults, which nobody has measured on this IMU: take those of its "
                   "data sheet, or let it lie still for hours and measure them."});
  }
  compare_noise("gyroscope_noise_density", noise.gyroscope_noise_density, imu.gyroscope, imu.times.step_s, out);
  compare_noise("accelerometer_noise_density", noise.accelerometer_noise_density, imu.accelerometer, imu.times.step_s,
                out);
}

}  // namespace calib

std::vector<CameraImuFinding> lint_camera_imu(const CalibrationTarget& target, std::span<const CameraRecording> cameras,
                                              std::span<const ImuMeasurement> imu, const ImuNoise& noise,
                                              double imu_rate_hz) {
  target.check();
  noise.check();
  require_not_negative("imu_rate_hz", imu_rate_hz);
  for (const CameraRecording& recording : cameras) {
    recording.camera.check();
    for (const TargetView& view : recording.views) view.check(target);
  }
  std::vector<CameraImuFinding> out;
  const calib::ImuLook imu_look = calib::look_at_imu(imu, imu_rate_hz, out);
  std::vector<calib::CameraLook> looks;
  for (const CameraRecording& recording : cameras) looks.push_back(calib::look_at_camera(target, recording, out));
  calib::look_at_both(imu_look, cameras, looks, out);
  // A unit that is wrong makes every density look wrong.
  const bool unit_wrong = std::ranges::any_of(out, [](const CameraImuFinding& f) {
    return f.severity == Verdict::kRefused && f.code.starts_with("imu.") && f.code.ends_with("_unit");
  });
  calib::look_at_noise(noise, unit_wrong ? calib::ImuLook{} : imu_look, out);
  std::ranges::stable_sort(out, std::ranges::greater(), &CameraImuFinding::severity);
  return out;
}

}  // namespace loc
