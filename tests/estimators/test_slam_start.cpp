// Start of visual-inertial SLAM in motion: its parts against differences and noise-free simulations, its covariance
// against Monte Carlo, its refusals against motions that tell nothing.
#include <gtest/gtest.h>

#include <limits>
#include <memory>

#include "libloc/estimators/slam_start.hpp"
#include "libloc/estimators/slam_start_detail.hpp"
#include "libloc/eval/consistency.hpp"
#include "libloc/geometry/so3.hpp"
#include "libloc/sim/camera.hpp"
#include "libloc/sim/composed_motion.hpp"
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
  std::optional<double> state_sigma_px;  // what the frames say, where it is not the truth

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
  SlamStart start(options, device.camera, noise, kGravity);
  ImuSimulator imu(device.imu, random.fork(1));
  CameraSimulator camera(device.model, device.camera, device.scene, random.fork(2));
  const double imu_dt = 1 / device.imu.rate_hz;
  Outcome out;
  for (int i = -2; i * imu_dt <= device.duration_s + 2 * imu_dt; ++i) {
    start.push(imu.measure(*device.motion, from_seconds(device.begin_s + i * imu_dt)));
  }
  for (int i = 0; i / device.model.rate_hz <= device.duration_s + 1e-9; ++i) {
    out.frames.push_back(camera.observe(device.motion->at(device.begin_s + i / device.model.rate_hz)));
    if (device.state_sigma_px) out.frames.back().measurement.sigma_px = *device.state_sigma_px;
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

struct DepthError {
  double relative;
  double normalised;  // of the inverse distance, in its deviations
};
std::vector<DepthError> depth_errors(const Outcome& r, const CameraCalibration& calibration) {
  const Camera camera(calibration);
  std::vector<DepthError> out;
  for (const SlamStartFeature& point : r.estimate->points) {
    for (const SimulatedFrame& frame : r.frames) {
      if (frame.measurement.time_ns != point.anchor_time_ns) continue;
      for (std::size_t i = 0; i < frame.truth.size(); ++i) {
        if (frame.measurement.features[i].id != point.id) continue;
        const double distance = frame.truth[i].depth_m / camera.unproject(frame.truth[i].pixel_px)->z();
        out.push_back({point.inverse_distance * distance - 1, (point.inverse_distance - 1 / distance) / point.sigma});
      }
    }
  }
  return out;
}

// A consumer's IMU with biases of EuRoC's size, pixels of 0.5 px.
Device noisy(std::uint64_t seed) {
  Device device;
  device.imu = ImuModel::consumer();
  device.imu.gyroscope.turn_on_bias_sigma = 0;
  device.imu.gyroscope.constant_bias = 0.08 * Random(seed).direction();
  device.motion = std::make_shared<HandHeldMotion>(in_room(), Random(seed));
  return device;
}

SlamStartOptions for_consumer() {
  SlamStartOptions options;
  options.sampling = ImuSampling::kIntervalMean;
  return options;
}

// Of tilt (2), velocity, gyroscope bias.
constexpr int kNeesDim = 8;
double nees(const Outcome& r) {
  const auto e = error_of(r);
  const Eigen::Matrix3d R = r.estimate->state.q_world_body.toRotationMatrix();
  Eigen::Matrix<double, kNeesDim, kInertialDim> pick = Eigen::Matrix<double, kNeesDim, kInertialDim>::Zero();
  pick.block<2, 3>(0, kTheta) = R.topRows<2>();
  pick.block<3, 3>(2, kVelocity).setIdentity();
  pick.block<3, 3>(5, kGyroscopeBias).setIdentity();
  Eigen::Vector<double, kNeesDim> error;
  error << R.topRows<2>() * e.head<3>(), e.segment<6>(3);
  Eigen::MatrixXd covariance = pick * r.estimate->covariance * pick.transpose();
  covariance = (0.5 * (covariance + covariance.transpose())).eval();
  return normalised_error_squared(error, covariance);
}

TEST(SlamStart, FindsTheStateWithoutNoise) {
  Device plain;
  Device late;
  late.camera.time_offset_s = 0.012;
  Device fisheye;
  fisheye.camera.distortion_model = DistortionModel::kEquidistant;
  fisheye.camera.distortion = {-0.02, 0.01, -0.005, 0.001};
  for (Device device : {plain, late, fisheye}) {
    device.imu = ImuModel::perfect(1000);
    device.imu.sampling = ImuSampleModel::kPoint;
    device.imu.gyroscope.constant_bias = {0.05, -0.06, 0.03};
    device.model.sigma_px = 0;
    SlamStartOptions options;
    options.sigma_px = 0.1;
    const Outcome r = run(device, 1, options, ImuNoise{});
    ASSERT_TRUE(r.estimate) << r.reason;
    EXPECT_EQ(r.outcome, SlamStartOutcome::kStarted);
    // What is left is the midpoint rule's.
    const auto e = error_of(r);
    EXPECT_LT(e.segment<3>(0).norm(), 1e-4);
    EXPECT_LT(e.segment<3>(3).norm(), 2e-4) << "of " << r.truth.velocity.norm() << " m/s";
    EXPECT_LT(e.segment<3>(6).norm(), 1e-5);
    EXPECT_GT(r.truth.velocity.norm(), 0.2);
    EXPECT_NEAR(so3::heading(r.estimate->state.q_world_body), 0, 1e-9);
    EXPECT_EQ(r.estimate->state.position.norm(), 0);
    EXPECT_EQ(r.estimate->time_ns, from_seconds(device.begin_s));
    EXPECT_EQ(r.estimate->frames, 20);
    EXPECT_EQ(r.estimate->outliers, 0);
    EXPECT_LT(r.estimate->residual_px_rms, 1e-3);
    const auto depths = depth_errors(r, device.camera);
    EXPECT_GT(depths.size(), 20u);
    for (const DepthError& d : depths) EXPECT_NEAR(d.relative, 0, 1e-3);
  }
}

// Motions of 40 hands: all start, and the errors are what the covariance says.
TEST(SlamStart, IsConsistent) {
  std::vector<double> values;
  double depth_squares = 0;
  double depths = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Device device = noisy(seed);
    const Outcome r = run(device, seed, for_consumer(), device.imu.calibration().noise);
    ASSERT_TRUE(r.estimate) << seed << ": " << r.reason;
    const auto e = error_of(r);
    EXPECT_LT(e.segment<3>(3).norm(), 0.05) << seed;
    EXPECT_LT(e.head<3>().norm(), 0.03) << seed;
    EXPECT_LT(e.segment<3>(6).norm(), 0.01) << seed;
    EXPECT_NEAR(r.estimate->residual_px_rms, 0.5, 0.05) << seed;
    EXPECT_LE(r.estimate->iterations, 15) << seed << ": points that do not follow the motion make it 19";
    values.push_back(nees(r));
    for (const DepthError& d : depth_errors(r, device.camera)) {
      depth_squares += d.normalised * d.normalised;
      depths += 1;
    }
    // Heading and position define the world.
    const Eigen::Matrix3d R = r.estimate->state.q_world_body.toRotationMatrix();
    EXPECT_LT((r.estimate->covariance.middleRows<3>(kTheta).transpose() * R.row(2).transpose()).norm(), 1e-12);
    EXPECT_EQ(r.estimate->covariance.middleRows<3>(kPosition).norm(), 0);
  }
  const Consistency c = average_consistency(values, kNeesDim, 0.99);
  EXPECT_TRUE(c.consistent()) << c.average << " is not in " << c.lower << " .. " << c.upper;
  EXPECT_NEAR(std::sqrt(depth_squares / depths), 1, 0.15);
}

