// loc-estimator --method error-state as a process: a drive with GPS and odometry, off line and live.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "libloc/core/gps_time.hpp"
#include "libloc/geometry/so3.hpp"
#include "libloc/io/lcm_log.hpp"
#include "libloc/io/tum.hpp"
#include "loc/fusion_t.hpp"
#include "msgs/convert.hpp"
#include "msgs/decode.hpp"
#include "program_test.hpp"
#include "tests/support/driven_circle.hpp"

namespace loc::test {
namespace {

constexpr double kRate = 50;

DrivenCircle car() {
  DrivenCircle motion;
  motion.q_vehicle_body = so3::exp({0.1, -0.2, 2.2});
  motion.gyroscope_bias = {0.01, -0.008, 0.012};
  return motion;
}
const LocalFrame kWorld(0.85, 0.2, 300);

// The drive as CSV: reference, IMU, GPS at 1 Hz, odometry of scale 2 at 10 Hz.
void write_drive(const std::string& file, double seconds) {
  std::ofstream out(file);
  out.precision(17);
  out << "time_ns,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2,latitude_rad,longitude_rad,altitude_m,sigma_e_m,"
         "sigma_n_m,sigma_u_m,odo_px_unit,odo_py_unit,odo_pz_unit,odo_qw,odo_qx,odo_qy,odo_qz,px_m,py_m,pz_m,qw,qx,qy,"
         "qz,vx_m_s,vy_m_s,vz_m_s\n";
  const DrivenCircle motion = car();
  Random random(1);
  const auto cells = [&](const auto& v) {
    for (Eigen::Index i = 0; i < v.size(); ++i) out << ',' << v[i];
  };
  for (int i = 0; i <= seconds * kRate; ++i) {
    const double t = i / kRate;
    const auto x = motion.at(t);
    const ImuMeasurement imu = motion.imu(t, kRate, {}, random);
    out << imu.time_ns;
    cells(imu.angular_velocity);
    cells(imu.specific_force);
    if (i % 50 == 0) {
      const GpsMeasurement gps = motion.gps(t, 1.5, 0, kWorld, random);
      cells(Eigen::Vector3d(gps.latitude, gps.longitude, gps.altitude));
      out << ",1.5,1.5,1.5";
    } else {
      out << ",,,,,,";
    }
    const Eigen::Quaterniond& q = x.T_world_body.rotation;
    const Eigen::Vector4d wxyz(q.w(), q.x(), q.y(), q.z());
    if (i % 5 == 0) {
      cells(Eigen::Vector3d(2 * x.T_world_body.translation + 0.05 * random.normal3()));
      cells(wxyz);
    } else {
      out << ",,,,,,,";
    }
    cells(x.T_world_body.translation);
    cells(wxyz);
    cells(x.velocity);
    out << '\n';
  }
}

class FusionProgram : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_.path(name); }
  std::string errors() const { return text_of(path("err")); }
  int estimate(const std::vector<std::string>& more) {
    std::vector<std::string> all = {"--method", "error-state", "--input", path("r.csv")};
    all.insert(all.end(), more.begin(), more.end());
    return run("loc-estimator", all, path("err"));
  }
  TemporaryFolder folder_;
};

TEST_F(FusionProgram, DriveFromCsvToTrajectoryScaleAndOrigin) {
  write_drive(path("r.csv"), 60);
  const std::string origin = "48.701412586115,11.459155902616,300";  // 0.85 and 0.2 rad
  ASSERT_EQ(estimate({"--output", path("e.tum"), "--origin", origin}), 0) << errors();
  EXPECT_EQ(figure(errors(), "event=ended", "gps.accepted"), 60) << errors();
  EXPECT_EQ(figure(errors(), "event=ended", "heading.found"), 1);
  EXPECT_GT(figure(errors(), "event=ended", "relative_odometry.accepted"), 200);
  const Trajectory trajectory = read_tum(path("e.tum")).trajectory;
  ASSERT_GT(trajectory.times_ns.size(), 2900U);
  const DrivenCircle motion = car();
  const auto truth = motion.at(to_seconds(trajectory.times_ns.back() - motion.start_ns));
  EXPECT_LT((trajectory.poses.back().translation - truth.T_world_body.translation).norm(), 3);
  EXPECT_LT(so3::angle_between(trajectory.poses.back().rotation, truth.T_world_body.rotation), 0.06);

  ASSERT_EQ(estimate({"--output", path("e.lcm"), "--origin", origin}), 0) << errors();
  LcmLogReader reader(path("e.lcm"));
  std::optional<Estimate> last;
  bool complete = false;
  while (const LcmLogEvent* event = reader.next()) {
    if (event->channel == kEstimateChannel) {
      last = from_message(decode_message<estimate_t>(event->data));
      complete = false;
    } else if (event->channel == kFusionChannel) {
      add_message(decode_message<fusion_t>(event->data), *last);
      complete = true;
    }
  }
  ASSERT_TRUE(complete);
  EXPECT_NEAR(last->scale, 2, 0.1);
  EXPECT_NEAR(last->origin.latitude, 0.85, 1e-9);
  EXPECT_EQ(last->valid & (kValidHeading | kValidPosition | kValidScale), kValidHeading | kValidPosition | kValidScale);
  EXPECT_LT((last->position - trajectory.poses.back().translation).norm(), 1e-6);

  ASSERT_EQ(estimate({"--output", path("e.csv"), "--no-odometry"}), 0) << errors();
  std::istringstream csv(text_of(path("e.csv")));
  std::string heading;
  std::getline(csv, heading);
  EXPECT_TRUE(heading.ends_with("scale,sigma_scale,origin_latitude_rad,origin_longitude_rad,origin_altitude_m"));
  EXPECT_NE(heading.find("sigma_pz_m"), std::string::npos);
}

