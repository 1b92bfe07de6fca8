// The fusion estimator on simulated drives: start, GPS, odometry, gaps, bad input, recovery.
#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "libloc/core/check.hpp"
#include "libloc/estimators/inertial_fusion.hpp"
#include "libloc/geometry/so3.hpp"
#include "tests/support/driven_circle.hpp"
#include "tests/support/sources.hpp"

namespace loc {
namespace {

using test::count;
using test::DrivenCircle;

constexpr double kRate = 100;

// The preset for real sensors, with GPS errors as they are simulated here.
InertialFusionOptions white_fixes() {
  InertialFusionOptions options = InertialFusionOptions::robust();
  options.gps_correlation_time_s = 0;
  return options;
}

// A drive through the estimator: IMU at 100 Hz, GPS at 1 Hz (velocity if gps_velocity_sigma is positive), odometry at
// 10 Hz with a world of its own. Hooks change what is sent; an empty optional is left out.
struct Drive {
  DrivenCircle motion;
  InertialFusionOptions options = white_fixes();
  double duration_s = 60;
  double gps_sigma = 1.5;
  double gps_velocity_sigma = 0;
  double gps_latency_s = 0;
  bool gps = true;
  bool odometry = false;
  double scale = 2;
  double odometry_sigma = 0.05;
  double odometry_heading = 1.3;              // of its world against ours
  Eigen::Vector3d odometry_origin{5, -3, 1};  // of ours in it, times the scale
  std::function<bool(ImuMeasurement&, double)> change_imu = [](ImuMeasurement&, double) { return true; };
  std::function<bool(GpsMeasurement&, double)> change_gps = [](GpsMeasurement&, double) { return true; };
  std::function<bool(OdometryMeasurement&, double)> change_odometry = [](OdometryMeasurement&, double) { return true; };
  std::function<void(const InertialFusion&, const Estimate&, double)> look = [](const InertialFusion&, const Estimate&,
                                                                                double) {};

  std::optional<InertialFusion> fusion;
  std::vector<Estimate> estimates;
  std::uint32_t statuses = 0;  // all bits that were seen
  LocalFrame world{0.85, 0.2, 300};

  double time_of(const Estimate& e) const { return to_seconds(e.time_ns - motion.start_ns); }

  void run(std::uint64_t seed = 1) {
    Random random(seed);
    fusion.emplace(options);
    std::vector<std::pair<double, Measurement>> late;
    const auto send = [&](const Measurement& m, double t) {
      if (!fusion->process(m)) return;
      estimates.push_back(fusion->estimate());
      statuses |= estimates.back().status;
      look(*fusion, estimates.back(), t);
    };
    for (int i = 0; i <= duration_s * kRate; ++i) {
      const double t = i / kRate;
      if (gps && i % 100 == 0) {
        GpsMeasurement fix = motion.gps(t, gps_sigma, gps_velocity_sigma, world, random);
        if (change_gps(fix, t)) late.emplace_back(t + gps_latency_s, fix);
      }
      while (!late.empty() && late.front().first <= t) {
        send(late.front().second, t);
        late.erase(late.begin());
      }
      if (odometry && i % 10 == 0) {
        const auto truth = motion.at(t);
        const Eigen::Quaterniond turn(Eigen::AngleAxisd(odometry_heading, Eigen::Vector3d::UnitZ()));
        OdometryMeasurement m;
        m.time_ns = motion.time(t);
        m.position =
            scale * (turn * truth.T_world_body.translation) + odometry_origin + odometry_sigma * random.normal3();
        m.rotation = turn * truth.T_world_body.rotation * so3::exp(0.002 * random.normal3());
        m.position_cov = odometry_sigma * odometry_sigma * Eigen::Matrix3d::Identity();
        m.orientation_cov = 4e-6 * Eigen::Matrix3d::Identity();
        if (change_odometry(m, t)) send(m, t);
      }
      ImuMeasurement imu = motion.imu(t, kRate, options.filter.noise, random);
      if (change_imu(imu, t)) send(imu, t);
    }
  }

