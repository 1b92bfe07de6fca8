// The SLAM filter and its two estimators on a closed-form ride: accuracy, consistency, bad input, bounds.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/estimators/inertial_fusion.hpp"
#include "libloc/estimators/inertial_slam.hpp"
#include "libloc/estimators/mono_slam.hpp"
#include "libloc/eval/trajectory_error.hpp"
#include "support/numeric_jacobian.hpp"
#include "support/slam_ride.hpp"

namespace loc {
namespace {

using test::ride_options;
using test::SlamRide;
using test::SlamRideOptions;

std::int64_t count_of(const NamedCounts& counts, const std::string& name) {
  for (const NamedCount& count : counts) {
    if (count.name == name) return count.value;
  }
  return 0;
}

struct Outcome {
  Trajectory estimate;
  Trajectory truth;
  std::uint32_t status = 0;  // all bits that were said
  Estimate last;
  NamedCounts counts;

  double ate(AlignmentMode mode) const { return absolute_error(estimate, truth, mode).translation.rmse; }
};

template <class Slam>
Outcome ride(Slam& slam, const SlamRideOptions& options, double until_s) {
  SlamRide ride(options);
  Outcome out;
  const auto note = [&](const SlamFrame& frame) {
    out.estimate.times_ns.push_back(frame.time_ns);
    out.estimate.poses.push_back({frame.estimate.q_world_body, frame.estimate.position});
    out.truth.times_ns.push_back(frame.time_ns);
    out.truth.poses.push_back(ride.pose(SlamRide::time_s(frame.time_ns)));
    out.status |= frame.estimate.status;
  };
  ride.run(until_s, [&](const Measurement& measurement) {
    const bool is_new = slam.process(measurement);
    if (is_new) out.status |= slam.estimate().status;
    if constexpr (std::is_same_v<Slam, InertialSlam>) {
      for (const SlamFrame& frame : slam.frames()) note(frame);
    } else {
      if (is_new) note(slam.frame());
    }
  });
  out.last = slam.estimate();
  out.counts = slam.counts();
  return out;
}

TEST(InertialSlam, FindsTheRideInMetresFromRest) {
  InertialSlam slam(ride_options(SlamMotion::kInertial));
  const Outcome out = ride(slam, {}, 20);
  EXPECT_GT(out.estimate.times_ns.size(), 395U) << "from the first frame on";
  EXPECT_LT(out.ate(AlignmentMode::kSe3), 0.03);
  const auto sim3 = absolute_error(out.estimate, out.truth, AlignmentMode::kSim3);
  EXPECT_NEAR(sim3.alignment.scale, 1, 0.01);
  EXPECT_EQ(count_of(out.counts, "starts.at_rest"), 1);
  EXPECT_EQ(count_of(out.counts, "slam.failed_updates"), 0);
  EXPECT_TRUE(test::near(out.last.gyroscope_bias, SlamRideOptions{}.gyroscope_bias, 2e-3));
  EXPECT_TRUE(test::near(out.last.accelerometer_bias, SlamRideOptions{}.accelerometer_bias, 0.05));
  EXPECT_EQ(out.last.status & (kFewFeatures | kScaleUnknown | kInitialising), 0U);
  EXPECT_EQ(out.last.covariance_dim, kInertialDim);
  EXPECT_GT(count_of(out.counts, "slam.converted"), 10);
}

TEST(InertialSlam, StartsInMotion) {
  InertialSlam slam(ride_options(SlamMotion::kInertial));
  SlamRideOptions options;
  options.rest_s = -3;  // has been moving for three seconds
  const Outcome out = ride(slam, options, 15);
  EXPECT_EQ(count_of(out.counts, "starts.moving"), 1);
  EXPECT_GT(out.estimate.times_ns.size(), 240U);
  EXPECT_LT(out.ate(AlignmentMode::kSe3), 0.08);
  EXPECT_NEAR(absolute_error(out.estimate, out.truth, AlignmentMode::kSim3).alignment.scale, 1, 0.03);
}

TEST(MonoSlam, FindsTheRideButForItsUnit) {
  MonoSlam slam(ride_options(SlamMotion::kConstantVelocity));
  const Outcome out = ride(slam, {}, 20);
  EXPECT_EQ(out.estimate.times_ns.size(), 401U) << "every frame has an estimate";
  EXPECT_LT(out.ate(AlignmentMode::kSim3), 0.06);
  EXPECT_NE(out.last.status & kScaleUnknown, 0U);
  EXPECT_EQ(out.last.covariance_dim, 9);
}

// The loosely coupled way: the camera alone is the odometry, the error-state filter finds its scale with the IMU.
TEST(MonoSlam, IsTheOdometryOfTheErrorStateFilter) {
  MonoSlam slam(ride_options(SlamMotion::kConstantVelocity));
  InertialFusionOptions options = InertialFusionOptions::robust();
  options.odometry = OdometryUse::kRelative;
  options.filter.noise = ImuNoise{};
  InertialFusion fusion(options);
  SlamRide world({});
  Trajectory estimate;
  Trajectory truth;
  double scale = 0;
  world.run(20, [&](const Measurement& measurement) {
    if (slam.process(measurement)) {
      OdometryMeasurement odometry = odometry_of(slam.frame());
      odometry.position_cov.diagonal().array() += 1e-6;  // the first pose is exact by definition
      odometry.orientation_cov.diagonal().array() += 1e-8;
      fusion.process(odometry);
    }
    if (!std::holds_alternative<ImuMeasurement>(measurement) || !fusion.process(measurement)) return;
    const Estimate now = fusion.estimate();
    const double t = SlamRide::time_s(now.time_ns);
    scale = now.scale;
    if (t < 5 || (now.valid & kValidPosition) == 0) return;
    estimate.times_ns.push_back(now.time_ns);
    estimate.poses.push_back({now.q_world_body, now.position});
    truth.times_ns.push_back(now.time_ns);
    truth.poses.push_back(world.pose(t));
  });
  ASSERT_GT(estimate.times_ns.size(), 2000U);
  const auto sim3 = absolute_error(estimate, truth, AlignmentMode::kSim3);
  EXPECT_NEAR(sim3.alignment.scale, 1, 0.1) << "metres";
  EXPECT_LT(absolute_error(estimate, truth, AlignmentMode::kSe3).translation.rmse, 0.3);
  EXPECT_GT(std::abs(scale - 1), 0.02) << "the odometry's unit is not the metre";
  SlamFrame empty;
  EXPECT_THROW(odometry_of(empty), std::invalid_argument);
}

// A target of known size fixes the unit; position and heading of world come with it.
TEST(MonoSlam, KnownLandmarksGiveMetres) {
  SlamOptions options = ride_options(SlamMotion::kConstantVelocity);
  SlamRide world({});
  const Pose3 start = world.pose(0);
  options.q_world_body = start.rotation;
  options.position = start.translation;
  const Camera camera(options.camera);
  for (std::size_t i = 0; i < world.points().size() && options.landmarks.size() < 8; ++i) {
    const auto pixel = camera.project((start * options.camera.T_body_camera).inverse() * world.points()[i]);
    if (pixel && camera.in_image(*pixel, 60))
      options.landmarks.push_back({static_cast<std::int64_t>(i), world.points()[i], 1e-3});
  }
  ASSERT_GE(options.landmarks.size(), 4U);
  MonoSlam slam(options);
  const Outcome out = ride(slam, {}, 20);
  EXPECT_LT(out.ate(AlignmentMode::kNone), 0.08) << "without any alignment";
  EXPECT_EQ(out.last.status & kScaleUnknown, 0U);
}

// Wrong features, lost frames, two seconds without any.
TEST(InertialSlam, SurvivesWhatTrackersDo) {
  InertialSlam clean(ride_options(SlamMotion::kInertial));
  const double good = ride(clean, {}, 20).ate(AlignmentMode::kSe3);
  SlamRideOptions bad;
  bad.outlier_rate = 0.1;
  bad.drop_rate = 0.2;
  bad.blind_from_s = 10;
  bad.blind_to_s = 12;
  InertialSlam slam(ride_options(SlamMotion::kInertial));
  const Outcome out = ride(slam, bad, 20);
  EXPECT_LT(out.ate(AlignmentMode::kSe3), std::max(2 * good, 0.03));
  EXPECT_NE(out.status & kFewFeatures, 0U) << "the pause is told";
  EXPECT_EQ(out.last.status & kFewFeatures, 0U) << "and so is its end";
  EXPECT_GT(count_of(out.counts, "slam.rejected"), 200);
}

TEST(MonoSlam, SurvivesWhatTrackersDo) {
  MonoSlam clean(ride_options(SlamMotion::kConstantVelocity));
  const double good = ride(clean, {}, 20).ate(AlignmentMode::kSim3);
  SlamRideOptions bad;
  bad.outlier_rate = 0.1;
  bad.drop_rate = 0.2;
  MonoSlam slam(ride_options(SlamMotion::kConstantVelocity));
  const Outcome out = ride(slam, bad, 20);
  EXPECT_LT(out.ate(AlignmentMode::kSim3), std::max(2 * good, 0.06));
}

// Two seconds in the dark leave the camera alone metres off: it finds itself in its map with the first frame after
// them.
TEST(MonoSlam, FindsItselfAgainAfterTheDark) {
  SlamOptions options = ride_options(SlamMotion::kConstantVelocity);
  SlamRideOptions dark;
  dark.blind_from_s = 10;
  dark.blind_to_s = 12;
  SlamRide world(dark);
  const Pose3 start = world.pose(0);
  options.q_world_body = start.rotation;
  options.position = start.translation;
  const Camera camera(options.camera);
  for (std::size_t i = 0; i < world.points().size() && options.landmarks.size() < 8; ++i) {
    const auto pixel = camera.project((start * options.camera.T_body_camera).inverse() * world.points()[i]);
    if (!pixel || !camera.in_image(*pixel, 60)) continue;
    options.landmarks.push_back({static_cast<std::int64_t>(i), world.points()[i], 1e-3});
  }
  MonoSlam slam(options);
  const Outcome out = ride(slam, dark, 14);
  double in_the_dark = 0;
  double after = 0;
  for (std::size_t i = 0; i < out.truth.times_ns.size(); ++i) {
    const double t = SlamRide::time_s(out.truth.times_ns[i]);
    const double error = (out.truth.poses[i].translation - out.estimate.poses[i].translation).norm();
    if (t > 11 && t < 11.99) in_the_dark = std::max(in_the_dark, error);
    if (t >= 12) after = std::max(after, error);
  }
  EXPECT_GT(in_the_dark, 1) << "else the test would show nothing";
  EXPECT_LT(after, 0.15);
}

// Streams come in the order of their stamps: a camera whose clock is ahead comes when the IMU is past it.
TEST(InertialSlam, ACameraWhoseClockIsAheadIsNotLost) {
  constexpr double kOffset = -0.02;
  SlamOptions options = ride_options(SlamMotion::kInertial);
  options.camera.time_offset_s = kOffset;
  InertialSlam slam(options);
  SlamRide world({});
  std::vector<Measurement> recording;
  world.run(10, [&](Measurement measurement) {
    if (std::holds_alternative<FeaturesMeasurement>(measurement))
      stamp_of(measurement).time_ns -= from_seconds(kOffset);
    recording.push_back(measurement);
  });
  std::stable_sort(recording.begin(), recording.end(), [](const Measurement& a, const Measurement& b) {
    return stamp_of(a).time_ns < stamp_of(b).time_ns;
  });
  for (const Measurement& measurement : recording) slam.process(measurement);
  EXPECT_EQ(count_of(slam.counts(), "features.skipped.late"), 0);
  EXPECT_GT(count_of(slam.counts(), "features.used"), 190);
  const double t = SlamRide::time_s(slam.estimate().time_ns);
  EXPECT_LT((slam.estimate().position - world.pose(t).translation).norm(), 0.05);
}

TEST(InertialSlam, BeginsWithTheHeadingThatIsGiven) {
  SlamOptions options = ride_options(SlamMotion::kInertial);
  options.q_world_body = Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitZ()));
  InertialSlam slam(options);
  ride(slam, {}, 1.4);
  EXPECT_NEAR(so3::heading(slam.estimate().q_world_body), 1, 0.01);
}