TEST(SlamStart, OutliersDoNoHarm) {
  for (const bool wrong_ids : {false, true}) {
    std::vector<double> values;
    int outliers = 0;
    int observations = 0;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      Device device = noisy(seed);
      (wrong_ids ? device.model.wrong_id_rate : device.model.outlier_rate) = 0.1;
      const Outcome r = run(device, seed, for_consumer(), device.imu.calibration().noise);
      ASSERT_TRUE(r.estimate) << seed << ": " << r.reason;
      EXPECT_LT(error_of(r).segment<3>(3).norm(), 0.05) << seed;
      EXPECT_NEAR(r.estimate->sigma_ratio, 1, 0.15) << seed;
      values.push_back(nees(r));
      outliers += r.estimate->outliers;
      observations += r.estimate->outliers + r.estimate->observations;
    }
    EXPECT_FALSE(average_consistency(values, kNeesDim, 0.99).optimistic());
    EXPECT_NEAR(outliers / static_cast<double>(observations), 0.1, 0.02);
  }
}

// With little parallax one start value is not enough: seeds 33, 35 and 40 have wrong minima nearby.
TEST(SlamStart, HalfASecondIsEnoughMostly) {
  std::vector<double> values;
  int tried = 0;
  for (const std::uint64_t seed : {3, 4, 5, 6, 8, 10, 17, 25, 33, 34, 35, 40}) {
    Device device = noisy(seed);
    device.duration_s = 0.5;
    device.model.outlier_rate = 0.1;
    const Outcome r = run(device, seed, for_consumer(), device.imu.calibration().noise);
    ++tried;
    if (!r.estimate) continue;
    EXPECT_LT(error_of(r).segment<3>(3).norm(), 0.12) << seed;
    values.push_back(nees(r));
  }
  EXPECT_GE(values.size(), tried - 3u);
  // Least squares are not linear over so little: 1.3 times the expected 8 over 40 seeds, more over these hard ones.
  EXPECT_LT(average_consistency(values, kNeesDim).average, 2 * kNeesDim);
}

