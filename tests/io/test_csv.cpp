// Recordings as comma-separated text: headings, units, damage.
#include <gtest/gtest.h>

#include <numbers>
#include <sstream>

#include "libloc/io/csv.hpp"
#include "tests/support/comma_locale.hpp"
#include "tests/support/data.hpp"
#include "tests/support/sources.hpp"
#include "tests/support/temp_folder.hpp"

namespace loc {
namespace {

using test::count;
using test::expect_data_error;
using test::only;
using test::read_all;

const std::string kHeading = "time_ns,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2\n";

class Csv : public testing::Test {
 protected:
  std::unique_ptr<MeasurementSource> open(const std::string& text, const CsvOptions& options = {}) {
    return open_csv(folder_.write("a.csv", text), options);
  }
  std::vector<Measurement> read(const std::string& text, const CsvOptions& options = {}) {
    return read_all(*open(text, options));
  }
  void expect_error(const std::string& text, const std::vector<std::string>& parts, const CsvOptions& options = {}) {
    expect_data_error([&] { read(text, options); }, parts);
  }
  test::TempFolder folder_;
};

TEST_F(Csv, reads_an_imu) {
  const auto imu = only<ImuMeasurement>(read(kHeading + "1000,1,2,3,4,5,6\n2000,-1e-1,.5,+3,4,5,9.81\n"));
  ASSERT_EQ(imu.size(), 2U);
  EXPECT_EQ(imu[0].time_ns, 1000);
  EXPECT_EQ(imu[0].angular_velocity, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(imu[1].angular_velocity, Eigen::Vector3d(-0.1, 0.5, 3));
  EXPECT_EQ(imu[1].specific_force, Eigen::Vector3d(4, 5, 9.81));
  EXPECT_EQ(imu[1].sequence, 1);
  EXPECT_EQ(imu[1].host_time_ns, kNoTime);
}

TEST_F(Csv, units_are_converted) {
  CsvOptions options;
  options.tesla_per_unit = 2e-7;
  const auto all = read(
      "t_ms,gx [deg/s],gy [DPS],gz_deg_s,Acc_X [g],acc_y [mg],acc_z [m/s^2],mx [uT],my [gauss],mz [arb]\n"
      "1.000001,180,90,-90,1,1000,9.5,50,0.5,100\n",
      options);
  const auto imu = only<ImuMeasurement>(all).at(0);
  EXPECT_EQ(imu.time_ns, 1'000'001);
  EXPECT_NEAR(imu.angular_velocity.x(), std::numbers::pi, 1e-15);
  EXPECT_NEAR(imu.angular_velocity.y(), std::numbers::pi / 2, 1e-15);
  EXPECT_NEAR(imu.angular_velocity.z(), -std::numbers::pi / 2, 1e-15);
  EXPECT_DOUBLE_EQ(imu.specific_force.x(), 9.80665);
  EXPECT_DOUBLE_EQ(imu.specific_force.y(), 9.80665);
  EXPECT_EQ(imu.specific_force.z(), 9.5);
  const auto field = only<MagnetometerMeasurement>(all).at(0).magnetic_field;
  EXPECT_DOUBLE_EQ(field.x(), 5e-5);
  EXPECT_DOUBLE_EQ(field.y(), 5e-5);
  EXPECT_DOUBLE_EQ(field.z(), 2e-5);
}

TEST_F(Csv, times_are_exact_in_every_unit) {
  const auto first_time = [&](const std::string& unit, const std::string& time) {
    return stamp_of(read("time_" + unit + ",px,py,pz\n" + time + ",0,0,0\n").at(0)).time_ns;
  };
  EXPECT_EQ(first_time("ns", "1403715274302142975"), 1403715274302142975);
  EXPECT_EQ(first_time("us", "1403715274302142.975"), 1403715274302142975);
  EXPECT_EQ(first_time("ms", "1403715274302.142975"), 1403715274302142975);
  EXPECT_EQ(first_time("s", "1403715274.302142975"), 1403715274302142975);
  EXPECT_EQ(first_time("s", "1.403715274302142975e9"), 1403715274302142975);
}

TEST_F(Csv, reads_the_heading_of_euroc) {
  const auto all = read(
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\r\n5,1,2,3,4,5,6\r\n");
  EXPECT_EQ(only<ImuMeasurement>(all).at(0).specific_force, Eigen::Vector3d(4, 5, 6));
}

TEST_F(Csv, columns_without_unit_need_the_options) {
  const std::string text = "#ts,wx,wy,wz,ax,ay,az\n5,1,2,3,4,5,6\n";
  expect_error(text, {"a.csv:1", "'ts'", "ns, us, ms, s"});
  CsvOptions options;
  options.time_unit = "ns";
  options.angular_velocity_unit = "rad/s";
  options.specific_force_unit = "m/s^2";
  EXPECT_EQ(read(text, options).size(), 1U);
  options.specific_force_unit = "furlong";
  expect_error(text, {"'ax'", "furlong", "m/s^2"}, options);
}

TEST_F(Csv, magnetometer_at_its_own_rate_has_empty_cells) {
  const auto all = read(
      "time_s,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2,mx_ut,my_ut,mz_ut\n"
      "0,1,2,3,4,5,6,,,\n0.01,1,2,3,4,5,6,10,20,30\n0.02,,,,,,,10,20,30\n");
  ASSERT_EQ(only<ImuMeasurement>(all).size(), 2U);
  ASSERT_EQ(only<MagnetometerMeasurement>(all).size(), 2U);
  EXPECT_TRUE(std::holds_alternative<MagnetometerMeasurement>(all.at(1))) << "before the IMU sample of the same time";
  expect_error("time_s,mx_ut,my_ut,mz_ut\n0,1,,3\n", {"a.csv:2", "mx_ut", "empty"});
}

TEST_F(Csv, reads_a_reference) {
  const auto all = read("time_s,qw,qx,qy,qz,px,py,pz,score\n1,0.7072,0,0,0.7072,1,2,3,0\n2,nan,nan,nan,nan,1,2,3,1\n");
  const auto reference = only<ReferenceMeasurement>(all);
  ASSERT_EQ(reference.size(), 2U);
  EXPECT_NEAR(reference[0].q_world_body.norm(), 1, 1e-15);
  EXPECT_NEAR(reference[0].q_world_body.z(), std::sqrt(0.5), 1e-15);
  EXPECT_FALSE(reference[0].score);
  EXPECT_TRUE(std::isnan(reference[0].velocity.x()));
  EXPECT_TRUE(std::isnan(reference[1].q_world_body.w()));
  expect_error("time_s,qw,qx,qy,qz\n1,0.5,0,0,0.5\n", {"a.csv:2", "norm"});
  expect_error("time_s,px,py,pz,score\n1,1,2,3,2\n", {"a.csv:2", "score"});
}

TEST_F(Csv, reads_gps_fixes) {
  const auto all = read(
      "time_s,latitude_deg,longitude [deg],altitude_m,ve_m_s,vn_m_s,vu_m_s,sigma_e_m,sigma_n,sigma_u [m],"
      "sigma_ve_m_s,sigma_vn,sigma_vu,fix,satellites\n"
      "1,45,-180,300,1,2,3,1.5,2,4,0.1,0.2,0.3,6,17\n2,-90,0,,,,,,,,,,,,\n3,,,,,,,,,,,,,0,\n"
      "4,nan,nan,nan,1,2,3,,,,,,,,\n");
  const auto gps = only<GpsMeasurement>(all);
  ASSERT_EQ(gps.size(), 3U);
  EXPECT_DOUBLE_EQ(gps[0].latitude, std::numbers::pi / 4);
  EXPECT_DOUBLE_EQ(gps[0].longitude, -std::numbers::pi);
  EXPECT_EQ(gps[0].altitude, 300);
  EXPECT_EQ(gps[0].velocity_enu, Eigen::Vector3d(1, 2, 3));
  EXPECT_TRUE(gps[0].position_cov == Eigen::Matrix3d(Eigen::Vector3d(2.25, 4, 16).asDiagonal()));
  EXPECT_NEAR(gps[0].velocity_cov(2, 2), 0.09, 1e-15);
  EXPECT_EQ(gps[0].fix, GpsFixType::kFixed);
  EXPECT_EQ(gps[0].satellites, 17);
  EXPECT_EQ(gps[1].fix, GpsFixType::k2d) << "by its content";
  EXPECT_TRUE(std::isnan(gps[1].altitude));
  EXPECT_TRUE(gps[1].position_cov.array().isNaN().all());
  EXPECT_EQ(gps[1].satellites, -1);
  EXPECT_EQ(gps[2].fix, GpsFixType::kNone);
  const auto radians = read("t_s,lat_rad,lon_rad,alt_m\n1,0.7853981633974483,-0.1,5\n");
  EXPECT_EQ(only<GpsMeasurement>(radians).at(0).latitude, 0.7853981633974483) << "to the bit";
  EXPECT_EQ(only<GpsMeasurement>(radians).at(0).fix, GpsFixType::k3d);
  expect_error("t_s,lat_rad,lon_rad\n1,45,0\n", {"a.csv:2", "lat_rad", "45", "90 degrees"});
  expect_error("t_s,lat_deg,lon_deg\n1,45,400\n", {"a.csv:2", "lon_deg", "400"});
  expect_error("t_s,lat_deg,lon_deg,sigma_e,sigma_n,sigma_u\n1,45,0,1,-1,1\n", {"a.csv:2", "sigma_n", "negative"});
  expect_error("t_s,lat_deg,lon_deg,fix\n1,45,0,7\n", {"a.csv:2", "fix", "7", "[0, 6]"});
  expect_error("t_s,lat_deg,lon_deg,satellites\n1,45,0,8.5\n", {"a.csv:2", "satellites", "8.5"});
  expect_error("t_s,lat_deg,lon_deg\n1,45,\n", {"a.csv:2", "lat_deg", "empty"});
  expect_error("t_s,lat,lon\n1,45,0\n", {"a.csv:1", "lat", "rad, deg"});
}

TEST_F(Csv, reads_odometry) {
  const auto all = read(
      "time_ns,odo_start [ns],odo_px,odo_py,odo_pz [unit],odo_qw,odo_qx,odo_qy,odo_qz,odo_sigma_px_m,odo_sigma_py,"
      "odo_sigma_pz,odo_sigma_theta_x_deg,odo_sigma_theta_y [rad],odo_sigma_theta_z_rad\n"
      "1403715274302142975,,1,2,3,0.7072,0,0,0.7072,1,2,3,180,0.5,1\n"
      "1403715274402142975,1403715274302142975,0.1,0,0,1,0,0,0,,,,,,\n1403715274502142975,,1,1,1,,,,,,,,,,\n");
  const auto odometry = only<OdometryMeasurement>(all);
  ASSERT_EQ(odometry.size(), 3U);
  EXPECT_EQ(odometry[0].start_time_ns, kNoTime) << "absolute";
  EXPECT_EQ(odometry[0].position, Eigen::Vector3d(1, 2, 3));
  EXPECT_NEAR(odometry[0].rotation.z(), std::sqrt(0.5), 1e-15);
  EXPECT_TRUE(odometry[0].position_cov == Eigen::Matrix3d(Eigen::Vector3d(1, 4, 9).asDiagonal()));
  EXPECT_NEAR(odometry[0].orientation_cov(0, 0), std::numbers::pi * std::numbers::pi, 1e-14);
  EXPECT_EQ(odometry[1].start_time_ns, 1403715274302142975) << "exact";
  EXPECT_TRUE(odometry[1].position_cov.array().isNaN().all());
  EXPECT_TRUE(odometry[2].rotation.coeffs().array().isNaN().all());
  const std::string heading = "t_s,odo_start_s,odo_px,odo_py,odo_pz,odo_qw,odo_qx,odo_qy,odo_qz\n";
  expect_error(heading + "5,5,0,0,0,1,0,0,0\n", {"a.csv:2", "odo_start", "before"});
  expect_error(heading + "5,x,0,0,0,1,0,0,0\n", {"a.csv:2", "odo_start", "'x'", "time"});
  expect_error(heading + "5,4,0,0,0,2,0,0,0\n", {"a.csv:2", "odometry quaternion", "norm 2"});
  expect_error("t_s,odo_px_km,odo_py,odo_pz\n", {"odo_px_km", "km", "unit, m"});
}

TEST_F(Csv, streams_of_one_row_come_in_the_order_of_equal_times) {
  const auto all = read(
      "time_s,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2,mx_ut,my_ut,mz_ut,px,py,pz,lat_deg,lon_deg,odo_px,"
      "odo_py,odo_pz\n1,1,2,3,4,5,6,7,8,9,1,2,3,45,5,1,2,3\n");
  std::vector<StreamKind> kinds;
  for (const Measurement& m : all) kinds.push_back(kind_of(m));
  EXPECT_EQ(kinds, (std::vector<StreamKind>{StreamKind::kMagnetometer, StreamKind::kGps, StreamKind::kOdometry,
                                            StreamKind::kReference, StreamKind::kImu}));
}

TEST_F(Csv, bad_headings_are_told) {
  expect_error("time_ns,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,temperature\n",
               {"a.csv:1", "temperature", "known are"});
  expect_error("time_ns,wx_rpm,wy_rad_s\n", {"wx_rpm", "rpm", "deg/s"});
  expect_error("time_ns,px,py\n1,2,3\n", {"2 of 3"});
  expect_error("time_ns,px,py,pz,px\n", {"twice"});
  expect_error("px,py,pz\n1,2,3\n", {"time"});
  expect_error("time_ns,ax_g,ay_g,az_g\n1,2,3,4\n", {"IMU has both"});
  expect_error("1403,1,2,3,4,5,6\n", {"'1403'", "known are"});
  expect_error("time_ns,px,py,pz,qw [m],qx,qy,qz\n", {"qw [m]", "no unit"});
  expect_error("time_ns,mx [arb],my [arb],mz [arb]\n1,2,3,4\n", {"mx [arb]", "tesla"});
  expect_error("time_ns [ns,px,py,pz\n", {"bracket"});
  expect_error("time_ns,px,py,pz,altitude\n", {"altitude without latitude"});
  expect_error("time_ns,lat_deg,lon_deg,sigma_ve,sigma_vn,sigma_vu\n", {"without ve vn vu"});
  expect_error("time_ns,px,py,pz,odo_start_ns\n", {"odo_start without odo_px"});
  expect_error("time_ns,odo_px,odo_py,odo_pz,odo_sigma_theta_x,odo_sigma_theta_y,odo_sigma_theta_z\n",
               {"'odo_sigma_theta_x'", "no unit", "rad, deg"});
}

TEST_F(Csv, bad_files_are_told) {
  expect_data_error([&] { open_csv(folder_.path() / "none.csv"); }, {"none.csv", "no such file"});
  expect_data_error([&] { open_csv(folder_.path()); }, {"folder"});
  expect_error("", {"empty"});
  expect_error(kHeading, {"no complete row"});
  expect_error("\n \n", {"heading line has no end"});
  expect_error("# my recording\n" + kHeading + "1,1,2,3,4,5,6\n", {"a.csv:1", "a comment, not a heading"});
  expect_error(kHeading + std::string(70000, '1') + "\n", {"a.csv:2", "longer"});
}

TEST_F(Csv, bad_cells_are_told_with_line_and_column) {
  const std::string good = kHeading + "1,1,2,3,4,5,6\n";
  expect_error(good + "2,1,x,3,4,5,6\n", {"a.csv:3", "wy_rad_s", "'x'"});
  expect_error(good + "2,1,0x2,3,4,5,6\n", {"a.csv:3", "wy_rad_s"});
  expect_error(good + "2,1,2 2,3,4,5,6\n", {"'2 2'"});
  expect_error(good + "2,1,1e999,3,4,5,6\n", {"1e999"});
  expect_error(good + "2,1,2,3,4,5\n", {"a.csv:3", "6 cells", "7"});
  expect_error(good + "2,1,2,3,4,5,6,7\n", {"8 cells"});
  expect_error(good + "nan,1,2,3,4,5,6\n", {"time_ns", "'nan'"});
  expect_error(good + ",1,2,3,4,5,6\n", {"time_ns", "''"});
  expect_error(good + "9223372036854775808,1,2,3,4,5,6\n", {"9223372036854775808"});
  expect_error(good + "-9223372036854775808,1,2,3,4,5,6\n", {"is not a time"});
  expect_error("time_s,px,py,pz\n1e+-5,1,2,3\n", {"a.csv:2", "'1e+-5'"});
  expect_error(good + "2,,,,4,5,6\n", {"a.csv:3", "empty"});
  expect_error(good + std::string("2,1,2\0,3,4,5,6\n", 15), {"a.csv:3"});
}

TEST_F(Csv, the_rows_before_a_bad_one_are_given) {
  const auto source = open(kHeading + "1,1,2,3,4,5,6\n2,1,2,3,4,5,6\n3,x,2,3,4,5,6\n");
  EXPECT_TRUE(source->next());
  EXPECT_TRUE(source->next());
  EXPECT_THROW(source->next(), DataError);
}

TEST_F(Csv, nan_and_infinity_pass_and_are_counted) {
  const auto source = open(kHeading + "1,nan,2,3,4,5,6\n2,1,2,3,inf,5,6\n3,1,2,3,4,5,6\n");
  EXPECT_EQ(read_all(*source).size(), 3U);
  EXPECT_EQ(count(source->counts(), "imu.not_finite"), 2);
  EXPECT_EQ(count(source->counts(), "imu.read"), 3);
}

TEST_F(Csv, repeated_shuffled_and_backward_rows_are_skipped_and_counted) {
  const auto source = open(kHeading + "1,1,2,3,4,5,6\n1,1,2,3,4,5,6\n5,1,2,3,4,5,6\n3,1,2,3,4,5,6\n6,1,2,3,4,5,6\n");
  const auto all = read_all(*source);
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(stamp_of(all[2]).time_ns, 6);
  EXPECT_EQ(count(source->counts(), "imu.skipped.time_not_increasing"), 1) << "the repeated one";
  EXPECT_EQ(count(source->counts(), "rows.skipped.time_not_increasing"), 1) << "the one that goes back";
  EXPECT_EQ(count(source->counts(), "imu.read"), 3);
  // Damage in a row that would be skipped shows all the same.
  expect_error(kHeading + "2,1,2,3,4,5,6\n1,1,2,3,4,5,oops\n", {"a.csv:3", "oops"});
}

const std::string kImuAndField = "time_s,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2,mx_ut,my_ut,mz_ut\n";

TEST_F(Csv, one_sensor_per_row_loses_none) {
  const auto source = open(kImuAndField +
                           "1,1,2,3,4,5,6,,,\n1,,,,,,,10,20,30\n"
                           "2,,,,,,,11,20,30\n2,1,2,3,4,5,7,,,\n");
  const auto all = read_all(*source);
  ASSERT_EQ(only<ImuMeasurement>(all).size(), 2U);
  const auto field = only<MagnetometerMeasurement>(all);
  ASSERT_EQ(field.size(), 2U);
  EXPECT_EQ(field[0].time_ns, 1'000'000'000);
  EXPECT_DOUBLE_EQ(field[1].magnetic_field.x(), 1.1e-5);
  EXPECT_EQ(field[1].sequence, 1);
  EXPECT_TRUE(std::holds_alternative<ImuMeasurement>(all[0])) << "at one time as in the file";
  EXPECT_EQ(source->counts().size(), 2U) << "nothing skipped";
}

TEST_F(Csv, of_a_row_at_the_same_time_only_what_is_repeated_is_skipped) {
  const auto source = open(kImuAndField +
                           "1,1,2,3,4,5,6,,,\n1,9,9,9,9,9,9,10,20,30\n1,,,,,,,9,9,9\n"
                           "2,1,2,3,4,5,6,,,\n1.5,,,,,,,10,20,30\n3,,,,,,,10,20,30\n");
  const auto all = read_all(*source);
  ASSERT_EQ(only<ImuMeasurement>(all).size(), 2U);
  EXPECT_EQ(only<ImuMeasurement>(all)[0].angular_velocity, Eigen::Vector3d(1, 2, 3)) << "the first one counts";
  const auto field = only<MagnetometerMeasurement>(all);
  ASSERT_EQ(field.size(), 2U);
  EXPECT_EQ(field[1].time_ns, 3'000'000'000) << "the row that goes back would break the order in time";
  EXPECT_EQ(count(source->counts(), "imu.read"), 2);
  EXPECT_EQ(count(source->counts(), "magnetometer.read"), 2);
  EXPECT_EQ(count(source->counts(), "imu.skipped.time_not_increasing"), 1);
  EXPECT_EQ(count(source->counts(), "magnetometer.skipped.time_not_increasing"), 1);
  EXPECT_EQ(count(source->counts(), "rows.skipped.time_not_increasing"), 1);
}

TEST_F(Csv, rows_without_any_value_are_counted) {
  const auto source = open(kImuAndField + "1,1,2,3,4,5,6,,,\n7, ,,,,,,,,\n2,1,2,3,4,5,6,,,\n");
  EXPECT_EQ(read_all(*source).size(), 2U);
  EXPECT_EQ(count(source->counts(), "rows.skipped.empty"), 1);
  EXPECT_EQ(count(source->counts(), "rows.skipped.time_not_increasing"), 0) << "its time says nothing";
  expect_error(kImuAndField + "1,,,,,,,,,\n", {"a.csv", "no complete row"});
}

TEST_F(Csv, byte_order_mark_carriage_returns_and_blank_lines) {
  const auto source = open("\xEF\xBB\xBFtime_ns, px , py, pz\r\n1, 2 ,3,4\r\n\r\n2,2,3,4\r\n");
  const auto all = read_all(*source);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(std::get<ReferenceMeasurement>(all[0]).position, Eigen::Vector3d(2, 3, 4));
  EXPECT_EQ(count(source->counts(), "rows.skipped.blank"), 1);

  const auto below = open("\n \r\n" + kHeading + "1,1,2,3,4,5,6\n");
  EXPECT_EQ(read_all(*below).size(), 1U);
  EXPECT_EQ(count(below->counts(), "rows.skipped.blank"), 2);
  expect_error("\n" + kHeading + "1,x,2,3,4,5,6\n", {"a.csv:3"});
}

TEST_F(Csv, cut_at_any_byte_gives_an_error_or_a_part_of_the_rows) {
  const std::string text = kHeading + "1000,1.25,2.5,3,4,5,6.75\n2000,1.25,2.5,3,4,5,6.75\n";
  const auto whole = read(text);
  ASSERT_EQ(whole.size(), 2U);
  for (std::size_t size = 0; size < text.size(); ++size) {
    SCOPED_TRACE(size);
    try {
      const auto source = open(text.substr(0, size));
      const auto part = read_all(*source);
      ASSERT_LT(part.size(), whole.size());
      for (std::size_t i = 0; i < part.size(); ++i) {
        EXPECT_EQ(stamp_of(part[i]).time_ns, stamp_of(whole[i]).time_ns);
        EXPECT_EQ(std::get<ImuMeasurement>(part[i]).specific_force, std::get<ImuMeasurement>(whole[i]).specific_force);
      }
      const bool at_line_end = text[size - 1] == '\n';
      EXPECT_EQ(count(source->counts(), "rows.skipped.no_line_end"), at_line_end ? 0 : 1);
    } catch (const DataError&) {
    }
  }
}

TEST_F(Csv, the_locale_does_not_matter) {
  const test::CommaLocale locale;
  std::ostringstream out;
  out << 1234.5;
  ASSERT_EQ(out.str(), "1.234,5") << "the locale is in force";
  const auto source = open("time_ms,wx_rad_s,wy_rad_s,wz_rad_s,ax_g,ay_g,az_g\n1234.5,1.5,2000,3e-3,4,5,1\n");
  const auto imu = only<ImuMeasurement>(read_all(*source));
  ASSERT_EQ(imu.size(), 1U);
  EXPECT_EQ(imu[0].time_ns, 1'234'500'000);
  EXPECT_EQ(imu[0].angular_velocity, Eigen::Vector3d(1.5, 2000, 3e-3));
  EXPECT_EQ(imu[0].specific_force.z(), 9.80665);
  expect_error("time_s,px,py,pz\n\"1,5\",1,2,3\n", {"a.csv:2"});

  Estimate e;
  e.time_ns = 1'234'567;
  e.sequence = 5678;
  e.valid = kValidPosition;
  e.position = {1234.5, 0.25, -1e6};
  CsvWriter writer(folder_.path() / "e.csv");
  writer.write(e);
  writer.flush();
  const std::string text = test::read_file(folder_.path() / "e.csv");
  EXPECT_NE(text.find("\n1234567,,,,,1234.5,0.25,-1e+06,"), std::string::npos) << text;
  EXPECT_TRUE(text.ends_with(",5678,,,,,\n")) << text;
}

TEST_F(Csv, reads_a_real_calibration_recording) {
  LOC_DATA_OR_SKIP(file, "euroc-cam-imu-calibration/imu0.csv");
  CsvOptions options;
  options.time_unit = "ns";
  options.angular_velocity_unit = "rad/s";
  options.specific_force_unit = "m/s^2";
  const auto source = open_csv(file, options);
  const auto imu = only<ImuMeasurement>(read_all(*source));
  ASSERT_GT(imu.size(), 14000U);
  EXPECT_EQ(imu[0].time_ns, 1404733405747800064);
  EXPECT_EQ(imu[0].specific_force, Eigen::Vector3d(9.365351, -0.335061, -3.277056));
  EXPECT_EQ(source->counts().size(), 1U) << "nothing skipped";
}

TEST_F(Csv, writer_gives_back_what_it_was_given) {
  Estimate e;
  e.time_ns = 1403715274302142975;
  e.sequence = 4;
  e.valid = kValidOrientation | kValidGyroscopeBias | kValidCovariance;
  e.status = kAtRest;
  e.q_world_body = Eigen::Quaterniond(0.1, 0.7, -0.7, 0.1).normalized();
  e.angular_velocity = {1.0 / 3, 2, 3};
  e.gyroscope_bias = {1e-5, 2e-5, 3e-5};
  e.position.setConstant(std::nan(""));
  e.covariance_dim = 3;
  e.covariance.setZero();
  e.covariance.diagonal().setConstant(4e-4);
  const auto path = folder_.path() / "e.csv";
  CsvWriter writer(path);
  writer.write(e);
  writer.flush();
  const std::string text = test::read_file(path);
  const std::string heading = text.substr(0, text.find('\n'));
  const std::string row = text.substr(text.find('\n') + 1);
  EXPECT_EQ(std::ranges::count(heading, ','), std::ranges::count(row, ','));
  std::string expected = "1403715274302142975";
  for (const double q : {e.q_world_body.w(), e.q_world_body.x(), e.q_world_body.y(), e.q_world_body.z()}) {
    const std::size_t at = expected.size() + 1;
    expected = row.substr(0, row.find(',', at));
    EXPECT_EQ(std::stod(expected.substr(at)), q) << "must read back the same";
  }
  EXPECT_NE(row.find(",,,,,,"), std::string::npos) << "no position, no velocity";
  EXPECT_NE(row.find(",0.02,0.02,0.02,,,"), std::string::npos) << row;
  EXPECT_TRUE(row.ends_with(",81,4,4,,,,,\n")) << row;
  e.valid |= kValidScale;
  e.scale = 2;
  e.scale_sigma = 0.125;
  e.origin = {0.5, -1.5, 300};
  writer.write(e);
  writer.flush();
  EXPECT_TRUE(test::read_file(path).ends_with(",209,4,4,2,0.125,0.5,-1.5,300\n")) << test::read_file(path);
  EXPECT_THROW(CsvWriter(folder_.path() / "none" / "e.csv"), DataError);
}

TEST_F(Csv, writer_tells_when_the_disk_is_full) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  EXPECT_THROW(
      {
        CsvWriter writer("/dev/full");
        writer.write(Estimate{});
        writer.flush();
      },
      DataError);
}

}  // namespace
}  // namespace loc