// Identities of different points that change places are outliers like any other.
TEST(InertialSlam, SurvivesSwitchedIdentities) {
  InertialSlam slam(ride_options(SlamMotion::kInertial));
  SlamRide world({});
  Random random(3);
  Trajectory estimate;
  Trajectory truth;
  world.run(15, [&](Measurement measurement) {
    if (auto* frame = std::get_if<FeaturesMeasurement>(&measurement); frame != nullptr && frame->sequence % 4 == 0) {
      for (int k = 0; k < 3 && frame->features.size() > 4; ++k) {
        const auto pick = [&] {
          return static_cast<std::size_t>(random.uniform() * static_cast<double>(frame->features.size()));
        };
        std::swap(frame->features[pick()].id, frame->features[pick()].id);
      }
    }
    slam.process(measurement);
    for (const SlamFrame& frame : slam.frames()) {
      estimate.times_ns.push_back(frame.time_ns);
      estimate.poses.push_back({frame.estimate.q_world_body, frame.estimate.position});
      truth.times_ns.push_back(frame.time_ns);
      truth.poses.push_back(world.pose(SlamRide::time_s(frame.time_ns)));
    }
  });
  EXPECT_LT(absolute_error(estimate, truth, AlignmentMode::kSe3).translation.rmse, 0.03);
}

