// Whether wrong intrinsics are told from the innovations of SLAM, and right ones are left in peace: flight in a room
// with an IMU, camera alone, and EuRoC V1_01.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <variant>

#include "libloc/estimators/inertial_slam.hpp"
#include "libloc/estimators/mono_slam.hpp"
#include "libloc/estimators/residual_watch.hpp"
#include "libloc/io/eqvio.hpp"
#include "support/data.hpp"
#include "support/slam_ride.hpp"

namespace loc {
namespace {

using test::ride_options;
using test::SlamRide;
using Change = std::function<void(CameraCalibration&)>;

struct Outcome {
  ResidualWatchVerdict verdict;
  bool said = false;  // kCalibrationDoubtful in an estimate
};

std::ostream& operator<<(std::ostream& out, const Outcome& o) {
  return out << "db " << o.verdict.db.transpose() << " sigma " << o.verdict.sigma.transpose() << " said " << o.said;
}

template <class Slam>
Outcome fly(SlamOptions options, const Change& change, std::uint64_t seed) {
  change(options.camera);
  Slam slam(options);
  SlamRide world({.seed = seed});
  Outcome out;
  world.run(24, [&](const Measurement& m) {
    if (std::is_same_v<Slam, MonoSlam> && !std::holds_alternative<FeaturesMeasurement>(m)) return;
    slam.process(m);
    out.said |= (slam.estimate().status & kCalibrationDoubtful) != 0;
  });
  out.verdict = slam.filter().residual_watch().verdict();
  return out;
}

Outcome fly_with_imu(const Change& change, std::uint64_t seed = 1) {
  return fly<InertialSlam>(ride_options(SlamMotion::kInertial), change, seed);
}

TEST(ResidualWatch, RightIntrinsicsAreLeftInPeace) {
  for (const std::uint64_t seed : {1U, 2U}) {
    const Outcome o = fly_with_imu([](CameraCalibration&) {}, seed);
    EXPECT_FALSE(o.said) << o;
    EXPECT_TRUE(o.verdict.db.allFinite());  // it had enough to judge
  }
}

TEST(ResidualWatch, WrongFocalLength) {
  for (const double factor : {0.9, 1.1}) {
    const Outcome o = fly_with_imu([&](CameraCalibration& c) { c.intrinsics_px.head<2>() *= factor; });
    EXPECT_TRUE(o.said) << factor << ": " << o;
    EXPECT_LT(o.verdict.db[0] * std::log(factor), 0) << o;
  }
}

TEST(ResidualWatch, WrongPrincipalPoint) {
  const Outcome o = fly_with_imu([](CameraCalibration& c) { c.intrinsics_px[2] += 25; });
  EXPECT_TRUE(o.said) << o;
  EXPECT_LT(o.verdict.db[1], 0) << o;
}

TEST(ResidualWatch, WrongDistortion) {
  const Outcome o = fly_with_imu([](CameraCalibration& c) { c.distortion.setZero(); });
  EXPECT_TRUE(o.said) << o;
}

TEST(ResidualWatch, CameraAloneRight) {
  const Outcome o = fly<MonoSlam>(
      ride_options(SlamMotion::kConstantVelocity), [](CameraCalibration&) {}, 1);
  EXPECT_FALSE(o.said) << o;
}

TEST(ResidualWatch, SaysNothingWithoutTurning) {
  SlamOptions options = ride_options(SlamMotion::kInertial);
  options.camera.intrinsics_px.head<2>() *= 1.1;
  InertialSlam slam(options);
  SlamRide world({.glide = 0.3});
  world.run(12, [&](const Measurement& m) {
    slam.process(m);
    EXPECT_EQ(slam.estimate().status & kCalibrationDoubtful, 0U);
  });
  EXPECT_TRUE(slam.filter().residual_watch().verdict().db.array().isNaN().all());
}

Outcome fly_v101(const std::filesystem::path& folder, SlamMotion motion, const Change& change) {
  const auto source = open_eqvio(folder / "tracks_and_imu.csv");
  SlamOptions options;
  options.motion = motion;
  options.camera = source->rig().cameras.at(0);
  change(options.camera);
  Outcome out;
  const auto run = [&](auto slam) {
    while (const auto m = source->next()) {
      slam.process(*m);
      out.said |= (slam.estimate().status & kCalibrationDoubtful) != 0;
    }
    out.verdict = slam.filter().residual_watch().verdict();
  };
  if (motion == SlamMotion::kInertial) {
    run(InertialSlam(options));
  } else {
    run(MonoSlam(options));
  }
  return out;
}

TEST(ResidualWatch, EurocV101) {
  LOC_DATA_OR_SKIP(folder, "euroc-v101-tracks");
  const Change none = [](CameraCalibration&) {};
  for (const SlamMotion motion : {SlamMotion::kInertial, SlamMotion::kConstantVelocity}) {
    const Outcome right = fly_v101(folder, motion, none);
    EXPECT_FALSE(right.said) << right;
    EXPECT_TRUE(right.verdict.db.allFinite());
  }
  const Change centre = [](CameraCalibration& c) { c.intrinsics_px[3] += 20; };
  const Change focal = [](CameraCalibration& c) { c.intrinsics_px.head<2>() *= 1.1; };
  const Change lens = [](CameraCalibration& c) {
    c.distortion_model = DistortionModel::kRadtan;
    c.distortion[0] = 0.1;
  };
  for (const Change& change : {centre, focal, lens}) {
    const Outcome wrong = fly_v101(folder, SlamMotion::kInertial, change);
    EXPECT_TRUE(wrong.said) << wrong;
  }
}

TEST(ResidualWatch, OptionsAreChecked) {
  const CameraCalibration camera = SlamRide::calibration();
  EXPECT_THROW(ResidualWatch(camera, {.batch_frames = 0}), std::invalid_argument);
  EXPECT_THROW(ResidualWatch(camera, {.least_batches = 16}), std::invalid_argument);
  EXPECT_THROW(ResidualWatch(camera, {.least_focal = std::nan("")}), std::invalid_argument);
}

}  // namespace
}  // namespace loc
