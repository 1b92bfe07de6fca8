// Camera-IMU calibration: simulated recordings with known truth.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "libloc/calib/camera_imu.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/geometry/so3.hpp"
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

constexpr double kDegree = 0.017453292519943295;

TEST(CameraImu, IsExactWithoutNoise) {
  const WavedRig rig = wave({.seconds = 20, .corner_sigma_px = 0, .imu_noise = 0, .time_offset_s = 0.0123}, 1);
  for (const int order : {4, 6}) {
    const CameraImuFit fit = calibrate(rig, {.order = order, .adapt_noise = false});
    EXPECT_TRUE(fit.converged);
    const Vector7d error = error_of(fit, rig, 0.0123);
    EXPECT_LT(error.head<3>().norm(), 0.001 * kDegree) << order;
    EXPECT_LT(error.segment<3>(3).norm(), 2e-5) << order;
    EXPECT_LT(std::abs(error[6]), 1e-6) << order;
    EXPECT_TRUE(near(fit.gravity_target, rig.gravity_target, 0.003));
  }
}

TEST(CameraImu, ErrorsAreAsLargeAsTheirDeviations) {
  constexpr int kSeeds = 5;
  double nees = 0;
  Vector7d squares = Vector7d::Zero();
  Vector7d variances = Vector7d::Zero();
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const WavedRig rig = wave({.seconds = 20}, static_cast<std::uint64_t>(seed));
    EXPECT_NEAR(rig.turn_rate_rms, 0.9, 0.1);
    const CameraImuFit fit = calibrate(rig, {.check_line_delay = false});
    EXPECT_TRUE(fit.converged);
    EXPECT_GT(fit.cameras[0].start.correlation, 0.8);
    const Vector7d error = error_of(fit, rig, 0);
    nees += error.dot(fit.cameras[0].covariance.ldlt().solve(error));
    squares += error.cwiseAbs2();
    variances += fit.cameras[0].sigma_by_noise.cwiseAbs2();
    EXPECT_TRUE((error.array().abs() < 4 * fit.cameras[0].sigma_by_noise.array()).all()) << error.transpose();
    EXPECT_TRUE((fit.cameras[0].sigma_by_blocks.array() > 0.3 * fit.cameras[0].sigma_by_noise.array()).all());
    EXPECT_TRUE((fit.cameras[0].sigma_by_blocks.array() < 3 * fit.cameras[0].sigma_by_noise.array()).all());
    EXPECT_NEAR(fit.gyroscope_noise_scale, 1, 0.1);
    EXPECT_NEAR(fit.accelerometer_noise_scale, 1, 0.1);
    EXPECT_EQ(fit.quality.verdict, Verdict::kOk) << fit.quality.reasons.front();
    EXPECT_TRUE(std::ranges::all_of(fit.cameras[0].views, &CameraImuView::used));
  }
  EXPECT_GT(nees, chi_square_quantile(0.0005, 7 * kSeeds));
  EXPECT_LT(nees, chi_square_quantile(0.9995, 7 * kSeeds));
  RecordProperty("nees", std::to_string(nees / kSeeds));
}

TEST(CameraImu, AnyOffsetGivesTheSame) {
  const WavedRig rig = wave({.seconds = 15}, 4);
  const CameraImuFit here = calibrate(rig);
  for (const double shift : {0.05, -2.0, 3600.0}) {
    WavedRig moved = rig;
    for (TargetView& view : moved.views) view.time_ns -= from_seconds(shift);
    const CameraImuFit fit = calibrate(moved);
    EXPECT_NEAR(fit.cameras[0].time_offset_s - shift, here.cameras[0].time_offset_s, 5e-7) << shift;
    EXPECT_TRUE(near(fit.cameras[0].T_camera_imu.translation, here.cameras[0].T_camera_imu.translation, 1e-5)) << shift;
  }
  for (const double wrong : {0.08, -0.08}) {
    const CameraImuFit fit = calibrate(rig, {.time_offset_s = wrong});
    EXPECT_NEAR(fit.cameras[0].time_offset_s, here.cameras[0].time_offset_s, 1e-7);
  }
}