  // Error of position in GPS's world, whose origin is the first fix.
  Eigen::Vector3d position_error(const Estimate& e) const {
    const Eigen::Vector3d truth = motion.at(time_of(e)).T_world_body.translation;
    return LocalFrame(e.origin).to_local(world.to_geodetic(truth)) - e.position;
  }
  double heading_error(const Estimate& e) const {
    return std::remainder(so3::heading(e.q_world_body) - so3::heading(motion.at(time_of(e)).T_world_body.rotation),
                          2 * std::numbers::pi);
  }
  // NEES of position and velocity over the drive from a time on; 6 on average when the covariance is right.
  double mean_nees(double from) const {
    double sum = 0;
    int n = 0;
    for (const Estimate& e : estimates) {
      if (time_of(e) < from || n++ % 10 != 0) continue;
      Eigen::Matrix<double, 6, 1> error;
      error << position_error(e), motion.at(time_of(e)).velocity - e.velocity;
      sum += error.dot(e.covariance.block<6, 6>(kPosition, kPosition).llt().solve(error)) * 10;
    }
    return sum / n;
  }
};

DrivenCircle car() {
  DrivenCircle motion;
  motion.q_vehicle_body = so3::exp({0.1, -0.2, 2.2});
  motion.gyroscope_bias = {0.01, -0.008, 0.012};
  motion.accelerometer_bias = {0.08, -0.1, 0.12};
  return motion;
}

TEST(InertialFusion, StartsAtRestAndFindsWhereAndWhitherItIsByGpsAlone) {
  Drive d;
  d.motion = car();
  d.options.gps_antenna = {0, 0, 0};
  bool heading_at_rest = false;
  d.look = [&](const InertialFusion&, const Estimate& e, double t) {
    if (t < d.motion.rest_s && (e.valid & kValidHeading) != 0) heading_at_rest = true;
    EXPECT_TRUE(e.position.allFinite() && e.q_world_body.coeffs().allFinite());
  };
  d.run();
  EXPECT_FALSE(heading_at_rest);
  EXPECT_EQ(d.estimates.front().time_ns, d.motion.time(1)) << "after the first second";
  EXPECT_NE(d.statuses & kAtRest, 0U);
  const Estimate& last = d.estimates.back();
  EXPECT_NE(last.valid & kValidHeading, 0U);
  EXPECT_EQ(last.status, 0U);
  EXPECT_LT(std::abs(d.heading_error(last)), 0.06);
  // The first fix is the origin, with its own error.
  EXPECT_LT(d.position_error(last).norm(), 5);
  EXPECT_LT((d.motion.at(60).velocity - last.velocity).norm(), 0.6);
  EXPECT_LT((last.gyroscope_bias - d.motion.gyroscope_bias).norm(), 2e-3);
  EXPECT_EQ(count(d.fusion->counts(), "gps.anchored"), 1);
  EXPECT_EQ(count(d.fusion->counts(), "heading.found"), 1);
  EXPECT_EQ(count(d.fusion->counts(), "gps.gated"), 0);
}

TEST(InertialFusion, ErrorsAreWhatTheCovarianceSays) {
  double sum = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Drive d;
    d.motion = car();
    d.motion.heading0 = static_cast<double>(seed);
    d.options.origin = d.world.origin();
    d.gps_velocity_sigma = seed % 2 == 0 ? 0.2 : 0;
    d.run(seed);
    sum += d.mean_nees(25);
  }
  EXPECT_GT(sum / 12, 3.5);
  EXPECT_LT(sum / 12, 8.5);
}

TEST(InertialFusion, StartsInMotion) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Drive d;
    d.motion = car();
    d.motion.rest_s = -10;
    d.gps_velocity_sigma = 0.2;
    d.run(seed);
    const Estimate& last = d.estimates.back();
    EXPECT_NE(last.valid & kValidHeading, 0U) << seed;
    // On a steady circle heading and accelerometer bias are hard to tell apart.
    EXPECT_LT(std::abs(d.heading_error(last)), 0.3) << seed;
    EXPECT_LT(d.position_error(last).norm(), 6) << seed;
    EXPECT_LT((d.motion.at(60).velocity - last.velocity).norm(), 0.6) << seed;
    EXPECT_EQ(d.statuses & kAtRest, 0U) << seed;
  }
}

// Velocity and scale can only be found together then, and a filter that linearises gets them wrong: not valid.
TEST(InertialFusion, AStartInMotionWithOdometryAloneIsNotTrusted) {
  Drive d;
  d.motion = car();
  d.gps = false;
  d.odometry = true;
  d.duration_s = 20;
  d.run(1);
  EXPECT_NE(d.estimates.back().valid & kValidScale, 0U) << "from rest";
  d = Drive{};
  d.motion = car();
  d.motion.rest_s = -10;
  d.gps = false;
  d.odometry = true;
  d.duration_s = 20;
  d.run(1);
  EXPECT_EQ(d.estimates.back().valid & (kValidScale | kValidPosition | kValidVelocity), 0U);
  EXPECT_EQ(d.statuses & kAtRest, 0U);
}

TEST(InertialFusion, OdometryThatKnowsNoCovarianceIsRefused) {
  for (const double wrong : {-1.0, 1e308}) {
    Drive d;
    d.motion = car();
    d.gps = false;
    d.odometry = true;
    d.duration_s = 10;
    d.change_odometry = [=](OdometryMeasurement& o, double) {
      o.orientation_cov = wrong * Eigen::Matrix3d::Identity();
      return true;
    };
    std::int64_t refused = 0;
    d.look = [&](const InertialFusion& fusion, const Estimate&, double) {
      for (const NamedCount& count : fusion.counts()) {
        if (count.name == "odometry.bad_covariance") refused = count.value;
      }
    };
    d.run(1);
    EXPECT_GT(refused, 50);
    EXPECT_NE(d.statuses & kBadCovariance, 0U);
  }
}

TEST(InertialFusion, LeverArmAndLatencyAreTakenIntoAccount) {
  for (const double latency : {0.0, 0.25}) {
    Drive d;
    d.motion = car();
    d.gps_sigma = 0.05;
    d.options.origin = d.world.origin();
    d.options.gps_antenna = {1, 0.5, 2};
    d.gps_latency_s = latency;
    d.change_gps = [&](GpsMeasurement& fix, double t) {
      const auto x = d.motion.at(t);
      const GeodeticPoint place = d.world.to_geodetic(x.T_world_body * d.options.gps_antenna);
      fix.latitude = place.latitude;
      fix.longitude = place.longitude;
      fix.altitude = place.altitude;
      return true;
    };
    d.run();
    EXPECT_LT(d.position_error(d.estimates.back()).norm(), 0.2) << latency;
    EXPECT_EQ(count(d.fusion->counts(), "gps.too_late"), 0) << latency;
    EXPECT_GT(count(d.fusion->counts(), "gps.accepted"), 50) << latency;
  }
}

