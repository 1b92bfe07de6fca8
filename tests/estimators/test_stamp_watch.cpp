// Stamps of the camera that are a second off against the IMU's: told, with the offset, whether SLAM can start or not.
// On a real flight, which turns quickly, 30 ms are.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "libloc/estimators/inertial_slam.hpp"
#include "libloc/estimators/stamp_watch.hpp"
#include "libloc/io/eqvio.hpp"
#include "support/data.hpp"
#include "support/slam_ride.hpp"

namespace loc {
namespace {

using test::ride_options;
using test::SlamRide;

struct Outcome {
  double offset_s = kUnknown;
  bool doubtful = false;
  bool said = false;  // kStampsDoubtful in an estimate
};

Outcome run(const SlamOptions& options, std::vector<Measurement> all, double late_s) {
  for (Measurement& m : all) {
    if (auto* frame = std::get_if<FeaturesMeasurement>(&m)) frame->time_ns += from_seconds(late_s);
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const auto& a, const auto& b) { return stamp_of(a).time_ns < stamp_of(b).time_ns; });
  InertialSlam slam(options);
  Outcome out;
  for (const Measurement& m : all) {
    slam.process(m);
    out.said |= (slam.estimate().status & kStampsDoubtful) != 0;
  }
  out.offset_s = slam.stamp_watch().offset_s();
  out.doubtful = slam.stamp_watch().doubtful();
  return out;
}

Outcome fly(double late_s, const SlamOptions& options = ride_options(SlamMotion::kInertial)) {
  SlamRide world({.seed = 3});
  std::vector<Measurement> all;
  world.run(24, [&](const Measurement& m) { all.push_back(m); });
  return run(options, std::move(all), late_s);
}

TEST(StampWatch, RightStamps) {
  const Outcome o = fly(0);
  EXPECT_FALSE(o.said);
  EXPECT_NEAR(o.offset_s, 0, 0.045);
}

TEST(StampWatch, ASecondLateOrEarly) {
  for (const double late : {1.0, -1.0}) {
    const Outcome o = fly(late);
    EXPECT_TRUE(o.said) << late;
    EXPECT_NEAR(o.offset_s, -late, 0.15);
  }
}

TEST(StampWatch, AKnownOffsetIsNoDoubt) {
  SlamOptions options = ride_options(SlamMotion::kInertial);
  options.camera.time_offset_s = -0.5;
  const Outcome o = fly(0.5, options);
  EXPECT_FALSE(o.said);
  EXPECT_NEAR(o.offset_s, 0, 0.045);
}

TEST(StampWatch, SaysNothingAtRest) {
  SlamRide world({.rest_s = 100});
  StampWatch watch(SlamRide::calibration());
  world.run(20, [&](const Measurement& m) {
    if (const auto* imu = std::get_if<ImuMeasurement>(&m)) watch.see(*imu);
    if (const auto* frame = std::get_if<FeaturesMeasurement>(&m)) watch.see(*frame);
  });
  EXPECT_TRUE(std::isnan(watch.offset_s()));
  EXPECT_FALSE(watch.doubtful());
}

TEST(StampWatch, EurocV101) {
  LOC_DATA_OR_SKIP(folder, "euroc-v101-tracks");
  const auto source = open_eqvio(folder / "tracks_and_imu.csv");
  SlamOptions options;
  options.motion = SlamMotion::kInertial;
  options.camera = source->rig().cameras.at(0);
  std::vector<Measurement> all;
  while (auto m = source->next()) all.push_back(std::move(*m));
  const Outcome right = run(options, all, 0);
  EXPECT_FALSE(right.said);
  EXPECT_NEAR(right.offset_s, 0, 0.005);
  for (const double late : {0.03, -0.1}) {
    const Outcome o = run(options, all, late);
    EXPECT_TRUE(o.doubtful) << late;
    EXPECT_NEAR(o.offset_s, -late, 0.005);
  }
  for (const double late : {1.0, -1.0}) {
    const Outcome o = run(options, all, late);
    EXPECT_TRUE(o.doubtful) << late;
    EXPECT_NEAR(o.offset_s, -late, 0.05);
  }
}

}  // namespace
}  // namespace loc
