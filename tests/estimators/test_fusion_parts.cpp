// Rest, start and search for the heading: the parts around the error-state filter, each for itself.
#include <gtest/gtest.h>

#include <numbers>

#include "libloc/core/check.hpp"
#include "libloc/estimators/fusion_start.hpp"
#include "libloc/estimators/heading_bank.hpp"
#include "libloc/estimators/stand_still.hpp"
#include "libloc/geometry/so3.hpp"
#include "tests/support/driven_circle.hpp"

namespace loc {
namespace {

using test::DrivenCircle;

constexpr double kRate = 100;
constexpr double kGravity = 9.80665;

// Part of the time from..to at which rest is told.
double share_at_rest(StandStillDetector& detector, const DrivenCircle& motion, double from, double to, Random& random,
                     double vibration = 0) {
  int rest = 0;
  int all = 0;
  for (double t = from; t < to; t += 1 / kRate) {
    ImuMeasurement imu = motion.imu(t, kRate, ImuNoise{}, random);
    imu.specific_force += vibration * random.normal3();
    rest += detector.update(imu, motion.gyroscope_bias, 1e-4) ? 1 : 0;
    ++all;
  }
  return static_cast<double>(rest) / all;
}

TEST(StandStill, TellsRestFromMotion) {
  DrivenCircle motion;
  motion.rest_s = 20;
  motion.gyroscope_bias = {0.02, -0.01, 0.015};
  motion.accelerometer_bias = {0.1, 0.2, -0.1};
  Random random(1);
  StandStillDetector detector({}, {}, kGravity);
  EXPECT_GT(share_at_rest(detector, motion, 0, 20, random), 0.95);
  EXPECT_NEAR(detector.statistic(), 6, 3) << "white noise of the densities";
  EXPECT_LT((detector.mean_rate() - motion.gyroscope_bias).norm(), 5 * detector.mean_rate_sigma());
  // The start is smooth: nothing vibrates, and the first half second is slower than 0.1 m/s^2.
  EXPECT_LT(share_at_rest(detector, motion, 20, 20.5, random), 0.9);
  EXPECT_EQ(share_at_rest(detector, motion, 21, 50, random), 0);
}

TEST(StandStill, VibrationIsNoRest) {
  DrivenCircle motion;
  motion.rest_s = 100;
  Random random(2);
  StandStillDetector detector({}, {}, kGravity);
  EXPECT_EQ(share_at_rest(detector, motion, 0, 20, random, 0.2), 0);
  EXPECT_GT(share_at_rest(detector, motion, 20, 30, random), 0.8);
}

TEST(StandStill, GlidingIsRestUntilASpeedSaysOtherwise) {
  DrivenCircle motion;
  motion.radius = std::numeric_limits<double>::infinity();
  motion.rest_s = 0;
  Random random(3);
  StandStillDetector detector({}, {}, kGravity);
  EXPECT_GT(share_at_rest(detector, motion, 10, 20, random), 0.8) << "what an IMU cannot know";
  const double before = detector.threshold();
  detector.confirm_speed(0.5, 0.3);
  EXPECT_EQ(detector.threshold(), before) << "may be zero";
  detector.confirm_speed(8, 0.3);
  EXPECT_FALSE(detector.at_rest());
  EXPECT_EQ(detector.false_alarms(), 1);
  EXPECT_LT(detector.threshold(), before);
  EXPECT_LT(share_at_rest(detector, motion, 20, 120, random), 0.01) << "learnt";
  detector.reset();
  EXPECT_LT(share_at_rest(detector, motion, 130, 140, random), 0.01) << "and kept";
}

TEST(StandStill, ASlowTurnOrAWrongForceIsNoRest) {
  DrivenCircle motion;
  motion.rest_s = 1000;
  Random random(4);
  StandStillDetector turning({}, {}, kGravity);
  motion.gyroscope_bias = {0, 0, 0};
  int rest = 0;
  for (int i = 0; i < 500; ++i) {
    ImuMeasurement imu = motion.imu(i / kRate, kRate, ImuNoise{}, random);
    imu.angular_velocity.z() += 0.05;
    rest += turning.update(imu, Eigen::Vector3d::Zero(), 1e-4) ? 1 : 0;
  }
  EXPECT_EQ(rest, 0);
  motion.accelerometer_bias = {0, 0, 1};
  StandStillDetector lift({}, {}, kGravity);
  EXPECT_EQ(share_at_rest(lift, motion, 0, 5, random), 0);
}

TEST(StandStill, BadInputAndOptions) {
  StandStillDetector detector({}, {}, kGravity);
  ImuMeasurement imu;
  imu.time_ns = 5;
  EXPECT_FALSE(detector.update(imu, Eigen::Vector3d::Zero(), 0)) << "NaN";
  EXPECT_TRUE(std::isnan(detector.statistic()));
  detector.confirm_speed(kUnknown, kUnknown);
  StandStillOptions options;
  options.threshold = 5;
  EXPECT_THROW(StandStillDetector(options, {}, kGravity), std::invalid_argument);
  options = {};
  options.min_duration_s = 0.1;
  EXPECT_THROW(StandStillDetector(options, {}, kGravity), std::invalid_argument);
}

FusionStartEstimate start_of(const DrivenCircle& motion, double from, const FusionStartOptions& options = {},
                             const std::optional<Eigen::Vector3d>& field = std::nullopt) {
  Random random(5);
  ImuNoise noise;
  FusionStart start(options, {}, noise, kGravity);
  for (double t = from; t < from + 10; t += 1 / kRate) {
    if (field) {
      MagnetometerMeasurement m;
      m.time_ns = motion.time(t);
      m.magnetic_field = motion.at(t).T_world_body.rotation.inverse() * *field;
      start.push(m);
    }
    if (start.push(motion.imu(t, kRate, noise, random))) return start.estimate();
  }
  throw std::logic_error("never started");
}

// Errors against the truth at the start, in deviations of the covariance; the heading apart.
void expect_within_sigmas(const FusionStartEstimate& start, const DrivenCircle& motion, double from, double sigmas) {
  const auto truth = motion.at(from);
  const Eigen::Vector3d up = start.state.q_world_body.inverse() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d true_up = truth.T_world_body.rotation.inverse() * Eigen::Vector3d::UnitZ();
  const double tilt = std::acos(std::clamp(up.dot(true_up), -1.0, 1.0));
  const Eigen::Vector3d axis = up.unitOrthogonal();
  EXPECT_LT(tilt, sigmas * std::sqrt(axis.dot(start.covariance.block<3, 3>(kTheta, kTheta) * axis)));
  const Eigen::Vector3d bias = start.state.gyroscope_bias - motion.gyroscope_bias;
  EXPECT_LT(bias.cwiseAbs().maxCoeff(), sigmas * std::sqrt(start.covariance(kGyroscopeBias, kGyroscopeBias)));
  const Eigen::Vector3d velocity = start.state.velocity - truth.velocity;
  EXPECT_LT(velocity.cwiseAbs().maxCoeff(), sigmas * std::sqrt(start.covariance(kVelocity, kVelocity)));
}

TEST(FusionStart, LevelsAndFindsTheBiasAtRest) {
  DrivenCircle motion;
  motion.rest_s = 100;
  motion.q_vehicle_body = so3::exp({0.4, -1.2, 2.0});
  motion.gyroscope_bias = {0.01, -0.015, 0.008};
  motion.accelerometer_bias = {0.1, -0.1, 0.15};
  const FusionStartEstimate start = start_of(motion, 0);
  EXPECT_TRUE(start.at_rest);
  EXPECT_EQ(start.heading, HeadingSource::kNone);
  EXPECT_EQ(start.time_ns, motion.time(0));
  expect_within_sigmas(start, motion, 0, 4);
  EXPECT_LT(std::sqrt(start.covariance(kGyroscopeBias, kGyroscopeBias)), 4e-4);
  const Eigen::Vector3d up = start.state.q_world_body.inverse() * Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(up.dot(start.covariance.block<3, 3>(kTheta, kTheta) * up), 0, 1e-12) << "the heading defines the axes";
}

TEST(FusionStart, SurvivesAStartInMotion) {
  DrivenCircle motion;
  motion.rest_s = 0;
  motion.q_vehicle_body = so3::exp({0.1, 0.2, -1.0});
  motion.gyroscope_bias = {0.005, -0.005, 0.008};
  for (const double from : {1.5, 2.0, 3.0, 10.0}) {
    const FusionStartEstimate start = start_of(motion, from);
    EXPECT_FALSE(start.at_rest) << from;
    expect_within_sigmas(start, motion, from, 3);
    EXPECT_EQ(start.state.gyroscope_bias.norm(), 0) << "the mean rate is no bias";
  }
}

TEST(FusionStart, HeadingFromTheMagnetometerOrAsGiven) {
  DrivenCircle motion;
  motion.rest_s = 100;
  motion.q_vehicle_body = so3::exp({0.3, -0.2, 0});
  const double truth = so3::heading(motion.at(0).T_world_body.rotation);
  const double declination = 0.3;  // the field points east of north
  const Eigen::Vector3d field(20e-6 * std::sin(declination), 20e-6 * std::cos(declination), -40e-6);
  FusionStartOptions options;
  options.magnetic_declination = declination;
  const FusionStartEstimate magnetic = start_of(motion, 0, options, field);
  EXPECT_EQ(magnetic.heading, HeadingSource::kMagnetometer);
  EXPECT_NEAR(so3::heading(magnetic.state.q_world_body), truth, 0.02);
  EXPECT_NEAR(heading_variance({magnetic.state, 1, {}, {}}, magnetic.covariance), 0.04, 1e-12);

  options.heading = -2;
  const FusionStartEstimate given = start_of(motion, 0, options, field);
  EXPECT_EQ(given.heading, HeadingSource::kGiven);
  EXPECT_NEAR(so3::heading(given.state.q_world_body), -2, 1e-9);
  EXPECT_EQ(start_of(motion, 0, {}, Eigen::Vector3d(0, 0, -50e-6)).heading, HeadingSource::kNone) << "a vertical field";
}

TEST(FusionStart, BeginsAnewAfterAGapAndWithoutGravity) {
  DrivenCircle motion;
  motion.rest_s = 100;
  Random random(6);
  FusionStart start({}, {}, {}, kGravity);
  EXPECT_THROW(start.estimate(), std::invalid_argument);
  for (double t = 0; t < 0.9; t += 0.01) EXPECT_FALSE(start.push(motion.imu(t, kRate, {}, random)));
  for (double t = 5; t < 5.99; t += 0.01) EXPECT_FALSE(start.push(motion.imu(t, kRate, {}, random))) << t;
  EXPECT_TRUE(start.push(motion.imu(6.001, kRate, {}, random)));
  EXPECT_EQ(start.estimate().time_ns, motion.time(5));
  EXPECT_EQ(start.repeated(), 1);

  FusionStart falling({}, {}, {}, kGravity);
  for (double t = 0; t < 3; t += 0.01) {
    ImuMeasurement imu = motion.imu(t, kRate, {}, random);
    imu.specific_force.setConstant(0.01);
    EXPECT_FALSE(falling.push(imu));
  }
  EXPECT_GE(falling.repeated(), 2);
  FusionStartOptions wrong;
  wrong.duration_s = 0;
  EXPECT_THROW(FusionStart(wrong, {}, {}, kGravity), std::invalid_argument);
}

// Feeds a bank from the truth turned to heading 0, as it starts when nobody knows the heading.
struct BankRun {
  DrivenCircle motion;
  HeadingBank bank{{}, [] {
                     ErrorStateOptions options;
                     options.estimate_scale = false;
                     return options;
                   }()};
  Random random{7};
  double decided_at = -1;
  LocalFrame world{0.7, 0.1, 200};

