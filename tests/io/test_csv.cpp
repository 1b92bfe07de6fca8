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
  EXPECT_TRUE(text.ends_with(",5678\n")) << text;
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
  EXPECT_TRUE(row.ends_with(",81,4,4\n")) << row;
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