TEST(CameraImu, OutliersAndMissingPicturesDoLittle) {
  for (const bool missing : {false, true}) {
    WavedRigOptions options{.seconds = 20};
    (missing ? options.missing : options.outliers) = missing ? 0.3 : 0.02;
    double nees = 0;
    for (int seed = 1; seed <= 3; ++seed) {
      const WavedRig rig = wave(options, static_cast<std::uint64_t>(seed));
      const CameraImuFit fit = calibrate(rig, {.check_line_delay = false});
      const Vector7d error = error_of(fit, rig, 0);
      nees += error.dot(fit.cameras[0].covariance.ldlt().solve(error));
    }
    EXPECT_LT(nees, chi_square_quantile(0.9999, 21)) << missing;
  }
}

TEST(CameraImu, SlowAndShortIsUncertainAndRight) {
  for (const bool slow : {false, true}) {
    WavedRigOptions options{.seconds = slow ? 30.0 : 10.0};
    if (slow) {
      options.turning *= 0.1;
      options.moving = 0.1;
    }
    double nees = 0;
    for (int seed = 1; seed <= 3; ++seed) {
      const WavedRig rig = wave(options, static_cast<std::uint64_t>(seed));
      const CameraImuFit fit = calibrate(rig, {.check_line_delay = false});
      const Vector7d error = error_of(fit, rig, 0);
      nees += error.dot(fit.cameras[0].covariance.ldlt().solve(error));
      EXPECT_GT(fit.cameras[0].sigma.segment<3>(3).norm(), slow ? 1e-3 : 2e-4);
      EXPECT_EQ(fit.quality.verdict == Verdict::kOk, !slow);
    }
    EXPECT_LT(nees, chi_square_quantile(0.9999, 21)) << slow;
  }
}

TEST(CameraImu, TellsWhatItSaw) {
  WavedRig rig = wave({.seconds = 15}, 2);
  for (std::size_t i = 100; i < 110; ++i) rig.views[i].corners.clear();
  rig.views[120].corners.resize(4);
  for (TargetCorner& corner : rig.views[130].corners) corner.pixel_px.x() += 30 * (corner.id % 2);
  const CameraImuFit fit = calibrate(rig);
  EXPECT_EQ(fit.cameras[0].views[100].reason, "no corners");
  EXPECT_EQ(fit.cameras[0].views[120].reason, "its corners give no pose");
  EXPECT_EQ(fit.cameras[0].views[130].reason, "no pose explains its corners");
  EXPECT_TRUE(fit.cameras[0].views[99].used);
  EXPECT_NEAR(fit.cameras[0].views[99].rms_px, 0.3 * std::sqrt(2), 0.15);
  EXPECT_NEAR(fit.cameras[0].views[99].sigma_px, 0.3, 0.08);
  // Noise that was said ten times too small is found, and told.
  ImuNoise optimistic;
  optimistic.gyroscope_noise_density /= 10;
  optimistic.accelerometer_noise_density /= 10;
  const CameraImuFit doubtful = calibrate(rig, {}, optimistic);
  EXPECT_NEAR(doubtful.gyroscope_noise_scale, 10, 1.5);
  EXPECT_NEAR(doubtful.accelerometer_noise_scale, 10, 1.5);
  EXPECT_EQ(doubtful.quality.verdict, Verdict::kFair);
  EXPECT_TRUE(near(doubtful.cameras[0].T_camera_imu.translation, fit.cameras[0].T_camera_imu.translation, 3e-4));
  // Stopped: the best so far, and it says so.
  int calls = 0;
  const CameraImuFit stopped = calibrate(rig, {.progress = [&](const CameraImuProgress& p) {
                                           EXPECT_EQ(p.iteration, ++calls);
                                           return calls < 2;
                                         }});
  EXPECT_FALSE(stopped.converged);
  EXPECT_EQ(stopped.stopped, "interrupted");
  const CameraImuFit late = calibrate(rig, {.time_limit_s = 1e-6});
  EXPECT_EQ(late.stopped, "time limit");
  EXPECT_EQ(late.iterations, 1);
  EXPECT_EQ(late.quality.verdict, Verdict::kRefused);
  EXPECT_EQ(stopped.quality.verdict, Verdict::kRefused);
  EXPECT_TRUE(near(stopped.cameras[0].T_camera_imu.translation, fit.cameras[0].T_camera_imu.translation, 0.01));
}

// ---- more unknowns