TEST(InertialFusion, WithoutGpsTheHeadingIsRelativeAndSaidToBe) {
  Drive d;
  d.motion = car();
  d.gps = false;
  d.duration_s = 10;
  d.run();
  for (const Estimate& e : d.estimates) ASSERT_EQ(e.valid & kValidHeading, 0U);
  const Estimate& last = d.estimates.back();
  EXPECT_TRUE(std::isnan(last.origin.latitude));
  // Relative to the start, where it is 0.
  const double turned =
      so3::heading(d.motion.at(10).T_world_body.rotation) - so3::heading(d.motion.at(0).T_world_body.rotation);
  EXPECT_NEAR(std::remainder(so3::heading(last.q_world_body) - turned, 2 * std::numbers::pi), 0, 0.03);
  EXPECT_GT(std::sqrt(last.covariance(kPosition, kPosition)), 0.3) << "dead reckoning";
}

TEST(InertialFusion, RestKeepsVelocityAndPosition) {
  for (const bool zero_velocity : {true, false}) {
    Drive d;
    d.motion = car();
    d.motion.rest_s = 100;
    d.gps = false;
    d.options.zero_velocity = zero_velocity;
    d.run();
    const Estimate& last = d.estimates.back();
    EXPECT_NE(last.status & kAtRest, 0U);
    if (zero_velocity) {
      EXPECT_LT(last.position.norm(), 0.3);
      EXPECT_LT(last.velocity.norm(), 0.02);
      EXPECT_LT((last.gyroscope_bias - d.motion.gyroscope_bias).norm(), 5e-4);
    } else {
      EXPECT_GT(last.velocity.norm(), 0.3) << "the test would not notice";
    }
    EXPECT_EQ(count(d.fusion->counts(), "zero_velocity.gated"), 0);
  }
}

TEST(InertialFusion, SmoothMotionAtConstantVelocityIsNotTakenForRest) {
  Drive d;
  d.motion = car();
  d.motion.radius = std::numeric_limits<double>::infinity();
  d.motion.rest_s = 5;
  d.gps_velocity_sigma = 0.2;
  d.duration_s = 120;
  int moved_at_rest = 0;
  d.look = [&](const InertialFusion&, const Estimate& e, double t) {
    if (t > 15 && (e.status & kAtRest) != 0) ++moved_at_rest;
  };
  d.run();
  EXPECT_LT(moved_at_rest, 120) << "1 % of the samples";
  EXPECT_LT((d.motion.at(120).velocity - d.estimates.back().velocity).norm(), 0.5);
  EXPECT_LT(d.position_error(d.estimates.back()).norm(), 6);
}

TEST(InertialFusion, GivenAndMagneticHeadingNeedNoSearch) {
  Drive d;
  d.motion = car();
  d.options.start.heading = so3::heading(d.motion.at(0).T_world_body.rotation) + 0.03;
  d.run();
  EXPECT_EQ(count(d.fusion->counts(), "heading.found"), 0);
  EXPECT_NE(d.estimates.front().valid & kValidHeading, 0U);
  EXPECT_LT(std::abs(d.heading_error(d.estimates.back())), 0.06);

  InertialFusion magnetic;
  Random random(3);
  for (int i = 0; i < 150; ++i) {
    const double t = i / kRate;
    MagnetometerMeasurement field;
    field.time_ns = d.motion.time(t);
    field.magnetic_field = d.motion.at(t).T_world_body.rotation.inverse() * Eigen::Vector3d(0, 2e-5, -4e-5);
    EXPECT_FALSE(magnetic.process(field));
    magnetic.process(d.motion.imu(t, kRate, {}, random));
  }
  EXPECT_NE(magnetic.estimate().valid & kValidHeading, 0U);
  EXPECT_LT(std::abs(d.heading_error(magnetic.estimate())), 0.05);
}

TEST(InertialFusion, AbsoluteOdometryAloneGivesScaleAndItsWorld) {
  Drive d;
  d.motion = car();
  d.gps = false;
  d.odometry = true;
  d.run();
  const Estimate& last = d.estimates.back();
  EXPECT_NE(last.valid & kValidScale, 0U);
  EXPECT_NEAR(last.scale, 2, 0.06);
  EXPECT_LT(std::abs(last.scale - 2), 5 * last.scale_sigma + 0.02);
  EXPECT_EQ(last.valid & kValidHeading, 0U) << "its world has no north";
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(d.odometry_heading, Eigen::Vector3d::UnitZ()));
  const auto truth = d.motion.at(60);
  EXPECT_LT(so3::angle_between(last.q_world_body, turn * truth.T_world_body.rotation), 0.03);
  EXPECT_LT((last.position - (turn * truth.T_world_body.translation)).norm(), 1.5);
  EXPECT_EQ(count(d.fusion->counts(), "odometry.world_adopted"), 1);
  EXPECT_EQ(count(d.fusion->counts(), "odometry.gated"), 0);
}