TEST(InertialSlam, EstimatesExtrinsicsAndTimeOffset) {
  SlamOptions options = ride_options(SlamMotion::kInertial);
  options.estimate_extrinsics = true;
  options.estimate_time_offset = true;
  options.sigma_extrinsic_rotation = 0.03;
  options.sigma_extrinsic_position = 0.03;
  const Pose3 truth = options.camera.T_body_camera;
  options.camera.T_body_camera.rotation = so3::boxplus(truth.rotation, {0.02, -0.015, 0.02});
  options.camera.T_body_camera.translation += Eigen::Vector3d(0.02, -0.02, 0.01);
  options.camera.time_offset_s = 0.004;  // none is true
  InertialSlam slam(options);
  const Outcome out = ride(slam, {}, 25);
  const SlamState& state = slam.filter().state();
  const SlamLayout& layout = slam.filter().layout();
  const Eigen::MatrixXd p = slam.filter().head_covariance();
  const Eigen::Vector3d turn = so3::boxminus(truth.rotation, state.T_body_camera.rotation);
  EXPECT_LT(turn.norm(), 0.006);
  EXPECT_LT((state.T_body_camera.translation - truth.translation).norm(), 0.015);
  EXPECT_LT(std::abs(state.time_offset_s), 0.0015);
  EXPECT_LT(std::sqrt(p(layout.extrinsic_rotation, layout.extrinsic_rotation)), 0.005);
  EXPECT_LT(std::sqrt(p(layout.time_offset, layout.time_offset)), 0.001);
  EXPECT_LT(out.ate(AlignmentMode::kSe3), 0.05);
}

