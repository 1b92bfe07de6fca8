#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "libloc/core/random.hpp"
#include "libloc/geometry/so3.hpp"
#include "libloc/sensors/imu_noise.hpp"
#include "libloc/sensors/rig.hpp"
#include "tests/support/numeric_jacobian.hpp"

namespace loc {
namespace {

const double kNan = std::numeric_limits<double>::quiet_NaN();

CameraCalibration good_camera() {
  CameraCalibration camera;
  camera.name = "cam0";
  camera.width_px = 752;
  camera.height_px = 480;
  camera.intrinsics_px = {458, 457, 367, 248};
  return camera;
}

TriadQuality good_quality() {
  TriadQuality quality;
  quality.method = "robust";
  quality.samples = 500;
  return quality;
}

ClockCalibration good_clock(const std::string& stream) {
  ClockCalibration clock;
  clock.stream = stream;
  clock.skew_ppm = 50;
  return clock;
}

Rig good_rig() {
  Rig rig;
  rig.imu = ImuCalibration{};
  rig.magnetometer = MagnetometerCalibration{};
  rig.cameras = {good_camera()};
  rig.magnetometer->triad.quality = good_quality();
  rig.gps = GpsCalibration{};
  rig.clocks = {good_clock("imu"), good_clock("gps")};
  return rig;
}

// The message names the field.
template <class Change>
void expect_refused(const Change& change, const std::string& field) {
  Rig rig = good_rig();
  rig.check();
  change(rig);
  try {
    rig.check();
    ADD_FAILURE() << field << " was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find(field), std::string::npos) << error.what();
  }
}

TEST(Rig, EmptyRigIsFine) {
  Rig{}.check();
}

TEST(Rig, EveryFieldIsChecked) {
  expect_refused([](Rig& r) { r.imu->rate_hz = -1; }, "imu.rate_hz");
  expect_refused([](Rig& r) { r.imu->noise.gyroscope_noise_density = -1; }, "gyroscope_noise_density");
  expect_refused([](Rig& r) { r.imu->noise.accelerometer_random_walk = kNan; }, "accelerometer_random_walk");
  expect_refused([](Rig& r) { r.imu->gyroscope.bias.x() = kNan; }, "imu.gyroscope.bias");
  expect_refused([](Rig& r) { r.imu->accelerometer.matrix(0, 0) = kNan; }, "imu.accelerometer.matrix");
  expect_refused([](Rig& r) { r.imu->accelerometer.matrix.setZero(); }, "imu.accelerometer.matrix");
  expect_refused([](Rig& r) { r.magnetometer->triad.matrix.setOnes(); }, "magnetometer.matrix");
  expect_refused([](Rig& r) { r.cameras[0].width_px = 0; }, "cam0.resolution");
  expect_refused([](Rig& r) { r.cameras[0].intrinsics_px[1] = 0; }, "cam0.intrinsics");
  expect_refused([](Rig& r) { r.cameras[0].distortion[2] = kNan; }, "cam0.distortion_coeffs");
  expect_refused([](Rig& r) { r.cameras[0].T_body_camera.translation.y() = kNan; }, "cam0.T_cam_imu");
  expect_refused([](Rig& r) { r.cameras[0].T_body_camera.rotation.w() = kNan; }, "cam0.T_cam_imu");
  expect_refused([](Rig& r) { r.cameras[0].T_body_camera.rotation.w() = 1.1; }, "cam0.T_cam_imu");
  expect_refused([](Rig& r) { r.cameras[0].time_offset_s = kNan; }, "cam0.timeshift_cam_imu");
  expect_refused([](Rig& r) { r.cameras[0].rate_hz = -20; }, "cam0.rate_hz");
  expect_refused([](Rig& r) { r.gps->antenna_in_body.z() = kNan; }, "gps.antenna_in_body");
  expect_refused([](Rig& r) { r.gps->time_offset_s = kNan; }, "gps.time_offset_s");
  expect_refused([](Rig& r) { r.gps->time_offset_s = 1.7e9; }, "gps.time_offset_s");
  expect_refused([](Rig& r) { r.gps->time_offset_sigma_s = -0.1; }, "gps.time_offset_sigma_s");
  expect_refused([](Rig& r) { r.imu->noise_measured = {"gyroscope_noise"}; }, "gyroscope_noise");
  expect_refused([](Rig& r) { r.imu->noise_measured.assign(2, "gyroscope_noise_density"); }, "twice");
}

TEST(Rig, EveryFieldOfAQualityIsChecked) {
  const auto expect = [](auto change, const std::string& field) {
    expect_refused([&](Rig& r) { change(*r.magnetometer->triad.quality); }, "magnetometer.quality." + field);
  };
  expect([](TriadQuality& q) { q.method = ""; }, "method");
  expect([](TriadQuality& q) { q.samples = -1; }, "samples");
  expect([](TriadQuality& q) { q.bias_sigma = {0, 1, kNan}; }, "bias_sigma");
  expect([](TriadQuality& q) { q.bias_sigma = {0, 1, -1}; }, "bias_sigma");
  expect([](TriadQuality& q) { q.matrix_sigma.setConstant(HUGE_VAL); }, "matrix_sigma");
  expect([](TriadQuality& q) { q.residual_rms = -1; }, "residual_rms");
  expect([](TriadQuality& q) { q.reasons = {"one", ""}; }, "reasons");
  expect([](TriadQuality& q) { q.reasons = {"two\nlines"}; }, "reasons");
}

TEST(Rig, EveryFieldOfTheQualityOfIntrinsicsIsChecked) {
  const auto expect = [](auto change, const std::string& field) {
    expect_refused(
        [&](Rig& r) {
          IntrinsicsQuality& q = r.cameras[0].intrinsics_quality.emplace();
          q.method = "target";
          q.check("fine");
          change(q);
        },
        "cam0.intrinsics_quality." + field);
  };
  expect([](IntrinsicsQuality& q) { q.method = ""; }, "method");
  expect([](IntrinsicsQuality& q) { q.pictures = -1; }, "pictures");
  expect([](IntrinsicsQuality& q) { q.intrinsics_sigma_px = {0, 1, 1, kNan}; }, "intrinsics_sigma");
  expect([](IntrinsicsQuality& q) { q.distortion_sigma = {0, 1, 1, -1}; }, "distortion_sigma");
  expect([](IntrinsicsQuality& q) { q.reprojection_rms_px = -1; }, "reprojection_rms_px");
  expect([](IntrinsicsQuality& q) { q.reasons = {"two\nlines"}; }, "reasons");
}

TEST(Rig, EveryFieldOfTheQualityOfAMountingIsChecked) {
  const auto expect = [](auto change, const std::string& field) {
    expect_refused(
        [&](Rig& r) {
          MountingQuality& q = r.cameras[0].mounting_quality.emplace();
          q.method = "camera-imu";
          q.check("fine");
          change(q);
        },
        "cam0.mounting_quality." + field);
  };
  expect([](MountingQuality& q) { q.method = ""; }, "method");
  expect([](MountingQuality& q) { q.pictures = -1; }, "pictures");
  expect([](MountingQuality& q) { q.rotation_sigma = {0, 1, kNan}; }, "rotation_sigma");
  expect([](MountingQuality& q) { q.translation_sigma = {0, 1, -1}; }, "translation_sigma");
  expect([](MountingQuality& q) { q.time_offset_sigma_s = HUGE_VAL; }, "time_offset_sigma_s");
  expect([](MountingQuality& q) { q.line_delay_s = 20; }, "line_delay_s = 20");  // microseconds
  expect([](MountingQuality& q) { q.line_delay_sigma_s = -1; }, "line_delay_sigma_s");
  expect([](MountingQuality& q) { q.reasons = {"two\nlines"}; }, "reasons");
}

TEST(Rig, DeviationsOfAMountingAreThoseOfTheInverse) {
  Random random(5);
  const Pose3 T_body_camera{random.rotation(), {0.3, -0.2, 0.5}};
  const Pose3 T_camera_body = T_body_camera.inverse();
  Eigen::Matrix<double, 7, 7> root;
  for (double& entry : root.reshaped()) entry = 1e-3 * random.normal();
  const Eigen::Matrix<double, 7, 7> covariance = root * root.transpose();
  MountingQuality quality;
  quality.set_deviations(T_body_camera, covariance);

  // How each column of the root moves camera and clock: the covariance is the sum of the columns' squares.
  Eigen::Matrix<double, 6, 7> moves;
  for (int i = 0; i < 7; ++i) {
    const auto moved = [&](double step) {
      const Eigen::Vector<double, 7> d = step * root.col(i);
      return Pose3{so3::boxplus(T_camera_body.rotation, d.head<3>()), T_camera_body.translation + d.segment<3>(3)}
          .inverse();
    };
    const Pose3 ahead = moved(1e-3);
    const Pose3 behind = moved(-1e-3);
    const Eigen::Vector3d turn = so3::log(ahead.rotation * behind.rotation.conjugate());  // about body axes
    moves.col(i) << turn / 2e-3, (ahead.translation - behind.translation) / 2e-3;
  }
  const Eigen::Vector<double, 6> sigma = moves.rowwise().norm();
  EXPECT_TRUE(test::near(quality.rotation_sigma, Eigen::Vector3d(sigma.head<3>()), 1e-9));
  EXPECT_TRUE(test::near(quality.translation_sigma, Eigen::Vector3d(sigma.tail<3>()), 1e-9));
  EXPECT_DOUBLE_EQ(quality.time_offset_sigma_s, root.row(6).norm());

  Eigen::Matrix<double, 7, 7> bad = covariance;
  bad(2, 2) = -1;
  EXPECT_THROW(quality.set_deviations(T_body_camera, bad), std::invalid_argument);
  bad(2, 2) = kNan;
  EXPECT_THROW(quality.set_deviations(T_body_camera, bad), std::invalid_argument);
  bad.setIdentity();
  bad(2, 4) = bad(4, 2) = -5;  // turn about z and shift along y
  EXPECT_THROW(quality.set_deviations({Eigen::Quaterniond::Identity(), {1, 0, 0}}, bad), std::invalid_argument);
  EXPECT_DOUBLE_EQ(quality.time_offset_sigma_s, root.row(6).norm()) << "what cannot be leaves it as it was";
}

TEST(Rig, EveryFieldOfAClockIsChecked) {
  const auto expect = [](auto change, const std::string& field) {
    expect_refused([&](Rig& r) { change(r.clocks[0]); }, field);
  };
  expect([](ClockCalibration& c) { c.stream = ""; }, "clocks.stream");
  expect([](ClockCalibration& c) { c.reference = ""; }, "clocks.reference");
  expect([](ClockCalibration& c) { c.skew_ppm = kNan; }, "clocks.imu.skew_ppm");
  expect([](ClockCalibration& c) { c.skew_ppm = 1e6; }, "clocks.imu.skew_ppm");
  expect([](ClockCalibration& c) { c.skew_sigma_ppm = -1; }, "clocks.imu.skew_sigma_ppm");
  expect([](ClockCalibration& c) { c.offset_sigma_s = -1; }, "clocks.imu.offset_sigma_s");
  expect([](ClockCalibration& c) { c.jitter_rms_s = HUGE_VAL; }, "clocks.imu.jitter_rms_s");
  expect([](ClockCalibration& c) { c.jitter_p99_s = -1; }, "clocks.imu.jitter_p99_s");
  expect_refused([](Rig& r) { r.clocks[1].stream = "imu"; }, "'imu' against 'host' comes twice");
  Rig rig = good_rig();
  rig.clocks[1] = good_clock("imu");
  rig.clocks[1].reference = "gps";  // against another clock: fine
  rig.check();
}

TEST(Rig, DoubtsTellOfWarningsAndOfWhatWasForced) {
  Rig rig = good_rig();
  EXPECT_TRUE(doubts(rig).empty());
  rig.magnetometer->triad.quality->verdict = Verdict::kFair;
  EXPECT_TRUE(doubts(rig).empty());
  rig.magnetometer->triad.quality->verdict = Verdict::kRefused;
  rig.magnetometer->triad.quality->reasons = {"flat", "disturbed"};
  rig.imu->gyroscope.quality = good_quality();
  rig.imu->accelerometer.quality = good_quality();
  rig.imu->accelerometer.quality->verdict = Verdict::kWarn;
  rig.imu->accelerometer.quality->reasons = {"10 poses"};
  rig.cameras[0].intrinsics_quality.emplace().verdict = Verdict::kWarn;
  rig.cameras[0].intrinsics_quality->reasons = {"no tilt"};
  rig.cameras[0].mounting_quality.emplace().verdict = Verdict::kRefused;
  rig.cameras[0].mounting_quality->reasons = {"one axis"};
  const auto found = doubts(rig);
  ASSERT_EQ(found.size(), 4U);
  EXPECT_EQ(found[3].block, "cam0.mounting");
  EXPECT_NE(found[3].text.find("forced); one axis"), std::string::npos) << found[3].text;
  EXPECT_EQ(found[2].block, "cam0.intrinsics");
  EXPECT_NE(found[2].text.find("warning; no tilt"), std::string::npos) << found[2].text;
  EXPECT_EQ(found[0].block, "imu.accelerometer");
  EXPECT_EQ(found[0].verdict, Verdict::kWarn);
  EXPECT_NE(found[0].text.find("warning; 10 poses"), std::string::npos) << found[0].text;
  EXPECT_EQ(found[1].block, "magnetometer");
  EXPECT_NE(found[1].text.find("forced); flat; disturbed"), std::string::npos) << found[1].text;
}

TEST(Rig, CalibratedMovesTheTimeOfAGpsFix) {
  Rig rig;
  rig.gps = GpsCalibration{};
  rig.gps->time_offset_s = -0.2;
  GpsMeasurement fix;
  fix.time_ns = 1'700'000'000'123'456'789;
  fix.host_time_ns = 7;
  fix.gps_time_ns = 8;
  const auto moved = std::get<GpsMeasurement>(calibrated(rig, fix));
  EXPECT_EQ(moved.time_ns, 1'699'999'999'923'456'789);
  EXPECT_EQ(moved.host_time_ns, 7);
  EXPECT_EQ(moved.gps_time_ns, 8);
  EXPECT_EQ(std::get<GpsMeasurement>(calibrated(Rig{}, fix)).time_ns, fix.time_ns);
  for (const TimeNs odd : {kNoTime, kNoTime + 1}) {  // unknown, and where the sum would overflow
    fix.time_ns = odd;
    EXPECT_EQ(std::get<GpsMeasurement>(calibrated(rig, fix)).time_ns, odd);
  }
}

TEST(Rig, ASmallUnitDoesNotMakeAMatrixSingular) {
  Rig rig = good_rig();
  rig.magnetometer->triad.matrix *= 1e-9;  // nanotesla to tesla
  rig.check();
}

TEST(Rig, CalibratedAppliesEachSensorsOwnTriad) {
  Rig rig;
  rig.imu = ImuCalibration{};
  rig.imu->gyroscope.bias = {0.1, 0, 0};
  rig.imu->accelerometer.matrix = 2 * Eigen::Matrix3d::Identity();
  rig.magnetometer = MagnetometerCalibration{};
  rig.magnetometer->triad.bias = {0, 1e-5, 0};
  rig.magnetometer->triad.matrix << 0, 1, 0, 1, 0, 0, 0, 0, -1;

  ImuMeasurement imu;
  imu.time_ns = 5;
  imu.angular_velocity = {1, 2, 3};
  imu.specific_force = {0, 0, 5};
  const Measurement imu_out = calibrated(rig, imu);
  EXPECT_TRUE(test::near(std::get<ImuMeasurement>(imu_out).angular_velocity, Eigen::Vector3d(0.9, 2, 3), 1e-15));
  EXPECT_TRUE(test::near(std::get<ImuMeasurement>(imu_out).specific_force, Eigen::Vector3d(0, 0, 10), 1e-15));
  EXPECT_EQ(stamp_of(imu_out).time_ns, 5);

  MagnetometerMeasurement field;
  field.magnetic_field = {1e-5, 3e-5, 4e-5};
  const Measurement field_out = calibrated(rig, field);
  EXPECT_TRUE(test::near(std::get<MagnetometerMeasurement>(field_out).magnetic_field,
                         Eigen::Vector3d(2e-5, 1e-5, -4e-5), 1e-20));

  const Measurement raw = calibrated(Rig{}, field);
  EXPECT_TRUE(test::near(std::get<MagnetometerMeasurement>(raw).magnetic_field, field.magnetic_field, 0));
}

TEST(ImuNoise, DiscretisationScalesWithTheRootOfTheStep) {
  ImuNoise noise;
  noise.gyroscope_noise_density = 2e-4;
  noise.gyroscope_random_walk = 3e-5;
  noise.accelerometer_noise_density = 4e-3;
  noise.accelerometer_random_walk = 5e-3;
  // 100 Hz: white noise by sqrt(rate) = 10, walks by sqrt(dt) = 0.1.
  const DiscreteImuNoise d = discretise(noise, 0.01);
  EXPECT_NEAR(d.sigma_angular_velocity, 2e-3, 1e-17);
  EXPECT_NEAR(d.sigma_specific_force, 4e-2, 1e-16);
  EXPECT_NEAR(d.sigma_gyroscope_bias_step, 3e-6, 1e-20);
  EXPECT_NEAR(d.sigma_accelerometer_bias_step, 5e-4, 1e-18);
  // The mean over a second and the walk of a second do not depend on the rate.
  for (const double rate : {50.0, 200.0, 1000.0}) {
    const DiscreteImuNoise at = discretise(noise, 1 / rate);
    EXPECT_NEAR(at.sigma_angular_velocity / std::sqrt(rate), 2e-4, 1e-17);
    EXPECT_NEAR(at.sigma_accelerometer_bias_step * std::sqrt(rate), 5e-3, 1e-16);
  }
  EXPECT_THROW(discretise(noise, 0), std::invalid_argument);
  EXPECT_THROW(discretise(noise, kNan), std::invalid_argument);
  noise.gyroscope_bias_sigma = -1;
  EXPECT_THROW(discretise(noise, 0.01), std::invalid_argument);
}

}  // namespace
}  // namespace loc