TEST(InertialFusion, OdometryBesideGpsIsRelativeAndBridgesAnOutage) {
  double errors[2] = {};
  for (const bool odometry : {true, false}) {
    Drive d;
    d.motion = car();
    d.odometry = odometry;
    d.options.origin = d.world.origin();
    d.duration_s = 80;
    d.change_gps = [](GpsMeasurement&, double t) { return t < 40; };
    d.run();
    const Estimate& last = d.estimates.back();
    errors[odometry ? 0 : 1] = d.position_error(last).norm();
    if (odometry) {
      EXPECT_GT(count(d.fusion->counts(), "relative_odometry.accepted"), 300);
      EXPECT_LT(count(d.fusion->counts(), "relative_odometry.gated"), 4);
      EXPECT_NEAR(last.scale, 2, 0.1);
    }
  }
  EXPECT_LT(errors[0], 8);
  EXPECT_GT(errors[1], 3 * errors[0]) << "without it";
}

TEST(InertialFusion, RelativeOdometryAsSuch) {
  Drive d;
  d.motion = car();
  d.gps = false;
  d.odometry = true;
  std::optional<OdometryMeasurement> before;
  d.change_odometry = [&](OdometryMeasurement& m, double) {
    const OdometryMeasurement now = m;
    if (before) {
      m.start_time_ns = before->time_ns;
      m.position = before->rotation.inverse() * (now.position - before->position);
      m.rotation = before->rotation.inverse() * now.rotation;
      m.position_cov *= 2;
      m.orientation_cov *= 2;
    }
    const bool send = before.has_value();
    before = now;
    return send;
  };
  d.run();
  EXPECT_GT(count(d.fusion->counts(), "relative_odometry.accepted"), 500);
  EXPECT_NEAR(d.estimates.back().scale, 2, 0.1);
  EXPECT_NEAR(d.estimates.back().velocity.norm(), d.motion.speed, 0.4);
}

TEST(InertialFusion, ShortGapsAreBridgedAndReported) {
  Drive d;
  d.motion = car();
  d.options.origin = d.world.origin();
  d.change_imu = [](ImuMeasurement&, double t) { return !(t > 30 && t < 30.5); };
  double before = 0;
  double after = 0;
  bool told = false;
  d.look = [&](const InertialFusion&, const Estimate& e, double t) {
    if (t <= 30) before = e.covariance(kVelocity, kVelocity);
    if (t > 30.4 && after == 0) {
      after = e.covariance(kVelocity, kVelocity);
      told = (e.status & (kBridged | kGap)) == (kBridged | kGap);
    }
  };
  d.run();
  EXPECT_TRUE(told);
  EXPECT_GT(after, 2 * before);
  EXPECT_EQ(count(d.fusion->counts(), "imu.bridged"), 1);
  EXPECT_EQ(count(d.fusion->counts(), "start.again"), 0);
  double sum = d.mean_nees(25);
  for (std::uint64_t seed = 2; seed <= 5; ++seed) {
    d.estimates.clear();
    d.run(seed);
    sum += d.mean_nees(25);
  }
  EXPECT_LT(sum / 5, 9) << "6 are due";
}

TEST(InertialFusion, ALongGapIsANewStartThatKeepsWhatIsStillKnown) {
  Drive d;
  d.motion = car();
  d.options.origin = d.world.origin();
  d.change_imu = [](ImuMeasurement&, double t) { return !(t > 30 && t < 33); };
  d.change_gps = [](GpsMeasurement&, double t) { return t < 30 || t > 36; };
  std::optional<Estimate> first;
  d.look = [&](const InertialFusion&, const Estimate& e, double t) {
    if (t > 30.5 && !first) first = e;
  };
  d.run();
  ASSERT_TRUE(first);
  EXPECT_NEAR(d.time_of(*first), 34, 0.05) << "a second to look, none of it silently integrated over the gap";
  EXPECT_NE(first->status & kReinitialised, 0U);
  EXPECT_NE(first->status & kGap, 0U);
  EXPECT_EQ(count(d.fusion->counts(), "start.again"), 1);
  const double sigma = std::sqrt(first->covariance(kPosition, kPosition));
  EXPECT_GT(sigma, 8) << "three seconds at 8 m/s";
  EXPECT_LT(d.position_error(*first).norm(), 3 * sigma);
  EXPECT_LT((first->gyroscope_bias - d.motion.gyroscope_bias).norm(), 2e-3) << "carried over";
  EXPECT_LT(d.position_error(d.estimates.back()).norm(), 5);
  EXPECT_LT(std::abs(d.heading_error(d.estimates.back())), 0.1);
  double sum = d.mean_nees(45);
  for (std::uint64_t seed = 2; seed <= 5; ++seed) {
    d.estimates.clear();
    d.run(seed);
    sum += d.mean_nees(45);
  }
  EXPECT_LT(sum / 5, 9) << "6 are due";
}

