#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "libloc/calib/stillness.hpp"
#include "libloc/core/random.hpp"
#include "libloc/io/broad.hpp"
#include "support/data.hpp"
#include "support/xsens.hpp"

namespace loc {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const Rows kAbsent(0, 3);

/// Rest and motion in turns, 100 Hz: white noise, and smooth motion of many times its size.
struct Simulated {
  std::vector<TimeNs> times;
  Rows gyro;
  Rows accel;
  std::vector<bool> moving;

  Simulated(const std::vector<double>& seconds, double unit = 1, std::uint64_t seed = 1, double drift_per_s = 0) {
    Random random(seed);
    std::size_t n = 0;
    for (const double s : seconds) n += static_cast<std::size_t>(s * 100);
    gyro.resize(static_cast<Eigen::Index>(n), 3);
    accel.resize(static_cast<Eigen::Index>(n), 3);
    Eigen::Vector3d gravity(0.3, -4, 9);
    Eigen::Index i = 0;
    for (std::size_t part = 0; part < seconds.size(); ++part) {
      const auto samples = static_cast<int>(seconds[part] * 100);
      const bool moves = part % 2 == 1;
      const Eigen::Vector3d from = gravity;
      if (moves) gravity = random.direction() * 9.81;
      for (int k = 0; k < samples; ++k, ++i) {
        const double phase = static_cast<double>(k) / samples;
        const double bump = std::sin(std::numbers::pi * phase);
        times.push_back(i * 10'000'000);
        const Eigen::Vector3d rate =
            moves ? Eigen::Vector3d(bump, 0.5 * bump * bump, -bump * bump) : Eigen::Vector3d::Zero();
        const Eigen::Vector3d force = moves ? Eigen::Vector3d(from + phase * (gravity - from)) : gravity;
        const Eigen::Vector3d bias =
            Eigen::Vector3d(0.01, -0.02, 0.03).array() + drift_per_s * 0.01 * static_cast<double>(i);
        gyro.row(i) = unit * (rate + bias + 0.003 * random.normal3());
        accel.row(i) = unit * (force + 0.01 * random.normal3());
        moving.push_back(moves);
      }
    }
  }
};

void expect_found(const Stillness& s, const Simulated& truth, std::size_t segments) {
  ASSERT_EQ(s.segments.size(), segments) << (s.quality.reasons.empty() ? "" : s.quality.reasons.front());
  EXPECT_TRUE(s.quality.usable());
  for (const StillSegment& segment : s.segments) {
    int moving = 0;
    for (auto i = segment.begin; i < segment.end; ++i) moving += truth.moving[static_cast<std::size_t>(i)] ? 1 : 0;
    EXPECT_LE(moving, 15) << "segment from row " << segment.begin;
  }
}

TEST(Stillness, FindsThePartsWhateverTheUnit) {
  const std::vector<double> parts = {3, 2, 4, 3, 2, 2, 5, 4, 3};
  for (const double unit : {1.0, 1e-9, 400.0, 1e12}) {
    const Simulated r(parts, unit);
    const Stillness s = find_stillness(r.times, r.gyro, r.accel);
    expect_found(s, r, 5);
    EXPECT_NEAR(s.rate_hz, 100, 1e-6);
    EXPECT_EQ(s.window_samples, 50);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(std::sqrt(s.gyroscope.variance[axis]) / unit, 0.003, 0.0004);
      EXPECT_NEAR(std::sqrt(s.accelerometer.variance[axis]) / unit, 0.01, 0.0013);
    }
    EXPECT_NEAR(s.gyroscope.whiteness, 1, 0.1);
    EXPECT_NEAR(s.segments[0].gyroscope.mean.x() / unit, 0.01, 0.001);
    EXPECT_NEAR(s.segments[0].accelerometer.mean.z() / unit, 9, 0.005);
    EXPECT_NEAR(s.segments[0].accelerometer.cov(0, 0) / (unit * unit), 1e-4, 3e-5);
    EXPECT_NEAR(s.segments[0].accelerometer.cov(0, 1) / (unit * unit), 0, 3e-5);
    EXPECT_NEAR(s.segments[0].duration_s(), 2.8, 0.1);
  }
}

