// Offset of a position stream against a reference: simulated drives whose offset is known, and the pntOS drive when
// LIBLOC_PNTOS_LOG names it.
#include <gtest/gtest.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <numbers>
#include <string>

#include "libloc/calib/time_offset.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/random.hpp"
#include "libloc/core/statistics.hpp"
#include "msgs/lcm_log_source.hpp"

namespace loc {
namespace {

struct Drive {
  PositionStream stream;
  PositionStream reference;
};

struct DriveOptions {
  double offset_s = -0.2;  // t_reference = t_stream + offset
  double speed = 12;
  double speed_wave = 8;  // it stops and goes
  double turn_wave = 0.5;
  double sigma_m = 0.5;
  double correlation_s = 30;  // of the errors
  double duration_s = 900;
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d lever_arm = Eigen::Vector3d::Zero();
};

// 1 Hz positions with correlated errors, 50 Hz reference.
Drive simulate_drive(const DriveOptions& o, std::uint64_t seed) {
  Drive drive;
  Random random(seed);
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d error = Eigen::Vector3d::Zero();
  const double keep = o.correlation_s > 0 ? std::exp(-1 / o.correlation_s) : 0;
  double heading = 0.3;
  constexpr int kStepMs = 5;
  const TimeNs offset = from_seconds(o.offset_s);
  for (int ms = 0; ms < 1000 * o.duration_s; ms += kStepMs) {
    // The middle of the step, so that the sum is the integral.
    const double t = 1e-3 * (ms + 0.5 * kStepMs);
    const double speed = o.speed + o.speed_wave * std::sin(0.31 * t) * std::cos(0.047 * t);
    heading += 1e-3 * kStepMs * o.turn_wave * std::sin(0.11 * t);
    const Eigen::Vector3d velocity(speed * std::cos(heading), speed * std::sin(heading), 0);
    const Eigen::Quaterniond rotation(Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()));
    const TimeNs now = 1'700'000'000'000'000'000 + TimeNs{ms} * 1'000'000;
    if (ms % 20 == 0) {
      drive.reference.times_ns.push_back(now);
      drive.reference.positions.push_back(position);
      drive.reference.velocities.push_back(velocity);
      drive.reference.rotations.push_back(rotation);
    }
    if (ms % 1000 == 500) {
      error = keep * error + std::sqrt(1 - keep * keep) * o.sigma_m * random.normal3();
      drive.stream.times_ns.push_back(now - offset);
      drive.stream.positions.push_back(position + error + o.bias + rotation * o.lever_arm);
    }
    position += 1e-3 * kStepMs * velocity;
  }
  return drive;
}

TEST(TimeOffset, sign_and_value) {
  for (const double offset : {-0.2, 0.35, 0.0, -0.9}) {
    const Drive drive = simulate_drive({.offset_s = offset}, 1);
    const TimeOffsetResult r = estimate_time_offset(drive.stream, drive.reference, {.bias_sigma_m = 0});
    EXPECT_NEAR(r.offset_s, offset, 4 * r.sigma_s) << "t_reference = t_stream + offset";
    EXPECT_LT(r.sigma_s, 0.03);
    EXPECT_TRUE(r.converged);
    EXPECT_EQ(r.quality.verdict, Verdict::kOk) << (r.quality.reasons.empty() ? "" : r.quality.reasons[0]);
    EXPECT_LT(r.rms_after_m, 1.0);
    if (offset != 0) {
      EXPECT_GT(r.rms_before_m, 1.3 * r.rms_after_m);
    }
  }
}

TEST(TimeOffset, exact_without_noise) {
  const Drive drive = simulate_drive({.offset_s = 0.1234, .sigma_m = 0}, 1);
  EXPECT_NEAR(estimate_time_offset(drive.stream, drive.reference).offset_s, 0.1234, 1e-4);
}

TEST(TimeOffset, sigma_is_honest) {
  std::vector<double> z;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const Drive drive = simulate_drive({.correlation_s = 20}, seed);
    const TimeOffsetResult r = estimate_time_offset(drive.stream, drive.reference, {.bias_sigma_m = 0});
    z.push_back((r.offset_s + 0.2) / r.sigma_s);
  }
  EXPECT_GT(root_mean_square(z), 0.6);
  EXPECT_LT(root_mean_square(z), 1.4);
}

