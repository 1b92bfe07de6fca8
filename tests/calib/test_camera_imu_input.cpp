// Camera-IMU calibration: recordings that are not as they should be.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "libloc/calib/camera_imu.hpp"
#include "libloc/calib/camera_imu_knots.hpp"
#include "tests/support/camera_imu_checks.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/sources.hpp"

namespace loc {
namespace {

using Eigen::Vector3d;
using test::calibrate;
using test::error_of;
using test::expect_data_error;
using test::in_sigmas;
using test::near;
using test::wave;
using test::WavedRig;
using test::WavedRigOptions;

std::int64_t count_of(const CameraImuFit& fit, const std::string& name) {
  const auto at = std::ranges::find(fit.counts, name, &NamedCount::name);
  return at == fit.counts.end() ? -1 : at->value;
}

TEST(CameraImu, ABoardWithoutDirectionKeepsItsNumbers) {
  const WavedRig rig = wave({.seconds = 12, .target = "checkerboard 8x6 0.045", .half_turns = true}, 2);
  ASSERT_FALSE(rig.target.has_direction());
  const CameraImuFit fit = calibrate(rig);
  EXPECT_TRUE(fit.converged);
  EXPECT_LT(in_sigmas(error_of(fit, rig, 0), fit.cameras[0]).cwiseAbs().maxCoeff(), 4);
  EXPECT_TRUE(std::ranges::all_of(fit.cameras[0].views, &CameraImuView::used));
  // Over a gap the gyroscope tells which end is which.
  WavedRig gap = rig;
  gap.views.erase(gap.views.begin() + 80, gap.views.begin() + 121);  // of both kinds
  EXPECT_LT(in_sigmas(error_of(calibrate(gap), rig, 0), fit.cameras[0]).cwiseAbs().maxCoeff(), 6);
}

// Gauge: the target's frame, turned by half a turn, turns gravity and the way with it, and nothing else.
TEST(CameraImu, TheFrameOfTheTargetDoesNotMatter) {
  const WavedRig rig = wave({.seconds = 12}, 5);
  WavedRig turned = rig;
  for (TargetView& view : turned.views) {
    for (TargetCorner& corner : view.corners) corner.id = rig.target.corner_count() - 1 - corner.id;
    std::ranges::sort(view.corners, {}, &TargetCorner::id);
  }
  const CameraImuFit a = calibrate(rig);
  const CameraImuFit b = calibrate(turned);
  EXPECT_LT((error_of(a, rig, 0) - error_of(b, rig, 0)).norm(), 1e-6);
  EXPECT_TRUE(
      near(b.gravity_target, Vector3d(-a.gravity_target.x(), -a.gravity_target.y(), a.gravity_target.z()), 1e-5));
  const Vector3d far_corner = rig.target.corner(rig.target.corner_count() - 1);
  const Vector3d at = a.T_target_imu[1000].translation;
  EXPECT_TRUE(
      near(b.T_target_imu[1000].translation, Vector3d(far_corner.x() - at.x(), far_corner.y() - at.y(), at.z()), 1e-5));
}

TEST(CameraImu, SamplesAndPicturesThatCannotBeUsedAreCounted) {
  WavedRig rig = wave({.seconds = 12}, 2);
  const CameraImuFit clean = calibrate(rig);
  std::swap(rig.views[40], rig.views[60]);        // out of order: no harm
  rig.views[70].time_ns = rig.views[71].time_ns;  // twice
  rig.views[90].time_ns = kNoTime;
  rig.imu.insert(rig.imu.begin() + 500, rig.imu[499]);  // twice
  rig.imu.insert(rig.imu.begin() + 800, rig.imu[300]);  // steps back
  rig.imu[1000].specific_force.x() = std::nan("");
  const CameraImuFit fit = calibrate(rig);
  EXPECT_EQ(count_of(fit, "imu.skipped.not_finite"), 1);
  EXPECT_EQ(count_of(fit, "imu.skipped.time_not_later"), 2);
  EXPECT_EQ(count_of(fit, "imu.used"), static_cast<std::int64_t>(fit.imu_time_ns.size()));
  EXPECT_EQ(fit.cameras[0].views[71].reason, "its time is that of another picture");
  EXPECT_EQ(fit.cameras[0].views[90].reason, "it has no time");
  EXPECT_TRUE(fit.cameras[0].views[40].used);
  EXPECT_LT(in_sigmas(error_of(fit, rig, 0) - error_of(clean, rig, 0), clean.cameras[0]).norm(), 1);
  // Half of the IMU is lost in the middle: neither knots nor noise take the gap for the rate.
  WavedRig gap = wave({.seconds = 20}, 2);
  gap.imu.erase(gap.imu.begin() + 1500, gap.imu.begin() + 2500);
  const CameraImuFit half = calibrate(gap);
  EXPECT_TRUE(half.converged);
  EXPECT_NEAR(half.knot_spacing_s, 0.02, 0.001);
  EXPECT_NEAR(half.gyroscope_noise_scale, 1, 0.15);
  EXPECT_LT(in_sigmas(error_of(half, gap, 0), half.cameras[0]).cwiseAbs().maxCoeff(), 4);
  // An accelerometer in g, or that is not there.
  for (const double factor : {1 / 9.80665, 0.0}) {
    WavedRig other = wave({.seconds = 12}, 2);
    for (ImuMeasurement& m : other.imu) m.specific_force *= factor;
    expect_data_error([&] { calibrate(other); }, {"accelerometer's mean is", "unit"});
  }
  // Readings in degrees: the camera knows better.
  for (ImuMeasurement& m : rig.imu) m.angular_velocity *= 180 / std::numbers::pi;
  expect_data_error([&] { calibrate(rig); }, {"times as fast as the camera", "deg/s"});
}

// Clocks of other epochs, and stamps that are nonsense, do not change the result.
TEST(CameraImu, AbsurdStampsAreLeftOut) {
  const WavedRig rig = wave({.seconds = 12}, 2);
  const CameraImuFit clean = calibrate(rig);
  const auto same = [&](const WavedRig& changed, double offset, double bar) {
    const CameraImuFit fit = calibrate(changed);
    EXPECT_LE(fit.iterations, clean.iterations + 2);
    EXPECT_LT((error_of(fit, rig, offset) - error_of(clean, rig, 0)).head<6>().norm(), bar);
    EXPECT_NEAR(fit.cameras[0].time_offset_s - offset, clean.cameras[0].time_offset_s, std::max(bar, 3e-7));
    return fit;
  };
  WavedRig epoch = rig;
  for (TargetView& view : epoch.views) view.time_ns += 1'700'000'000'000'000'000;
  const CameraImuFit far_epoch = same(epoch, -1.7e9, 1e-8);
  EXPECT_NEAR(far_epoch.cameras[0].start.time_offset_s, -1.7e9, 0.01);
  EXPECT_NEAR(far_epoch.cameras[0].start.curve.offset_s.front(), -1.7e9, 60);
  WavedRig stamps = rig;
  stamps.imu.front().time_ns = 0;                                        // long before the rest
  stamps.imu[700].time_ns = std::numeric_limits<TimeNs>::max();          // a jump ahead, and back
  stamps.imu[900].time_ns = stamps.imu[899].time_ns + 40'000'000'000LL;  // likewise, nearer
  stamps.views.front().time_ns = 0;
  stamps.views[50].time_ns = std::numeric_limits<TimeNs>::max();
  const CameraImuFit odd = same(stamps, 0, 2e-4);
  EXPECT_EQ(count_of(odd, "imu.skipped.time_not_later"), 2);
  EXPECT_EQ(count_of(odd, "imu.skipped.time_far_off"), 1);
  EXPECT_EQ(odd.cameras[0].views.front().reason, "its time is more than ten minutes from most others");
  EXPECT_EQ(odd.cameras[0].views[50].reason, odd.cameras[0].views.front().reason);
  // A third of the pictures, thirty days late.
  WavedRig late = rig;
  for (std::size_t i = 0; i < late.views.size() / 3; ++i) late.views[i].time_ns += 30 * 86'400'000'000'000LL;
  const CameraImuFit rest = calibrate(late);
  EXPECT_EQ(std::ranges::count_if(rest.cameras[0].views, &CameraImuView::used),
            std::ssize(rig.views) - std::ssize(rig.views) / 3);
  EXPECT_LT(in_sigmas(error_of(rest, rig, 0), rest.cameras[0]).cwiseAbs().maxCoeff(), 4);
  for (TargetView& view : epoch.views) view.time_ns += 7'000'000'000'000'000'000;
  for (ImuMeasurement& m : epoch.imu) m.time_ns -= 7'000'000'000'000'000'000;
  expect_data_error([&] { calibrate(epoch); }, {"cam0", "more than a century apart"});
}

// Where there are no pictures, or no samples, for long, nothing is computed.
TEST(CameraImu, LongGapsAreCutOut) {
  const WavedRig rig = wave({.seconds = 30}, 2);
  const CameraImuFit whole = calibrate(rig);
  const auto later = [](TimeNs& t, TimeNs from, TimeNs by) {
    if (t >= from) t += by;
  };
  const TimeNs middle = from_seconds(1015);
  constexpr TimeNs kGap = 400'000'000'000;
  // Both stop for 400 s; the biases walk on, so the second half has others.
  WavedRig both = rig;
  for (ImuMeasurement& m : both.imu) later(m.time_ns, middle, kGap);
  for (TargetView& view : both.views) later(view.time_ns, middle, kGap);
  const CameraImuFit cut = calibrate(both);
  EXPECT_TRUE(cut.converged);
  EXPECT_LT(in_sigmas(error_of(cut, rig, 0), cut.cameras[0]).cwiseAbs().maxCoeff(), 4);
  EXPECT_LT(cut.bias_time_ns.size(), whole.bias_time_ns.size() + 4);
  EXPECT_LT(cut.cameras[0].sigma_by_noise.norm(), 1.1 * whole.cameras[0].sigma_by_noise.norm());
  // Times that come out are those of the clock.
  EXPECT_GT(cut.imu_time_ns.size(), both.imu.size() - 20);  // half a second beyond the last picture is enough
  EXPECT_TRUE(std::ranges::all_of(cut.imu_time_ns, [&](TimeNs t) {
    const auto nearest = std::ranges::lower_bound(both.imu, t - 10, {}, &ImuMeasurement::time_ns);
    return nearest != both.imu.end() && std::abs(nearest->time_ns - t) < 10;
  }));
  EXPECT_GT(cut.bias_time_ns.back(), middle + kGap);
  // A drift is one of the whole time.
  WavedRig drifting = both;
  const double drift = 2e-6;
  for (TargetView& view : drifting.views)
    view.time_ns -= from_seconds(drift * to_seconds(view.time_ns - middle - kGap / 2));
  const CameraImuFit drifted = calibrate(drifting, {.estimate_drift = true});
  EXPECT_NEAR(drifted.cameras[0].offset_drift.value, drift, 4 * drifted.cameras[0].offset_drift.sigma);
  EXPECT_LT(drifted.cameras[0].offset_drift.sigma, 0.2 * drift);
  // The IMU alone stops: pictures in its gap are left out with the reason. The camera alone: samples are counted.
  WavedRig imu = rig;
  std::erase_if(imu.imu, [](const ImuMeasurement& m) { return std::abs(to_seconds(m.time_ns) - 1015) < 4; });
  const CameraImuFit without_imu = calibrate(imu);
  EXPECT_EQ(without_imu.cameras[0].views[290].reason, "no IMU samples at its time");
  EXPECT_LT(in_sigmas(error_of(without_imu, rig, 0), without_imu.cameras[0]).cwiseAbs().maxCoeff(), 4);
  WavedRig camera = rig;
  for (std::size_t i = 200; i < 400; ++i) camera.views[i].corners.clear();
  const CameraImuFit without_camera = calibrate(camera);
  EXPECT_NEAR(static_cast<double>(count_of(without_camera, "imu.skipped.no_pictures")), 1900, 120);
  EXPECT_LT(in_sigmas(error_of(without_camera, rig, 0), without_camera.cameras[0]).cwiseAbs().maxCoeff(), 4);
}

TEST(CameraImu, CamerasMaySeeTheTargetOneAfterTheOther) {
  WavedRig rig = wave({.seconds = 30, .time_offset_s = 0.05, .second_camera = true}, 5);
  const auto expect_right = [&](const CameraImuFit& fit) {
    EXPECT_TRUE(fit.converged);
    EXPECT_LT(in_sigmas(error_of(fit, rig, 0.05), fit.cameras[0]).cwiseAbs().maxCoeff(), 4);
    const Vector7d second = error_of(fit.cameras[1], rig.T_second_imu, 0.05 + test::kSecondOffset);
    EXPECT_LT(in_sigmas(second, fit.cameras[1]).cwiseAbs().maxCoeff(), 4);
  };
  for (std::size_t i = 0; i < rig.views.size(); ++i) {
    (i < rig.views.size() / 2 ? rig.second_views : rig.views)[i].corners.clear();
  }
  expect_right(calibrate(rig));
  rig = wave({.seconds = 30, .camera_hz = 3, .time_offset_s = 0.05, .second_camera = true}, 5);
  expect_right(calibrate(rig));
  // A board without direction, which the second camera numbers from its other end.
  rig = wave({.seconds = 15, .time_offset_s = 0.05, .target = "checkerboard 8x6 0.045", .second_camera = true}, 5);
  for (TargetView& view : rig.second_views) {
    for (TargetCorner& corner : view.corners) corner.id = rig.target.corner_count() - 1 - corner.id;
    std::ranges::sort(view.corners, {}, &TargetCorner::id);
  }
  const CameraImuFit turned = calibrate(rig);
  expect_right(turned);
  EXPECT_EQ(turned.cameras[1].corners.front().id, rig.second_views.front().corners.front().id);
}

TEST(CameraImu, KnotsFollowTheSpectrum) {
  const auto knots = [](double speed, double imu_hz, int order, double camera_hz = 20) {
    const WavedRig rig = wave({.seconds = 20, .imu_hz = imu_hz, .camera_hz = camera_hz, .speed = speed}, 1);
    std::vector<calib::ImuRow> imu;
    for (const ImuMeasurement& m : rig.imu) {
      imu.push_back({to_seconds(m.time_ns - rig.imu[0].time_ns), m.angular_velocity, m.specific_force});
    }
    return calib::choose_knots(imu, order, 0, 1 / camera_hz);
  };
  const calib::KnotChoice slow = knots(1, 200, 6);
  EXPECT_EQ(slow.spacing_s, 0.02);
  EXPECT_NEAR(slow.bandwidth_hz, 3, 1.5);  // the motion reaches 1.3 Hz
  EXPECT_FALSE(slow.too_fast);
  const calib::KnotChoice fast = knots(10, 200, 6);
  EXPECT_GT(fast.bandwidth_hz, 11);
  EXPECT_LT(fast.bandwidth_hz, 22);
  EXPECT_NEAR(fast.spacing_s * 5 * fast.bandwidth_hz, 1, 0.08);
  EXPECT_LT(knots(10, 200, 4).spacing_s, fast.spacing_s);
  EXPECT_TRUE(knots(25, 200, 6).too_fast);
  EXPECT_NEAR(knots(1, 100, 6).spacing_s, 0.04, 1e-9);
  // 40 ms and 25 pictures a second keep step.
  const calib::KnotChoice step = knots(1, 100, 6, 25);
  EXPECT_LT(step.spacing_s, 0.038);
  EXPECT_NE(step.reason.find("keep step"), std::string::npos);
}

TEST(CameraImu, WhatCannotBeSaysWhy) {
  const auto refused = [](const WavedRigOptions& options, const std::vector<std::string>& parts) {
    const WavedRig rig = wave(options, 2);
    expect_data_error([&] { calibrate(rig); }, parts);
  };
  refused({.seconds = 20, .turning = {1, 0, 0}}, {"one axis", "all three"});
  refused({.seconds = 20, .turning = {0, 0, 0}}, {"does not turn"});
  refused({.seconds = 20, .missing = 1}, {"too few pictures"});
  WavedRig other = wave({.seconds = 20}, 1);
  other.imu = wave({.seconds = 20}, 7).imu;
  expect_data_error([&] { calibrate(other); }, {"do not turn alike"});
  const WavedRig rig = wave({.seconds = 3}, 1);
  EXPECT_THROW(calibrate(rig, {.order = 2}), std::invalid_argument);
  EXPECT_THROW(calibrate(rig, {.loss_sigmas = 0}), std::invalid_argument);
  // What is said to have no noise.
  for (double ImuNoise::*field : {&ImuNoise::gyroscope_noise_density, &ImuNoise::accelerometer_noise_density,
                                  &ImuNoise::gyroscope_random_walk, &ImuNoise::accelerometer_random_walk}) {
    ImuNoise none;
    none.*field = 0;
    EXPECT_THROW(calibrate(wave({.seconds = 12}, 1), {}, none), std::invalid_argument);
  }
  // Knots closer than samples are refused before any memory is asked for.
  EXPECT_THROW(calibrate(wave({.seconds = 12}, 1), {.knot_spacing_s = 0.004}), std::invalid_argument);
  // More memory than is allowed, and fewer steps than are needed.
  expect_data_error([&] { calibrate(wave({.seconds = 12}, 1), {.memory_limit_mb = 5}); },
                    {"11.9", "MB", "memory_limit_mb"});
  const CameraImuFit unfinished = calibrate(wave({.seconds = 12}, 1), {.max_iterations = 2});
  EXPECT_EQ(unfinished.stopped, "2 iterations");
  EXPECT_EQ(unfinished.quality.verdict, Verdict::kRefused);
  // Biases that are all but constant: knots all the same, at every hundredth of the pose's.
  const CameraImuFit even = calibrate(wave({.seconds = 12}, 1), {.bias_spacing_s = 1000});
  EXPECT_TRUE(even.converged);
  EXPECT_GT(even.bias_time_ns.size(), 4U);
}

}  // namespace
}  // namespace loc
