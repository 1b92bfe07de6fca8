#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>
#include <string>

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

Rig good_rig() {
  Rig rig;
  rig.imu = ImuCalibration{};
  rig.magnetometer = MagnetometerCalibration{};
  rig.cameras = {good_camera()};
  rig.gps = GpsCalibration{};
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