TEST(InertialFusion, BadInputIsCountedAndFlaggedAndChangesNothing) {
  Drive clean;
  clean.motion = car();
  clean.duration_s = 20;
  clean.run();
  Drive d = clean;
  d.estimates.clear();
  d.statuses = 0;
  InertialFusion fusion(d.options);
  d.look = [&](const InertialFusion& running, const Estimate&, double t) {
    if (std::fmod(t, 1) > 0.005) return;
    auto& f = const_cast<InertialFusion&>(running);
    const Estimate before = f.estimate();
    ImuMeasurement imu;
    imu.time_ns = before.time_ns + 1'000'000;
    EXPECT_FALSE(f.process(imu)) << "NaN";
    imu.angular_velocity.setConstant(std::numeric_limits<double>::infinity());
    imu.specific_force.setZero();
    EXPECT_FALSE(f.process(imu));
    imu.angular_velocity.setConstant(1e5);
    EXPECT_FALSE(f.process(imu));
    imu.angular_velocity.setZero();
    imu.time_ns = before.time_ns;
    EXPECT_FALSE(f.process(imu)) << "the same time";
    imu.time_ns = before.time_ns - 5;
    EXPECT_FALSE(f.process(imu)) << "back";
    GpsMeasurement gps;
    gps.time_ns = before.time_ns;
    EXPECT_FALSE(f.process(gps)) << "no fix";
    gps.fix = GpsFixType::k3d;
    EXPECT_FALSE(f.process(gps)) << "NaN";
    gps.latitude = 48;
    gps.longitude = 11;
    EXPECT_FALSE(f.process(gps)) << "degrees";
    gps.latitude = 0.85;
    gps.longitude = 0.2;
    gps.altitude = 300;
    gps.position_cov.setZero();
    EXPECT_FALSE(f.process(gps)) << "a covariance that is none";
    gps.time_ns = before.time_ns - 3'000'000'000;
    gps.position_cov.setIdentity();
    EXPECT_FALSE(f.process(gps)) << "older than the history";
    gps.time_ns = before.time_ns + 3'600'000'000'000;
    EXPECT_FALSE(f.process(gps)) << "an hour ahead";
    OdometryMeasurement odometry;
    odometry.time_ns = before.time_ns;
    EXPECT_FALSE(f.process(odometry)) << "NaN";
    EXPECT_FALSE(f.process(ReferenceMeasurement{}));
    EXPECT_FALSE(f.process(ImageMeasurement{}));
    EXPECT_FALSE(f.process(FeaturesMeasurement{}));
    EXPECT_EQ(f.estimate().position, before.position);
    EXPECT_EQ(f.estimate().q_world_body.coeffs(), before.q_world_body.coeffs());
  };
  d.run();
  const Estimate& a = clean.estimates.back();
  const Estimate& b = d.estimates.back();
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.covariance, b.covariance);
  const NamedCounts counts = d.fusion->counts();
  const std::int64_t times = count(counts, "imu.skipped.out_of_range");
  EXPECT_GE(times, 18);
  EXPECT_EQ(count(counts, "imu.skipped.not_finite"), 2 * times);
  EXPECT_EQ(count(counts, "imu.skipped.time_not_increasing"), 2 * times);
  EXPECT_EQ(count(counts, "gps.skipped.no_fix"), times);
  EXPECT_EQ(count(counts, "gps.skipped.not_finite"), times);
  EXPECT_EQ(count(counts, "gps.skipped.out_of_range"), times);
  EXPECT_EQ(count(counts, "gps.skipped.ahead"), times);
  EXPECT_EQ(count(counts, "odometry.skipped.not_finite"), times);
  EXPECT_EQ(count(counts, "gps.bad_covariance"), times);
  EXPECT_EQ(count(counts, "gps.too_late"), times);
  EXPECT_EQ(d.statuses & (kNotFinite | kOutOfRange | kTimeNotIncreasing | kBadCovariance | kTooLate),
            kNotFinite | kOutOfRange | kTimeNotIncreasing | kBadCovariance | kTooLate);
}

TEST(InertialFusion, OdometryBeforeTheFirstImuIsCountedAndFlagged) {
  const DrivenCircle motion = car();
  InertialFusion fusion;
  Random random(4);
  OdometryMeasurement odometry;
  odometry.time_ns = motion.time(-2);
  odometry.position.setZero();
  odometry.rotation.setIdentity();
  EXPECT_FALSE(fusion.process(odometry));
  std::uint32_t status = 0;
  for (int i = 0; i < 110; ++i) {
    if (fusion.process(motion.imu(i / kRate, kRate, {}, random))) status |= fusion.estimate().status;
  }
  EXPECT_NE(status & kTooLate, 0U);
  EXPECT_EQ(count(fusion.counts(), "odometry.too_late"), 1);
  EXPECT_EQ(count(fusion.counts(), "odometry.world_adopted"), 0);
}

TEST(InertialFusion, AClockThatIsSetBackIsANewStart) {
  DrivenCircle motion = car();
  motion.rest_s = 1000;
  InertialFusion fusion;
  Random random(5);
  for (int i = 0; i < 300; ++i) fusion.process(motion.imu(i / kRate, kRate, {}, random));
  ASSERT_TRUE(fusion.running());
  motion.start_ns -= 3'600'000'000'000;
  int estimates = 0;
  std::uint32_t status = 0;
  for (int i = 300; i < 600; ++i) {
    if (!fusion.process(motion.imu(i / kRate, kRate, {}, random))) continue;
    ++estimates;
    status |= fusion.estimate().status;
  }
  EXPECT_NEAR(estimates, 180, 3) << "20 to be believed, 100 to look";
  EXPECT_NE(status & kReinitialised, 0U);
  EXPECT_EQ(count(fusion.counts(), "imu.clock_set_back"), 1);
  EXPECT_EQ(count(fusion.counts(), "imu.skipped.time_not_increasing"), 19);
  EXPECT_EQ(fusion.estimate().time_ns, motion.time(5.99));
}

