// loc-estimator with everything together: IMU, tracks and GPS of a simulated drive, off line and live.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "libloc/geometry/geodesy.hpp"
#include "libloc/io/lcm_log.hpp"
#include "libloc/io/tum.hpp"
#include "loc/estimator_status_t.hpp"
#include "loc/reference_t.hpp"
#include "msgs/convert.hpp"
#include "msgs/decode.hpp"
#include "program_test.hpp"

namespace loc::test {
namespace {

// A car goes round a block; from 12 to 17 s there is no GPS.
class AnchoredProgram : public ::testing::Test {
 protected:
  static constexpr double kDuration = 24;

  void SetUp() override {
    ASSERT_EQ(
        run("loc-simulate",
            {"--scenario", "street-car", "--seed", "7", "--duration", "24s", "--gps-outage", "12:17", "--streams",
             "imu,gps,features,magnetometer,reference", "--out", path("drive.log"), "--write-rig", path("rig.yaml")},
            path("err")),
        0)
        << errors();
  }
  std::string path(const std::string& name) const { return folder_.path(name); }
  std::string errors() const { return text_of(path("err")); }
  int offline(const std::string& method, const std::string& output, const std::vector<std::string>& more = {}) {
    // The origin of the simulated world, so that the truth is in the same one.
    std::vector<std::string> all = {
        "--method",        method,     "--config", path("rig.yaml"), "--input",
        path("drive.log"), "--output", output,     "--origin",       "43.60208819,1.438123869,150"};
    all.insert(all.end(), more.begin(), more.end());
    return run("loc-estimator", all, path("err"));
  }
  /// Largest distance from the truth, horizontal, of the poses of a span.
  double worst(const Trajectory& estimated, double from_s, double to_s) const {
    Trajectory truth;
    LcmLogReader reader(path("drive.log"));
    while (const LcmLogEvent* event = reader.next()) {
      if (event->channel != default_channel(StreamKind::kReference)) continue;
      const auto reference = decode_message<reference_t>(event->data);
      truth.push_back(reference.time_ns, Pose3(Eigen::Quaterniond::Identity(),
                                               Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(reference.position))));
    }
    double out = 0;
    std::size_t at = 0;
    for (std::size_t i = 0; i < estimated.size(); ++i) {
      const TimeNs time = estimated.times_ns[i];
      const double t = to_seconds(time - truth.times_ns.front());
      while (at + 1 < truth.size() && truth.times_ns[at + 1] <= time) ++at;
      if (t < from_s || t > to_s || time - truth.times_ns[at] > 10 * kMs) continue;
      const Eigen::Vector3d off = estimated.poses[i].translation - truth.poses[at].translation;
      out = std::max(out, off.head<2>().norm());
    }
    return out;
  }

  TemporaryFolder folder_;
};

TEST_F(AnchoredProgram, PosesAreOnTheEarthFromTheFirstToTheLast) {
  for (const std::string method : {"inertial-slam", "mono-slam"}) {
    ASSERT_EQ(offline(method, path("e.tum"), {"--map-out", path("map.ply")}), 0) << errors();
    const Trajectory estimated = read_tum(path("e.tum")).trajectory;
    ASSERT_GT(estimated.size(), 400U);
    EXPECT_LT(estimated.poses.front().translation.norm(), 10) << method;
    // Fixes share an error of 1.5 m that lasts for minutes.
    const double bound = method == "mono-slam" ? 8 : 4;
    EXPECT_LT(worst(estimated, 0, 12), bound) << method;
    EXPECT_LT(worst(estimated, 12, 17), bound) << method;
    EXPECT_LT(worst(estimated, 17, kDuration), bound) << method;
    EXPECT_NE(errors().find("event=degraded condition=\"no GPS\""), std::string::npos) << errors();
    EXPECT_NE(errors().find("event=restored condition=\"no GPS\""), std::string::npos) << errors();
    EXPECT_EQ(figure(errors(), "event=ended", "anchor.started"), 1) << method;
    EXPECT_NE(text_of(path("map.ply")).find("latitude 43.60"), std::string::npos);
  }
  ASSERT_EQ(offline("inertial-slam", path("e.gpx")), 0) << errors();
  EXPECT_NE(text_of(path("e.gpx")).find("<trkpt lat=\"43.60"), std::string::npos);
  // Left aside on request: the map's own world, and nothing is missed.
  std::filesystem::remove(path("err"));
  ASSERT_EQ(offline("inertial-slam", path("e.csv"), {"--no-gps"}), 0) << errors();
  EXPECT_EQ(errors().find("no GPS"), std::string::npos) << errors();
}

// The state of things in words, and estimates and frames as off line from the moment that the world is known.
TEST_F(AnchoredProgram, LiveItSaysWhatItGoesOnWithout) {
  ASSERT_EQ(offline("inertial-slam", path("offline.lcm")), 0) << errors();
  ASSERT_EQ(
      run("loc-live",
          {"lcm-log", path("drive.log"), "--config", path("rig.yaml"), "--transport", "hub", "--speed", "4", "--log",
           path("live.lcm"), "--estimator-args", "--method inertial-slam --origin 43.60208819,1.438123869,150"},
          path("live.err"), 60 * kSecond),
      0)
      << text_of(path("live.err"));
  std::set<std::string> conditions;
  bool georeferenced = false;
  LcmLogReader reader(path("live.lcm"));
  while (const LcmLogEvent* event = reader.next()) {
    if (event->channel == "LOC_ESTIMATOR_STATUS") {
      const auto status = decode_message<estimator_status_t>(event->data);
      EXPECT_EQ(status.method, "inertial-slam");
      for (const std::string& condition : status.condition) conditions.insert(condition);
      georeferenced = georeferenced || status.georeferenced != 0;
    }
  }
  EXPECT_TRUE(conditions.contains("no GPS"));
  EXPECT_TRUE(georeferenced);
  const auto offline_estimates = estimates_in(path("offline.lcm"));
  const auto live_estimates = estimates_in(path("live.lcm"));
  ASSERT_EQ(live_estimates.size(), offline_estimates.size());
  std::size_t same = 0;
  while (same < live_estimates.size() &&
         live_estimates[live_estimates.size() - 1 - same] == offline_estimates[live_estimates.size() - 1 - same]) {
    ++same;
  }
  EXPECT_GT(same, static_cast<std::size_t>(200 * (kDuration - 7)));
}

}  // namespace
}  // namespace loc::test