// What turns everything about the vertical is known no better after frames than before them, and stays a turn: at the
// latest estimate for invariant errors, where plain Jacobians leave the filter with what nobody told it.
TEST(SlamFilter, HeadingStaysUnobservable) {
  const auto run = [](SlamConsistency consistency) {
    SlamOptions options = ride_options(SlamMotion::kInertial);
    options.consistency = consistency;
    SlamFilter filter(options);
    SlamRideOptions moving;
    moving.rest_s = -2;
    SlamRide world(moving);
    const Pose3 pose = world.pose(0);
    SlamState state;
    state.q_world_body = so3::boxplus(pose.rotation, {0.03, -0.02, 0.03});
    state.position = pose.translation;
    state.velocity = world.velocity(0) + Eigen::Vector3d(0.2, -0.1, 0.1);
    state.gyroscope_bias = moving.gyroscope_bias;
    state.T_body_camera = options.camera.T_body_camera;
    const auto direction = [&](const SlamState& x) {
      Eigen::VectorXd n = Eigen::VectorXd::Zero(filter.layout().dim);
      n.segment<3>(kTheta) = x.q_world_body.conjugate() * Eigen::Vector3d::UnitZ();
      n.segment<3>(kPosition) = Eigen::Vector3d::UnitZ().cross(x.position);
      n.segment<3>(kVelocity) = Eigen::Vector3d::UnitZ().cross(x.velocity);
      return n;
    };
    Eigen::VectorXd sigma = Eigen::VectorXd::Constant(filter.layout().dim, 0.05);
    sigma.segment<3>(kPosition).setConstant(1e-4);
    sigma.segment<3>(kVelocity).setConstant(0.3);
    sigma.segment<3>(kGyroscopeBias).setConstant(1e-4);
    const Eigen::VectorXd n = direction(state);
    const Eigen::MatrixXd p = sigma.array().square().matrix().asDiagonal();
    filter.start(SlamRide::time_ns(0), state, p + 0.25 * n * n.transpose());
    for (int sample = 0; sample <= 400; ++sample) {
      const ImuMeasurement imu = world.imu(sample);
      if (sample > 0) {
        const InertialStep step{imu.angular_velocity - filter.state().gyroscope_bias,
                                imu.specific_force - filter.state().accelerometer_bias, 1 / SlamRide::kImuHz};
        filter.propagate(imu.time_ns, step, {1e-10, 1e-8, 0, 0, 0});
      }
      if (sample % 10 == 0) filter.update(*world.frame(sample / 10));
    }
    // The variance of the heading, and how much of it the position shares as a turn says.
    const Eigen::MatrixXd after = filter.head_covariance();
    const Eigen::VectorXd now = direction(filter.state());
    const Eigen::Vector3d up = now.segment<3>(kTheta);
    const double variance = up.dot(after.block<3, 3>(kTheta, kTheta) * up);
    const Eigen::Vector3d shared = after.block<3, 3>(kPosition, kTheta) * up / variance;
    return std::pair(variance, (shared - now.segment<3>(kPosition)).norm());
  };
  const auto [variance, off] = run(SlamConsistency::kInvariant);
  EXPECT_NEAR(variance, 0.25, 0.02);
  EXPECT_LT(off, 0.02);
  EXPECT_LT(run(SlamConsistency::kPlain).first, 0.8 * variance) << "else the test would show nothing";
}