// Where the world is does not depend on a clock, and a given start is given for one time only.
TEST(InertialFusion, AClockThatIsSetBackKeepsTheOriginAndDoesNotRepeatAGivenStart) {
  for (const bool given : {false, true}) {
    Drive d;
    d.motion = car();
    if (given) {
      ErrorStateState state;
      state.inertial.q_world_body = d.motion.at(0).T_world_body.rotation;
      const int size = ErrorStateFilter(d.options.filter).layout().size;
      d.options.given_start = GivenStart{state, 1e-2 * Eigen::MatrixXd::Identity(size, size)};
    }
    const auto set_back = [&](Stamp& stamp, double t) {
      if (t >= 30) stamp.time_ns -= from_seconds(5);
      return true;
    };
    d.change_imu = set_back;
    d.change_gps = set_back;
    std::optional<GeodeticPoint> before;
    std::optional<Estimate> first_after;
    d.look = [&](const InertialFusion& fusion, const Estimate& e, double t) {
      if (t < 30) {
        before = fusion.world()->origin();
      } else if (!first_after) {
        first_after = e;
      }
    };
    d.run();
    EXPECT_EQ(count(d.fusion->counts(), "imu.clock_set_back"), 1);
    ASSERT_TRUE(before && first_after && d.fusion->world());
    EXPECT_EQ(d.fusion->world()->origin().latitude, before->latitude);
    EXPECT_EQ(d.fusion->world()->origin().longitude, before->longitude);
    // It says that it does not know where the body is by now, or it knows.
    Estimate last = d.estimates.back();
    last.time_ns += from_seconds(5);
    EXPECT_LT(d.position_error(last).norm(), 6) << given;
  }
}

// Errors that last do not average out, whether the heading is known or not, and a fix sent twice tells nothing new.
TEST(InertialFusion, FixesWhoseErrorsLastAreNotAveragedAway) {
  for (const bool twice : {false, true}) {
    Drive d;
    d.motion = car();
    d.motion.rest_s = 1000;
    d.duration_s = 120;
    d.options.gps_correlation_time_s = 60;
    const Eigen::Vector3d lasting(1.5, -1.2, 0);
    d.gps_sigma = 0.3;
    d.change_gps = [&](GpsMeasurement& fix, double) {
      const LocalFrame& w = d.world;
      const GeodeticPoint moved = w.to_geodetic(w.to_local({fix.latitude, fix.longitude, fix.altitude}) + lasting);
      fix.latitude = moved.latitude;
      fix.longitude = moved.longitude;
      fix.position_cov = Eigen::Vector3d(1.5, 1.5, 9).cwiseAbs2().asDiagonal();
      if (twice) d.fusion->process(fix);
      return true;
    };
    d.run();
    EXPECT_GT(std::sqrt(d.estimates.back().covariance(kPosition, kPosition)), 0.7) << twice;
    EXPECT_EQ(count(d.fusion->counts(), "gps.skipped.repeated") > 50, twice);
  }
}

TEST(InertialFusion, GpsThatReallyMovedIsBelievedInTheEnd) {
  Drive d;
  d.motion = car();
  d.options.origin = d.world.origin();
  d.duration_s = 120;
  // As after an outage in which the receiver had been wrong: all fixes 150 m further north.
  d.change_gps = [&](GpsMeasurement& fix, double t) {
    if (t >= 40) fix.latitude += 150 / 6.37e6;
    return true;
  };
  bool flagged = false;
  d.look = [&](const InertialFusion&, const Estimate& e, double t) {
    if (t > 43 && t < 47 && (e.status & kGpsRejected) != 0) flagged = true;
  };
  d.run();
  EXPECT_TRUE(flagged);
  EXPECT_NE(d.statuses & kRecovered, 0U);
  const Eigen::Vector3d off = d.position_error(d.estimates.back());
  EXPECT_NEAR(off.y(), -150, 8);
  EXPECT_NEAR(off.x(), 0, 8);
  EXPECT_LT(count(d.fusion->counts(), "gps.gated"), 30);
}

TEST(InertialFusion, AFilterThatIsLostFindsBack) {
  Drive d;
  d.motion = car();
  d.options.origin = d.world.origin();
  d.duration_s = 150;
  // The device is turned by 100 degrees in its mount while nobody looks: attitude and biases are wrong at once.
  d.change_imu = [&](ImuMeasurement& imu, double t) {
    if (t < 40) return true;
    const Eigen::Quaterniond turn = so3::exp({0, 0, 1.7});
    imu.angular_velocity = turn * imu.angular_velocity;
    imu.specific_force = turn * imu.specific_force;
    return true;
  };
  d.run();
  EXPECT_GT(count(d.fusion->counts(), "widened"), 0);
  EXPECT_NE(d.statuses & kRecovered, 0U);
  EXPECT_LT(d.position_error(d.estimates.back()).norm(), 8);
  EXPECT_LT((d.motion.at(150).velocity - d.estimates.back().velocity).norm(), 1.5);
}