  void run(double until, double outlier_at = -1) {
    const auto first = motion.at(0);
    ErrorStateState state;
    const double heading = so3::heading(first.T_world_body.rotation);
    state.inertial.q_world_body =
        Eigen::Quaterniond(Eigen::AngleAxisd(-heading, Eigen::Vector3d::UnitZ())) * first.T_world_body.rotation;
    Eigen::VectorXd sigmas(kInertialDim);
    sigmas << 0.02, 0.02, 0.02, 2, 2, 2, 20, 20, 20, 1e-3, 1e-3, 1e-3, 0.1, 0.1, 0.1;
    bank.start_all_headings(motion.time(0), state, sigmas.cwiseAbs2().asDiagonal());
    for (int i = 0; i <= until * kRate; ++i) {
      const double t = i / kRate;
      EXPECT_NE(bank.predict(motion.imu(t, kRate, {}, random)), PredictOutcome::kNotFinite);
      if (i % 100 == 0) {
        const GpsMeasurement gps = motion.gps(t, 1.5, 0, world, random);
        Eigen::Vector3d position = world.to_local({gps.latitude, gps.longitude, gps.altitude});
        if (std::abs(t - outlier_at) < 0.1) position.x() += 200;
        bank.fuse([&](ErrorStateFilter& one) { return one.fuse_gps(gps.time_ns, position, gps.position_cov); });
      }
      if (bank.decide()) decided_at = t;
    }
  }
  double heading_error() const {
    const Eigen::Quaterniond& q = bank.best().state().inertial.q_world_body;
    const double t = to_seconds(bank.best().time_ns() - motion.start_ns);
    return std::remainder(so3::heading(q) - so3::heading(motion.at(t).T_world_body.rotation), 2 * std::numbers::pi);
  }
};

TEST(HeadingBank, FindsTheHeadingFromGpsWhateverTheMounting) {
  for (int i = 0; i < 6; ++i) {
    BankRun r;
    r.random = Random(100 + static_cast<std::uint64_t>(i));
    r.motion.heading0 = -3 + i;
    r.motion.q_vehicle_body = so3::exp({0.2 * i, -0.1 * i, 1.1 * i});
    r.run(30, i == 3 ? 9 : -1);
    EXPECT_EQ(r.bank.size(), 1U) << i;
    EXPECT_GT(r.decided_at, r.motion.rest_s) << i;
    const double sigma = std::sqrt(r.bank.heading_variance());
    EXPECT_LT(sigma, 0.1) << i;
    EXPECT_LT(std::abs(r.heading_error()), 4 * sigma) << i;
  }
}

TEST(HeadingBank, WaitsWhileNothingTellsTheHeading) {
  BankRun rest;
  rest.motion.rest_s = 1000;
  rest.run(40);
  EXPECT_EQ(rest.bank.size(), 12U);
  EXPECT_GT(std::sqrt(rest.bank.heading_variance()), 1.2) << "any of them, and it says so";
}

TEST(HeadingBank, TurningKeepsTheCovarianceConsistent) {
  ErrorStateState state;
  state.inertial.q_world_body = so3::exp({0.3, -0.5, 1});
  state.inertial.velocity = {3, 4, 1};
  Random random(8);
  Eigen::MatrixXd root(kInertialDim, kInertialDim);
  for (double& x : root.reshaped()) x = random.normal();
  const Eigen::MatrixXd before = root * root.transpose();
  Eigen::MatrixXd after = before;
  ErrorStateState turned = state;
  turn_heading(0.8, 0, turned, after);
  // Back again: nothing is lost.
  turn_heading(-0.8, 0, turned, after);
  EXPECT_LT((after - before).norm(), 1e-12);
  EXPECT_LT(so3::angle_between(turned.inertial.q_world_body, state.inertial.q_world_body), 1e-7);
  // A turn by sigma moves theta and v as the added direction says.
  Eigen::MatrixXd only = Eigen::MatrixXd::Zero(kInertialDim, kInertialDim);
  turned = state;
  turn_heading(0, 1, turned, only);
  ErrorStateState moved = state;
  Eigen::MatrixXd ignored = Eigen::MatrixXd::Zero(kInertialDim, kInertialDim);
  constexpr double kStep = 1e-6;
  turn_heading(kStep, 0, moved, ignored);
  Eigen::VectorXd direction = Eigen::VectorXd::Zero(kInertialDim);
  direction.segment<3>(kTheta) = so3::boxminus(moved.inertial.q_world_body, state.inertial.q_world_body) / kStep;
  direction.segment<3>(kVelocity) = (moved.inertial.velocity - state.inertial.velocity) / kStep;
  EXPECT_LT((only - direction * direction.transpose()).norm(), 1e-4);
}

TEST(HeadingBank, OptionsAreChecked) {
  HeadingBankOptions options;
  options.headings = 3;
  EXPECT_THROW(HeadingBank(options, {}), std::invalid_argument);
  options = {};
  options.separation = -1;
  EXPECT_THROW(HeadingBank(options, {}), std::invalid_argument);
}

}  // namespace
}  // namespace loc