TEST(Stillness, OneSensorIsEnough) {
  const Simulated r({3, 2, 4, 3, 2});
  const Stillness g = find_stillness(r.times, r.gyro, kAbsent);
  expect_found(g, r, 3);
  EXPECT_TRUE(std::isnan(g.segments[0].accelerometer.mean.x()));
  const Stillness a = find_stillness(r.times, kAbsent, r.accel);
  expect_found(a, r, 3);
  EXPECT_TRUE(std::isnan(a.segments[0].gyroscope.mean.x()));
}

TEST(Stillness, AllStillIsOneSegment) {
  const Simulated r({20});
  const Stillness s = find_stillness(r.times, r.gyro, r.accel);
  expect_found(s, r, 1);
  EXPECT_EQ(s.segments[0].begin, 0);
  EXPECT_EQ(s.segments[0].end, 2000);
  EXPECT_EQ(s.still_share, 1);
}

TEST(Stillness, DriftDoesNoHarm) {
  // 1 mrad/s each minute, a third of the noise.
  const Simulated r({60, 3, 60, 3, 60, 3, 60}, 1, 2, 1e-3 / 60);
  expect_found(find_stillness(r.times, r.gyro, r.accel), r, 4);
}

TEST(Stillness, MotionAloneIsNotStill) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const int n = 6000;
    Rows gyro(n, 3);
    Rows accel(n, 3);
    std::vector<TimeNs> times;
    Eigen::Vector3d phase = 6 * Eigen::Vector3d(random.uniform(), random.uniform(), random.uniform());
    for (int i = 0; i < n; ++i) {
      const double t = 0.01 * i;
      times.push_back(TimeNs{i} * 10'000'000);
      for (int axis = 0; axis < 3; ++axis) {
        const double w = 2 + 1.3 * axis;
        gyro(i, axis) = std::sin(w * t + phase[axis]) + 0.4 * std::sin(3.3 * w * t);
        accel(i, axis) = 3 * std::cos(w * t + phase[axis]) + std::sin(2.1 * w * t);
      }
      gyro.row(i) += 0.003 * random.normal3();
      accel.row(i) += 0.01 * random.normal3();
    }
    const Stillness s = find_stillness(times, gyro, accel);
    EXPECT_TRUE(s.segments.empty()) << "seed " << seed;
    EXPECT_EQ(s.quality.verdict, Verdict::kRefused);
  }
}

// A drone: the motors' vibration is white and always there, the motion below it smooth and smaller.
TEST(Stillness, VibrationDoesNotHideMotion) {
  Simulated r({20});
  Random random(8);
  const auto n = r.gyro.rows();
  Eigen::Vector3d phase = 6 * random.normal3();
  for (Eigen::Index i = 0; i < n; ++i) {
    r.gyro.row(i) += 0.05 * random.normal3();
    r.accel.row(i) += 0.5 * random.normal3();
    if (i < 500) continue;
    const double t = 0.01 * static_cast<double>(i);
    for (int axis = 0; axis < 3; ++axis) r.gyro(i, axis) += 0.06 * std::sin((2 + 0.7 * axis) * t + phase[axis]);
  }
  const Stillness s = find_stillness(r.times, r.gyro, r.accel);
  ASSERT_EQ(s.segments.size(), 1U);
  EXPECT_EQ(s.segments[0].begin, 0);
  EXPECT_NEAR(static_cast<double>(s.segments[0].end), 500, 50);
  EXPECT_GT(s.wandering_segments, 0);
  StillnessOptions off;
  off.max_wander = 0;
  EXPECT_GT(find_stillness(r.times, r.gyro, r.accel, off).still_share, 0.9);
}

TEST(Stillness, EvenTurningIsNotStill) {
  Simulated r({4, 2, 4, 2, 4, 2, 4});
  // The second rest becomes a turn about the vertical, which the accelerometer does not see.
  for (Eigen::Index i = 600; i < 1000; ++i) r.gyro(i, 2) += 0.3;
  const Stillness s = find_stillness(r.times, r.gyro, r.accel);
  EXPECT_EQ(s.turning_segments, 1);
  EXPECT_EQ(s.segments.size(), 3U);
}