TEST(InertialFusion, OutliersAreRejected) {
  Drive d;
  d.motion = car();
  d.options.origin = d.world.origin();
  int sent = 0;
  d.change_gps = [&](GpsMeasurement& fix, double t) {
    if (t > 30 && std::fmod(t, 7) < 0.5) {
      fix.latitude += 300 / 6.37e6;
      ++sent;
    }
    return true;
  };
  d.run();
  EXPECT_GE(count(d.fusion->counts(), "gps.gated"), sent);
  EXPECT_LE(count(d.fusion->counts(), "gps.gated"), sent + 1);
  EXPECT_EQ(d.statuses & kRecovered, 0U);
  EXPECT_LT(d.position_error(d.estimates.back()).norm(), 5);
}

// Receivers state how much their fixes scatter, not that their stamps are off.
TEST(InertialFusion, AReceiverThatBoastsIsSurvived) {
  double nees[2] = {};
  for (const bool floors : {true, false}) {
    Drive d;
    d.motion = car();
    d.options.origin = d.world.origin();
    d.gps_sigma = 0.3;
    d.gps_velocity_sigma = 0.05;
    d.change_gps = [](GpsMeasurement& fix, double) {
      fix.time_ns += 80'000'000;
      return true;
    };
    if (!floors) d.options.gps_sigma_floor = d.options.gps_velocity_sigma_floor = d.options.gps_time_sigma = 0;
    d.run();
    const std::int64_t gated = count(d.fusion->counts(), "gps.gated");
    nees[floors ? 0 : 1] = d.mean_nees(25);
    if (floors) {
      EXPECT_EQ(gated, 0);
      EXPECT_EQ(d.statuses & kRecovered, 0U);
      EXPECT_LT(d.position_error(d.estimates.back()).norm(), 3);
    }
  }
  EXPECT_LT(nees[0], 25);
  EXPECT_GT(nees[1], 3 * nees[0]) << "the test would not notice";
}

// A winding road, from rest on; fixes at 1 Hz are where the body was late_s before their stamps. Level, x forward.
struct WindingDrive {
  double late_s = 0;
  std::optional<double> odometry_late_s{};
  double looks_about = 0;  ///< [rad]
  double gps_sigma = 1;
  InertialFusionOptions options = white_fixes();
  LocalFrame world{0.85, 0.2, 300};
  std::uint32_t statuses = 0;
  std::optional<InertialFusion> fusion;

  static Eigen::Vector3d place(double t) {
    // Speeds up for four seconds.
    const double u = t < 3 ? 0 : t < 7 ? (t - 3) * (t - 3) / 8 : t - 5;
    return {40 * std::sin(0.15 * u), 7 * u - 20 * std::sin(0.22 * u), 0};
  }

  void run(double duration_s, std::uint64_t seed) {
    constexpr double kH = 1e-3;
    Random random(seed);
    fusion.emplace(options);
    double heading = std::atan2(7 - 0.22 * 20, 0.15 * 40);
    const double start = heading;
    const auto heading_at = [&](double t) {
      const Eigen::Vector3d v = (place(t + kH) - place(t - kH)) / (2 * kH);
      const double about = t < 7 ? 0 : looks_about * (std::sin(1.7 * (t - 7)) + 0.7 * std::sin(3.1 * (t - 7)));
      return (v.norm() < 1e-3 ? start : std::atan2(v.y(), v.x())) + about;
    };
    for (int i = 0; i <= duration_s * kRate; ++i) {
      const double t = i / kRate;
      if (i % 100 == 0) {
        const GeodeticPoint at = world.to_geodetic(place(t - late_s) + gps_sigma * random.normal3());
        GpsMeasurement fix;
        fix.time_ns = from_seconds(t);
        fix.fix = GpsFixType::k3d;
        fix.latitude = at.latitude;
        fix.longitude = at.longitude;
        fix.altitude = at.altitude;
        fix.position_cov = gps_sigma * gps_sigma * Eigen::Matrix3d::Identity();
        fusion->process(fix);
      }
      const Eigen::Vector3d acceleration = (place(t + kH) - 2 * place(t) + place(t - kH)) / (kH * kH);
      const double before = heading;
      heading = heading_at(t);
      ImuMeasurement imu;
      imu.time_ns = from_seconds(t);
      imu.angular_velocity = Eigen::Vector3d(0, 0, std::remainder(heading - before, 2 * std::numbers::pi) * kRate) +
                             Eigen::Vector3d(0.004, -0.003, 0.005) + 1e-3 * random.normal3();
      imu.specific_force =
          Eigen::AngleAxisd(-heading, Eigen::Vector3d::UnitZ()) * (acceleration + Eigen::Vector3d(0, 0, 9.80665)) +
          Eigen::Vector3d(0.05, -0.04, 0.03) + 0.03 * random.normal3();
      if (odometry_late_s && i % 10 == 0) {
        OdometryMeasurement odometry;
        const double then = t - *odometry_late_s;
        odometry.time_ns = from_seconds(t);
        odometry.position = place(then) + 0.05 * random.normal3();
        odometry.rotation =
            Eigen::AngleAxisd(heading_at(then), Eigen::Vector3d::UnitZ()) * so3::exp(0.002 * random.normal3());
        odometry.position_cov = 0.05 * 0.05 * Eigen::Matrix3d::Identity();
        odometry.orientation_cov = 4e-6 * Eigen::Matrix3d::Identity();
        fusion->process(odometry);
      }
      if (fusion->process(imu)) statuses |= fusion->estimate().status;
    }
  }
};