TEST(CameraImu, BothRotationFormsAgree) {
  const WavedRig rig = wave({.seconds = 15}, 8);
  const CameraImuFit cumulative = calibrate(rig);
  const CameraImuFit angles = calibrate(rig, {.rotation = RotationForm::kThreeAngles});
  EXPECT_TRUE(angles.converged);
  const Vector7d apart = in_sigmas(error_of(cumulative, rig, 0) - error_of(angles, rig, 0), cumulative.cameras[0]);
  EXPECT_LT(apart.norm(), 0.05);
  EXPECT_NEAR(angles.gyroscope_chi, cumulative.gyroscope_chi, 3e-3);
  // Close to a quarter of a turn from the mean is more than three angles can say.
  WavedRigOptions wide{.seconds = 15};
  wide.turning = {1, 6, 1};
  const WavedRig turned = wave(wide, 8);
  expect_data_error([&] { calibrate(turned, {.rotation = RotationForm::kThreeAngles}); },
                    {"too wide a motion for three angles", "cumulative"});
}

TEST(CameraImu, TwoCameras) {
  WavedRig rig = wave({.seconds = 20, .time_offset_s = 0.05, .second_camera = true}, 5);
  const CameraImuFit both = calibrate(rig);
  EXPECT_TRUE(both.converged);
  ASSERT_EQ(both.cameras.size(), 2U);
  EXPECT_EQ(both.cameras[1].camera.name, "cam1");
  const Vector7d second = error_of(both.cameras[1], rig.T_second_imu, 0.05 + test::kSecondOffset);
  EXPECT_LT(in_sigmas(error_of(both, rig, 0.05), both.cameras[0]).cwiseAbs().maxCoeff(), 3.5);
  EXPECT_LT(in_sigmas(second, both.cameras[1]).cwiseAbs().maxCoeff(), 3.5);
  // The rig as it is written.
  EXPECT_TRUE(near(both.cameras[1].camera.T_body_camera.translation, rig.T_second_imu.inverse().translation, 2e-3));
  EXPECT_EQ(both.cameras[1].camera.time_offset_s, both.cameras[1].time_offset_s);
  rig.second_views.clear();
  const CameraImuFit alone = calibrate(rig);
  EXPECT_LT(both.cameras[0].sigma_by_noise.norm(), alone.cameras[0].sigma_by_noise.norm());
}

TEST(CameraImu, RollingShutterIsToldAndEstimated) {
  const double delay = 3e-5;  // 14 ms from the first row to the last
  const WavedRig rig = wave({.seconds = 15, .line_delay_s = delay}, 6);
  const CameraImuFit held = calibrate(rig);
  const CameraImuCamera& told = held.cameras[0];
  EXPECT_FALSE(told.line_delay_s.estimated);
  EXPECT_NEAR(told.line_delay_s.value, delay, 0.5 * delay);  // one step only
  EXPECT_GE(held.quality.verdict, Verdict::kWarn);
  EXPECT_NE(held.quality.reasons.front().find("rolling shutter"), std::string::npos);
  const CameraImuFit fit = calibrate(rig, {.estimate_line_delay = true});
  const CameraImuCheck& line = fit.cameras[0].line_delay_s;
  EXPECT_TRUE(line.estimated);
  EXPECT_NEAR(line.value, delay, 4 * line.sigma);
  EXPECT_LT(line.sigma, 0.02 * delay);
  EXPECT_LT(in_sigmas(error_of(fit, rig, 0), fit.cameras[0]).cwiseAbs().maxCoeff(), 4);
  EXPECT_EQ(fit.quality.verdict, Verdict::kOk) << fit.quality.reasons.front();
}

TEST(CameraImu, DriftOfTheClocksIsToldAndEstimated) {
  const double drift = 5e-5;
  const WavedRig rig = wave({.seconds = 20, .drift = drift}, 6);
  const CameraImuFit held = calibrate(rig);
  const CameraImuCheck& told = held.cameras[0].offset_drift;
  EXPECT_FALSE(told.estimated);
  EXPECT_NEAR(told.value, drift, 5 * told.sigma);
  EXPECT_EQ(held.quality.verdict, Verdict::kWarn);
  EXPECT_NE(held.quality.reasons.front().find("drift apart"), std::string::npos);
  const CameraImuFit fit = calibrate(rig, {.estimate_drift = true});
  EXPECT_NEAR(fit.cameras[0].offset_drift.value, drift, 4 * fit.cameras[0].offset_drift.sigma);
  EXPECT_LT(in_sigmas(error_of(fit, rig, 0), fit.cameras[0]).cwiseAbs().maxCoeff(), 4);
  EXPECT_EQ(fit.quality.verdict, Verdict::kOk) << fit.quality.reasons.front();
}

