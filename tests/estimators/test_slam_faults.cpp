// What sensors and files do wrong, and what SLAM makes of it: stamps, deviations, long gaps, frames without features,
// saved states that are broken, an estimator that is used again; and what must not be taken for rest.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>

#include "libloc/estimators/inertial_slam.hpp"
#include "libloc/estimators/mono_slam.hpp"
#include "support/slam_ride.hpp"

namespace loc {
namespace {

using test::ride_options;
using test::SlamRide;
using test::SlamRideOptions;

constexpr TimeNs kDayNs = 86'400'000'000'000;

std::int64_t count_of(const NamedCounts& counts, const std::string& name) {
  for (const NamedCount& count : counts) {
    if (count.name == name) return count.value;
  }
  return 0;
}

double seconds_of(const Measurement& measurement) {
  return SlamRide::time_s(stamp_of(measurement).time_ns);
}

double position_sigma(const Estimate& estimate) {
  return std::sqrt(estimate.covariance.block<3, 3>(kPosition, kPosition).trace());
}

template <class Slam>
double error_at(const Slam& slam, const SlamRide& world) {
  const Estimate estimate = slam.estimate();
  return (estimate.position - world.pose(SlamRide::time_s(estimate.time_ns)).translation).norm();
}

void expect_usable(const Estimate& estimate) {
  ASSERT_NE(estimate.valid & kValidPosition, 0U);
  EXPECT_TRUE(estimate.position.allFinite());
  EXPECT_TRUE(estimate.velocity.allFinite());
  const int n = estimate.covariance_dim;
  const Eigen::MatrixXd p = estimate.covariance.topLeftCorner(n, n);
  ASSERT_TRUE(p.allFinite());
  EXPECT_TRUE((p.diagonal().array() >= 0).all()) << p.diagonal().transpose();
}

void expect_same(const Estimate& a, const Estimate& b) {
  EXPECT_EQ(a.time_ns, b.time_ns);
  EXPECT_EQ(a.valid, b.valid);
  EXPECT_EQ(a.status, b.status);
  const auto same = [](const auto& x, const auto& y) {
    return ((x.array() == y.array()) || (x.array().isNaN() && y.array().isNaN())).all();
  };
  EXPECT_TRUE(same(a.q_world_body.coeffs(), b.q_world_body.coeffs()));
  EXPECT_TRUE(same(a.position, b.position));
  EXPECT_TRUE(same(a.velocity, b.velocity));
  ASSERT_EQ(a.covariance_dim, b.covariance_dim);
  const int n = a.covariance_dim;
  EXPECT_TRUE(same(a.covariance.topLeftCorner(n, n), b.covariance.topLeftCorner(n, n)));
}

// One bit of a stamp is wrong: the frame is left out, those after it are not.
TEST(SlamFaults, AFrameFarInTheFutureIsLeftOut) {
  InertialSlam slam(ride_options(SlamMotion::kInertial));
  SlamRide world({});
  int wrong = 0;
  std::uint32_t status = 0;
  world.run(6, [&](Measurement measurement) {
    if (std::holds_alternative<FeaturesMeasurement>(measurement)) {
      const double t = seconds_of(measurement);
      if (t == 0.5 || t == 3 || t == 4) {  // before the start, too
        stamp_of(measurement).time_ns += t == 4 ? std::numeric_limits<TimeNs>::max() / 2 : kDayNs;
        ++wrong;
      }
    }
    slam.process(measurement);
    status |= slam.estimate().status;
  });
  ASSERT_EQ(wrong, 3);
  EXPECT_EQ(count_of(slam.counts(), "features.skipped.out_of_range"), 3);
  EXPECT_EQ(count_of(slam.counts(), "features.skipped.time_not_increasing"), 0);
  EXPECT_EQ(count_of(slam.counts(), "features.used"), 121 - 3);
  EXPECT_NE(status & kOutOfRange, 0U) << "it is told";
  EXPECT_EQ(status & kFewFeatures, 0U);
  EXPECT_LT(error_at(slam, world), 0.05);
}

// With one clock alone it may be a pause: what followed is believed when it goes on.
TEST(SlamFaults, TheCameraAloneComesBackFromAFrameInTheFuture) {
  for (const TimeNs ahead : {TimeNs{10} * kDayNs, std::numeric_limits<TimeNs>::max() - SlamRide::time_ns(6)}) {
    SlamOptions options = ride_options(SlamMotion::kConstantVelocity);
    SlamRide world({});
    options.q_world_body = world.pose(0).rotation;
    MonoSlam slam(options);
    int used_after = 0;
    for (int i = 0; i < 160; ++i) {
      FeaturesMeasurement frame = *world.frame(i);
      if (i == 80) frame.time_ns += ahead;
      used_after += slam.process(frame) && i > 80 ? 1 : 0;
      expect_usable(slam.estimate());
    }
    EXPECT_GE(used_after, 70);
    EXPECT_EQ(count_of(slam.counts(), "features.out_of_range"), ahead > 100 * kDayNs ? 1 : 0);
    EXPECT_EQ(count_of(slam.counts(), "diverged"), 0);
    EXPECT_EQ(count_of(slam.counts(), "slam.failed_updates"), 0);
    EXPECT_EQ(slam.estimate().status & kFewFeatures, 0U);
    EXPECT_LT(position_sigma(slam.estimate()), 20);
  }
}

// One sample far ahead is an error of its stamp: nothing is lost but that sample.
TEST(SlamFaults, OneImuSampleFarAheadChangesNothing) {
  InertialSlam slam(ride_options(SlamMotion::kInertial));
  InertialSlam without(ride_options(SlamMotion::kInertial));
  SlamRide world({});
  bool told = false;
  world.run(6, [&](Measurement measurement) {
    const bool is_wrong = std::holds_alternative<ImuMeasurement>(measurement) && seconds_of(measurement) == 4;
    if (!is_wrong) without.process(measurement);
    if (is_wrong) stamp_of(measurement).time_ns += kDayNs;
    const bool is_new = slam.process(measurement);
    if (is_wrong) {
      EXPECT_FALSE(is_new) << "held until the next one tells what it was";
    }
    told = told || (slam.estimate().status & kOutOfRange) != 0;
    if (!is_wrong) {
      Estimate estimate = slam.estimate();
      estimate.status &= ~kOutOfRange;
      expect_same(estimate, without.estimate());
    }
  });
  EXPECT_TRUE(told);
  EXPECT_EQ(count_of(slam.counts(), "imu.skipped.alone_after_gap"), 1);
  EXPECT_EQ(count_of(slam.counts(), "imu.gaps.restarted"), 0);
  EXPECT_EQ(count_of(slam.counts(), "imu.used"), count_of(without.counts(), "imu.used"));
}

// Two that agree are a pause: a new start, which is told.
TEST(SlamFaults, SamplesThatGoOnAfterTheGapAreAPause) {
  InertialSlam slam(ride_options(SlamMotion::kInertial));
  SlamRide world({});
  std::uint32_t status = 0;
  world.run(9, [&](Measurement measurement) {
    const bool after = seconds_of(measurement) >= 4;
    if (after) stamp_of(measurement).time_ns += 5'000'000'000;
    if (slam.process(measurement) && after) status |= slam.estimate().status;
  });
  EXPECT_EQ(count_of(slam.counts(), "imu.gaps.restarted"), 1);
  EXPECT_NE(status & kReinitialised, 0U);
  EXPECT_TRUE(slam.running());
}

// A deviation that no tracker has is as good as none: that of the options holds, bit for bit.
TEST(SlamFaults, DeviationsOutOfRangeAreNotUsed) {
  const double wrong[] = {1e200, 1e-200, 0, -1, std::numeric_limits<double>::infinity(), 1e4};
  for (const SlamMotion motion : {SlamMotion::kInertial, SlamMotion::kConstantVelocity}) {
    const auto run = [&](auto slam, bool say_wrong) {
      SlamRide world({});
      int n = 0;
      world.run(4, [&](Measurement measurement) {
        if (auto* frame = std::get_if<FeaturesMeasurement>(&measurement); frame != nullptr && ++n % 10 == 5) {
          frame->sigma_px = say_wrong ? wrong[static_cast<std::size_t>(n / 10) % std::size(wrong)] : kUnknown;
        }
        slam.process(measurement);
      });
      EXPECT_EQ(count_of(slam.counts(), "slam.sigma_px.not_usable"), say_wrong ? 8 : 0);
      expect_usable(slam.estimate());
      return slam.estimate();
    };
    if (motion == SlamMotion::kInertial) {
      expect_same(run(InertialSlam(ride_options(motion)), true), run(InertialSlam(ride_options(motion)), false));
    } else {
      expect_same(run(MonoSlam(ride_options(motion)), true), run(MonoSlam(ride_options(motion)), false));
    }
  }
}

// What is not known any more is not known better than by a bound: one must be able to calculate with it.
TEST(SlamFaults, VariancesAreBoundedAfterLongGaps) {
  for (const TimeNs gap : {TimeNs{100'000'000'000}, TimeNs{30} * kDayNs}) {
    InertialSlam slam(ride_options(SlamMotion::kInertial));
    SlamRide world({});
    double widest = 0;
    world.run(9, [&](Measurement measurement) {
      const bool after = seconds_of(measurement) >= 4;
      if (after) stamp_of(measurement).time_ns += gap;
      if (!slam.process(measurement)) return;
      expect_usable(slam.estimate());
      if (after) widest = std::max(widest, position_sigma(slam.estimate()));
    });
    EXPECT_EQ(count_of(slam.counts(), "starts.moving"), 1);
    EXPECT_GT(widest, 50) << "the place is not known any more";
    EXPECT_LT(widest, 200);
    EXPECT_EQ(count_of(slam.counts(), "slam.failed_updates"), 0);
    EXPECT_EQ(count_of(slam.counts(), "diverged"), 0);
    EXPECT_EQ(slam.estimate().status & (kFewFeatures | kFeaturesRejected), 0U);
  }
}

// A body that glides slowly moves by less than a pixel from frame to frame.
TEST(SlamFaults, CreepingIsNotTakenForRest) {
  for (const double rate_hz : {20.0, 50.0}) {
    SlamRideOptions creeping;
    creeping.glide = 0.1;
    creeping.rate_hz = rate_hz;
    double error[2];
    for (const bool zero_velocity : {false, true}) {
      SlamOptions options = ride_options(SlamMotion::kInertial);
      options.zero_velocity = zero_velocity;
      InertialSlam slam(options);
      SlamRide world(creeping);
      int moving = 0;
      int said_rest = 0;
      world.run(9, [&](const Measurement& measurement) {
        if (!slam.process(measurement) || seconds_of(measurement) < 4) return;
        ++moving;
        said_rest += (slam.estimate().status & kAtRest) != 0 ? 1 : 0;
      });
      ASSERT_GT(moving, 900);
      EXPECT_EQ(said_rest, 0) << rate_hz;
      error[zero_velocity ? 1 : 0] = error_at(slam, world);
    }
    EXPECT_LT(error[1], error[0] + 0.01) << "the zero velocity does no harm";
    EXPECT_LT(error[1], 0.2) << "of 0.65 m; the scale is hardly seen";
  }
}

// It stands from the start on: that is rest, before it has ever moved.
TEST(SlamFaults, RestFromTheStartOnIsTold) {
  SlamRideOptions standing;
  standing.rest_s = 6;
  InertialSlam slam(ride_options(SlamMotion::kInertial));
  SlamRide world(standing);
  int samples = 0;
  int said = 0;
  int frames_that_say = 0;
  world.run(5.99, [&](const Measurement& measurement) {
    const bool is_new = slam.process(measurement);
    if (seconds_of(measurement) < 2.1) return;
    for (const SlamFrame& frame : slam.frames()) frames_that_say += (frame.estimate.status & kAtRest) != 0 ? 1 : 0;
    if (!is_new) return;
    ++samples;
    said += (slam.estimate().status & kAtRest) != 0 ? 1 : 0;
  });
  EXPECT_EQ(said, samples);
  EXPECT_GE(frames_that_say, 70);
  EXPECT_GE(count_of(slam.counts(), "rest.used"), 9);
  EXPECT_EQ(count_of(slam.counts(), "rest.rejected"), 0);
  EXPECT_LT(slam.estimate().velocity.norm(), 5e-3);
}

SlamSnapshot good_snapshot(const SlamOptions& options) {
  InertialSlam slam(options);
  SlamRide world({});
  world.run(3, [&](const Measurement& measurement) { slam.process(measurement); });
  return slam.snapshot();
}

FeaturesMeasurement frame_of(SlamRide& world) {
  return *world.frame(0);
}

// A state that cannot be right is refused by name, and the estimator is what it was.
TEST(SlamFaults, BrokenSnapshotsAreRefused) {
  const SlamOptions options = ride_options(SlamMotion::kInertial);
  const SlamSnapshot good = good_snapshot(options);
  ASSERT_GT(good.landmarks.size(), 10U);
  const auto spherical = static_cast<std::size_t>(
      std::find_if(good.landmarks.begin(), good.landmarks.end(), [](const auto& l) { return !l.point.converted; }) -
      good.landmarks.begin());
  ASSERT_LT(spherical, good.landmarks.size());
  const std::pair<std::function<void(SlamSnapshot&)>, const char*> changes[] = {
      {[](SlamSnapshot& s) { s.time_ns = kNoTime; }, "without a time"},
      {[](SlamSnapshot& s) { s.state.position.x() = kUnknown; }, "the state is not finite"},
      {[](SlamSnapshot& s) { s.state.gyroscope_bias.z() = INFINITY; }, "the state is not finite"},
      {[](SlamSnapshot& s) { s.state.time_offset_s = kUnknown; }, "the state is not finite"},
      {[](SlamSnapshot& s) { s.state.q_world_body.coeffs().setZero(); }, "quaternion"},
      {[](SlamSnapshot& s) { s.state.T_body_camera.rotation.coeffs() *= 2; }, "quaternion"},
      {[](SlamSnapshot& s) { s.covariance(3, 2) = kUnknown; }, "not finite"},
      {[](SlamSnapshot& s) { s.covariance(20, 20) *= -1; }, "a variance is negative"},
      {[](SlamSnapshot& s) { s.covariance(20, 2) += std::sqrt(s.covariance(20, 20) * s.covariance(2, 2)); },
       "not symmetric"},
      {[](SlamSnapshot& s) {
         s.covariance(20, 2) = s.covariance(2, 20) = 2 * std::sqrt(s.covariance(20, 20) * s.covariance(2, 2));
       },
       "not positive"},
      {[](SlamSnapshot& s) { s.covariance.conservativeResize(s.covariance.rows() - 1, s.covariance.cols() - 1); },
       "does not fit"},
      {[](SlamSnapshot& s) { s.covariance.conservativeResize(s.covariance.rows(), s.covariance.cols() - 1); },
       "does not fit"},
      {[](SlamSnapshot& s) { s.landmarks[1].id = s.landmarks[0].id; }, "comes twice"},
      {[](SlamSnapshot& s) { ++s.landmarks[1].offset; }, "out of place"},
      {[](SlamSnapshot& s) { s.landmarks[2].tries = kUnknown; }, "is not finite"},
      {[=](SlamSnapshot& s) { s.landmarks[spherical].point.inverse_depth.inverse_depth = kUnknown; }, "is not finite"},
      {[=](SlamSnapshot& s) { s.landmarks[spherical].first.inverse_depth.anchor.x() = kUnknown; }, "is not finite"},
      {[=](SlamSnapshot& s) { s.landmarks[spherical].first.converted = true; }, "two kinds"},
      {[](SlamSnapshot& s) {
         MonoSlam other(ride_options(SlamMotion::kConstantVelocity));
         other.process(*SlamRide({}).frame(0));
         s = other.snapshot();  // the camera alone has another state
       },
       "snapshot"},
  };
  InertialSlam slam(options);
  InertialSlam undisturbed(options);
  std::size_t next = 0;
  SlamRide world({});
  world.run(4, [&](const Measurement& measurement) {
    slam.process(measurement);
    undisturbed.process(measurement);
    if (seconds_of(measurement) < 2 || next == std::size(changes)) return;
    SlamSnapshot broken = good;
    changes[next].first(broken);
    try {
      slam.restore(broken);
      ADD_FAILURE() << "taken: " << next << ", " << changes[next].second;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(changes[next].second), std::string::npos) << error.what();
    }
    ++next;
  });
  EXPECT_EQ(next, std::size(changes));
  expect_same(slam.estimate(), undisturbed.estimate());
  EXPECT_NO_THROW(slam.restore(good));
  EXPECT_EQ(slam.map().size(), good.landmarks.size());

  SlamOptions single = options;
  single.precision = SlamPrecision::kFloat;
  const SlamSnapshot rounded = good_snapshot(single);
  EXPECT_NO_THROW(InertialSlam(single).restore(rounded)) << "rounding is no fault";
}

// After reset() and after restore() nothing is left of what was before.
TEST(SlamFaults, ResetIsAFreshObject) {
  SlamRideOptions wild;
  wild.seed = 7;
  wild.outlier_rate = 0.2;
  wild.rest_s = 3;
  wild.blind_from_s = 4.2;  // its last frames say that there are few features
  const auto compare = [&](auto used, auto fresh, auto again, const SlamRideOptions& ride) {
    SlamRide before(ride);
    before.run(4.3, [&](Measurement measurement) {
      stamp_of(measurement).time_ns -= 100'000'000'000;
      used.process(measurement);
    });
    again(used);
    again(fresh);
    expect_same(used.estimate(), fresh.estimate());
    EXPECT_EQ(used.running(), fresh.running());
    EXPECT_EQ(used.map().size(), fresh.map().size());
    EXPECT_TRUE(used.filter().frame().features.empty());
    SlamRide world({});
    const NamedCounts counts = used.counts();
    world.run(4, [&](const Measurement& measurement) {
      EXPECT_EQ(used.process(measurement), fresh.process(measurement));
      expect_same(used.estimate(), fresh.estimate());
    });
    EXPECT_TRUE(used.running());
    for (const char* name : {"features.used", "slam.measured", "slam.added", "slam.rejected"}) {
      EXPECT_EQ(count_of(used.counts(), name) - count_of(counts, name), count_of(fresh.counts(), name)) << name;
    }
  };
  const SlamOptions inertial = ride_options(SlamMotion::kInertial);
  const SlamOptions alone = ride_options(SlamMotion::kConstantVelocity);
  const auto reset = [](auto& slam) { slam.reset(); };
  compare(InertialSlam(inertial), InertialSlam(inertial), reset, wild);
  compare(MonoSlam(alone), MonoSlam(alone), reset, wild);
  const SlamSnapshot snapshot = good_snapshot(inertial);
  const auto restore = [&](auto& slam) { slam.restore(snapshot); };
  compare(InertialSlam(inertial), InertialSlam(inertial), restore, wild);
  SlamRideOptions standing;  // its picture is that of the next ride's beginning
  standing.rest_s = 10;
  compare(InertialSlam(inertial), InertialSlam(inertial), restore, standing);
}

// Tracks that are mostly wrong cost a start all attempts that there are: they are not made again and again, or a live
// program would fall behind. When the tracks are right it starts.
TEST(SlamFaults, HopelessStartsAreTriedLessOften) {
  SlamOptions options = ride_options(SlamMotion::kInertial);
  options.moving_start.max_frames = options.moving_start.min_frames = 10;  // cheaper
  options.moving_start.max_features = 24;
  options.moving_start.min_features = 6;
  InertialSlam slam(options);
  SlamRideOptions moving;
  moving.rest_s = -3;
  SlamRide world(moving);
  Random random(4);
  constexpr double kUntil = 3.5;
  double running_since = 0;
  std::int64_t tried = 0;
  world.run(7.5, [&](Measurement measurement) {
    const double t = seconds_of(measurement);
    if (auto* frame = std::get_if<FeaturesMeasurement>(&measurement); frame != nullptr && t < kUntil) {
      for (FeatureObservation& feature : frame->features) {
        if (random.uniform() < 0.5) feature.pixel_px = {random.uniform(0, 639), random.uniform(0, 479)};
      }
    }
    if (slam.running()) return;
    slam.process(measurement);
    if (t < kUntil) {
      tried =
          count_of(slam.counts(), "starts.refused.residual") + count_of(slam.counts(), "starts.refused.no-solution");
    }
    if (slam.running()) running_since = t;
  });
  EXPECT_GE(tried, 3);
  EXPECT_LE(tried, 5) << "every five frames it would be 8";
  EXPECT_GT(running_since, kUntil);
  EXPECT_LT(running_since, kUntil + 4);
}

// The end of a recording: frames that wait for a sample after them are taken when it would not change what they say.
TEST(SlamFaults, TheEndTakesTheFramesThatWait) {
  const SlamOptions options = ride_options(SlamMotion::kInertial);
  const auto last = [](const InertialSlam& slam) { return SlamRide::time_s(slam.frames().back().time_ns); };
  SlamRide world({});
  InertialSlam at_sample(options);
  world.run(5, [&](const Measurement& measurement) { at_sample.process(measurement); });
  ASSERT_EQ(count_of(at_sample.counts(), "features.waiting"), 0);

  for (const double after : {0.0, 0.002, 0.005, 0.02}) {
    // The last frame comes after the last sample.
    InertialSlam slam(options);
    SlamRide ride({});
    FeaturesMeasurement frame;
    ride.run(5, [&](const Measurement& measurement) {
      if (const auto* f = std::get_if<FeaturesMeasurement>(&measurement); f != nullptr && f->sequence == 100) {
        frame = *f;
      } else {
        slam.process(measurement);
      }
    });
    frame.time_ns += from_seconds(after);  // as if it had been taken then: hardly anything moves in that time
    EXPECT_FALSE(slam.process(frame));
    EXPECT_EQ(count_of(slam.counts(), "features.waiting"), 1);
    slam.finish();
    const bool near = after < 0.01;
    ASSERT_EQ(slam.frames().size(), near ? 1U : 0U) << after;
    EXPECT_EQ(count_of(slam.counts(), "features.waiting"), near ? 0 : 1);
    if (!near) continue;
    EXPECT_NEAR(last(slam), 5 + after, 1e-9);
    EXPECT_LT((slam.frames().back().estimate.position - world.pose(5 + after).translation).norm(), 0.05);
    if (after == 0) {
      EXPECT_EQ(slam.frames().back().estimate.position, at_sample.estimate().position) << "nothing is made up";
    }
    slam.finish();
    EXPECT_TRUE(slam.frames().empty()) << "once";
    // It may go on.
    ImuMeasurement next = ride.imu(1001);
    next.time_ns = SlamRide::time_ns(5.01);
    EXPECT_TRUE(slam.process(next));
    expect_usable(slam.estimate());
  }

  // Samples that are held back for a camera whose clock is ahead leave, too.
  SlamOptions ahead = options;
  ahead.camera.time_offset_s = -0.02;
  InertialSlam slam(ahead);
  SlamRide ride({});
  ride.run(4, [&](const Measurement& measurement) { slam.process(measurement); });
  EXPECT_NEAR(SlamRide::time_s(slam.estimate().time_ns), 3.98, 1e-9);
  EXPECT_TRUE(slam.finish());
  EXPECT_NEAR(SlamRide::time_s(slam.estimate().time_ns), 4, 1e-9);

  InertialSlam empty(options);
  EXPECT_FALSE(empty.finish());
  empty.restore(good_snapshot(options));
  EXPECT_FALSE(empty.process(frame_of(world)));
  EXPECT_FALSE(empty.finish()) << "nobody knows when it is";
}

// In the dark there is nothing to add: nobody leaves the map for it, and it is said.
TEST(SlamFaults, FramesWithoutFeaturesKeepTheMap) {
  SlamOptions options = ride_options(SlamMotion::kInertial);
  options.map.max_features = options.map.max_measured = options.map.min_visible = 40;
  SlamRideOptions dark;
  dark.blind_from_s = 5;
  dark.blind_to_s = 5.4;
  InertialSlam slam(options);
  SlamRide world(dark);
  std::size_t before = 0;
  int blind = 0;
  world.run(5.3, [&](const Measurement& measurement) {
    slam.process(measurement);
    for (const SlamFrame& frame : slam.frames()) {
      if (frame.counts.in_frame > 0) continue;
      ++blind;
      EXPECT_EQ(frame.counts.deleted, 0);
      EXPECT_EQ(frame.counts.visible > 0, true);
      EXPECT_NE(frame.estimate.status & kFewFeatures, 0U);
    }
    if (blind == 0) before = slam.map().size();
  });
  EXPECT_GE(blind, 6);
  EXPECT_GE(before, 38U) << "there is no room";
  EXPECT_EQ(slam.map().size(), before);

  MonoSlam alone(ride_options(SlamMotion::kConstantVelocity));
  FeaturesMeasurement empty;
  empty.time_ns = SlamRide::time_ns(0);
  ASSERT_TRUE(alone.process(empty));
  EXPECT_NE(alone.estimate().status & kFewFeatures, 0U) << "also with a map that has nothing yet";
  empty.time_ns += 50'000'000;
  empty.features = {{1, {kUnknown, 1}}, {2, {1, kUnknown}}, {3, {kUnknown, 5}}, {4, {kUnknown, 9}}};
  ASSERT_TRUE(alone.process(empty));
  EXPECT_NE(alone.estimate().status & kFewFeatures, 0U) << "pixels that are no numbers are no features";
}

TEST(SlamFaults, NoFrameAfterRestoreIsTold) {
  const SlamOptions options = ride_options(SlamMotion::kInertial);
  InertialSlam slam(options);
  slam.restore(good_snapshot(options));
  SlamRide world({});
  for (int i = 0; i < 400; ++i) {
    const ImuMeasurement imu = world.imu(i);
    ASSERT_TRUE(slam.process(imu));
    const bool few = (slam.estimate().status & kFewFeatures) != 0;
    const double t = SlamRide::time_s(imu.time_ns);
    if (t < options.lost_after_s - 0.01) {
      EXPECT_FALSE(few) << t;
    }
    if (t > options.lost_after_s + 0.01) {
      EXPECT_TRUE(few) << t;
    }
  }
}

// What live programs publish with each sample says of the last frame what the frame itself says.
TEST(SlamFaults, RejectedFeaturesAreToldBetweenFrames) {
  InertialSlam slam(ride_options(SlamMotion::kInertial));
  SlamRide world({});
  Random random(5);
  int rejected = 0;
  world.run(5, [&](Measurement measurement) {
    if (auto* frame = std::get_if<FeaturesMeasurement>(&measurement); frame != nullptr && seconds_of(measurement) > 4) {
      for (FeatureObservation& feature : frame->features) {
        feature.pixel_px = {random.uniform(0, 639), random.uniform(0, 479)};
      }
    }
    if (!slam.process(measurement) || seconds_of(measurement) < 3) return;
    const bool told = (slam.estimate().status & kFeaturesRejected) != 0;
    const SlamFrame& frame = slam.filter().frame();
    EXPECT_EQ(told, frame.counts.rejected > frame.counts.measured) << seconds_of(measurement);
    rejected += told ? 1 : 0;
  });
  EXPECT_GT(rejected, 50);
}

// A lens that was covered: the map is as it was, and what follows finds itself in it. With other surroundings nothing
// joins the map for relocate_s; then it goes on in them.
TEST(SlamFaults, WhatDoesNotFindItselfInItsMapSaysSoUntilItDoes) {
  for (const bool elsewhere : {false, true}) {
    SlamOptions options = ride_options(SlamMotion::kConstantVelocity);
    options.relocate_s = 0.75;
    MonoSlam slam(options);
    SlamRide world({.rest_s = 0, .blind_from_s = 3, .blind_to_s = elsewhere ? 3 : 4.5});
    std::size_t map_before = 0;
    int refound = 0;
    world.run(6, [&](Measurement measurement) {
      auto* frame = std::get_if<FeaturesMeasurement>(&measurement);
      if (frame == nullptr) return;
      const double t = seconds_of(measurement);
      if (elsewhere && t >= 3) {
        for (FeatureObservation& feature : frame->features) feature.id += 1000;
      }
      ASSERT_TRUE(slam.process(measurement));
      const std::uint32_t status = slam.estimate().status;
      const double end = elsewhere ? 3.75 : 4.5;  // relocate_s, then one more whose features are known
      const double since = t - 2.95;
      EXPECT_EQ((status & kLost) != 0, since > options.lost_after_s + 1e-9 && t < end - 1e-9) << t;
      EXPECT_EQ((status & kMapLinkUnknown) != 0, elsewhere && t >= end - 1e-9) << t;
      if ((status & kLost) != 0) {
        // It may have stopped, or turned back.
        const double sigma = std::sqrt(slam.estimate().covariance.block<3, 3>(3, 3).trace());
        EXPECT_GT(sigma, 0.99 * std::sqrt(3) * options.sigma_velocity * since) << t;
      }
      if (t < 2.96) map_before = slam.map().size();
      if (t > 2.96 && t < end - 0.04 - (elsewhere ? 0.05 : 0)) {
        EXPECT_EQ(slam.map().size(), map_before) << t;
        EXPECT_TRUE((status & kRefound) == 0) << t;
      }
      if ((status & kRefound) == 0) return;
      ++refound;
      EXPECT_NEAR(t, 4.5, 1e-9);
    });
    EXPECT_EQ(refound, elsewhere ? 0 : 1);
    EXPECT_EQ(count_of(slam.counts(), "slam.gone_on"), elsewhere ? 1 : 0);
    EXPECT_GT(slam.frame().counts.measured, 20);
  }
}

// New surroundings for a while, then the old ones again: the link to them is told to be unknown until they are seen.
TEST(SlamFaults, TheLinkToAMapThatWasLeftIsUnknownUntilItIsSeenAgain) {
  SlamOptions options = ride_options(SlamMotion::kConstantVelocity);
  options.relocate_s = 0.75;
  MonoSlam slam(options);
  SlamRide world({.rest_s = 0});
  int refound = 0;
  std::uint32_t status = 0;
  double linked_s = 0;
  world.run(7, [&](Measurement measurement) {
    auto* frame = std::get_if<FeaturesMeasurement>(&measurement);
    if (frame == nullptr) return;
    const double t = seconds_of(measurement);
    if (t >= 3 && t < 4.5) {
      for (FeatureObservation& feature : frame->features) feature.id += 1000;
    }
    ASSERT_TRUE(slam.process(measurement));
    status = slam.estimate().status;
    if (t > 3.8 && t < 4.5) {
      EXPECT_EQ(status & (kMapLinkUnknown | kLost), kMapLinkUnknown) << t;
    }
    if ((status & kRefound) != 0) {
      ++refound;
      linked_s = t;
    }
  });
  EXPECT_EQ(refound, 1);
  EXPECT_GE(linked_s, 4.5);
  EXPECT_EQ(status & kMapLinkUnknown, 0U);
  EXPECT_GE(count_of(slam.counts(), "slam.gone_on"), 1);
}

}  // namespace
}  // namespace loc
