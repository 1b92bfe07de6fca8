// Start of visual-inertial SLAM in motion: its parts against differences and noise-free simulations, its covariance
// against Monte Carlo, its refusals against motions that tell nothing.
#include <gtest/gtest.h>

#include <iostream>
#include <memory>

#include "libloc/estimators/slam_start.hpp"
#include "libloc/estimators/slam_start_detail.hpp"
#include "libloc/eval/consistency.hpp"
#include "libloc/geometry/so3.hpp"
#include "libloc/sim/camera.hpp"
#include "libloc/sim/imu.hpp"
#include "libloc/sim/room.hpp"
#include "libloc/sim/scenario.hpp"
#include "libloc/sim/shape_motion.hpp"
#include "tests/support/numeric_jacobian.hpp"

namespace loc {
namespace {

constexpr double kGravity = 9.80665;

HandHeldOptions in_room() {
  HandHeldOptions o;
  o.T_world_mean.translation = {0, 0, 1.4};
  return o;
}

// A camera and an IMU on a motion, in the room of the scenario "hand-held".
struct Device {
  CameraCalibration camera;
  ImuModel imu = ImuModel::perfect();
  CameraModel model;
  std::shared_ptr<const Motion> motion = std::make_shared<HandHeldMotion>(in_room(), Random(20));
  Scene scene = box_room({.size_m = {8, 6, 3}, .cell_m = 0.5}, Random(20));
  double begin_s = 1;
  double duration_s = 1;
  double gravity = kGravity;