TEST(CameraImu, IntrinsicsTakePart) {
  WavedRig rig = wave({.seconds = 15}, 7);
  const CameraCalibration truth = rig.camera;
  rig.camera.intrinsics_px += Eigen::Vector4d(1.5, 1.2, -1.4, 1.3);
  rig.camera.intrinsics_quality->intrinsics_sigma_px.setConstant(1.5);
  rig.camera.intrinsics_quality->distortion_sigma.setConstant(1e-4);
  // Held: wrong by more than noise can, and the deviations say so.
  const CameraImuFit held = calibrate(rig);
  const Vector7d error = error_of(held, rig, 0);
  EXPECT_GT(error.cwiseQuotient(held.cameras[0].sigma_by_noise).norm(), 10);
  EXPECT_LT(in_sigmas(error, held.cameras[0]).cwiseAbs().maxCoeff(), 3);
  EXPECT_GT(held.cameras[0].sigma_by_intrinsics.norm(), 5 * held.cameras[0].sigma_by_noise.norm());
  // What the mounting moves by is what by_intrinsics says.
  rig.camera.intrinsics_px[2] += 0.5;
  const CameraImuFit moved = calibrate(rig);
  const Vector7d by_cx = 0.5 * held.cameras[0].by_intrinsics.col(2);
  EXPECT_LT((error - error_of(moved, rig, 0) - by_cx).norm(), 0.1 * by_cx.norm());
  rig.camera.intrinsics_px[2] -= 0.5;
  // Refined: found.
  const CameraImuFit fit = calibrate(rig, {.refine_intrinsics = true});
  const CameraImuCamera& camera = fit.cameras[0];
  EXPECT_TRUE(fit.converged);
  const Eigen::Vector4d left =
      (truth.intrinsics_px - camera.camera.intrinsics_px).cwiseQuotient(camera.intrinsics_sigma.head<4>());
  EXPECT_LT(left.cwiseAbs().maxCoeff(), 4);
  EXPECT_LT(camera.intrinsics_sigma.head<4>().maxCoeff(), 0.8);
  EXPECT_TRUE(near(camera.intrinsics_change.head<4>(), -Eigen::Vector4d(1.5, 1.2, -1.4, 1.3), 1.0));
  EXPECT_LT(in_sigmas(error_of(fit, rig, 0), camera).cwiseAbs().maxCoeff(), 4);
  // A rig gets what was found, not what it knew before.
  ASSERT_TRUE(camera.camera.intrinsics_quality && camera.camera.mounting_quality);
  EXPECT_EQ(camera.camera.intrinsics_quality->method, "camera-imu");
  EXPECT_EQ(camera.camera.intrinsics_quality->intrinsics_sigma_px, camera.intrinsics_sigma.head<4>());
  EXPECT_EQ(camera.camera.mounting_quality->verdict, fit.quality.verdict);
  EXPECT_NEAR(camera.camera.mounting_quality->rotation_sigma.norm(), camera.sigma.head<3>().norm(), 1e-9);
  EXPECT_EQ(held.cameras[0].camera.intrinsics_quality->method, "simulation");
  // Where nobody measured them, something is taken to be.
  rig.camera.intrinsics_quality.reset();
  EXPECT_NEAR(calibrate(rig).cameras[0].intrinsics_sigma[0], 0.23, 0.02);
}