// NEES over seeds, inertial: a filter that is right says how wrong it is.
TEST(InertialSlam, CovarianceIsHonest) {
  double nees = 0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    SlamRideOptions options;
    options.seed = seed;
    options.accelerometer_bias = 0.05 * Random(seed).normal3();
    SlamOptions settings = ride_options(SlamMotion::kInertial);
    settings.imu_noise.accelerometer_bias_sigma = 0.05;
    InertialSlam slam(settings);
    SlamRide world(options);
    world.run(12, [&](const Measurement& measurement) {
      slam.process(measurement);
      for (const SlamFrame& frame : slam.frames()) {
        const double t = SlamRide::time_s(frame.time_ns);
        if (t < 4 || frame.sequence % 10 != 0) continue;
        const Eigen::Vector3d error = world.pose(t).translation - frame.estimate.position;
        nees += error.dot(frame.estimate.covariance.block<3, 3>(kPosition, kPosition).ldlt().solve(error));
        ++count;
      }
    });
  }
  const double mean = nees / count;
  RecordProperty("nees", std::to_string(mean));
  EXPECT_GT(mean, 1.0);
  EXPECT_LT(mean, 6.0) << "3 is right";
}

TEST(SlamFilter, FloatAndDoubleAgree) {
  Outcome outcomes[2];
  for (const SlamPrecision precision : {SlamPrecision::kDouble, SlamPrecision::kFloat}) {
    SlamOptions options = ride_options(SlamMotion::kInertial);
    options.precision = precision;
    InertialSlam slam(options);
    outcomes[static_cast<int>(precision)] = ride(slam, {}, 12);
    EXPECT_EQ(count_of(slam.counts(), "slam.failed_updates"), 0);
  }
  const auto difference = absolute_error(outcomes[0].estimate, outcomes[1].estimate, AlignmentMode::kNone);
  EXPECT_LT(difference.translation.max, 0.01);
  EXPECT_GT(difference.translation.max, 0) << "they are not the same arithmetic";
}

TEST(SlamFilter, SameInputSameOutput) {
  Outcome outcomes[2];
  for (Outcome& outcome : outcomes) {
    InertialSlam slam(ride_options(SlamMotion::kInertial));
    SlamRideOptions options;
    options.outlier_rate = 0.1;
    outcome = ride(slam, options, 6);
  }
  for (std::size_t i = 0; i < outcomes[0].estimate.poses.size(); ++i) {
    ASSERT_EQ(outcomes[0].estimate.poses[i].translation, outcomes[1].estimate.poses[i].translation);
    ASSERT_EQ(outcomes[0].estimate.poses[i].rotation.coeffs(), outcomes[1].estimate.poses[i].rotation.coeffs());
  }
}