TEST(SlamStart, ResidualsLargerThanStatedWidenTheCovariance) {
  Device device = noisy(1);
  const ImuNoise noise = device.imu.calibration().noise;
  SlamStartOptions options = for_consumer();
  options.max_sigma_ratio = 3;
  const Outcome as_stated = run(device, 1, options, noise);
  device.state_sigma_px = 0.25;  // half of what it is
  const Outcome twice = run(device, 1, options, noise);
  ASSERT_TRUE(as_stated.estimate && twice.estimate);
  EXPECT_NEAR(twice.estimate->sigma_ratio, 2, 0.1);
  const auto sigma = [](const Outcome& r) { return std::sqrt(r.estimate->covariance(kVelocity, kVelocity)); };
  EXPECT_NEAR(sigma(twice) / sigma(as_stated), 1, 0.1);
  // Not said at all: the option's.
  device.state_sigma_px = kUnknown;
  options.sigma_px = 0.5;
  const Outcome by_option = run(device, 1, options, noise);
  ASSERT_TRUE(by_option.estimate);
  EXPECT_NEAR(sigma(by_option) / sigma(as_stated), 1, 1e-6);
  options.sigma_px = 0.05;
  const Outcome too_small = run(device, 1, options, noise);
  EXPECT_EQ(too_small.outcome, SlamStartOutcome::kResidual) << too_small.reason;
}

// Along a straight line with constant speed.
class Glide : public Motion {
 public:
  Glide(const Eigen::Vector3d& velocity, const Eigen::Vector3d& rate) : velocity_(velocity), rate_(rate) {}
  double duration_s() const override { return 60; }
  MotionState at(double time_s) const override {
    MotionState s;
    s.time_s = time_s;
    s.T_world_body = {so3::exp(time_s * rate_), Eigen::Vector3d(-1, 0, 1.4) + time_s * velocity_};
    s.velocity = velocity_;
    s.angular_velocity = rate_;
    return s;
  }

 private:
  Eigen::Vector3d velocity_, rate_;
};