TEST(CameraImu, MatricesOfTheImuAndGravityAreFound) {
  WavedRigOptions options{.seconds = 20};
  options.gyroscope_matrix << 1.01, 0.003, -0.002, 0.004, 0.99, 0.001, -0.003, 0.002, 1.005;
  options.accelerometer_matrix << 1.008, 0, 0, 0.004, 0.995, 0, -0.003, 0.002, 1.004;
  const WavedRig rig = wave(options, 3);
  const CameraImuFit fit = calibrate(rig, {.estimate_imu_matrices = true});
  EXPECT_TRUE(fit.converged);
  const auto off = [](const CameraImuMatrixCheck& found, const Eigen::Matrix3d& truth) {
    double most = 0;
    for (int i = 0; i < 9; ++i) {
      if (found.sigma(i) > 0) most = std::max(most, std::abs(found.value(i) - truth(i)) / found.sigma(i));
    }
    return most;
  };
  EXPECT_TRUE(fit.gyroscope_matrix.estimated);
  EXPECT_LT(off(fit.gyroscope_matrix, options.gyroscope_matrix), 4);
  EXPECT_LT(off(fit.accelerometer_matrix, options.accelerometer_matrix), 4);
  EXPECT_LT(fit.gyroscope_matrix.sigma.maxCoeff(), 2e-3);
  EXPECT_LT(in_sigmas(error_of(fit, rig, 0), fit.cameras[0]).cwiseAbs().maxCoeff(), 4);
  // Gravity's size: looked at where it is held, found where it is asked for.
  const WavedRig plain = wave({.seconds = 20}, 3);
  const CameraImuFit wrong = calibrate(plain, {.gravity = 9.75});
  EXPECT_NEAR(wrong.gravity_size.value, 9.80665, 5 * wrong.gravity_size.sigma);
  EXPECT_LT(wrong.gravity_size.sigma, 0.02);
  const CameraImuFit far_off = calibrate(plain, {.gravity = 8});
  EXPECT_GE(far_off.quality.verdict, Verdict::kWarn);
  EXPECT_NE(far_off.quality.reasons.front().find("Gravity seems to be"), std::string::npos)
      << far_off.quality.reasons.front();
  const CameraImuFit found = calibrate(plain, {.gravity = 9.75, .estimate_gravity = true});
  EXPECT_NEAR(found.gravity_size.value, 9.80665, 4 * found.gravity_size.sigma);
  EXPECT_NEAR(found.gravity_target.norm(), found.gravity_size.value, 1e-9);
  EXPECT_NEAR(found.target_scale.value, 1, 4 * found.target_scale.sigma);
  const CameraImuFit both = calibrate(plain, {.estimate_gravity = true, .estimate_imu_matrices = true});
  EXPECT_TRUE(std::isnan(both.target_scale.value));
}

// One thing that was held wrongly is told by its name and its size, and nothing else is accused; where it moves the
// mounting by more than its deviations, the verdict is a warning.
TEST(CameraImu, WhatWasHeldWronglyIsNamed) {
  const auto told = [](const WavedRig& rig, const std::string& name, const std::string& size) {
    SCOPED_TRACE(name + " " + size);
    const CameraImuFit fit = calibrate(rig);
    const std::vector<std::string>& reasons = fit.quality.reasons;
    ASSERT_FALSE(reasons.empty());
    EXPECT_NE(reasons.front().find(name), std::string::npos) << reasons.front();
    EXPECT_NE(reasons.front().find(size), std::string::npos) << reasons.front();
    EXPECT_EQ(std::ranges::count_if(reasons,
                                    [](const std::string& r) { return r.find("would move by") != std::string::npos; }),
              1);
    if (in_sigmas(error_of(fit, rig, 0), fit.cameras[0]).cwiseAbs().maxCoeff() > 5) {
      EXPECT_EQ(fit.quality.verdict, Verdict::kWarn);
    }
  };
  const WavedRigOptions plain{.seconds = 20};
  WavedRig rig = wave(plain, 1);
  rig.target.size_m *= 1.02;
  told(rig, "the target is", "2 % smaller");
  rig.target.size_m /= 1.02 * 1.05;
  told(rig, "the target is", " % larger");
  rig = wave(plain, 1);
  rig.camera.intrinsics_px.head<2>() *= 1.03;
  told(rig, "change the intrinsics", " px");
  WavedRigOptions other = plain;
  other.gyroscope_matrix *= 1.02;
  told(wave(other, 1), "gyroscope's scale", "2.");
  other.gyroscope_matrix = Eigen::Matrix3d::Identity();
  other.gyroscope_matrix(0, 1) = 0.01;
  told(wave(other, 1), "gyroscope's scale", " %");
  other = plain;
  other.accelerometer_matrix *= 1.02;
  told(wave(other, 1), "accelerometer's scale", "2 %");
  const CameraImuFit right = calibrate(wave(plain, 1));
  EXPECT_EQ(right.quality.verdict, Verdict::kOk);
  EXPECT_NEAR(right.target_scale.value, 1, 4 * right.target_scale.sigma);
  EXPECT_LT(right.target_scale.sigma, 1e-3);
  EXPECT_FALSE(right.gyroscope_matrix.estimated);
  EXPECT_LT((right.gyroscope_matrix.value - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 3e-3);
}

}  // namespace
}  // namespace loc
