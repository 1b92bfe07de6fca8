// What is said about a recording before it is solved: each fault by its own code, good recordings get none.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "libloc/calib/camera_imu_lint.hpp"
#include "libloc/core/random.hpp"
#include "tests/support/data.hpp"
#include "tests/support/number_table.hpp"
#include "tests/support/waved_rig.hpp"

namespace loc {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = 0.017453292519943295;

struct Input {
  CalibrationTarget target;
  std::vector<CameraRecording> cameras;
  std::vector<ImuMeasurement> imu;
  ImuNoise noise;
  double imu_rate_hz = 200;
};

// Not the defaults.
ImuNoise measured_noise() {
  ImuNoise noise;
  noise.gyroscope_noise_density = 1.8e-4;
  noise.accelerometer_noise_density = 2.1e-3;
  return noise;
}

Input waved(test::WavedRigOptions options = {}, std::uint64_t seed = 1) {
  options.noise = measured_noise();
  test::WavedRig rig = test::wave(options, seed);
  rig.camera.rate_hz = options.camera_hz;
  return {rig.target, {{rig.camera, rig.views}}, rig.imu, options.noise, options.imu_hz};
}

// One that tests alter.
const Input& good() {
  static const Input input = waved({.seconds = 20});
  return input;
}

std::vector<CameraImuFinding> lint(const Input& in) {
  return lint_camera_imu(in.target, in.cameras, in.imu, in.noise, in.imu_rate_hz);
}

std::string all_of(const std::vector<CameraImuFinding>& findings) {
  std::string text;
  for (const CameraImuFinding& f : findings) {
    text += std::string(verdict_name(f.severity)) + " " + f.code + ": " + f.text + "\n";
  }
  return text;
}

// The change leads to this finding, with these words, and to no other.
void expect_only(const std::function<void(Input&)>& change, Verdict severity, const std::string& code,
                 const std::vector<std::string>& parts) {
  Input input = good();
  change(input);
  const auto findings = lint(input);
  ASSERT_EQ(findings.size(), 1U) << code << "\n" << all_of(findings);
  EXPECT_EQ(findings[0].code, code) << all_of(findings);
  EXPECT_EQ(findings[0].severity, severity) << all_of(findings);
  for (const std::string& part : parts) {
    EXPECT_NE(findings[0].text.find(part), std::string::npos) << "'" << part << "' not in: " << findings[0].text;
  }
}

TEST(CameraImuLint, AGoodRecordingGetsNoFinding) {
  EXPECT_EQ(all_of(lint(good())), "");
  for (const std::uint64_t seed : {2U, 3U}) {
    EXPECT_EQ(all_of(lint(waved({.seconds = 20}, seed))), "");
    EXPECT_EQ(all_of(lint(waved({.seconds = 20, .time_offset_s = -0.05, .outliers = 0.02}, seed))), "");
    // It moves so little that the target stays in the middle.
    const auto calm = lint(waved({.seconds = 20, .turning = {0.3, 0.3, 0.3}, .moving = 0.3, .missing = 0.3}, seed));
    ASSERT_EQ(calm.size(), 1U) << all_of(calm);
    EXPECT_EQ(calm[0].code, "camera.small_part") << all_of(calm);
    EXPECT_EQ(calm[0].severity, Verdict::kFair) << all_of(calm);
    EXPECT_EQ(all_of(lint(waved({.seconds = 20, .imu_hz = 1000, .camera_hz = 10, .imu_noise = 5}, seed))), "");
  }
  // Clocks of the device, of which nothing is known.
  Input early = good();
  early.imu_rate_hz = 0;
  early.cameras[0].camera.rate_hz = 0;
  EXPECT_EQ(all_of(lint(early)), "");
}

TEST(CameraImuLint, GyroscopeInDegrees) {
  const auto in_degrees = [](Input& in) {
    for (ImuMeasurement& m : in.imu) m.angular_velocity /= kDegree;
  };
  expect_only(in_degrees, Verdict::kRefused, "imu.gyroscope_unit", {"deg/s", "57", "cam0", "Convert"});
  // The clocks have nothing in common.
  Input apart = good();
  in_degrees(apart);
  for (ImuMeasurement& m : apart.imu) m.time_ns -= from_seconds(1e6);
  const std::string apart_text = all_of(lint(apart));
  EXPECT_NE(apart_text.find("refused imu.gyroscope_unit: The gyroscope seems to be in deg/s: the gyroscope's readings "
                            "are 5"),
            std::string::npos)
      << apart_text;
  // Too few pictures to compare with: by size alone.
  Input blind = good();
  in_degrees(blind);
  blind.cameras.clear();
  const auto findings = lint(blind);
  ASSERT_EQ(findings.size(), 1U) << all_of(findings);
  EXPECT_EQ(findings[0].severity, Verdict::kRefused);
  EXPECT_NE(findings[0].text.find("more than a hand can turn"), std::string::npos) << findings[0].text;
  // In tenths of the right size: no usual unit, but not the same motion.
  expect_only(
      [](Input& in) {
        for (ImuMeasurement& m : in.imu) m.angular_velocity *= 0.1;
      },
      Verdict::kWarn, "imu.gyroscope_unit", {"does not turn as much", "times the turn rates of cam0"});
  // The camera whose clock is the IMU's has the say.
  Input two = good();
  for (ImuMeasurement& m : two.imu) m.angular_velocity *= 0.1;
  two.cameras.insert(two.cameras.begin(), two.cameras[0]);
  two.cameras[1].camera.name = "cam1";
  for (TargetView& view : two.cameras[0].views) view.time_ns += from_seconds(1e6);
  EXPECT_NE(all_of(lint(two)).find("times the turn rates of cam1"), std::string::npos) << all_of(lint(two));
}

TEST(CameraImuLint, AccelerometerInOtherUnits) {
  const auto times = [](double factor) {
    return [factor](Input& in) {
      for (ImuMeasurement& m : in.imu) m.specific_force *= factor;
    };
  };
  expect_only(times(1 / 9.80665), Verdict::kRefused, "imu.accelerometer_unit", {"in g", "Multiply by 9.80665"});
  expect_only(times(1000 / 9.80665), Verdict::kRefused, "imu.accelerometer_unit", {"thousandths of g or in cm/s^2"});
  expect_only(times(100), Verdict::kRefused, "imu.accelerometer_unit", {"thousandths of g or in cm/s^2"});
  expect_only(times(16384 / 9.80665), Verdict::kRefused, "imu.accelerometer_unit", {"not m/s^2", "9.81"});
  expect_only(times(1e299), Verdict::kRefused, "imu.accelerometer_unit", {"not m/s^2", "e+299,"});
  // What some drivers call linear acceleration.
  Random random(4);
  for (const double size : {0.65, 2.0}) {  // of a size as in g, and larger
    expect_only(
        [&](Input& in) {
          for (ImuMeasurement& m : in.imu) m.specific_force = size * random.normal3();
        },
        Verdict::kRefused, "imu.gravity_removed", {"lacks gravity"});
  }
}

TEST(CameraImuLint, RatesOfTheImu) {
  const auto every = [](std::size_t n) {
    return [n](Input& in) {
      std::vector<ImuMeasurement> kept;
      for (std::size_t i = 0; i < in.imu.size(); i += n) kept.push_back(in.imu[i]);
      in.imu = kept;
      in.imu_rate_hz = 200 / static_cast<double>(n);
    };
  };
  expect_only(every(5), Verdict::kWarn, "imu.rate_low", {"40 samples a second"});
  expect_only(every(20), Verdict::kRefused, "imu.rate_low", {"10 samples a second"});
  expect_only([](Input& in) { in.imu_rate_hz = 100; }, Verdict::kWarn, "imu.rate_not_nominal",
              {"200 samples a second", "100 of the rig"});
}

TEST(CameraImuLint, TimesOfTheImu) {
  expect_only(
      [](Input& in) {
        in.imu.erase(in.imu.begin() + 1000, in.imu.begin() + 1200);
        in.imu.erase(in.imu.begin() + 200, in.imu.begin() + 240);
      },
      Verdict::kWarn, "imu.gaps", {"2 gaps", "1 s at 5.00 s", "6 % of its"});
  expect_only([](Input& in) { in.imu.erase(in.imu.begin() + 1000, in.imu.begin() + 1003); }, Verdict::kFair, "imu.gaps",
              {"1 gap,", "0.02 s at 5"});
  // Twice the same sample, and one stamp for two samples.
  expect_only([](Input& in) { in.imu.insert(in.imu.begin() + 500, in.imu[499]); }, Verdict::kFair, "imu.duplicated",
              {"1 IMU sample of 4001 came twice"});
  expect_only(
      [](Input& in) {
        for (std::size_t i = 1000; i < 1400; i += 2) in.imu[i].time_ns = in.imu[i - 1].time_ns;
      },
      Verdict::kWarn, "imu.same_time", {"200 IMU samples of 4000", "too coarse"});
  expect_only(
      [](Input& in) {
        for (std::size_t i = 2000; i < in.imu.size(); ++i) in.imu[i].time_ns -= from_seconds(0.1025);
      },
      Verdict::kWarn, "imu.time_back", {"step back 1 time", "by up to 0.0975 s at 10.00", "20 samples of 4000"});
  expect_only([](Input& in) { in.imu[7].time_ns = kNoTime; }, Verdict::kFair, "imu.no_time", {"1 IMU sample"});
  expect_only(
      [](Input& in) {
        in.imu[7].specific_force.y() = kUnknown;
        in.imu[9].angular_velocity.x() = HUGE_VAL;
      },
      Verdict::kFair, "imu.not_finite", {"2 IMU samples of 4000", "sample 7"});
  Input empty = good();
  for (std::size_t i = 0; i < 3999; ++i) empty.imu[i].angular_velocity.z() = kUnknown;
  const std::string text = all_of(lint(empty));
  EXPECT_NE(text.find("refused imu.no_samples: Of 4000 IMU samples 1 can"), std::string::npos) << text;
  EXPECT_NE(text.find("warn imu.not_finite: 3999 IMU samples"), std::string::npos) << text;
}

TEST(CameraImuLint, ReadingsThatAreHeld) {
  expect_only(
      [](Input& in) {
        for (std::size_t i = 1; i < in.imu.size(); i += 2) in.imu[i].specific_force = in.imu[i - 1].specific_force;
      },
      Verdict::kWarn, "imu.held", {"50 % of the accelerometer's", "about 100 new ones", "read 200 times"});
  expect_only(
      [](Input& in) {
        for (ImuMeasurement& m : in.imu) m.angular_velocity = {0.1, 0.2, 0.3};
      },
      Verdict::kRefused, "imu.constant", {"gyroscope never changes", "4000", "(0.1, 0.2, 0.3)"});
}

TEST(CameraImuLint, Saturation) {
  // A gyroscope of 125 deg/s that is turned faster.
  constexpr double kEnd = 125 * kDegree;
  const Input fast = waved({.seconds = 20, .turning = {2.2, 1, 1}, .speed = 2});
  Input cut = fast;
  for (ImuMeasurement& m : cut.imu) m.angular_velocity = m.angular_velocity.cwiseMax(-kEnd).cwiseMin(kEnd);
  for (const auto& [input, expected] : {std::pair(fast, false), std::pair(cut, true)}) {
    std::set<std::string> codes;
    for (const CameraImuFinding& f : lint(input)) codes.insert(f.code);
    EXPECT_EQ(codes.contains("imu.saturated"), expected) << all_of(lint(input));
  }
  const auto findings = lint(cut);
  EXPECT_NE(all_of(findings).find("The gyroscope comes to the end of its range (x at -2.1817, x at 2.1817, y"),
            std::string::npos)
      << all_of(findings);
  // One time, but long.
  expect_only(
      [](Input& in) {
        for (std::size_t i = 2000; i < 2012; ++i) in.imu[i].angular_velocity.y() = -4.3633;
      },
      Verdict::kWarn, "imu.saturated", {"(y at -4.3633 rad/s), in 12 readings, the longest time at 10.00 s"});
  // No gyroscope has so small a range.
  Input gentle = good();
  for (ImuMeasurement& m : gentle.imu) m.angular_velocity = m.angular_velocity.cwiseMax(-1.2).cwiseMin(1.2);
  EXPECT_EQ(all_of(lint(gentle)), "");
  // Coarse readings of a rig at rest, or of slow motion, stay the same too.
  for (const double resolution : {0.3, 0.01}) {
    Input coarse = good();
    for (ImuMeasurement& m : coarse.imu) {
      m.specific_force = (m.specific_force / resolution).array().round().matrix() * resolution;
      m.angular_velocity = (m.angular_velocity / resolution * 10).array().round().matrix() * resolution / 10;
    }
    EXPECT_EQ(all_of(lint(coarse)).find("imu.saturated"), std::string::npos) << all_of(lint(coarse));
  }
}

TEST(CameraImuLint, TimesOfTheCamera) {
  const auto keep = [](Input& in, std::size_t n) {
    std::vector<TargetView> kept;
    for (std::size_t i = 0; i < in.cameras[0].views.size(); i += n) kept.push_back(in.cameras[0].views[i]);
    in.cameras[0].views = kept;
    in.cameras[0].camera.rate_hz = 20 / static_cast<double>(n);
  };
  Input slow = waved({.seconds = 60});
  keep(slow, 3);
  EXPECT_EQ(all_of(lint(slow)),
            "fair camera.rate_low: cam0: 6.67 pictures a second: take 10 to 30, or move slowly and "
            "for longer.\n");
  keep(slow, 2);
  EXPECT_NE(all_of(lint(slow)).find("warn camera.rate_low"), std::string::npos);
  keep(slow, 2);
  EXPECT_NE(all_of(lint(slow)).find("refused camera.rate_low"), std::string::npos);
  expect_only([](Input& in) { in.cameras[0].camera.rate_hz = 30; }, Verdict::kFair, "camera.rate_not_nominal",
              {"20 pictures a second", "30 of the rig"});
  const auto views = [](Input& in) -> std::vector<TargetView>& { return in.cameras[0].views; };
  expect_only([&](Input& in) { views(in).erase(views(in).begin() + 100, views(in).begin() + 120); }, Verdict::kFair,
              "camera.gaps", {"1 gap,", "1.05 s at 4.95", "5.26 %"});
  expect_only([&](Input& in) { views(in)[50].time_ns = views(in)[49].time_ns; }, Verdict::kWarn, "camera.same_time",
              {"1 picture of 380"});
  expect_only([&](Input& in) { std::swap(views(in)[50].time_ns, views(in)[51].time_ns); }, Verdict::kWarn,
              "camera.time_back", {"step back 1 time", "0.05 s", "1 picture of 380"});
  expect_only([&](Input& in) { views(in)[50].time_ns = kNoTime; }, Verdict::kWarn, "camera.no_time", {"1 picture of"});
}

TEST(CameraImuLint, TheTargetInThePictures) {
  const auto views = [](Input& in) -> std::vector<TargetView>& { return in.cameras[0].views; };
  const auto without = [&](std::size_t begin, std::size_t end) {
    return [=](Input& in) {
      for (std::size_t i = begin; i < end; ++i) views(in)[i].corners.clear();
    };
  };
  expect_only(without(0, 380), Verdict::kRefused, "camera.no_target", {"none of its 380 pictures", "checkerboard 9x6"});
  expect_only(without(100, 150), Verdict::kFair, "camera.target_lost", {"1 time,", "2.55 s at 4.95"});
  const auto every = [&](std::size_t n) {
    return [=](Input& in) {
      for (std::size_t i = 0; i < 380; ++i) {
        if (i % n != 0) views(in)[i].corners.clear();
      }
    };
  };
  expect_only(every(3), Verdict::kFair, "camera.few_pictures", {"127 of 380 pictures"});
  expect_only(every(5), Verdict::kWarn, "camera.few_pictures", {"76 of 380 pictures"});
  expect_only(every(16), Verdict::kRefused, "camera.few_pictures", {"24 of 380 pictures"});
  expect_only(
      [&](Input& in) {
        for (TargetView& view : views(in)) {
          std::erase_if(view.corners, [](const TargetCorner& c) { return c.id % 9 > 4 || c.id > 13; });
        }
      },
      Verdict::kFair, "camera.few_corners", {"no more than 10"});
  expect_only([](Input& in) { in.cameras[0].camera.width_px = 376; }, Verdict::kRefused, "camera.outside_image",
              {"376x480", "another resolution"});
  expect_only([&](Input& in) { views(in)[7].corners[3].pixel_px.y() = -9; }, Verdict::kFair, "camera.outside_image",
              {"1 corner of ", " lies outside the image of 752x480", "wrongly placed"});
  // A board far away, in the middle of the image.
  const auto shrink = [&](double share) {
    return [=](Input& in) {
      for (TargetView& view : views(in)) {
        Eigen::Vector2d mean = Eigen::Vector2d::Zero();
        for (const TargetCorner& c : view.corners) mean += c.pixel_px / static_cast<double>(view.corners.size());
        for (TargetCorner& c : view.corners) {
          c.pixel_px += Eigen::Vector2d(376, 240) - mean - (1 - share) * (c.pixel_px - mean);
        }
      }
    };
  };
  expect_only(shrink(0.4), Verdict::kWarn, "camera.small_part", {"% of the image"});
  // Another target.
  expect_only([](Input& in) { in.target = parse_target("checkerboard 11x6 0.04"); }, Verdict::kRefused, "camera.lens",
              {"no pose explains", "checkerboard 11x6"});
  // A lens that is nearly right.
  expect_only([](Input& in) { in.cameras[0].camera.intrinsics_px[1] *= 1.2; }, Verdict::kWarn, "camera.lens",
              {"px between corner and projection", "do intrinsics and target"});
  expect_only([](Input& in) { in.cameras[0].camera.distortion[0] += 0.3; }, Verdict::kFair, "camera.lens",
              {"leave 1."});
  // Corners that hardly have to do with the board.
  Random random(6);
  expect_only(
      [&](Input& in) {
        for (TargetView& view : views(in)) {
          for (TargetCorner& c : view.corners) {
            c.pixel_px += 25 * Eigen::Vector2d(random.normal(), random.normal());
            c.pixel_px = c.pixel_px.cwiseMax(0).cwiseMin(Eigen::Vector2d(751, 479));
          }
        }
      },
      Verdict::kRefused, "camera.lens", {"px"});
  // In millimetres.
  expect_only([](Input& in) { in.target.size_m = 40; }, Verdict::kWarn, "target.size", {"40 m?", "m away"});
}

TEST(CameraImuLint, ClocksAndLength) {
  expect_only(
      [](Input& in) {
        for (ImuMeasurement& m : in.imu) m.time_ns -= from_seconds(1e6);
      },
      Verdict::kOk, "clocks.apart", {"begin 1000000.5 s after the IMU's first", "offset will be found"});
  expect_only(
      [](Input& in) {
        for (ImuMeasurement& m : in.imu) m.time_ns += from_seconds(12);
      },
      Verdict::kFair, "clocks.little_overlap", {"share only 7.45 s of 19 s"});
  EXPECT_EQ(all_of(lint(waved({.seconds = 12}))),
            "fair recording.short: cam0: the recording is short, 11 s with the target and 12 s of IMU: record for a "
            "minute.\n");
  EXPECT_NE(all_of(lint(waved({.seconds = 5}))).find("warn recording.short"), std::string::npos);
}

TEST(CameraImuLint, Noise) {
  const auto set = [](double ImuNoise::*field, double value) { return [=](Input& in) { in.noise.*field = value; }; };
  expect_only([](Input& in) { in.noise = ImuNoise{}; }, Verdict::kFair, "noise.default", {"nobody has measured"});
  expect_only(set(&ImuNoise::gyroscope_noise_density, 10), Verdict::kWarn, "noise.unit",
              {"gyroscope_noise_density = 10", "mdps/sqrt(Hz)"});
  expect_only(set(&ImuNoise::accelerometer_noise_density, 200), Verdict::kWarn, "noise.unit", {"ug/sqrt(Hz)"});
  expect_only(set(&ImuNoise::accelerometer_random_walk, 40), Verdict::kWarn, "noise.unit",
              {"accelerometer_random_walk = 40"});
  expect_only(set(&ImuNoise::gyroscope_random_walk, 0), Verdict::kRefused, "noise.zero", {"gyroscope_random_walk = 0"});
  // deg/s/sqrt(Hz): possible for some sensor, not for this one.
  expect_only(set(&ImuNoise::gyroscope_noise_density, 1.8e-4 / kDegree), Verdict::kWarn, "noise.too_large",
              {"gyroscope_noise_density is 0.0103", "rad/s/sqrt(Hz): ", "times less"});
  expect_only(set(&ImuNoise::accelerometer_noise_density, 1.1e-5), Verdict::kWarn, "noise.too_small", {"times more"});
}

TEST(CameraImuLint, TheWorstComesFirst) {
  Input input = good();
  input.noise = ImuNoise{};
  for (ImuMeasurement& m : input.imu) {
    m.angular_velocity /= kDegree;
    m.time_ns -= from_seconds(1e6);
  }
  input.imu_rate_hz = 100;
  const auto findings = lint(input);
  std::vector<std::string> codes(findings.size());
  std::ranges::transform(findings, codes.begin(), &CameraImuFinding::code);
  EXPECT_EQ(codes,
            std::vector<std::string>({"imu.gyroscope_unit", "imu.rate_not_nominal", "noise.default", "clocks.apart"}))
      << all_of(findings);
}

TEST(CameraImuLint, NothingAtAllIsSaidToo) {
  const auto findings = lint_camera_imu(good().target, {}, {}, measured_noise(), 0);
  EXPECT_EQ(all_of(findings),
            "refused imu.no_samples: Of 0 IMU samples 0 can be used: there is nothing to calibrate.\n");
  Input empty = good();
  empty.cameras[0].views.clear();
  EXPECT_NE(all_of(lint(empty)).find("refused camera.no_target"), std::string::npos);
}

TEST(CameraImuLint, WhatNoRecordingHasIsRefused) {
  const auto refused = [](const std::function<void(Input&)>& change) {
    Input input = good();
    change(input);
    EXPECT_THROW(lint(input), std::invalid_argument);
  };
  refused([](Input& in) { in.imu_rate_hz = -1; });
  refused([](Input& in) { in.target.rows = 0; });
  refused([](Input& in) { in.noise.gyroscope_noise_density = -1; });
  refused([](Input& in) { in.cameras[0].camera.width_px = 0; });
  refused([](Input& in) { in.cameras[0].views[3].corners[2].id = 99; });
}

// 72 s of a hand-held rig. The table has only the pictures with the target, of which 23 lack in a row; every other
// sentence would be a false alarm.
TEST(CameraImuLint, ARealRecordingGetsNoFinding) {
  LOC_DATA_OR_SKIP(folder, "euroc-cam-imu-calibration");
  Input input;
  input.target = parse_target("aprilgrid 6x6 0.088 0.3");
  input.noise.gyroscope_noise_density = 1.6968e-04;
  input.noise.accelerometer_noise_density = 2.0e-3;
  CameraCalibration camera = good().cameras[0].camera;
  camera.rate_hz = 20;
  input.cameras = {{camera, {}}};
  std::vector<TargetView>& views = input.cameras[0].views;
  const Eigen::MatrixXd corners = test::read_number_table(folder / "cam0_corners.csv");
  for (const auto& row : corners.rowwise()) {
    // Times as differences from the first, which a double holds to 256 ns.
    const TimeNs time = from_seconds((row(0) - corners(0, 0)) * 1e-9);
    if (views.empty() || views.back().time_ns != time) views.push_back({time, {}});
    views.back().corners.push_back({static_cast<std::int32_t>(4 * row(1) + row(2)), {row(3), row(4)}});
  }
  const Eigen::MatrixXd imu = test::read_number_table(folder / "imu0.csv");
  for (const auto& row : imu.rowwise()) {
    ImuMeasurement m;
    m.time_ns = from_seconds((row(0) - corners(0, 0)) * 1e-9);
    m.angular_velocity = row.segment<3>(1).transpose();
    m.specific_force = row.segment<3>(4).transpose();
    input.imu.push_back(m);
  }
  EXPECT_EQ(all_of(lint(input)),
            "ok camera.gaps: cam0: the pictures have 1 gap, the longest of 1.2 s at 55.75 s; about 1.6 % of them are "
            "missing.\n");
  for (ImuMeasurement& m : input.imu) m.angular_velocity /= kDegree;
  const auto findings = lint(input);
  ASSERT_EQ(findings.size(), 2U) << all_of(findings);
  EXPECT_EQ(findings[0].code, "imu.gyroscope_unit");
  for (ImuMeasurement& m : input.imu) {
    m.angular_velocity *= kDegree;
    m.specific_force /= 9.80665;
  }
  EXPECT_NE(all_of(lint(input)).find("The accelerometer seems to be in g"), std::string::npos) << all_of(lint(input));
}

}  // namespace
}  // namespace loc