// Rest, turning on the spot and gliding tell neither scale nor speed.
TEST(SlamStart, RefusesMotionsThatTellNothing) {
  HandHeldOptions turning = in_room();
  turning.moves = {false, false, false};
  struct Case {
    const char* name;
    std::shared_ptr<const Motion> motion;
    bool without_parallax;
  };
  const std::vector<Case> cases = {
      {"rest", std::make_shared<RestMotion>(RestOptions{in_room().T_world_mean}), true},
      {"turning", std::make_shared<HandHeldMotion>(turning, Random(20)), true},
      {"gliding", std::make_shared<Glide>(Eigen::Vector3d(0.2, 0.5, 0.1), Eigen::Vector3d(0, 0, 0)), false},
      {"gliding, turning", std::make_shared<Glide>(Eigen::Vector3d(0.1, 0.5, 0.1), Eigen::Vector3d(0.1, -0.1, 0.2)),
       false}};
  for (const Case& c : cases) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      Device device = noisy(seed);
      device.motion = c.motion;
      device.duration_s = seed % 2 == 0 ? 0.6 : 1.8;
      device.camera.T_body_camera.translation.setZero();  // a camera beside the axis of turning moves
      const Outcome r = run(device, seed, for_consumer(), device.imu.calibration().noise);
      EXPECT_FALSE(r.estimate) << c.name << ", seed " << seed;
      if (c.without_parallax) {
        EXPECT_EQ(r.outcome, SlamStartOutcome::kNoParallax) << c.name << ": " << r.reason;
      }
      EXPECT_FALSE(r.reason.empty());
    }
  }
}

// A live stream: the window slides, memory stays bounded, and it starts as soon as the motion lets it.
TEST(SlamStart, WindowSlidesUntilTheMotionBegins) {
  Device device = noisy(3);
  device.motion = std::make_shared<RestFirstMotion>(std::make_shared<HandHeldMotion>(in_room(), Random(3)));
  SlamStart start(for_consumer(), device.camera, device.imu.calibration().noise, kGravity);
  ImuSimulator imu(device.imu, Random(1));
  CameraSimulator camera(device.model, device.camera, device.scene, Random(2));
  std::optional<SlamStartEstimate> estimate;
  double now = 0;
  std::int64_t sample = 0;
  for (int frame = 0; !estimate && frame < 120; ++frame) {
    now = frame / device.model.rate_hz;
    // The frame comes before the samples that surround it.
    start.push(camera.observe(device.motion->at(now)).measurement);
    for (; static_cast<double>(sample) / device.imu.rate_hz < now + 0.01; ++sample) {
      start.push(imu.measure(*device.motion, from_seconds(static_cast<double>(sample) / device.imu.rate_hz)));
    }
    EXPECT_LE(start.duration_s(), 2.0 + 1e-9);
    if (frame % 5 == 0) estimate = start.solve();
    if (frame == 5) {
      EXPECT_EQ(start.outcome(), SlamStartOutcome::kTooShort);
    } else if (frame == 35) {
      EXPECT_EQ(start.outcome(), SlamStartOutcome::kNoParallax) << start.reason();
    }
  }
  ASSERT_TRUE(estimate) << start.reason();
  EXPECT_GT(now, 2) << "it rests until then";
  EXPECT_LT(now, 5);
  const MotionState truth = device.motion->at(to_seconds(estimate->time_ns));
  EXPECT_NEAR(estimate->state.velocity.norm(), truth.velocity.norm(), 0.05);
}

TEST(SlamStart, LeavesBadInputAside) {
  const Device device = noisy(1);
  SlamStart start(for_consumer(), device.camera, ImuNoise{}, kGravity);
  EXPECT_EQ(start.outcome(), SlamStartOutcome::kNone);
  EXPECT_FALSE(start.solve());
  EXPECT_EQ(start.outcome(), SlamStartOutcome::kTooShort);
  ImuMeasurement imu;
  imu.time_ns = 0;
  start.push(imu);  // NaN
  imu.angular_velocity.setZero();
  imu.specific_force = {0, 0, kGravity};
  start.push(imu);
  start.push(imu);  // the same time
  imu.time_ns = -5;
  start.push(imu);
  imu.time_ns = kNoTime;
  start.push(imu);
  FeaturesMeasurement frame;
  frame.time_ns = 1'000'000;
  frame.features = {{1, {100, 100}}, {1, {200, 200}}, {-3, {100, 100}}, {4, {kUnknown, 3}}, {5, {300, 200}}};
  start.push(frame);
  start.push(frame);
  frame.time_ns = std::numeric_limits<TimeNs>::max();
  start.push(frame);
  imu.time_ns = from_seconds(0.05);
  start.push(imu);
  imu.time_ns = from_seconds(0.2);
  start.push(imu);  // 150 ms later
  EXPECT_EQ(start.counts().imu_not_finite, 1);
  EXPECT_EQ(start.counts().imu_not_later, 2);
  EXPECT_EQ(start.counts().bad_times, 2);
  EXPECT_EQ(start.counts().imu_gaps, 1);
  EXPECT_EQ(start.counts().frames_not_later, 1);
  EXPECT_EQ(start.counts().features_bad, 3);
  EXPECT_EQ(start.duration_s(), 0) << "the gap took the frame with it";
  // Frames without features.
  for (int i = 0; i < 200; ++i) {
    imu.time_ns += 5'000'000;
    start.push(imu);
    if (i % 10 != 0) continue;
    frame.time_ns = imu.time_ns;
    frame.features.clear();
    start.push(frame);
  }
  EXPECT_FALSE(start.solve());
  EXPECT_EQ(start.outcome(), SlamStartOutcome::kFewFeatures) << start.reason();
  start.reset();
  EXPECT_EQ(start.duration_s(), 0);
  EXPECT_EQ(start.outcome(), SlamStartOutcome::kNone);
}

