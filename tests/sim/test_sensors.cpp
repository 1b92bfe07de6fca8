// Simulated odometry, GPS and magnetometer: each error is what its model says, and nothing else changes when it does.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/geometry/so3.hpp"
#include "libloc/sim/gps.hpp"
#include "libloc/sim/magnetometer.hpp"
#include "libloc/sim/noise.hpp"
#include "libloc/sim/visual_odometry.hpp"
#include "tests/support/noise_statistics.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/wobble_motion.hpp"

namespace loc {
namespace {

using test::correlation;
using test::mean;
using test::near;
using test::RestingMotion;
using test::sigma;
using test::Vectors;
using test::WobbleMotion;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct OdometryRun {
  std::vector<OdometryMeasurement> measurements;
  std::vector<VisualOdometryTruth> truth;  // of every frame
};

OdometryRun run_odometry(const VisualOdometryModel& model, const Motion& motion, int frames, std::uint64_t seed) {
  VisualOdometrySimulator simulator(model, Random(seed));
  OdometryRun run;
  for (int k = 0; k < frames; ++k) {
    if (const auto m = simulator.measure(motion.at(k / model.rate_hz))) run.measurements.push_back(*m);
    run.truth.push_back(simulator.truth());
  }
  return run;
}

TEST(SimulatedOdometry, ScalesTheTruth) {
  const WobbleMotion motion;
  VisualOdometryModel model = VisualOdometryModel::perfect();
  model.scale = 2;
  const OdometryRun run = run_odometry(model, motion, 200, 1);
  ASSERT_EQ(run.measurements.size(), 200);
  for (const OdometryMeasurement& m : run.measurements) {
    const MotionState s = motion.at(to_seconds(m.time_ns));
    EXPECT_TRUE(near(m.position, 2 * s.T_world_body.translation, 1e-12));
    EXPECT_LT(so3::angle_between(m.rotation, s.T_world_body.rotation), 1e-12);
    EXPECT_EQ(m.start_time_ns, kNoTime);
    EXPECT_EQ(m.host_time_ns, m.time_ns);
    EXPECT_TRUE(near(m.position_cov, 1e-4 * Eigen::Matrix3d::Identity(), 1e-18));
    EXPECT_TRUE(near(m.orientation_cov, 1e-4 * Eigen::Matrix3d::Identity(), 1e-18));
  }
}

TEST(SimulatedOdometry, DriftAndNoiseAreTheExamples) {
  const VisualOdometryModel model;
  EXPECT_DOUBLE_EQ(model.drift_sigma * model.drift_sigma, 1.34);
  EXPECT_DOUBLE_EQ(model.drift_step_sigma(), std::sqrt(2.0 / 232 + 1.0 / (232.0 * 232.0)) * std::sqrt(1.34));
  const OdometryRun run = run_odometry(model, RestingMotion(), 200'000, 2);  // 862 time constants
  Vectors drift;
  Vectors noise;
  for (std::size_t k = 0; k < run.truth.size(); ++k) {
    drift.push_back(run.truth[k].drift);
    noise.push_back(run.measurements[k].position - run.truth[k].drift);
  }
  EXPECT_NEAR(sigma(noise) / 0.139, 1, 0.005);
  EXPECT_NEAR(correlation(noise, 1), 0, 0.006);
  // Stationary variance of the discrete recursion: sigma_A^2 / (1 - phi^2) = sigma_B^2 (1 + 1/(2 tau)) / (1 - 1/(2
  // tau))
  EXPECT_NEAR(sigma(drift) / std::sqrt(1.34), 1, 0.05);
  EXPECT_NEAR(correlation(drift, 232), std::pow(1 - 1.0 / 232, 232), 0.06);
  // One step of it, exactly.
  const Eigen::Vector3d step = drift[1] - (1 - 1.0 / 232) * drift[0];
  EXPECT_LT(step.norm(), 6 * model.drift_step_sigma());
}

TEST(SimulatedOdometry, DriftStartsWhereAskedAndForgets) {
  VisualOdometryModel model = VisualOdometryModel::perfect();
  model.drift_start = {5, 0, -1};
  model.drift_frames = 10;
  const OdometryRun run = run_odometry(model, RestingMotion(), 3, 2);
  EXPECT_TRUE(near(run.measurements[2].position, 0.9 * 0.9 * 0.9 * model.drift_start, 1e-12));
}

TEST(SimulatedOdometry, ScaleWandersAlongTheWay) {
  VisualOdometryModel model = VisualOdometryModel::perfect();
  model.scale_walk = 0.05;
  Vectors logs;
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    const OdometryRun run = run_odometry(model, RestingMotion(), 26, seed);
    logs.emplace_back(Eigen::Vector3d::Constant(std::log(run.truth.back().scale)));
  }
  EXPECT_NEAR(sigma(logs) / 0.05, 1, 0.05);  // after one second

  const WobbleMotion motion;
  const OdometryRun run = run_odometry(model, motion, 100, 3);
  for (std::size_t k = 1; k < 100; ++k) {
    const double dt = 1 / model.rate_hz;
    const Eigen::Vector3d piece = motion.at(static_cast<double>(k) * dt).T_world_body.translation -
                                  motion.at(static_cast<double>(k - 1) * dt).T_world_body.translation;
    EXPECT_TRUE(
        near(run.measurements[k].position - run.measurements[k - 1].position, run.truth[k].scale * piece, 1e-12));
  }
}

TEST(SimulatedOdometry, OrientationNoiseOutliersLatency) {
  VisualOdometryModel model = VisualOdometryModel::perfect();
  model.sigma_orientation = 0.02;
  model.outlier_fraction = 0.1;
  model.outlier_position = 30;
  model.latency_s = 0.08;
  model.stamp_delay_s = 0.01;
  const OdometryRun run = run_odometry(model, RestingMotion(), 20'000, 4);
  Vectors turns;
  Vectors jumps;
  int outliers = 0;
  for (std::size_t k = 0; k < run.measurements.size(); ++k) {
    const OdometryMeasurement& m = run.measurements[k];
    turns.push_back(so3::log(m.rotation));
    if (run.truth[k].outlier) {
      ++outliers;
      jumps.push_back(m.position);
    } else {
      EXPECT_EQ(m.position, Eigen::Vector3d::Zero());
    }
    EXPECT_EQ(m.time_ns, static_cast<TimeNs>(k) * 40'000'000 + 10'000'000);
    EXPECT_EQ(m.host_time_ns, static_cast<TimeNs>(k) * 40'000'000 + 80'000'000);
  }
  EXPECT_NEAR(sigma(turns) / 0.02, 1, 0.01);
  EXPECT_NEAR(outliers / 20'000.0, 0.1, 0.007);
  EXPECT_NEAR(sigma(jumps) / 30, 1, 0.04);
}

TEST(SimulatedOdometry, OutagesAndOutliersLeaveTheOtherFramesAsTheyWere) {
  const WobbleMotion motion;
  VisualOdometryModel model;
  const OdometryRun before = run_odometry(model, motion, 100, 5);
  model.outages = {{1, 2}, {3, 3.5}};
  const OdometryRun after = run_odometry(model, motion, 100, 5);
  EXPECT_EQ(after.measurements.size(), 100 - 25 - 13);
  for (const OdometryMeasurement& m : after.measurements) {
    EXPECT_FALSE(contains(model.outages, to_seconds(m.time_ns)));
    const auto k = static_cast<std::size_t>(m.time_ns / 40'000'000);
    EXPECT_EQ(m.position, before.measurements[k].position);
  }
  model.outages.clear();
  model.outlier_fraction = 0.2;
  const OdometryRun outliers = run_odometry(model, motion, 100, 5);
  int same = 0;
  for (std::size_t k = 0; k < 100; ++k) {
    if (!outliers.truth[k].outlier) {
      EXPECT_EQ(outliers.measurements[k].position, before.measurements[k].position);
      ++same;
    }
  }
  EXPECT_GT(same, 60);
  EXPECT_LT(same, 100);
}

TEST(SimulatedOdometry, RelativePosesAddUp) {
  const WobbleMotion motion;
  VisualOdometryModel model = VisualOdometryModel::perfect();
  model.scale = 0.5;
  model.relative = true;
  const OdometryRun run = run_odometry(model, motion, 101, 6);
  ASSERT_EQ(run.measurements.size(), 100);
  Pose3 sum = motion.at(0).T_world_body;
  for (const OdometryMeasurement& m : run.measurements) {
    EXPECT_EQ(m.start_time_ns, m.time_ns - 40'000'000);
    sum = sum * Pose3{m.rotation, m.position / 0.5};
  }
  EXPECT_TRUE(near(sum.matrix(), motion.at(4).T_world_body.matrix(), 1e-11));

  model.outages = {{1, 2}};
  const OdometryRun gap = run_odometry(model, motion, 101, 6);
  EXPECT_EQ(gap.measurements.size(), 100 - 25 - 1);  // nothing bridges the outage
  for (const OdometryMeasurement& m : gap.measurements) EXPECT_EQ(m.start_time_ns, m.time_ns - 40'000'000);

  model.outages.clear();
  model.sigma_position = 0.02;
  const OdometryRun noisy = run_odometry(model, RestingMotion(), 30'001, 7);
  Vectors steps;
  for (const OdometryMeasurement& m : noisy.measurements) steps.push_back(m.position);
  EXPECT_NEAR(sigma(steps) / 0.02, 1, 0.01);
  EXPECT_NEAR(correlation(steps, 1), 0, 0.015);
}

TEST(SimulatedOdometry, RelativeOfTwoAbsoluteOnes) {
  const WobbleMotion motion;
  VisualOdometryModel model = VisualOdometryModel::perfect();
  model.sigma_position = 0.01;
  model.sigma_orientation = 0.03;
  model.told_sigma_orientation = 0.03;
  VisualOdometrySimulator simulator(model, Random(8));
  // The covariance told is that of the errors, over many draws of the same two poses.
  Vectors position_errors;
  Vectors turn_errors;
  Eigen::Matrix3d told = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d sample = Eigen::Matrix3d::Zero();
  const Pose3 truth = motion.at(0.1).T_world_body.inverse() * motion.at(1.9).T_world_body;
  constexpr int kDraws = 4000;
  for (int i = 0; i < kDraws; ++i) {
    MotionState a = motion.at(0.1);
    MotionState b = motion.at(1.9);
    a.time_s += 4 * i;
    b.time_s += 4 * i;
    // The way between the draws is not of interest: each pair starts where the sum of pieces stands.
    const OdometryMeasurement start = *simulator.measure(a);
    const OdometryMeasurement end = *simulator.measure(b);
    const OdometryMeasurement m = relative_odometry(start, end);
    EXPECT_EQ(m.start_time_ns, start.time_ns);
    EXPECT_EQ(m.time_ns, end.time_ns);
    const Eigen::Vector3d e = m.position - truth.translation;
    sample += e * e.transpose() / kDraws;
    told += m.position_cov / kDraws;
    turn_errors.push_back(so3::boxminus(m.rotation, truth.rotation));
    EXPECT_TRUE(near(m.orientation_cov, 2 * 9e-4 * Eigen::Matrix3d::Identity(), 1e-15));
  }
  EXPECT_TRUE(near(sample, told, 0.08 * told.norm()));
  EXPECT_NEAR(sigma(turn_errors) / (0.03 * std::sqrt(2)), 1, 0.03);
  OdometryMeasurement relative;
  relative.start_time_ns = 0;
  relative.time_ns = 1;
  EXPECT_THROW(relative_odometry(relative, relative), std::invalid_argument);
  EXPECT_THROW(relative_odometry(OdometryMeasurement{}, OdometryMeasurement{}), std::invalid_argument);
}

TEST(SimulatedOdometry, OwnAxes) {
  const WobbleMotion motion;
  VisualOdometryModel model = VisualOdometryModel::perfect();
  model.T_body_odometry = {so3::exp({0.1, -0.2, 0.3}), {1, 0.5, -0.2}};
  const OdometryMeasurement m = *VisualOdometrySimulator(model, Random(1)).measure(motion.at(1.5));
  const Pose3 expected = motion.at(1.5).T_world_body * model.T_body_odometry;
  EXPECT_TRUE(near(m.position, expected.translation, 1e-13));
  EXPECT_LT(so3::angle_between(m.rotation, expected.rotation), 1e-13);
}

TEST(SimulatedOdometry, RefusesWhatMakesNoSense) {
  const auto refused = [](const std::function<void(VisualOdometryModel&)>& change) {
    VisualOdometryModel model;
    change(model);
    EXPECT_THROW(VisualOdometrySimulator(model, Random(1)), std::invalid_argument);
  };
  refused([](VisualOdometryModel& m) { m.rate_hz = kNan; });
  refused([](VisualOdometryModel& m) { m.scale = 0; });
  refused([](VisualOdometryModel& m) { m.drift_frames = 0.5; });
  refused([](VisualOdometryModel& m) { m.sigma_position = -0.1; });
  refused([](VisualOdometryModel& m) { m.outlier_fraction = 1.1; });
  refused([](VisualOdometryModel& m) { m.latency_s = -1; });
  refused([](VisualOdometryModel& m) { m.outages = {{5, 5}}; });
  refused([](VisualOdometryModel& m) { m.outages = {{-1, 5}}; });
  refused([](VisualOdometryModel& m) { m.told_sigma_position = 0; });
  refused([](VisualOdometryModel& m) { m.T_body_odometry.rotation.coeffs() *= 2; });
  refused([](VisualOdometryModel& m) { m.drift_start.x() = kNan; });
  VisualOdometrySimulator simulator(VisualOdometryModel{}, Random(1));
  simulator.measure(MotionState{});
  EXPECT_THROW(simulator.measure(MotionState{}), std::invalid_argument);
}

std::vector<GpsMeasurement> run_gps(const GpsModel& model, const Motion& motion, int epochs, std::uint64_t seed) {
  GpsSimulator simulator(model, Random(seed));
  std::vector<GpsMeasurement> out;
  for (int k = 0; k < epochs; ++k) {
    if (const auto m = simulator.measure(motion.at(k / model.rate_hz))) out.push_back(*m);
  }
  return out;
}

GpsModel perfect_gps() {
  GpsModel m;
  m.sigma_horizontal = m.sigma_vertical = m.sigma_velocity_horizontal = m.sigma_velocity_vertical = 0;
  return m;
}

TEST(SimulatedGps, TellsPlaceAndVelocityOfTheAntenna) {
  const WobbleMotion motion;
  GpsModel model = perfect_gps();
  model.rate_hz = 10;
  model.antenna_in_body = {0.4, -0.3, 1.2};
  model.latency_s = 0.15;
  const LocalFrame frame(model.origin);
  const std::vector<GpsMeasurement> fixes = run_gps(model, motion, 50, 1);
  ASSERT_EQ(fixes.size(), 50);
  for (const GpsMeasurement& m : fixes) {
    const double t = to_seconds(m.time_ns);
    const auto antenna = [&](double at) { return motion.at(at).T_world_body * model.antenna_in_body; };
    EXPECT_TRUE(near(frame.to_local(m.latitude, m.longitude, m.altitude), antenna(t), 1e-8));
    // Its velocity is the derivative of its position.
    const double d = 1e-4;
    if (t > 0) {
      EXPECT_TRUE(near(m.velocity_enu, (antenna(t + d) - antenna(t - d)) / (2 * d), 1e-5));
    }
    EXPECT_EQ(m.host_time_ns, m.time_ns + 150'000'000);
    EXPECT_EQ(m.gps_time_ns, model.start_gps_time_ns + m.time_ns);
    EXPECT_EQ(m.fix, GpsFixType::k3d);
    EXPECT_EQ(m.satellites, 9);
  }
  model.with_velocity = false;
  EXPECT_TRUE(run_gps(model, motion, 1, 1)[0].velocity_enu.array().isNaN().all());
}

TEST(SimulatedGps, ErrorsAreEastNorthUpOfThePlace) {
  // 100 km north of the origin up leans 0.9 degrees: errors of altitude there are not errors of z.
  struct Far final : Motion {
    double duration_s() const override { return 1e9; }
    MotionState at(double t) const override {
      MotionState s;
      s.time_s = t;
      s.T_world_body.translation = {0, 1e5, 0};
      s.velocity = {0, 0, 1};
      return s;
    }
  };
  GpsModel model = perfect_gps();
  const GpsMeasurement exact = run_gps(model, Far(), 1, 1)[0];
  EXPECT_NEAR(exact.velocity_enu.y(), -std::sin(1e5 / 6.37e6), 1e-4);  // north there leans down, seen from the origin
  model.sigma_vertical = 100;
  const GpsMeasurement off = run_gps(model, Far(), 1, 1)[0];
  EXPECT_NEAR(off.latitude, exact.latitude, 1e-12);
  EXPECT_NEAR(off.longitude, exact.longitude, 1e-12);
  EXPECT_GT(std::abs(off.altitude - exact.altitude), 1);
}

TEST(SimulatedGps, WhiteAndColouredErrors) {
  GpsModel model;
  model.coloured_sigma_horizontal = 1.5;
  model.coloured_sigma_vertical = 3;
  model.coloured_time_s = 20;
  const LocalFrame frame(model.origin);
  GpsSimulator simulator(model, Random(3));
  Vectors white;
  Vectors coloured;
  Vectors velocity;
  for (int k = 0; k < 40'000; ++k) {
    const GpsMeasurement m = *simulator.measure(RestingMotion().at(k));
    const Eigen::Vector3d error = frame.to_local(m.latitude, m.longitude, m.altitude);
    const Eigen::Vector3d c = simulator.truth().coloured_error;
    coloured.emplace_back(c.cwiseQuotient(Eigen::Vector3d(1.5, 1.5, 3)));
    white.emplace_back((error - c).cwiseQuotient(Eigen::Vector3d(2, 2, 4)));
    velocity.emplace_back(m.velocity_enu.cwiseQuotient(Eigen::Vector3d(0.1, 0.1, 0.2)));
    if (k == 0) {
      EXPECT_TRUE(near(m.position_cov.diagonal(), Eigen::Vector3d(6.25, 6.25, 25), 1e-12));
      EXPECT_TRUE(near(m.velocity_cov.diagonal(), Eigen::Vector3d(0.01, 0.01, 0.04), 1e-12));
    }
  }
  EXPECT_NEAR(sigma(white), 1, 0.01);
  EXPECT_NEAR(correlation(white, 1), 0, 0.015);
  EXPECT_NEAR(sigma(coloured), 1, 0.05);
  EXPECT_NEAR(correlation(coloured, 20), std::exp(-1), 0.06);
  EXPECT_NEAR(sigma(velocity), 1, 0.01);
}

TEST(SimulatedGps, OutagesLeaveTheOtherFixesAsTheyWere) {
  GpsModel model = GpsModel::single();
  const auto before = run_gps(model, WobbleMotion(), 60, 4);
  model.outages = {{20, 30}};
  const auto after = run_gps(model, WobbleMotion(), 60, 4);
  ASSERT_EQ(before.size(), 60);
  ASSERT_EQ(after.size(), 50);
  EXPECT_EQ(after[19].time_ns, 19'000'000'000);
  EXPECT_EQ(after[20].time_ns, 30'000'000'000);
  EXPECT_EQ(after[20].latitude, before[30].latitude);
  EXPECT_EQ(after[49].velocity_enu, before[59].velocity_enu);
}

TEST(SimulatedGps, RefusesWhatMakesNoSense) {
  const auto refused = [](const std::function<void(GpsModel&)>& change) {
    GpsModel model = GpsModel::rtk();
    EXPECT_NO_THROW(GpsSimulator(model, Random(1)));
    change(model);
    EXPECT_THROW(GpsSimulator(model, Random(1)), std::invalid_argument);
  };
  refused([](GpsModel& m) { m.rate_hz = -1; });
  refused([](GpsModel& m) { m.sigma_horizontal = kNan; });
  refused([](GpsModel& m) { m.coloured_time_s = 0; });
  refused([](GpsModel& m) { m.origin.latitude = 43.6; });
  refused([](GpsModel& m) { m.antenna_in_body.z() = kNan; });
  refused([](GpsModel& m) { m.outages = {{3, 1}}; });
  refused([](GpsModel& m) { m.fix = GpsFixType::kNone; });
  refused([](GpsModel& m) { m.latency_s = kNan; });
}

TEST(SimulatedMagnetometer, FieldThroughTheSensor) {
  const WobbleMotion motion;
  MagnetometerModel model;
  model.sigma = 0;
  model.hard_iron = {1e-5, -2e-5, 3e-5};
  model.soft_iron << 1.1, 0.05, 0, 0.05, 0.9, 0.02, 0, 0.02, 1;
  MagnetometerSimulator simulator(model, Random(1));
  for (const double t : {0.0, 1.0, 2.5}) {
    const MotionState s = motion.at(t);
    const MagnetometerMeasurement m = simulator.measure(s);
    EXPECT_EQ(m.time_ns, from_seconds(t));
    const Eigen::Vector3d body = s.T_world_body.rotation.toRotationMatrix().transpose() * model.field;
    EXPECT_TRUE(near(m.magnetic_field, model.soft_iron * body + model.hard_iron, 1e-18));
    EXPECT_TRUE(near(model.calibration().triad.apply(m.magnetic_field), body, 1e-18));
  }
}

TEST(SimulatedMagnetometer, NoiseRangeResolution) {
  MagnetometerModel model;
  model.sigma = 2e-7;
  MagnetometerSimulator simulator(model, Random(2));
  Vectors errors;
  for (int k = 0; k < 20'000; ++k) {
    errors.push_back(simulator.measure(RestingMotion().at(0.02 * k)).magnetic_field - model.field);
  }
  EXPECT_NEAR(sigma(errors) / 2e-7, 1, 0.01);
  model.sigma = 0;
  model.range = 40e-6;
  model.resolution = 5e-6;
  EXPECT_TRUE(near(MagnetometerSimulator(model, Random(1)).measure(MotionState{}).magnetic_field,
                   Eigen::Vector3d(0, 20e-6, -40e-6), 1e-18));
}

TEST(SimulatedMagnetometer, Disturbances) {
  MagnetometerModel model;
  model.sigma = 0;
  model.disturbances = {{{2, 3}, {1e-5, 0, 0}}};
  const MagnetometerSimulator simulator(model, Random(1));
  EXPECT_EQ(simulator.true_field(1.9, {0, 0, 0}), model.field);
  EXPECT_EQ(simulator.true_field(2, {0, 0, 0}), model.field + Eigen::Vector3d(1e-5, 0, 0));
  EXPECT_EQ(simulator.true_field(3, {0, 0, 0}), model.field);

  // On the axis of a dipole mu0 m / (2 pi r^3) along it, beside it half of that against it.
  const MagneticDipole dipole{{1, 2, 3}, {0, 0, 100}, 0.5};
  EXPECT_TRUE(near(dipole.field_at({1, 2, 5}), Eigen::Vector3d(0, 0, 2e-7 * 100 / 8), 1e-20));
  EXPECT_TRUE(near(dipole.field_at({3, 2, 3}), Eigen::Vector3d(0, 0, -1e-7 * 100 / 8), 1e-20));
  EXPECT_TRUE(near(dipole.field_at({1, 2, 3.1}), dipole.field_at({1, 2, 3.5}), 1e-20));
  EXPECT_TRUE(dipole.field_at({1, 2, 3}).allFinite());
  // No magnetic charge: the field has no divergence.
  const Eigen::Vector3d at(2, 2.7, 3.9);
  double divergence = 0;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d d = 1e-4 * Eigen::Vector3d::Unit(i);
    divergence += (dipole.field_at(at + d) - dipole.field_at(at - d))[i] / 2e-4;
  }
  EXPECT_NEAR(divergence / dipole.field_at(at).norm(), 0, 1e-6);
  model.dipoles = {dipole};
  EXPECT_EQ(MagnetometerSimulator(model, Random(1)).true_field(0, {1, 2, 5}), model.field + dipole.field_at({1, 2, 5}));
}

TEST(SimulatedMagnetometer, RefusesWhatMakesNoSense) {
  const auto refused = [](const std::function<void(MagnetometerModel&)>& change) {
    MagnetometerModel model;
    change(model);
    EXPECT_THROW(MagnetometerSimulator(model, Random(1)), std::invalid_argument);
  };
  refused([](MagnetometerModel& m) { m.rate_hz = 0; });
  refused([](MagnetometerModel& m) { m.field.x() = kNan; });
  refused([](MagnetometerModel& m) { m.soft_iron.setZero(); });
  refused([](MagnetometerModel& m) { m.sigma = -1; });
  refused([](MagnetometerModel& m) { m.disturbances = {{{3, 2}, {0, 0, 0}}}; });
  refused([](MagnetometerModel& m) { m.dipoles = {{{0, 0, 0}, {0, 0, 1}, 0}}; });
  refused([](MagnetometerModel& m) { m.dipoles = {{{0, kNan, 0}, {0, 0, 1}, 1}}; });
}

TEST(SimulatedNoise, GaussMarkovDoesNotDependOnTheStep) {
  // The same process in steps of other lengths: the same deviation, from the first value on.
  for (const double dt : {0.01, 1.0, 50.0}) {
    Vectors values;
    for (std::uint64_t seed = 0; seed < 2000; ++seed) {
      GaussMarkov process(2, 10, Random(seed));
      for (int i = 0; i < 3; ++i) process.advance(dt);
      values.push_back(process.value());
    }
    EXPECT_NEAR(sigma(values) / 2, 1, 0.03) << dt;
  }
}

}  // namespace
}  // namespace loc