TEST_F(FusionProgram, APathOnTheEarthForMaps) {
  write_drive(path("r.csv"), 20);
  ASSERT_EQ(estimate({"--output", path("e.gpx"), "--geo-times", "gps"}), 0) << errors();
  const std::string gpx = text_of(path("e.gpx"));
  std::vector<double> latitudes;
  double longitude = 0;
  for (std::size_t at = gpx.find("<trkpt"); at != std::string::npos; at = gpx.find("<trkpt", at + 1)) {
    double latitude = 0;
    ASSERT_EQ(std::sscanf(gpx.c_str() + at, "<trkpt lat=\"%lf\" lon=\"%lf\"", &latitude, &longitude), 2);
    latitudes.push_back(latitude);
  }
  // Ten a second from the moment on at which the world is tied to the Earth.
  EXPECT_GT(latitudes.size(), 100U);
  EXPECT_LE(latitudes.size(), 201U);
  const DrivenCircle motion = car();
  const GeodeticPoint truth = kWorld.to_geodetic(motion.at(20).T_world_body.translation);
  EXPECT_NEAR(latitudes.back() / 180 * M_PI, truth.latitude, 4 / 6.4e6);
  EXPECT_NEAR(longitude / 180 * M_PI, truth.longitude, 4 / 4.2e6);
  EXPECT_NE(gpx.find("<loc:sigma_horizontal>"), std::string::npos);
  const std::string time = to_text(utc_from_gps(motion.time(20))).substr(0, 16);
  EXPECT_NE(gpx.find("<time>" + time.substr(0, 10)), std::string::npos) << time;
  ASSERT_EQ(estimate({"--output", path("e.geojson"), "--geo-rate-hz", "1"}), 0) << errors();
  EXPECT_NE(text_of(path("e.geojson")).find("\"LineString\""), std::string::npos);
  EXPECT_LT(text_of(path("e.geojson")).size(), gpx.size() / 5);

  EXPECT_EQ(estimate({"--output", path("none.kml"), "--no-gps"}), 1);
  EXPECT_NE(errors().find("tied to the Earth"), std::string::npos) << errors();
  EXPECT_FALSE(std::filesystem::exists(path("none.kml")));
}

TEST_F(FusionProgram, PresetsOfTheExampleStartFromTheReference) {
  write_drive(path("r.csv"), 30);
  for (const std::string preset : {"16", "19"}) {
    ASSERT_EQ(estimate({"--output", path(preset + ".tum"), "--preset", preset, "--start", "reference", "--no-gps"}), 0)
        << errors();
    const Trajectory trajectory = read_tum(path(preset + ".tum")).trajectory;
    const DrivenCircle motion = car();
    EXPECT_EQ(trajectory.times_ns.front(), motion.time(0)) << "no second to look";
    const auto truth = motion.at(30);
    EXPECT_LT((trajectory.poses.back().translation - truth.T_world_body.translation).norm(), 4) << preset;
  }
}

TEST_F(FusionProgram, LiveGivesWhatOfflineGives) {
  write_drive(path("r.csv"), 20);
  ASSERT_EQ(estimate({"--output", path("offline.lcm")}), 0) << errors();
  ASSERT_EQ(run("loc-live",
                {"csv", path("r.csv"), "--transport", "hub", "--speed", "max", "--log", path("live.lcm"),
                 "--estimator-args", "--method error-state"},
                path("live.err")),
            0)
      << text_of(path("live.err"));
  const auto offline = estimates_in(path("offline.lcm"));
  EXPECT_GT(offline.size(), 900U);
  EXPECT_EQ(estimates_in(path("live.lcm")), offline);
}

TEST_F(FusionProgram, WrongOptionsAreTold) {
  write_drive(path("r.csv"), 3);
  EXPECT_EQ(estimate({"--output", path("e.csv"), "--preset", "report"}), 2);
  EXPECT_NE(errors().find("report"), std::string::npos) << errors();
  EXPECT_EQ(estimate({"--output", path("e.csv"), "--world", "NED"}), 2);
  EXPECT_EQ(estimate({"--output", path("e.csv"), "--origin", "48.7,11.4"}), 2);
  EXPECT_EQ(estimate({"--output", path("e.csv"), "--origin", "148.7,11.4,300"}), 2);
  EXPECT_EQ(estimate({"--output", path("e.csv"), "--odometry", "relative", "--preset", "16"}), 2);
  EXPECT_NE(errors().find("clones"), std::string::npos) << errors();
  EXPECT_EQ(run("loc-estimator", {"--method", "error-state", "--start", "reference"}, path("err")), 2);
  EXPECT_EQ(
      run("loc-estimator",
          {"--method", "madgwick", "--preset", "19", "--input", path("r.csv"), "--output", path("e.csv")}, path("err")),
      2);
}

}  // namespace
}  // namespace loc::test