TEST(TimeOffset, sigma_holds_what_a_constant_error_may_do) {
  // In a drive that goes one way most of the time, an error along the track and an offset are nearly the same.
  std::vector<double> z;
  std::vector<double> believed;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    Random random(seed + 100);
    const Eigen::Vector3d bias(1.5 * random.normal(), 1.5 * random.normal(), 0);
    const Drive drive = simulate_drive({.turn_wave = 0.05, .correlation_s = 20, .bias = bias}, seed);
    const TimeOffsetResult r = estimate_time_offset(drive.stream, drive.reference);
    z.push_back((r.offset_s + 0.2) / r.sigma_s);
    const TimeOffsetResult naive = estimate_time_offset(drive.stream, drive.reference, {.bias_sigma_m = 0});
    believed.push_back((naive.offset_s + 0.2) / naive.sigma_s);
  }
  EXPECT_LT(root_mean_square(z), 1.4);
  EXPECT_GT(root_mean_square(believed), 2);
}

TEST(TimeOffset, outliers_do_not_move_it) {
  Drive drive = simulate_drive({}, 2);
  Random random(3);
  for (std::size_t i = 0; i < drive.stream.positions.size(); i += 10) {
    drive.stream.positions[i] += 50 * random.direction();
  }
  const TimeOffsetResult r = estimate_time_offset(drive.stream, drive.reference);
  EXPECT_NEAR(r.offset_s, -0.2, 0.05);
  EXPECT_GE(r.down_weighted, 80);
}

TEST(TimeOffset, bias_and_lever_arm) {
  const DriveOptions options{.bias = {3, -2, 0}, .lever_arm = {2, 0.5, 0}};
  const Drive drive = simulate_drive(options, 4);
  const TimeOffsetResult r =
      estimate_time_offset(drive.stream, drive.reference, {.estimate_bias = true, .estimate_lever_arm = true});
  EXPECT_NEAR(r.offset_s, -0.2, 4 * r.sigma_s);
  EXPECT_NEAR((r.bias - options.bias).norm(), 0, 0.6);
  EXPECT_NEAR((r.lever_arm - options.lever_arm).head<2>().norm(), 0, 0.6);
  const TimeOffsetResult given =
      estimate_time_offset(drive.stream, drive.reference, {.estimate_bias = true, .lever_arm = options.lever_arm});
  EXPECT_NEAR(given.offset_s, -0.2, 4 * given.sigma_s);
  // The lever arm, taken for an offset: this is what ignoring it does.
  const TimeOffsetResult ignored = estimate_time_offset(drive.stream, drive.reference);
  EXPECT_GT(ignored.offset_s, -0.15);
}

bool any_reason_has(const Quality& quality, const std::string& text) {
  for (const std::string& reason : quality.reasons) {
    if (reason.find(text) != std::string::npos) return true;
  }
  return false;
}

TEST(TimeOffset, constant_velocity_is_refused) {
  for (const double speed : {0.0, 20.0}) {
    const Drive drive = simulate_drive({.speed = speed, .speed_wave = 0, .turn_wave = 0}, 5);
    const TimeOffsetResult r = estimate_time_offset(drive.stream, drive.reference, {.estimate_bias = true});
    EXPECT_EQ(r.quality.verdict, Verdict::kRefused) << speed;
    EXPECT_TRUE(any_reason_has(r.quality, "along the track")) << speed;
  }
}

TEST(TimeOffset, constant_speed_is_a_warning) {
  const Drive drive = simulate_drive({.speed = 15, .speed_wave = 0.2}, 5);
  EXPECT_EQ(estimate_time_offset(drive.stream, drive.reference).quality.verdict, Verdict::kWarn);
  const TimeOffsetResult r = estimate_time_offset(drive.stream, drive.reference, {.estimate_lever_arm = true});
  EXPECT_EQ(r.quality.verdict, Verdict::kRefused);
}

TEST(TimeOffset, range_too_narrow_is_refused) {
  const Drive drive = simulate_drive({.offset_s = -3}, 5);
  EXPECT_EQ(estimate_time_offset(drive.stream, drive.reference).quality.verdict, Verdict::kRefused);
  EXPECT_NEAR(estimate_time_offset(drive.stream, drive.reference, {.max_offset_s = 5}).offset_s, -3, 0.05);
}

TEST(TimeOffset, gaps_and_missing_values_are_counted) {
  Drive drive = simulate_drive({}, 6);
  drive.stream.positions[10].setConstant(std::numeric_limits<double>::quiet_NaN());
  // 10 s without reference.
  PositionStream holes;
  for (std::size_t i = 0; i < drive.reference.times_ns.size(); ++i) {
    if (i >= 10'000 && i < 10'500) continue;
    holes.times_ns.push_back(drive.reference.times_ns[i]);
    holes.positions.push_back(drive.reference.positions[i]);
  }
  const TimeOffsetResult r = estimate_time_offset(drive.stream, holes);
  EXPECT_EQ(r.not_finite, 1);
  EXPECT_NEAR(static_cast<double>(r.outside), 14, 2) << "10 s and 1 s on either side, and the ends";
  EXPECT_NEAR(r.offset_s, -0.2, 4 * r.sigma_s) << "velocity from the positions";
}