TEST(Stillness, HostileRowsAreCountedAndLeftOut) {
  Simulated r({5, 2, 5});
  r.gyro(100, 1) = kNan;
  r.accel(150, 0) = std::numeric_limits<double>::infinity();
  r.times[200] = r.times[199] - 50;
  r.times[201] = r.times[199];
  r.times[250] = kNoTime;
  const Stillness s = find_stillness(r.times, r.gyro, r.accel);
  EXPECT_EQ(s.not_finite, 3);
  EXPECT_EQ(s.out_of_order, 2);
  ASSERT_EQ(s.segments.size(), 2U);
  EXPECT_EQ(s.segments[0].samples, s.segments[0].end - s.segments[0].begin - 5);
  EXPECT_TRUE(s.segments[0].gyroscope.mean.allFinite());
}

TEST(Stillness, OneHugeValueDoesNotSpoilTheRest) {
  Simulated r({7, 2, 5});
  r.accel(200, 2) = 1e30;
  r.gyro(400, 0) = 1e200;
  const Stillness s = find_stillness(r.times, r.gyro, r.accel);
  ASSERT_EQ(s.segments.size(), 4U);
  for (const StillSegment& segment : s.segments) {
    EXPECT_FALSE(segment.begin <= 200 && 200 < segment.end);
    EXPECT_FALSE(segment.begin <= 400 && 400 < segment.end);
    EXPECT_LT(segment.accelerometer.cov(2, 2), 3e-4);
  }
}

TEST(Stillness, GapsEndASegment) {
  Simulated r({10, 2, 5});
  for (std::size_t i = 500; i < r.times.size(); ++i) r.times[i] += 3'000'000'000;
  const Stillness s = find_stillness(r.times, r.gyro, r.accel);
  EXPECT_EQ(s.gaps, 1);
  ASSERT_EQ(s.segments.size(), 3U);
  EXPECT_EQ(s.segments[0].end, 500);
  EXPECT_EQ(s.segments[1].begin, 500);
}

TEST(Stillness, CoarseReadings) {
  // Noise below one step: most neighbours are equal.
  Simulated r({5, 2, 5, 2, 5});
  r.gyro = (r.gyro.array() / 0.01).round() * 0.01;
  r.accel = (r.accel.array() / 0.04).round() * 0.04;
  expect_found(find_stillness(r.times, r.gyro, r.accel), r, 3);
}

TEST(Stillness, AStuckAxisIsNamed) {
  Simulated r({5, 2, 5});
  r.accel.col(1).setConstant(3);
  const Stillness s = find_stillness(r.times, r.gyro, r.accel);
  EXPECT_EQ(s.segments.size(), 2U);
  EXPECT_EQ(s.quality.verdict, Verdict::kWarn);
  EXPECT_NE(s.quality.reasons.at(0).find("accelerometer's axis y"), std::string::npos);
  r.accel.setZero();
  r.gyro.setZero();
  const Stillness dead = find_stillness(r.times, r.gyro, r.accel);
  EXPECT_EQ(dead.quality.verdict, Verdict::kWarn);
  EXPECT_EQ(dead.quality.reasons.size(), 6U);
}

TEST(Stillness, TooLittle) {
  EXPECT_EQ(find_stillness({}, kAbsent, kAbsent).quality.verdict, Verdict::kRefused);
  const Simulated r({0.15});
  const Stillness s = find_stillness(r.times, r.gyro, r.accel);
  EXPECT_EQ(s.quality.verdict, Verdict::kRefused);
  EXPECT_TRUE(s.segments.empty());
  const std::vector<TimeNs> same(50, 7);
  EXPECT_EQ(find_stillness(same, Rows::Zero(50, 3), kAbsent).quality.verdict, Verdict::kRefused);
  const std::vector<TimeNs> ends = {std::numeric_limits<TimeNs>::min() + 1, 0, std::numeric_limits<TimeNs>::max()};
  EXPECT_EQ(find_stillness(ends, Rows::Zero(3, 3), kAbsent).quality.verdict, Verdict::kRefused);
  const Rows nan = Rows::Constant(50, 3, kNan);
  std::vector<TimeNs> times;
  for (int i = 0; i < 50; ++i) times.push_back(i);
  EXPECT_EQ(find_stillness(times, nan, kAbsent).not_finite, 50);
}