TEST(InertialFusion, StampsOfOdometryThatAreOffAreTold) {
  for (const double late : {0.0, 1.0, -1.0}) {
    WindingDrive d;
    d.odometry_late_s = late;
    d.looks_about = 0.2;
    d.run(150, 4);
    EXPECT_EQ((d.statuses & kStampsDoubtful) != 0, late != 0) << late << ": " << d.fusion->stamp_watch().offset_s();
    EXPECT_NEAR(d.fusion->stamp_watch().offset_s(), -late, 0.1);
    EXPECT_EQ(count(d.fusion->counts(), "stamps.odometry_to_add_ms") != 0, late != 0);
  }
}

TEST(InertialFusion, StampsOfGpsThatAreOffAreTold) {
  for (const double late : {0.0, 1.0, -1.0}) {
    WindingDrive d;
    d.late_s = late;
    d.run(400, 3);
    const GpsLagWatch& watch = d.fusion->lag_watch();
    EXPECT_EQ((d.statuses & kGpsStampsDoubtful) != 0, late != 0)
        << late << ": " << watch.offset_s() << " +- " << watch.sigma_s();
    EXPECT_NEAR(watch.offset_s(), -late, 0.4);
    EXPECT_EQ(count(d.fusion->counts(), "stamps.gps_to_add_ms") != 0, late != 0);
  }
}

TEST(InertialFusion, PresetsAndOptions) {
  for (const char* name : {"robust", "as_published", "16", "19"}) {
    Drive d;
    d.motion = car();
    d.motion.accelerometer_bias.setZero();
    d.gps = false;
    d.odometry = true;
    d.odometry_sigma = 0.139;
    d.options = InertialFusionOptions::preset(name);
    d.run();
    EXPECT_NEAR(d.estimates.back().scale, 2, 0.1) << name;
    EXPECT_EQ(count(d.fusion->counts(), "odometry.world_adopted"), 1) << name;
  }
  EXPECT_THROW(InertialFusionOptions::preset("17"), std::invalid_argument);
  InertialFusionOptions options = InertialFusionOptions::robust();
  options.gps_sigma = -1;
  EXPECT_THROW(InertialFusion{options}, std::invalid_argument);
  options = InertialFusionOptions::preset("16");
  options.odometry = OdometryUse::kRelative;
  EXPECT_THROW(InertialFusion{options}, std::invalid_argument) << "no past pose is kept";
  options = InertialFusionOptions::robust();
  options.filter.gravity = {0, 0, 9.8};
  EXPECT_THROW(InertialFusion{options}, std::invalid_argument) << "z down";
  options = InertialFusionOptions::robust();
  options.given_start = GivenStart{{}, Eigen::MatrixXd::Identity(3, 3)};
  EXPECT_THROW(InertialFusion{options}, std::invalid_argument);
  EXPECT_EQ(parse_odometry_use("relative"), OdometryUse::kRelative);
  EXPECT_THROW(parse_odometry_use("x"), std::invalid_argument);
}

TEST(InertialFusion, AGivenStartIsUsedAsItIs) {
  Drive d;
  d.motion = car();
  d.options.origin = d.world.origin();
  d.options.zero_velocity = false;
  ErrorStateState state;
  const auto truth = d.motion.at(0);
  state.inertial.q_world_body = truth.T_world_body.rotation;
  state.inertial.position = truth.T_world_body.translation;
  const int size = ErrorStateFilter(d.options.filter).layout().size;
  d.options.given_start = GivenStart{state, 1e-2 * Eigen::MatrixXd::Identity(size, size)};
  d.run();
  EXPECT_EQ(d.estimates.front().time_ns, d.motion.time(0)) << "no second to look";
  EXPECT_EQ(count(d.fusion->counts(), "gps.anchored"), 0);
  EXPECT_NE(d.estimates.front().valid & kValidHeading, 0U);
  EXPECT_LT(d.position_error(d.estimates.back()).norm(), 4);
}

TEST(InertialFusion, ResetForgetsThePastAndKeepsTheCounts) {
  Drive d;
  d.motion = car();
  d.duration_s = 20;
  d.run();
  const std::int64_t used = count(d.fusion->counts(), "imu.used");
  const std::int64_t accepted = count(d.fusion->counts(), "gps.accepted");
  d.fusion->reset();
  EXPECT_FALSE(d.fusion->running());
  EXPECT_EQ(d.fusion->estimate().valid, 0U);
  EXPECT_EQ(count(d.fusion->counts(), "imu.used"), used);
  EXPECT_EQ(count(d.fusion->counts(), "gps.accepted"), accepted);
  const std::vector<Estimate> first = d.estimates;
  Drive again = d;
  again.estimates.clear();
  again.run();
  EXPECT_EQ(again.estimates.size(), first.size());
  EXPECT_EQ(again.estimates.back().position, first.back().position) << "the same input, the same numbers";
}

}  // namespace
}  // namespace loc
