// StreamWatch, AttitudeCheck and GpsLagWatch: what an estimator goes on without, a second opinion on its vertical, and
// whether fixes are of the time that they say.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "libloc/core/random.hpp"
#include "libloc/estimators/attitude_check.hpp"
#include "libloc/estimators/gps_lag_watch.hpp"
#include "libloc/estimators/stream_watch.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

template <class T>
Measurement at(double t) {
  T m;
  m.time_ns = from_seconds(t);
  return m;
}

TEST(StreamWatch, TellsWhichStreamIsSilent) {
  StreamWatchOptions options;
  options.needed = {StreamKind::kImu, StreamKind::kImage};
  StreamWatch watch(options);
  EXPECT_EQ(watch.status(), 0U);  // nothing has been there
  const auto run = [&](double from, double to, bool imu, bool images, bool gps) {
    for (int i = 0; from + 0.01 * i < to; ++i) {
      const double t = from + 0.01 * i;
      if (imu) watch.see(at<ImuMeasurement>(t));
      if (images && i % 5 == 0) watch.see(at<ImageMeasurement>(t));
      if (gps && i % 100 == 0) watch.see(at<GpsMeasurement>(t));
    }
  };
  run(0, 1, true, false, false);
  EXPECT_EQ(watch.status(), kNoImages);  // needed from the start; GPS is not
  run(1, 5, true, true, true);
  EXPECT_EQ(watch.status(), 0U);
  run(5, 5.4, true, false, true);
  EXPECT_EQ(watch.status(), 0U);
  run(5.4, 6, true, false, true);
  EXPECT_EQ(watch.status(), kNoImages);
  run(6, 7, false, true, true);
  EXPECT_EQ(watch.status(), kNoImu);
  run(7, 10.5, true, true, false);
  EXPECT_EQ(watch.status(), 0U);
  run(10.5, 11.5, true, true, false);  // more than five of its intervals
  EXPECT_EQ(watch.status(), kNoGps);
  watch.reset();
  EXPECT_EQ(watch.status(), 0U);
}

TEST(StreamWatch, ASlowStreamIsNotAnOutageAndOneAbsurdTimeIsNothing) {
  StreamWatch watch;
  for (int i = 0; i < 100; ++i) {
    watch.see(at<ImuMeasurement>(0.1 * i));
    if (i % 4 == 0) watch.see(at<ImageMeasurement>(0.1 * i));
  }
  EXPECT_EQ(watch.status(), 0U);
  for (int i = 100; i < 115; ++i) watch.see(at<ImuMeasurement>(0.1 * i));
  EXPECT_EQ(watch.status(), 0U);
  watch.see(at<GpsMeasurement>(1000));
  EXPECT_EQ(watch.status(), 0U);
  EXPECT_EQ(watch.newest_ns(), from_seconds(11.4));
  for (int i = 115; i < 140; ++i) watch.see(at<ImuMeasurement>(0.1 * i));
  EXPECT_EQ(watch.status(), kNoImages);
  // A receiver on another clock says nothing, ahead or behind, however far.
  const std::uint32_t before = watch.status();
  for (const TimeNs time :
       {from_seconds(-20), std::numeric_limits<TimeNs>::max(), std::numeric_limits<TimeNs>::min() + 1}) {
    GpsMeasurement gps;
    gps.time_ns = time;
    watch.see(gps);
    watch.see(gps);
    EXPECT_EQ(watch.status(), before);
    EXPECT_EQ(watch.newest_ns(), from_seconds(13.9));
  }
  // The clock was set back: another time line.
  watch.see(at<ImuMeasurement>(1));
  EXPECT_EQ(watch.status(), 0U);
}

// A body that turns slowly about all axes; the estimate is off by a turn.
struct Turning {
  AttitudeCheck check;
  double t = 0;
  double held_s = 0;  // an estimate is so much older than the newest sample

  static Eigen::Quaterniond truth(double t) {
    return so3::exp({0, 0, 0.3 * t}) * so3::exp({0.4 * std::sin(0.5 * t), 0.3 * std::sin(0.3 * t), 0});
  }