TEST(Stillness, RefusesWrongArguments) {
  const Simulated r({2});
  EXPECT_THROW(find_stillness(r.times, Rows::Zero(3, 3), kAbsent), std::invalid_argument);
  EXPECT_THROW(find_stillness(r.times, kAbsent, Rows::Zero(3, 3)), std::invalid_argument);
  EXPECT_THROW(find_stillness(r.times, kAbsent, kAbsent), std::invalid_argument);
  StillnessOptions options;
  options.leave_ratio = 1;
  EXPECT_THROW(find_stillness(r.times, r.gyro, r.accel, options), std::invalid_argument);
  options = {};
  options.window_s = kNan;
  EXPECT_THROW(find_stillness(r.times, r.gyro, r.accel, options), std::invalid_argument);
}

TEST(StillnessDetector, AgreesWithTheRecordingsAnswer) {
  const Simulated r({5, 3, 5, 3, 5});
  const Stillness s = find_stillness(r.times, r.gyro, r.accel);
  ASSERT_EQ(s.segments.size(), 3U);
  StillnessDetector detector(s.gyroscope, s.accelerometer, s.rate_hz, s.window_samples);
  for (std::size_t i = 0; i < r.times.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const bool still = detector.update(r.times[i], r.gyro.row(row), r.accel.row(row));
    // The window that ends here is centred half a window ago.
    const auto centre = static_cast<std::int64_t>(i) - s.window_samples / 2 + 1;
    const bool inside = std::any_of(s.segments.begin(), s.segments.end(), [&](const StillSegment& segment) {
      return segment.begin <= centre && centre < segment.end;
    });
    if (i >= 50) {
      EXPECT_EQ(still, inside) << "row " << i;
    }
    if (still) {
      EXPECT_LT((detector.gyroscope_mean() - Eigen::Vector3d(0.01, -0.02, 0.03)).norm(), 0.006);
    }
  }
  EXPECT_EQ(detector.rejected(), 0);
}

TEST(StillnessDetector, OddInput) {
  const Simulated r({5});
  const Stillness s = find_stillness(r.times, r.gyro, r.accel);
  StillnessDetector detector(s.gyroscope, RestNoise{}, 100, 50, {}, Eigen::Vector3d(0.01, -0.02, 0.03));
  const Eigen::Vector3d nan = Eigen::Vector3d::Constant(kNan);
  for (std::size_t i = 0; i < 100; ++i) detector.update(r.times[i], r.gyro.row(static_cast<Eigen::Index>(i)), nan);
  EXPECT_TRUE(detector.still());
  EXPECT_EQ(detector.still_since_ns(), r.times[49]);
  EXPECT_TRUE(detector.update(r.times[50], r.gyro.row(100), nan));  // clock stepped back: not taken
  EXPECT_TRUE(detector.update(r.times[100], nan, nan));
  EXPECT_EQ(detector.rejected(), 2);
  EXPECT_FALSE(detector.update(r.times[200], r.gyro.row(200), nan));  // gap of a second
  for (std::size_t i = 201; i < 300; ++i) {
    detector.update(r.times[i], r.gyro.row(static_cast<Eigen::Index>(i)) + Eigen::RowVector3d(0.1, 0, 0), nan);
  }
  EXPECT_FALSE(detector.still()) << "an even turn";
  EXPECT_THROW(StillnessDetector(RestNoise{}, RestNoise{}, 100, 50), std::invalid_argument);
  EXPECT_THROW(StillnessDetector(s.gyroscope, s.accelerometer, kNan, 50), std::invalid_argument);
  EXPECT_THROW(StillnessDetector(s.gyroscope, s.accelerometer, 100, 1), std::invalid_argument);
}