TEST(SlamStart, ChecksItsOptions) {
  const Device device;
  const auto make = [&](const SlamStartOptions& o) { SlamStart(o, device.camera, ImuNoise{}, kGravity); };
  EXPECT_NO_THROW(make({}));
  EXPECT_THROW(make({.min_duration_s = 3}), std::invalid_argument);
  EXPECT_THROW(make({.min_frames = 2}), std::invalid_argument);
  EXPECT_THROW(make({.min_frames = 30}), std::invalid_argument);
  EXPECT_THROW(make({.sigma_px = 0}), std::invalid_argument);
  EXPECT_THROW(make({.max_sigma_ratio = 0.5}), std::invalid_argument);
  EXPECT_THROW(make({.min_inliers = kUnknown}), std::invalid_argument);
  EXPECT_THROW(make({.max_condition = -1}), std::invalid_argument);
  EXPECT_THROW(SlamStart({}, device.camera, ImuNoise{}, 0), std::invalid_argument);
  CameraCalibration camera = device.camera;
  camera.time_offset_s = 1e9;
  EXPECT_THROW(SlamStart({}, camera, ImuNoise{}, kGravity), std::invalid_argument);
  EXPECT_THROW(SlamStart({}, CameraCalibration{}, ImuNoise{}, kGravity), std::invalid_argument);
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

// Against the covariance of a state with copies of its poses, propagated as a whole.
TEST(SlamStart, CovarianceOfPosesIsThatOfClones) {
  const Camera camera(make_scenario("hand-held").cameras.at(0).calibration);
  slam_start::Problem problem = steps_only(camera);
  problem.noise = {1e-3, 2e-3, 3e-2, 4e-2, 0, 0};
  const Eigen::Vector3d bg(0.1, -0.05, 0.02);
  const Eigen::Vector3d ba(0.2, 0.1, -0.3);
  Eigen::MatrixXd P = Eigen::MatrixXd::Zero(kInertialDim, kInertialDim);
  InertialState state;
  std::size_t at = 0;
  for (std::size_t frame = 1; frame < problem.step_end.size(); ++frame) {
    for (; at < problem.step_end[frame]; ++at) {
      InertialStep step = problem.steps[at];
      step.angular_velocity -= bg;
      step.specific_force -= ba;
      const InertialJacobian f = propagate(state, step, Eigen::Vector3d::Zero(), ImuIntegration::kMidpoint);
      propagate_covariance(P, f, {1e-6 * step.dt_s, 9e-4 * step.dt_s, 0, 4e-6 * step.dt_s, 16e-4 * step.dt_s});
    }
    const Eigen::Index n = P.rows();
    P.conservativeResize(n + 6, n + 6);
    P.bottomRows(6) = P.topRows(6).eval();
    P.rightCols(6) = P.leftCols(6).eval();
  }
  const Eigen::MatrixXd expected = P.bottomRightCorner(18, 18);
  EXPECT_TRUE(test::near(slam_start::pose_covariance(problem, bg, ba), expected, 1e-12 * expected.maxCoeff()));
}

}  // namespace
}  // namespace loc