TEST(TimeOffset, bad_input_is_named) {
  const Drive drive = simulate_drive({.duration_s = 60}, 6);
  const auto message = [&](const std::function<void(Drive&)>& change, const TimeOffsetOptions& options = {}) {
    Drive changed = drive;
    change(changed);
    try {
      estimate_time_offset(changed.stream, changed.reference, options);
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const auto contains = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  EXPECT_TRUE(contains(message([](Drive& d) { d.stream = {}; }), "stream: no positions"));
  EXPECT_TRUE(contains(message([](Drive& d) { d.stream.times_ns[3] = d.stream.times_ns[2]; }), "times_ns[3]"));
  EXPECT_TRUE(contains(message([](Drive& d) { d.reference.positions[7].x() = std::nan(""); }), "positions[7]"));
  EXPECT_TRUE(contains(message([](Drive& d) { d.reference.velocities[7].x() = INFINITY; }), "velocities[7]"));
  EXPECT_TRUE(contains(message([](Drive& d) { d.reference.rotations[7].w() = 5; }), "rotations[7]"));
  EXPECT_TRUE(contains(message([](Drive& d) { d.reference.velocities.pop_back(); }), "velocities for"));
  EXPECT_TRUE(contains(message([](Drive& d) { d.stream.positions.pop_back(); }), "positions for"));
  EXPECT_TRUE(
      contains(message([](Drive& d) { d.reference.rotations.clear(); }, {.lever_arm = {1, 0, 0}}), "rotations"));
  EXPECT_TRUE(contains(message([](Drive&) {}, {.max_offset_s = -1}), "max_offset_s = -1"));
  EXPECT_TRUE(contains(message([](Drive&) {}, {.correlation_s = std::nan("")}), "correlation_s"));
  EXPECT_TRUE(contains(message([](Drive&) {}, {.max_reference_gap_s = 0}), "max_reference_gap_s"));

  Drive apart = drive;
  for (TimeNs& t : apart.stream.times_ns) t += TimeNs{1'000'000'000'000};
  const TimeOffsetResult r = estimate_time_offset(apart.stream, apart.reference);
  EXPECT_EQ(r.quality.verdict, Verdict::kRefused);
  EXPECT_EQ(r.outside, 60);
  EXPECT_TRUE(any_reason_has(r.quality, "same clock"));
}

// 43 minutes of car, GPS at 1 Hz against a reference INS at 200 Hz.
TEST(TimeOffset, latency_of_the_gps_in_the_pntos_drive) {
  const char* path = std::getenv("LIBLOC_PNTOS_LOG");
  if (path == nullptr) GTEST_SKIP() << "LIBLOC_PNTOS_LOG does not name cobra_gps_ins_example_data.log";
  const auto source = open_lcm_log(path);
  PositionStream gps;
  PositionStream reference;
  std::vector<Eigen::Vector3d> geodetic;
  while (const auto m = source->next()) {
    if (const auto* fix = std::get_if<GpsMeasurement>(&*m)) {
      gps.times_ns.push_back(fix->time_ns);
      geodetic.emplace_back(fix->latitude, fix->longitude, fix->altitude);
    } else if (const auto* truth = std::get_if<ReferenceMeasurement>(&*m)) {
      reference.times_ns.push_back(truth->time_ns);
      reference.positions.push_back(truth->position);
      reference.velocities.push_back(truth->velocity);
      reference.rotations.push_back(truth->q_world_body);
    }
  }
  constexpr double kDegrees = 180 / std::numbers::pi;
  const auto origin = source->origin();
  ASSERT_TRUE(origin);
  const GeographicLib::LocalCartesian plane(origin->latitude * kDegrees, origin->longitude * kDegrees,
                                            origin->altitude);
  for (const Eigen::Vector3d& g : geodetic) {
    Eigen::Vector3d p;
    plane.Forward(g.x() * kDegrees, g.y() * kDegrees, g.z(), p.x(), p.y(), p.z());
    gps.positions.push_back(p);
  }
  const TimeOffsetResult r = estimate_time_offset(gps, reference);
  RecordProperty("offset_s", to_text(r.offset_s));
  std::printf("offset %.4f s, sigma %.4f s, horizontal RMS %.3f -> %.3f m, %lld positions\n", r.offset_s, r.sigma_s,
              r.rms_before_m, r.rms_after_m, static_cast<long long>(r.used));
  EXPECT_NEAR(r.offset_s, -0.20, 0.02);
  EXPECT_NEAR(r.rms_before_m, 2.48, 0.02);
  EXPECT_NEAR(r.rms_after_m, 1.62, 0.02);
  EXPECT_LT(r.sigma_s, 0.03);
  EXPECT_GE(r.used, 2590);
  EXPECT_TRUE(r.quality.usable());
}

}  // namespace
}  // namespace loc