  Device() : camera(make_scenario("hand-held").cameras.at(0).calibration) {
    imu.sampling = ImuSampleModel::kPoint;
    model.sigma_px = 0.5;
  }
};

struct Outcome {
  std::optional<SlamStartEstimate> estimate;
  SlamStartOutcome outcome;
  std::string reason;
  MotionState truth;  // at the estimate's time
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();
  std::vector<SimulatedFrame> frames;
};

Outcome run(const Device& device, std::uint64_t seed, const SlamStartOptions& options, const ImuNoise& noise,
            const SlamStartFeature** = nullptr) {
  Random random(seed);
  SlamStart start(options, device.camera, noise, device.gravity);
  ImuSimulator imu(device.imu, random.fork(1));
  CameraSimulator camera(device.model, device.camera, device.scene, random.fork(2));
  const double imu_dt = 1 / device.imu.rate_hz;
  Outcome out;
  for (int i = -2; i * imu_dt <= device.duration_s + 2 * imu_dt; ++i) {
    start.push(imu.measure(*device.motion, from_seconds(device.begin_s + i * imu_dt)));
  }
  for (int i = 0; i / device.model.rate_hz <= device.duration_s + 1e-9; ++i) {
    out.frames.push_back(camera.observe(device.motion->at(device.begin_s + i / device.model.rate_hz)));
    start.push(out.frames.back().measurement);
  }
  out.estimate = start.solve();
  out.outcome = start.outcome();
  out.reason = start.reason();
  out.gyroscope_bias = imu.truth().gyroscope_bias;
  out.accelerometer_bias = imu.truth().accelerometer_bias;
  if (out.estimate) out.truth = device.motion->at(to_seconds(out.estimate->time_ns));
  return out;
}

// Error (theta, v, bg, ba), true minus estimate, in the estimate's world: heading is free.
Eigen::Vector<double, 12> error_of(const Outcome& r) {
  const InertialState& s = r.estimate->state;
  const Eigen::Vector3d down = s.q_world_body.conjugate() * -Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d true_down = r.truth.T_world_body.rotation.conjugate() * -Eigen::Vector3d::UnitZ();
  // true_down = Exp(-theta) down
  const Eigen::Vector3d theta = so3::log(Eigen::Quaterniond::FromTwoVectors(true_down, down));
  const Eigen::Quaterniond q_true = so3::boxplus(s.q_world_body, theta);
  Eigen::Vector<double, 12> e;
  e << theta, q_true * (r.truth.T_world_body.rotation.conjugate() * r.truth.velocity) - s.velocity,
      r.gyroscope_bias - s.gyroscope_bias, r.accelerometer_bias - s.accelerometer_bias;
  return e;
}

// Relative errors of the depths.
std::vector<double> depth_errors(const Outcome& r) {
  std::vector<double> out;
  for (const SlamStartFeature& point : r.estimate->points) {
    for (const SimulatedFrame& frame : r.frames) {
      if (frame.measurement.time_ns != point.anchor_time_ns) continue;
      for (std::size_t i = 0; i < frame.truth.size(); ++i) {
        if (frame.measurement.features[i].id != point.id) continue;
        const Camera camera(make_scenario("hand-held").cameras.at(0).calibration);
        const double cosine = camera.unproject(frame.truth[i].pixel_px)->z();
        out.push_back(point.inverse_distance * frame.truth[i].depth_m / cosine - 1);
      }
    }
  }
  return out;
}

TEST(SlamStart, FindsTheStateWithoutNoise) {
  Device device;
  device.imu = ImuModel::perfect(1000);
  device.imu.gyroscope.constant_bias = {0.05, -0.06, 0.03};
  device.model.sigma_px = 0;
  device.camera.time_offset_s = 0.012;
  SlamStartOptions options;
  options.sigma_px = 0.1;
  const Outcome r = run(device, 1, options, ImuNoise{});
  ASSERT_TRUE(r.estimate) << r.reason;
  const auto e = error_of(r);
  std::cout << e.transpose() << "\n it " << r.estimate->iterations << " rms " << r.estimate->residual_px_rms
            << " scale sigma " << r.estimate->scale_sigma << " cond " << r.estimate->condition << "\n";
  EXPECT_LT(e.segment<3>(0).norm(), 2e-4);
  for (const double d : depth_errors(r)) EXPECT_NEAR(d, 0, 1e-3);
}

// A small problem by hand: two frames are enough for derivatives.
slam_start::Problem steps_only(const Camera& camera) {
  slam_start::Problem problem;
  problem.camera = &camera;
  problem.T_body_camera = make_scenario("hand-held").cameras.at(0).calibration.T_body_camera;
  problem.T_body_camera.translation = {0.05, -0.1, 0.2};
  Random random(3);
  problem.step_end = {0};
  problem.times_s = {0};
  problem.sigma_px = {1};
  for (int frame = 1; frame < 4; ++frame) {
    for (int i = 0; i < 20; ++i) {
      problem.steps.push_back({random.normal3(), Eigen::Vector3d(0, 0, 9.8) + random.normal3(), 0.01});
    }
    problem.times_s.push_back(0.2 * frame);
    problem.sigma_px.push_back(1);
    problem.step_end.push_back(problem.steps.size());
  }
  return problem;
}

TEST(SlamStart, JacobiansOfPosesMatchDifferences) {
  const Camera camera(make_scenario("hand-held").cameras.at(0).calibration);
  const slam_start::Problem problem = steps_only(camera);
  slam_start::Unknowns x;
  x.velocity = {0.3, -0.5, 0.2};
  x.down = Eigen::Vector3d(0.3, -0.2, -0.8).normalized();
  x.gyroscope_bias = {0.1, -0.05, 0.02};
  x.accelerometer_bias = {0.2, 0.1, -0.3};
  x.noise = Eigen::VectorXd::Zero(18);
  x.noise.segment<6>(6) << 0.1, -0.2, 0.05, 0.01, 0.02, -0.03;
  using Vector = Eigen::Vector<double, slam_start::kStartDim>;
  for (const std::size_t frame : {1u, 2u, 3u}) {
    const auto pose = [&](const Vector& d) {
      slam_start::Unknowns y = x;
      y.velocity += d.segment<3>(slam_start::kStartVelocity);
      y.down = (x.down + slam_start::tangent(x.down) * d.segment<2>(slam_start::kStartDown)).normalized();
      y.gyroscope_bias += d.segment<3>(slam_start::kStartGyroscopeBias);
      y.accelerometer_bias += d.segment<3>(slam_start::kStartAccelerometerBias);
      return slam_start::pose_models(problem, y)[frame];
    };
    const Eigen::MatrixXd by_motion = pose(Vector::Zero()).by_motion;
    const auto rotation = [&](const Vector& d) { return Eigen::Quaterniond(pose(d).rotation); };
    const auto position = [&](const Vector& d) { return pose(d).position; };
    EXPECT_TRUE(test::near(by_motion.topRows<3>(), test::numeric_jacobian(rotation, Vector(Vector::Zero())), 1e-8));
    EXPECT_TRUE(test::near(by_motion.bottomRows<3>(), test::numeric_jacobian(position, Vector(Vector::Zero())), 1e-8));
  }
}

TEST(SlamStart, JacobiansOfPixelsMatchDifferences) {
  const Camera camera(make_scenario("hand-held").cameras.at(0).calibration);
  const slam_start::Problem problem = steps_only(camera);
  const Pose3 body{so3::exp({0.05, -0.1, 0.2}), {0.1, 0.2, -0.3}};
  // In front of the camera, which looks along x of body: near, far, and a little beyond infinity.
  for (const double inverse_distance : {0.5, 0.001, -0.01}) {
    const slam_start::Point point{Eigen::Vector3d(0.9, 0.2, 0.1).normalized(), inverse_distance, true};
    const auto by_pose = [&](const Eigen::Vector<double, 6>& d) {
      const Eigen::Matrix3d R = so3::boxplus(body.rotation, d.head<3>()).toRotationMatrix();
      return Eigen::Vector2d(pixel_model(problem, R, body.translation + d.tail<3>(), point)->pixel_px);
    };
    const auto by_point = [&](const Eigen::Vector3d& d) {
      slam_start::Point moved = point;
      moved.direction = (point.direction + slam_start::tangent(point.direction) * d.head<2>()).normalized();
      moved.inverse_distance += d[2];
      return Eigen::Vector2d(pixel_model(problem, body.rotation.toRotationMatrix(), body.translation, moved)->pixel_px);
    };
    const auto model = pixel_model(problem, body.rotation.toRotationMatrix(), body.translation, point);
    ASSERT_TRUE(model);
    EXPECT_TRUE(test::near(model->by_pose,
                           test::numeric_jacobian(by_pose, Eigen::Vector<double, 6>(Eigen::Vector<double, 6>::Zero())),
                           1e-5));
    EXPECT_TRUE(test::near(model->by_point, test::numeric_jacobian(by_point, Eigen::Vector3d(0, 0, 0)), 1e-5));
  }
}

}  // namespace
}  // namespace loc
