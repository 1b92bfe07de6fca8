// Numbers against evo's (golden_evo.py wrote the tables), properties against closed forms.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "libloc/core/check.hpp"
#include "libloc/core/random.hpp"
#include "libloc/eval/trajectory_error.hpp"
#include "libloc/geometry/so3.hpp"
#include "tests/support/numeric_jacobian.hpp"

namespace loc {
namespace {

using test::near;
constexpr TimeNs kSecond = 1'000'000'000;
constexpr TimeNs kStart = 1'700'000'000 * kSecond;

struct PoseRow {
  TimeNs time_ns;
  double w, x, y, z, px, py, pz;
};
constexpr PoseRow kReference[] = {
#include "golden_reference.inc"
};
constexpr PoseRow kEstimate[] = {
#include "golden_estimate.inc"
};
struct StatisticsRow {
  const char* name;
  int count;
  double rmse, mean, median, std, min, max, sse;
};
constexpr StatisticsRow kEvo[] = {
#include "golden_evo.inc"
};
struct AlignmentRow {
  const char* name;
  std::array<double, 13> values;
};
constexpr AlignmentRow kEvoAlignment[] = {
#include "golden_evo_alignment.inc"
};

template <std::size_t N>
Trajectory trajectory_of(const PoseRow (&rows)[N]) {
  Trajectory t;
  for (const PoseRow& r : rows) {
    t.push_back(r.time_ns, {Eigen::Quaterniond(r.w, r.x, r.y, r.z).normalized(), {r.px, r.py, r.pz}});
  }
  return t;
}

Association golden_pairs(const std::string& how) {
  AssociationOptions options;
  options.max_difference_ns = 30'000'000;
  options.interpolate_reference = how == "interpolated";
  return associate(trajectory_of(kEstimate), trajectory_of(kReference), options);
}

void expect_statistics(const ErrorStatistics& ours, const std::string& name) {
  for (const StatisticsRow& row : kEvo) {
    if (row.name != name) continue;
    EXPECT_EQ(ours.count, row.count) << name;
    EXPECT_NEAR(ours.rmse, row.rmse, 1e-9) << name;
    EXPECT_NEAR(ours.mean, row.mean, 1e-9) << name;
    EXPECT_NEAR(ours.median, row.median, 1e-9) << name;
    EXPECT_NEAR(ours.std, row.std, 1e-9) << name;
    EXPECT_NEAR(ours.min, row.min, 1e-9) << name;
    EXPECT_NEAR(ours.max, row.max, 1e-9) << name;
    EXPECT_NEAR(ours.sse, row.sse, 1e-9 * (1 + row.sse)) << name;
    return;
  }
  ADD_FAILURE() << "no row " << name;
}

TEST(TrajectoryError, AbsoluteErrorAgreesWithEvo) {
  for (const std::string how : {"nearest", "interpolated"}) {
    const Association pairs = golden_pairs(how);
    for (const AlignmentMode mode : {AlignmentMode::kNone, AlignmentMode::kSe3, AlignmentMode::kSim3}) {
      const AbsoluteError error = absolute_error(pairs.estimate, pairs.reference, mode);
      const std::string name = how + " " + alignment_name(mode);
      expect_statistics(error.translation, "ape " + name + " translation");
      expect_statistics(error.rotation, "ape " + name + " rotation");
      for (const AlignmentRow& row : kEvoAlignment) {
        if (row.name != name) continue;
        const Eigen::Matrix3d r = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(row.values.data());
        EXPECT_TRUE(near(error.alignment.T_reference_estimate.rotation.toRotationMatrix(), r, 1e-9));
        EXPECT_TRUE(near(error.alignment.T_reference_estimate.translation,
                         Eigen::Map<const Eigen::Vector3d>(row.values.data() + 9), 1e-9));
        EXPECT_NEAR(error.alignment.scale, row.values[12], 1e-10);
      }
    }
  }
}

TEST(TrajectoryError, RelativeErrorAgreesWithEvo) {
  struct Case {
    const char* name;
    double delta;
    DeltaUnit unit;
    bool all_pairs, from_reference;
  };
  const Case cases[] = {{"1 frames consecutive estimate", 1, DeltaUnit::kFrames, false, false},
                        {"5 frames consecutive estimate", 5, DeltaUnit::kFrames, false, false},
                        {"7 frames all estimate", 7, DeltaUnit::kFrames, true, false},
                        {"2 meters consecutive estimate", 2, DeltaUnit::kMetres, false, false},
                        {"2 meters consecutive reference", 2, DeltaUnit::kMetres, false, true},
                        {"3 meters all estimate", 3, DeltaUnit::kMetres, true, false},
                        {"1.5 meters all reference", 1.5, DeltaUnit::kMetres, true, true}};
  for (const std::string how : {"nearest", "interpolated"}) {
    const Association pairs = golden_pairs(how);
    for (const Case& c : cases) {
      RelativeErrorOptions options;
      options.delta = c.delta;
      options.unit = c.unit;
      options.all_pairs = c.all_pairs;
      options.pairs_from_reference = c.from_reference;
      const RelativeError error = relative_error(pairs.estimate, pairs.reference, options);
      const std::string name = "rpe " + how + " " + c.name;
      expect_statistics(error.translation, name + " translation");
      expect_statistics(error.rotation, name + " rotation");
    }
  }
}

Trajectory winding(int count, TimeNs step_ns) {
  Trajectory t;
  for (int i = 0; i < count; ++i) {
    const double s = 0.1 * i;
    t.push_back(kStart + i * step_ns, {so3::exp({0.1 * std::sin(s), 0.2 * std::cos(s), 0.3 * s}),
                                       {3 * std::cos(s), 2 * std::sin(s), 0.2 * s}});
  }
  return t;
}

Trajectory moved(const Trajectory& trajectory, const Pose3& by) {
  Trajectory out;
  for (std::size_t i = 0; i < trajectory.size(); ++i) out.push_back(trajectory.times_ns[i], by * trajectory.poses[i]);
  return out;
}

TEST(TrajectoryError, YawAlignmentLeavesATiltAsRotationError) {
  const Trajectory reference = winding(100, kSecond / 10);
  const Pose3 turn{so3::exp({0, 0, 2.5}), {100, -50, 3}};
  const AbsoluteError turned = absolute_error(moved(reference, turn), reference, AlignmentMode::kYaw);
  EXPECT_LT(turned.translation.max, 1e-12);
  EXPECT_LT(turned.rotation.max, 1e-12);
  // A tilt of the world by 0.01 rad at the origin cannot be taken out.
  const Pose3 tilt{so3::exp({0.01, 0, 0}), {0, 0, 0}};
  const AbsoluteError tilted = absolute_error(moved(reference, tilt), reference, AlignmentMode::kYaw);
  EXPECT_NEAR(tilted.rotation.mean, 0.01, 1e-4);
  EXPECT_LT(absolute_error(moved(reference, tilt), reference, AlignmentMode::kSe3).rotation.max, 1e-12);
}

TEST(TrajectoryError, AKnownErrorComesOut) {
  const Trajectory reference = winding(50, kSecond / 10);
  Trajectory estimate = reference;
  estimate.poses[20].translation += Eigen::Vector3d(3, 0, 4);
  estimate.poses[30].rotation = so3::boxplus(estimate.poses[30].rotation, {0, 0.25, 0});
  const AbsoluteError error = absolute_error(estimate, reference, AlignmentMode::kNone);
  EXPECT_NEAR(error.translation_m[20], 5, 1e-14);
  EXPECT_NEAR(error.translation.rmse, 5 / std::sqrt(50), 1e-14);
  EXPECT_NEAR(error.translation.sse, 25, 1e-13);
  EXPECT_NEAR(error.rotation_rad[30], 0.25, 1e-14);
  EXPECT_NEAR(error.rotation.max, 0.25, 1e-14);
  EXPECT_LT(error.rotation.median, 1e-15);
}

TEST(TrajectoryError, RelativeErrorInSecondsIsTheDriftOfThatTime) {
  // Reference at rest, estimate drifts by 0.1 m/s and turns by 0.02 rad/s about the drift: 10 Hz.
  Trajectory reference;
  Trajectory estimate;
  for (int i = 0; i <= 200; ++i) {
    const double t = 0.1 * i;
    reference.push_back(kStart + i * (kSecond / 10), Pose3{});
    estimate.push_back(kStart + i * (kSecond / 10), {so3::exp({0.02 * t, 0, 0}), {0.1 * t, 0, 0}});
  }
  RelativeErrorOptions options;
  options.unit = DeltaUnit::kSeconds;
  for (const double delta : {0.1, 0.3, 2.0, 2.05}) {
    options.delta = delta;
    options.all_pairs = false;
    // Pieces end to end, as many whole samples as reach delta: not one more by rounding of 0.1 and 0.3.
    const auto samples = static_cast<std::size_t>(std::ceil(delta * 10 - 1e-9));
    const RelativeError consecutive = relative_error(estimate, reference, options);
    EXPECT_EQ(consecutive.first.size(), 200 / samples);
    for (std::size_t i = 0; i < consecutive.first.size(); ++i) {
      EXPECT_EQ(consecutive.first[i], i * samples);
      EXPECT_EQ(consecutive.last[i], (i + 1) * samples);
    }
    EXPECT_NEAR(consecutive.translation.max, 0.01 * static_cast<double>(samples), 1e-13);
    EXPECT_NEAR(consecutive.rotation.min, 0.002 * static_cast<double>(samples), 1e-13);
  }
  options.all_pairs = true;
  options.delta = 2.0;
  const RelativeError all = relative_error(estimate, reference, options);
  EXPECT_EQ(all.first.size(), 183U);  // 181 of 2.0 s, then 1.9 and 1.8 s: within 10 %
  options.relative_tolerance = 0;
  EXPECT_EQ(relative_error(estimate, reference, options).first.size(), 181U);
}

TEST(TrajectoryError, ARigidTransformOfTheEstimateDoesNotChangeTheRelativeError) {
  Random random(1);
  const Trajectory reference = winding(60, kSecond / 10);
  Trajectory estimate = reference;
  for (Pose3& pose : estimate.poses) {
    Vector6d xi;
    xi << 0.1 * random.normal3(), 0.02 * random.normal3();
    pose = pose.boxplus(xi);
  }
  const RelativeError a = relative_error(estimate, reference);
  const RelativeError b = relative_error(moved(estimate, {random.rotation(), random.normal3()}), reference);
  EXPECT_NEAR(a.translation.rmse, b.translation.rmse, 1e-12);
  EXPECT_NEAR(a.rotation.rmse, b.rotation.rmse, 1e-12);
  EXPECT_GT(a.rotation.rmse, 0.01);
}

TEST(Association, PairsTheNearestWithinTheLimitOnce) {
  Trajectory estimate;
  Trajectory reference;
  for (const TimeNs t : {0, 10, 12, 50, 91}) estimate.push_back(t, Pose3{});
  for (const TimeNs t : {1, 11, 30, 60, 70, 80, 90}) reference.push_back(t, Pose3{});
  AssociationOptions options;
  options.max_difference_ns = 2;
  const Association once = associate(estimate, reference, options);
  EXPECT_EQ(once.estimate_index, (std::vector<std::size_t>{0, 1, 4}));
  EXPECT_EQ(once.reference_index, (std::vector<std::size_t>{0, 1, 6}));
  EXPECT_EQ(once.without_partner, 1);
  EXPECT_EQ(once.shared_partner, 1);
  options.one_to_one = false;
  const Association as_evo = associate(estimate, reference, options);
  EXPECT_EQ(as_evo.estimate_index, (std::vector<std::size_t>{0, 1, 2, 4}));
  EXPECT_EQ(as_evo.reference_index, (std::vector<std::size_t>{0, 1, 1, 6}));
  EXPECT_EQ(as_evo.shared_partner, 0);
  // From the shorter one: the roles change, the pairs do not.
  const Association swapped = associate(reference, estimate, options);
  EXPECT_EQ(swapped.reference_index, as_evo.estimate_index);
  EXPECT_EQ(swapped.estimate_index, as_evo.reference_index);
}

TEST(Association, OfTwoThatShareAPartnerTheNearerStays) {
  Trajectory estimate;
  Trajectory reference;
  for (const TimeNs t : {100, 103, 400}) estimate.push_back(t, Pose3{});
  for (const TimeNs t : {104, 200, 300, 400}) reference.push_back(t, Pose3{});
  AssociationOptions options;
  options.max_difference_ns = 10;
  EXPECT_EQ(associate(estimate, reference, options).estimate_index, (std::vector<std::size_t>{1, 2}));
}

TEST(Association, TimeOffsetShiftsTheEstimate) {
  const Trajectory reference = winding(100, kSecond / 10);
  Trajectory estimate = reference;
  for (TimeNs& t : estimate.times_ns) t -= 5 * kSecond;
  AssociationOptions options;
  options.estimate_time_offset_ns = 5 * kSecond;
  const Association pairs = associate(estimate, reference, options);
  EXPECT_EQ(pairs.estimate.size(), 100U);
  EXPECT_EQ(pairs.estimate_index, pairs.reference_index);
  EXPECT_EQ(pairs.estimate.times_ns, estimate.times_ns);
}

TEST(Association, InterpolationDoesNotReachBeyondTheReferenceOrOverItsGaps) {
  Trajectory reference = winding(100, kSecond / 10);
  reference.times_ns.erase(reference.times_ns.begin() + 40, reference.times_ns.begin() + 60);
  reference.poses.erase(reference.poses.begin() + 40, reference.poses.begin() + 60);
  Trajectory estimate;
  for (int i = -10; i < 1010; ++i) estimate.push_back(kStart + i * (kSecond / 100), Pose3{});
  AssociationOptions options;
  options.interpolate_reference = true;
  options.max_difference_ns = kSecond / 20;
  const Association pairs = associate(estimate, reference, options);
  // [0, 3.9] and [6.0, 9.9] s, and 50 ms into the gap from both sides: there its neighbour is near enough.
  EXPECT_EQ(pairs.estimate.size(), 391U + 5 + 5 + 391);
  EXPECT_EQ(pairs.without_partner, 1020 - 792);
  EXPECT_EQ(pairs.reference.times_ns, pairs.estimate.times_ns);
}

TEST(TrajectoryError, StatisticsOfKnownNumbers) {
  const ErrorStatistics s = error_statistics(std::array{1.0, 2.0, 3.0, 6.0});
  EXPECT_EQ(s.count, 4);
  EXPECT_DOUBLE_EQ(s.mean, 3);
  EXPECT_DOUBLE_EQ(s.median, 2.5);
  EXPECT_DOUBLE_EQ(s.sse, 50);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(12.5));
  EXPECT_DOUBLE_EQ(s.std, std::sqrt(3.5));
  EXPECT_EQ(s.min, 1);
  EXPECT_EQ(s.max, 6);
  EXPECT_THROW(error_statistics({}), std::invalid_argument);
  EXPECT_THROW(error_statistics(std::array{1.0, std::numeric_limits<double>::quiet_NaN()}), std::invalid_argument);
}

TEST(TrajectoryError, SaysWhatIsWrongWithTheInput) {
  const Trajectory good = winding(10, kSecond);
  Trajectory later = good;
  for (TimeNs& t : later.times_ns) t += 100 * kSecond;
  EXPECT_THROW(associate(good, later), DataError);
  EXPECT_THROW(associate(Trajectory{}, good), DataError);
  EXPECT_THROW(associate(good, Trajectory{}), DataError);
  Trajectory back = good;
  back.times_ns[5] = back.times_ns[3];
  EXPECT_THROW(associate(back, good), DataError);
  Trajectory with_nan = good;
  with_nan.poses[4].translation.z() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(absolute_error(with_nan, good), DataError);
  EXPECT_THROW(relative_error(good, with_nan), DataError);
  EXPECT_THROW(absolute_error(winding(9, kSecond), good), std::invalid_argument);
  EXPECT_THROW(absolute_error(Trajectory{}, Trajectory{}), DataError);

  Trajectory still;
  for (int i = 0; i < 10; ++i) still.push_back(i, Pose3{});
  try {
    absolute_error(still, still, AlignmentMode::kSe3);
    ADD_FAILURE() << "a standing trajectory was aligned";
  } catch (const DataError& error) {
    EXPECT_EQ(std::string(error.what()).find("alignment se3 of 10 poses: all points are in one place"), 0U);
  }
  EXPECT_EQ(absolute_error(still, still, AlignmentMode::kNone).translation.max, 0);

  RelativeErrorOptions options;
  options.delta = 10;
  EXPECT_THROW(relative_error(good, good, options), DataError);
  options.delta = 9;
  EXPECT_EQ(relative_error(good, good, options).first.size(), 1U);
  options.delta = 1.5;
  EXPECT_THROW(relative_error(good, good, options), std::invalid_argument);
  options.delta = 0;
  EXPECT_THROW(relative_error(good, good, options), std::invalid_argument);
  AssociationOptions association;
  association.max_difference_ns = -1;
  EXPECT_THROW(associate(good, good, association), std::invalid_argument);
}

}  // namespace
}  // namespace loc