TEST(StillnessReal, XsensPosesWithoutThresholds) {
  LOC_DATA_OR_SKIP(folder, "imu-tk-xsens");
  const test::XsensRecording r = test::read_xsens(folder);
  const Stillness s = find_stillness(r.times_ns, r.gyroscope, r.accelerometer);
  EXPECT_EQ(s.quality.verdict, Verdict::kOk);
  const auto& poses = test::xsens_poses();
  std::size_t found = 0;
  for (const auto& [from, to] : poses) {
    found += std::any_of(s.segments.begin(), s.segments.end(),
                         [&](const StillSegment& segment) {
                           return to_seconds(segment.start_ns) < to && to_seconds(segment.end_ns) > from;
                         })
                 ? 1
                 : 0;
  }
  int in_motion = 0;
  for (const StillSegment& segment : s.segments) {
    const bool in_a_pose = std::any_of(poses.begin(), poses.end(), [&](const auto& pose) {
      return to_seconds(segment.start_ns) > pose.first - 2 && to_seconds(segment.end_ns) < pose.second + 6;
    });
    in_motion += in_a_pose ? 0 : 1;
  }
  std::printf("%zu of 38 poses found in %zu segments, %d segments in motion; whiteness %.2f, %.2f\n", found,
              s.segments.size(), in_motion, s.gyroscope.whiteness, s.accelerometer.whiteness);
  EXPECT_GE(found, 36U);
  EXPECT_EQ(in_motion, 0);
}

// BROAD marks where each trial moves; its optical reference is not looked at here.
TEST(StillnessReal, BroadMovementFlags) {
  LOC_DATA_OR_SKIP(folder, "broad");
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".mat") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  for (const auto& file : files) {
    const BroadTrial trial = read_broad_trial(file);
    const Stillness s = find_stillness(trial.time_ns, trial.angular_velocity, trial.specific_force);
    std::int64_t still_in_motion = 0;
    std::int64_t still_at_rest = 0;
    for (const StillSegment& segment : s.segments) {
      for (auto i = segment.begin; i < segment.end; ++i) ++(trial.score[i] ? still_in_motion : still_at_rest);
    }
    const auto rest = trial.score.size() - trial.score.count();
    std::printf("%-46s %2zu segments, whiteness %.2f %.2f: %.1f %% of the rest, %.2f %% of the motion\n",
                file.filename().c_str(), s.segments.size(), s.gyroscope.whiteness, s.accelerometer.whiteness,
                100.0 * static_cast<double>(still_at_rest) / static_cast<double>(rest),
                100.0 * static_cast<double>(still_in_motion) / static_cast<double>(trial.score.count()));
    EXPECT_GE(still_at_rest, rest * 9 / 10) << file;
    EXPECT_EQ(still_in_motion, 0) << file;
  }
}

// The same trials without their rest: nothing in them is still, however gentle it is.
TEST(StillnessReal, BroadMotionAlone) {
  LOC_DATA_OR_SKIP(folder, "broad");
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    // With breaks: these are rest.
    if (entry.path().extension() != ".mat" || entry.path().string().find("breaks") != std::string::npos) continue;
    const BroadTrial trial = read_broad_trial(entry.path());
    Eigen::Index first = 0;
    while (!trial.score[first]) ++first;
    Eigen::Index last = trial.score.size();
    while (!trial.score[last - 1]) --last;
    const Eigen::Index n = last - first;
    const Stillness s =
        find_stillness(std::span(trial.time_ns).subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(n)),
                       trial.angular_velocity.middleRows(first, n), trial.specific_force.middleRows(first, n));
    std::printf("%-46s %zu segments, whiteness %.2f %.2f\n", entry.path().filename().c_str(), s.segments.size(),
                s.gyroscope.whiteness, s.accelerometer.whiteness);
    EXPECT_TRUE(s.segments.empty()) << entry.path();
  }
}

}  // namespace
}  // namespace loc
