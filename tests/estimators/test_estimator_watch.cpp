// StreamWatch and AttitudeCheck: what an estimator goes on without, and a second opinion on its vertical.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "libloc/estimators/attitude_check.hpp"
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

}  // namespace
}  // namespace loc