  std::uint32_t run(double seconds, const Eigen::Quaterniond& q_world_est, double sigma,
                    const Eigen::Vector3d& acceleration = Eigen::Vector3d::Zero(), bool field = false) {
    std::uint32_t status = 0;
    for (const double end = t + seconds; t < end; t += 0.005) {
      constexpr double kH = 1e-4;
      if (field) {
        MagnetometerMeasurement m;
        m.time_ns = from_seconds(t);
        m.magnetic_field = truth(t).inverse() * Eigen::Vector3d(0, 20e-6, -40e-6);
        check.see(m);
      }
      ImuMeasurement imu;
      imu.time_ns = from_seconds(t);
      imu.angular_velocity = so3::log(truth(t - kH).inverse() * truth(t + kH)) / (2 * kH);
      imu.specific_force = truth(t).inverse() * (Eigen::Vector3d(0, 0, 9.81) + acceleration);
      check.see(imu);
      Estimate e = estimate(q_world_est, sigma);
      if (held_s > 0) e.q_world_body = q_world_est * truth(t - held_s);
      e.time_ns = from_seconds(t - held_s);
      status = check.compare(e);
    }
    return status;
  }
  Estimate estimate(const Eigen::Quaterniond& q_est_world, double sigma) const {
    Estimate e;
    e.time_ns = from_seconds(t);
    e.valid = kValidOrientation | kValidCovariance;
    e.q_world_body = q_est_world * truth(t);
    e.covariance_dim = kMaxEstimateDim;
    e.covariance.setZero();
    e.covariance.diagonal().setConstant(sigma * sigma);
    return e;
  }
};

TEST(AttitudeCheck, SeesAWrongVerticalAndOnlyThat) {
  EXPECT_EQ(Turning().run(30, Eigen::Quaterniond::Identity(), 0.01), 0U);
  EXPECT_EQ(Turning().run(30, so3::exp({0, 0, 2}), 0.01), 0U);     // a heading is anybody's choice
  EXPECT_EQ(Turning().run(30, so3::exp({0.05, 0, 0}), 0.01), 0U);  // 3 degrees
  EXPECT_EQ(Turning().run(30, so3::exp({0.2, 0, 0}), 0.01), kTiltDoubtful);
  EXPECT_EQ(Turning().run(30, so3::exp({0.2, 0, 0}), 0.1), 0U);  // it knows that it does not know
  Turning held;                                                  // as with a camera whose clock is ahead
  held.held_s = 0.05;
  EXPECT_EQ(held.run(30, so3::exp({0.2, 0, 0}), 0.01), kTiltDoubtful);
  EXPECT_EQ(held.run(30, Eigen::Quaterniond::Identity(), 0.01), 0U);
  // Braking for two seconds is not a wrong vertical, and one that was wrong and was mended is right.
  Turning turning;
  EXPECT_EQ(turning.run(20, Eigen::Quaterniond::Identity(), 0.01), 0U);
  EXPECT_EQ(turning.run(2, Eigen::Quaterniond::Identity(), 0.01, {3, 0, 0}), 0U);
  EXPECT_EQ(turning.run(10, so3::exp({0, 0.25, 0}), 0.01), kTiltDoubtful);
  EXPECT_EQ(turning.run(20, Eigen::Quaterniond::Identity(), 0.01), 0U);
}

TEST(AttitudeCheck, TheMagnetometerTellsWhereTheWorldsXPoints) {
  Turning turning;
  turning.run(20, so3::exp({0, 0, -0.7}), 0.01, Eigen::Vector3d::Zero(), false);
  turning.t -= 0.005;
  EXPECT_FALSE(turning.check.heading_of_world(turning.estimate(so3::exp({0, 0, -0.7}), 0.01)).has_value());
  Turning with_field;
  with_field.run(20, so3::exp({0, 0, -0.7}), 0.01, Eigen::Vector3d::Zero(), true);
  with_field.t -= 0.005;
  const auto heading = with_field.check.heading_of_world(with_field.estimate(so3::exp({0, 0, -0.7}), 0.01));
  ASSERT_TRUE(heading.has_value());
  EXPECT_NEAR(*heading, 0.7, 0.05);
}

using Path = std::function<Eigen::Vector2d(double)>;

Eigen::Vector2d winding(double t) {
  return {60 * std::sin(0.1 * t), 8 * t - 30 * std::sin(0.15 * t)};
}

// Round blocks of 25 m, on foot.
Eigen::Vector2d round_the_block(double t) {
  const double gone = std::fmod(1.4 * t, 100);
  const double side = std::fmod(gone, 25);
  if (gone < 25) return {side, 0};
  if (gone < 50) return {25, side};
  if (gone < 75) return {25 - side, 25};
  return {0, 25 - side};
}

// Fixes d late, half of their error the same for a minute; the other way drifts.
GpsLagWatch watched(const Path& path, double d, std::uint64_t seed, const GpsLagWatchOptions& options = {},
                    double jump_every_s = 1e9) {
  GpsLagWatch watch(options);
  Random random(seed);
  const auto noise = [&](double sigma) { return Eigen::Vector2d(sigma * random.normal(), sigma * random.normal()); };
  Eigen::Vector2d slow = noise(1.5);
  Eigen::Vector2d drift = Eigen::Vector2d::Zero();
  const double keep = std::exp(-1.0 / 60);
  for (int t = 0; t < 480; ++t) {
    slow = keep * slow + noise(1.5 * std::sqrt(1 - keep * keep));
    drift += noise(0.03);
    if (t > 0 && std::fmod(t, jump_every_s) < 0.5) {
      drift += Eigen::Vector2d(40, -30);
      watch.break_off();
    }
    constexpr double kH = 1e-3;
    watch.see(from_seconds(t), path(t + d) + slow + noise(0.5), path(t) + drift,
              (path(t + kH) - path(t - kH)) / (2 * kH));
  }
  return watch;
}