// The map stays within its bounds, forgets what is gone, and finds again what comes back.
TEST(SlamFilter, MapIsBoundedAndRemembers) {
  SlamOptions options = ride_options(SlamMotion::kInertial);
  options.map.max_features = 40;
  options.map.max_measured = 12;
  options.map.min_visible = 12;
  InertialSlam slam(options);
  SlamRide world({});
  std::int64_t most = 0;
  std::int64_t measured = 0;
  bool seen_again = false;
  std::map<std::int64_t, TimeNs> last_seen;
  world.run(20, [&](const Measurement& measurement) {
    slam.process(measurement);
    for (const SlamFrame& frame : slam.frames()) {
      most = std::max(most, frame.counts.map);
      measured = std::max(measured, frame.counts.measured);
      for (const SlamFeature& feature : frame.features) {
        if (feature.state != SlamFeatureState::kMeasured) continue;
        const auto found = last_seen.find(feature.id);
        if (found != last_seen.end() && frame.time_ns - found->second > 2'000'000'000) seen_again = true;
        last_seen[feature.id] = frame.time_ns;
      }
    }
  });
  EXPECT_LE(most, 40);
  EXPECT_LE(measured, 12);
  EXPECT_TRUE(seen_again) << "a feature that was out of view for two seconds is used again";
  for (const SlamMapPoint& point : slam.map()) {
    if (!point.position.allFinite()) continue;
    const Eigen::Vector3d error = point.position - world.points()[static_cast<std::size_t>(point.id)];
    if (point.converted) {
      EXPECT_LT(error.norm(), 0.5) << point.id;
    }
  }
}

TEST(SlamFilter, GoesOnFromASnapshotAsIfNothingHadBeen) {
  InertialSlam first(ride_options(SlamMotion::kInertial));
  SlamRide world({});
  SlamFilter copy(first.options());
  bool taken = false;
  world.run(8, [&](const Measurement& measurement) {
    first.process(measurement);
    if (first.frames().empty() || SlamRide::time_s(first.frames().back().time_ns) < 5) return;
    if (!taken) {
      copy.restore(first.snapshot());
      taken = true;
      EXPECT_EQ(copy.landmarks().size(), first.filter().landmarks().size());
      EXPECT_TRUE(test::near(copy.covariance().dense(), first.filter().covariance().dense(), 0));
    }
  });
  ASSERT_TRUE(taken);
  // Same frame, same answer.
  SlamSnapshot snapshot = first.snapshot();
  SlamFilter a(first.options());
  SlamFilter b(first.options());
  a.restore(snapshot);
  b.restore(snapshot);
  const auto frame = *world.frame(161);
  EXPECT_EQ(a.update(frame).estimate.position, b.update(frame).estimate.position);

  SlamOptions other = first.options();
  other.map.max_features = 10;
  other.map.max_measured = 10;
  other.map.min_visible = 5;
  EXPECT_THROW(SlamFilter(other).restore(snapshot), std::invalid_argument);
  other = first.options();
  other.estimate_time_offset = true;
  EXPECT_THROW(SlamFilter(other).restore(snapshot), std::invalid_argument);
  snapshot.covariance(0, 0) = kUnknown;
  EXPECT_THROW(a.restore(snapshot), std::invalid_argument);
}

TEST(InertialSlam, BadInputIsCountedAndTold) {
  InertialSlam slam(ride_options(SlamMotion::kInertial));
  SlamRide world({});
  int sample = 0;
  world.run(6, [&](const Measurement& measurement) {
    slam.process(measurement);
    if (++sample % 100 != 50) return;
    Measurement bad = measurement;
    if (auto* imu = std::get_if<ImuMeasurement>(&bad)) {
      slam.process(bad);  // the same time again
      imu->time_ns += 1;
      imu->specific_force.x() = kUnknown;
      slam.process(bad);
      imu->specific_force.x() = 1e4;
      slam.process(bad);
    }
    FeaturesMeasurement old;
    old.time_ns = SlamRide::time_ns(0);
    slam.process(old);
    old.camera = 3;  // another camera's
    slam.process(old);
  });
  const NamedCounts counts = slam.counts();
  EXPECT_GT(count_of(counts, "imu.skipped.not_finite"), 5);
  EXPECT_GT(count_of(counts, "imu.skipped.out_of_range"), 5);
  EXPECT_GT(count_of(counts, "imu.skipped.time_not_increasing"), 5);
  EXPECT_GT(count_of(counts, "features.skipped.time_not_increasing"), 5);
  EXPECT_LT((slam.estimate().position - world.pose(6).translation).norm(), 0.1);
}

TEST(SlamFilter, BadFeaturesAreLeftOut) {
  MonoSlam slam(ride_options(SlamMotion::kConstantVelocity));
  SlamRide world({});
  FeaturesMeasurement frame = *world.frame(0);
  const auto count = static_cast<std::int64_t>(frame.features.size());
  frame.features[0].pixel_px.x() = kUnknown;
  frame.features[1].pixel_px = {-50, 10};
  frame.features[2].id = frame.features[3].id;
  ASSERT_TRUE(slam.process(frame));
  EXPECT_EQ(slam.frame().counts.in_frame, count);
  EXPECT_EQ(count_of(slam.counts(), "slam.features.not_usable"), 2);
  EXPECT_EQ(count_of(slam.counts(), "slam.features.ambiguous"), 1);
  for (const SlamFeature& feature : slam.frame().features) {
    EXPECT_NE(feature.id, frame.features[0].id);
    EXPECT_NE(feature.id, frame.features[3].id);
  }
}

// Gaps of the IMU: a short one is bridged, a long one begins anew where the body was.
TEST(InertialSlam, GapsAreToldAndSurvived) {
  for (const double gap : {0.3, 3.0}) {
    InertialSlam slam(ride_options(SlamMotion::kInertial));
    SlamRide world({});
    std::uint32_t status = 0;
    world.run(16, [&](const Measurement& measurement) {
      const double t = SlamRide::time_s(stamp_of(measurement).time_ns);
      if (t > 8 && t < 8 + gap) return;
      if (slam.process(measurement) && t > 8) status |= slam.estimate().status;
    });
    EXPECT_NE(status & kGap, 0U);
    EXPECT_EQ((status & kReinitialised) != 0, gap > 1) << gap;
    EXPECT_TRUE(slam.running());
    const double error = (slam.estimate().position - world.pose(16).translation).norm();
    const double sigma = std::sqrt(slam.estimate().covariance.block<3, 3>(kPosition, kPosition).trace());
    EXPECT_LT(error, 4 * sigma + 0.05) << gap;
    if (gap < 1) {
      EXPECT_LT(error, 0.3);
    }
  }
}

// What a front end is told before a frame is what the filter itself expects then.
TEST(MonoSlam, ExpectsFramesAsItFindsThem) {
  for (const bool second_order : {false, true}) {
    SlamOptions options = ride_options(SlamMotion::kConstantVelocity);
    options.second_order_noise = second_order;
    MonoSlam slam(options);
    SlamRide world({});
    SlamPrediction expected;
    slam.predict_frame(0, expected);
    EXPECT_FALSE(expected.valid) << "before the first frame";
    for (int i = 0; i < 60; ++i) slam.process(*world.frame(i));
    FeaturesMeasurement frame = *world.frame(60);
    frame.sigma_px = kUnknown;
    slam.predict_frame(frame.time_ns, expected);
    ASSERT_TRUE(expected.valid);
    const std::vector<SlamLandmark> map = slam.filter().landmarks();
    ASSERT_EQ(expected.features.size(), map.size());
    ASSERT_TRUE(slam.process(frame));
    int compared = 0;
    for (const SlamFeature& feature : slam.frame().features) {
      const auto found = std::find_if(expected.features.begin(), expected.features.end(),
                                      [&](const SlamFeaturePrediction& one) { return one.id == feature.id; });
      if (found == expected.features.end() || !found->visible || !feature.innovation_cov.allFinite()) continue;
      EXPECT_TRUE(test::near(found->pixel_px, feature.predicted_px, 1e-9));
      EXPECT_LT((found->search_cov - feature.innovation_cov).norm(), 1e-6 * feature.innovation_cov.norm());
      ++compared;
    }
    EXPECT_GT(compared, 20);
    slam.predict_frame(frame.time_ns, expected);
    EXPECT_FALSE(expected.valid) << "not after the last frame";
    slam.predict_frame(frame.time_ns + from_seconds(options.max_gap_s + 0.1), expected);
    EXPECT_FALSE(expected.valid) << "after a pause";
    EXPECT_TRUE(expected.lost);
    ASSERT_EQ(expected.features.size(), slam.map().size());
    for (const SlamFeaturePrediction& one : expected.features) EXPECT_FALSE(one.visible);
  }
}

TEST(InertialSlam, ExpectsFramesAsItFindsThem) {
  InertialSlam slam(ride_options(SlamMotion::kInertial));
  SlamRide world({});
  SlamPrediction expected;
  double worst = 0;
  int frames = 0;
  world.run(8, [&](const Measurement& measurement) {
    const auto* frame = std::get_if<FeaturesMeasurement>(&measurement);
    if (frame != nullptr && SlamRide::time_s(frame->time_ns) > 4) {
      slam.predict_frame(frame->time_ns, expected);
      ASSERT_TRUE(expected.valid);
    }
    slam.process(measurement);
    if (!expected.valid) return;
    for (const SlamFrame& done : slam.frames()) {
      if (done.time_ns != expected.time_ns) continue;
      ++frames;
      for (const SlamFeature& feature : done.features) {
        for (const SlamFeaturePrediction& one : expected.features) {
          if (one.id != feature.id || !one.visible || !feature.predicted_px.allFinite()) continue;
          worst = std::max(worst, (one.pixel_px - feature.predicted_px).norm());
        }
      }
    }
  });
  EXPECT_GT(frames, 60);
  EXPECT_LT(worst, 0.5) << "all but the last samples of the IMU were there";
}

TEST(MonoSlam, GapsAndClocksSetBack) {
  MonoSlam slam(ride_options(SlamMotion::kConstantVelocity));
  SlamRide world({});
  for (int i = 0; i < 100; ++i) slam.process(*world.frame(i));
  FeaturesMeasurement late = *world.frame(150);
  ASSERT_TRUE(slam.process(late));
  EXPECT_NE(slam.estimate().status & kGap, 0U);
  EXPECT_EQ(count_of(slam.counts(), "gaps"), 1);
  // Ten frames of an earlier time in a row are another clock.
  int taken = 0;
  for (int i = 10; i < 25; ++i) taken += slam.process(*world.frame(i)) ? 1 : 0;
  EXPECT_EQ(taken, 6);
  EXPECT_EQ(count_of(slam.counts(), "features.time_not_increasing"), 10);
  slam.reset();
  EXPECT_FALSE(slam.running());
  EXPECT_TRUE(slam.process(*world.frame(3)));
}

TEST(SlamOptions, ChecksNameTheField) {
  const auto message = [](auto change) {
    SlamOptions options = ride_options(SlamMotion::kInertial);
    change(options);
    try {
      options.check();
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message([](SlamOptions&) {}), "");
  EXPECT_NE(message([](SlamOptions& o) { o.map.inverse_depth = -1; }).find("map.inverse_depth = -1"),
            std::string::npos);
  EXPECT_NE(message([](SlamOptions& o) { o.map.min_visible = 81; }).find("map.min_visible"), std::string::npos);
  EXPECT_NE(message([](SlamOptions& o) { o.association.gate_probability = 1; }).find("gate_probability"),
            std::string::npos);
  EXPECT_NE(message([](SlamOptions& o) { o.sigma_px = kUnknown; }).find("sigma_px"), std::string::npos);
  EXPECT_NE(message([](SlamOptions& o) {
              o.landmarks = {{1, {0, 0, 0}, 1}, {1, {0, 0, 0}, 1}};
            }).find("comes twice"),
            std::string::npos);
  EXPECT_NE(message([](SlamOptions& o) { o.moving_start_factor = 0; }).find("moving_start_factor"), std::string::npos);
  EXPECT_THROW(MonoSlam{ride_options(SlamMotion::kInertial)}, std::invalid_argument);
  EXPECT_THROW(InertialSlam{ride_options(SlamMotion::kConstantVelocity)}, std::invalid_argument);
  EXPECT_EQ(parse_slam_consistency("first-estimate"), SlamConsistency::kFirstEstimate);
  EXPECT_THROW(parse_slam_consistency("none"), std::invalid_argument);
}

}  // namespace
}  // namespace loc
