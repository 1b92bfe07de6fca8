// What an estimator goes on without, in words; and estimates that are held back until GPS says where they are.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tools/support/conditions.hpp"
#include "tools/support/held_back_output.hpp"

namespace loc {
namespace {

TEST(Conditions, BeginAndEndAndAreCounted) {
  Conditions conditions;
  const auto at = [&](double t, std::uint32_t status) { conditions.update(from_seconds(t), status); };
  at(1, 0);
  EXPECT_TRUE(conditions.held().empty());
  EXPECT_FALSE(conditions.take_change());
  // One that comes and goes with every other sample is one.
  for (int i = 0; i < 20; ++i) at(2 + 0.1 * i, i % 2 == 0 ? kNoGps : 0U);
  ASSERT_EQ(conditions.held().size(), 1U);
  EXPECT_STREQ(conditions.held()[0].condition.name, "no GPS");
  EXPECT_EQ(conditions.held()[0].since_ns, from_seconds(2));
  EXPECT_EQ(conditions.status(), kNoGps);
  EXPECT_TRUE(conditions.take_change());
  EXPECT_FALSE(conditions.take_change());
  at(5, kLost);
  ASSERT_EQ(conditions.held().size(), 1U);
  EXPECT_STREQ(conditions.held()[0].condition.name, "lost");
  at(6, 0);
  EXPECT_TRUE(conditions.held().empty());
  ASSERT_EQ(conditions.counts().size(), 2U);
  EXPECT_EQ(conditions.counts()[0].name, "condition.no_GPS");
  EXPECT_EQ(conditions.counts()[0].value, 1);
  // The clock was set back; and times at the ends of what a time can be.
  at(7, kNoImu);
  at(0.5, 0);
  EXPECT_TRUE(conditions.held().empty());
  conditions.update(std::numeric_limits<TimeNs>::min() + 1, kNoImu);
  conditions.update(std::numeric_limits<TimeNs>::max(), 0);
  conditions.update(0, 0);
}

TEST(Conditions, SayByHowMuchAndWhatToDo) {
  testing::internal::CaptureStdout();
  Conditions conditions;
  int asked = 0;
  for (const double t : {1.0, 1.1, 1.2}) {
    conditions.update(from_seconds(t), kStampsDoubtful | kLost | kCalibrationDoubtful, [&](std::uint32_t bit) {
      ++asked;
      return bit == kStampsDoubtful ? std::string("-22 ms") : std::string();
    });
  }
  EXPECT_EQ(asked, 3);  // when each begins
  ASSERT_EQ(conditions.held().size(), 3U);
  int with_detail = 0;
  for (const Conditions::Held& held : conditions.held()) {
    if (held.condition.bit != kStampsDoubtful) {
      EXPECT_EQ(held.detail, "");
      continue;
    }
    ++with_detail;
    EXPECT_EQ(held.detail, "-22 ms");
  }
  EXPECT_EQ(with_detail, 1);
  const std::string log = testing::internal::GetCapturedStdout();
  EXPECT_NE(
      log.find("condition=\"stamps of camera (odometry) and IMU doubtful\" time=1.000000000 detail=\"-22 ms\" hint="),
      std::string::npos)
      << log;
  EXPECT_NE(log.find("loc-calibrate camera"), std::string::npos) << log;
  EXPECT_NE(log.find("condition=\"lost\" time=1.000000000\n"), std::string::npos) << log;
}

struct Written {
  std::vector<Estimate> estimates;
  bool finished = false;
};

class Sink : public EstimateOutput {
 public:
  explicit Sink(Written& to) : to_(to) {}
  void write(const Estimate& estimate) override { to_.estimates.push_back(estimate); }
  void finish() override { to_.finished = true; }

 private:
  Written& to_;
};

// A body that goes east along x of its map, with RTK fixes from from_s on; again in another map from anew_s on.
Written written_of(double from_s, double anew_s, std::size_t most) {
  MapAnchorOptions options;
  options.scale_known = false;
  options.tilt_sigma = 1e-3;
  options.gps_sigma = 0.05;
  MapAnchor anchor(options);
  const LocalFrame world(0.8, 0.2, 100);
  Written out;
  HeldBackOutput output(
      std::make_unique<Sink>(out), [&] { return &anchor; }, most);
  for (int i = 0; i < 400; ++i) {
    const double t = 0.05 * i;
    Estimate pose;
    pose.time_ns = from_seconds(t);
    pose.valid = kValidOrientation | kValidPosition | kValidVelocity;
    pose.q_world_body.setIdentity();
    const double unit = t < anew_s ? 0.5 : 0.25;
    pose.position = Eigen::Vector3d(unit * 4 * (t < anew_s ? t : t - anew_s), 0, 0);
    pose.velocity = Eigen::Vector3d(unit * 4, 0, 0);
    if (i > 0 && t >= anew_s && t - 0.05 < anew_s) pose.status |= kReinitialised;
    anchor.move(pose);
    if (t >= from_s && i % 5 == 0) {
      const GeodeticPoint place = world.to_geodetic({4 * t, 0, 0});
      GpsMeasurement gps;
      gps.time_ns = pose.time_ns;
      gps.fix = GpsFixType::kFixed;
      gps.latitude = place.latitude;
      gps.longitude = place.longitude;
      gps.altitude = place.altitude;
      anchor.fuse(gps);
    }
    output.write(anchor.in_world(pose));
  }
  output.finish();
  return out;
}

TEST(HeldBackOutput, AFileHasOneWorld) {
  const Written out = written_of(8, 1e9, 1000);
  EXPECT_TRUE(out.finished);
  ASSERT_EQ(out.estimates.size(), 400U);
  for (std::size_t i = 0; i < out.estimates.size(); ++i) {
    const Estimate& e = out.estimates[i];
    EXPECT_EQ(e.time_ns, from_seconds(0.05 * static_cast<double>(i)));
    ASSERT_TRUE(std::isfinite(e.origin.latitude)) << i;
    // The first fix, 32 m on the way, is the origin.
    EXPECT_NEAR(e.position.x(), 4 * 0.05 * static_cast<double>(i) - 32, 1) << i;
  }
}

TEST(HeldBackOutput, AnotherMapIsNotPutWhereThisOneIs) {
  // The first map never came to the Earth: its estimates stay in it.
  const Written out = written_of(12, 10, 1000);
  ASSERT_EQ(out.estimates.size(), 400U);
  EXPECT_FALSE(std::isfinite(out.estimates[100].origin.latitude));
  EXPECT_DOUBLE_EQ(out.estimates[100].position.x(), 10);
  EXPECT_TRUE(std::isfinite(out.estimates[210].origin.latitude));
  EXPECT_TRUE(std::isfinite(out.estimates[399].origin.latitude));
}

TEST(HeldBackOutput, HoldsSoManyAndLosesNone) {
  const Written never = written_of(1e9, 1e9, 50);
  ASSERT_EQ(never.estimates.size(), 400U);
  EXPECT_DOUBLE_EQ(never.estimates[399].position.x(), 0.5 * 4 * 0.05 * 399);
  const Written late = written_of(15, 1e9, 50);
  ASSERT_EQ(late.estimates.size(), 400U);
  EXPECT_FALSE(std::isfinite(late.estimates[0].origin.latitude));
  EXPECT_TRUE(std::isfinite(late.estimates[399].origin.latitude));
}

}  // namespace
}  // namespace loc