TEST(GpsLagWatch, TellsStampsThatAreASecondOffAndLeavesOthersInPeace) {
  for (const bool on_foot : {false, true}) {
    const Path path = on_foot ? Path(round_the_block) : Path(winding);
    for (const int order : {1, 2}) {
      for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        const GpsLagWatchOptions options{.drift_order = order, .scale_known = order == 2};
        const GpsLagWatch right = watched(path, 0, seed, options);
        EXPECT_FALSE(right.doubtful()) << right.offset_s() << " +- " << right.sigma_s();
        for (const double d : {1.0, -1.0}) {
          const GpsLagWatch wrong = watched(path, d, seed, options);
          EXPECT_TRUE(wrong.doubtful()) << d << ": " << wrong.offset_s() << " +- " << wrong.sigma_s();
          EXPECT_NEAR(wrong.offset_s(), d, 0.4);
        }
      }
    }
  }
}

TEST(GpsLagWatch, SaysNothingOfStraightWaysAndSteadyCircles) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    EXPECT_FALSE(watched([](double t) { return Eigen::Vector2d(8 * t, 0); }, 1, seed).doubtful());
    const Path circle = [](double t) { return Eigen::Vector2d(30 * std::sin(0.25 * t), 30 * std::cos(0.25 * t)); };
    EXPECT_FALSE(watched(circle, 1, seed).doubtful());
    EXPECT_FALSE(watched(winding, 0, seed, {}, 45).doubtful());
  }
}

TEST(GpsLagWatch, OptionsAreChecked) {
  EXPECT_THROW(GpsLagWatch({.window_s = 0}), std::invalid_argument);
  EXPECT_THROW(GpsLagWatch({.drift_order = 3}), std::invalid_argument);
  EXPECT_THROW(GpsLagWatch({.least_s = std::nan("")}), std::invalid_argument);
}

// A steady circle: the rate and the force of the body do not change.
TEST(ImuReckoning, GoesWhereTheImuSays) {
  constexpr double kRate = 0.4;
  constexpr double kSpeed = 6;
  const auto truth = [=](double t) {
    ImuReckoning::Point x;
    x.position = kSpeed / kRate * Eigen::Vector3d(std::sin(kRate * t), 1 - std::cos(kRate * t), 0);
    x.velocity = kSpeed * Eigen::Vector3d(std::cos(kRate * t), std::sin(kRate * t), 0);
    x.q_world_body = so3::exp({0, 0, kRate * t});
    return x;
  };
  const Eigen::Vector3d gyroscope_bias(0.01, -0.02, 0.03);
  const Eigen::Vector3d accelerometer_bias(0.1, 0.2, -0.3);
  ImuReckoning reckoning;
  EXPECT_FALSE(reckoning.at(0));
  ImuReckoning::Point begin = truth(0);
  begin.time_ns = 0;
  reckoning.begin(begin, gyroscope_bias, accelerometer_bias);
  ImuMeasurement imu;
  imu.angular_velocity = Eigen::Vector3d(0, 0, kRate) + gyroscope_bias;
  imu.specific_force = Eigen::Vector3d(0, kSpeed * kRate, 9.81) + accelerometer_bias;
  for (int i = 1; i <= 1000; ++i) {
    imu.time_ns = from_seconds(0.005 * i);
    reckoning.step(imu, 9.81);
  }
  for (const double t : {2.5, 4.0, 4.9987, 5.02}) {
    const auto point = reckoning.at(from_seconds(t));
    ASSERT_TRUE(point) << t;
    EXPECT_LT((point->position - truth(t).position).norm(), 0.01) << t;
    EXPECT_LT((point->velocity - truth(t).velocity).norm(), t > 5 ? 0.1 : 0.01) << t;
    EXPECT_LT(point->q_world_body.angularDistance(truth(t).q_world_body), 0.01) << t;
  }
  EXPECT_FALSE(reckoning.at(from_seconds(1)));    // not kept for so long
  EXPECT_FALSE(reckoning.at(from_seconds(5.2)));  // nobody knows yet
  imu.time_ns = from_seconds(7);
  reckoning.step(imu, 9.81);
  EXPECT_FALSE(reckoning.running());
}

}  // namespace
}  // namespace loc
