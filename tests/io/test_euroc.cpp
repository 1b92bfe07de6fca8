// EuRoC folders: files merged in time order, absent ones, damage.
#include <gtest/gtest.h>

#include <algorithm>

#include "libloc/io/euroc.hpp"
#include "tests/support/sources.hpp"
#include "tests/support/temp_folder.hpp"

namespace loc {
namespace {

using test::count;
using test::expect_data_error;
using test::only;
using test::read_all;

const std::string kImu =
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m "
    "s^-2],a_RS_S_z [m s^-2]\n"
    "1403715273262142976,-0.002,0.02,0.07,8.1,-0.3,-2.7\n"
    "1403715273267143168,-0.003,0.02,0.07,8.2,-0.3,-2.7\n"
    "1403715273272142848,-0.004,0.02,0.07,8.3,-0.3,-2.7\n";
const std::string kReference =
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x [m "
    "s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], "
    "b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]\n"
    "1403715273267143168,0.878612,2.142470,0.947262,0.060514,-0.828459,-0.058956,-0.553641,0.009,-0.016,-0.004,-0.002,"
    "0.02,0.07,-0.03,0.1,0.1\n";

class Euroc : public testing::Test {
 protected:
  Euroc() {
    folder_.write("r/mav0/imu0/data.csv", kImu);
    folder_.write("r/mav0/state_groundtruth_estimate0/data.csv", kReference);
  }
  std::filesystem::path recording() const { return folder_.path() / "r"; }
  test::TempFolder folder_;
};

TEST_F(Euroc, merges_the_files_in_time_order) {
  const auto source = open_euroc(recording());
  const auto all = read_all(*source);
  ASSERT_EQ(all.size(), 4U);
  EXPECT_TRUE(std::holds_alternative<ReferenceMeasurement>(all[1])) << "before the IMU sample of the same time";
  const auto reference = std::get<ReferenceMeasurement>(all[1]);
  EXPECT_NEAR(reference.q_world_body.w(), 0.060514, 1e-6);
  EXPECT_NEAR(reference.q_world_body.x(), -0.828459, 1e-6);
  EXPECT_EQ(reference.velocity, Eigen::Vector3d(0.009, -0.016, -0.004));
  EXPECT_EQ(std::get<ImuMeasurement>(all[3]).specific_force, Eigen::Vector3d(8.3, -0.3, -2.7));
  EXPECT_EQ(stamp_of(all[3]).sequence, 2);
  EXPECT_EQ(count(source->counts(), "imu.read"), 3);
  EXPECT_EQ(count(source->counts(), "reference.read"), 1);
}

TEST_F(Euroc, takes_mav0_itself_and_leaves_out_what_is_not_wanted) {
  EXPECT_EQ(read_all(*open_euroc(recording() / "mav0")).size(), 4U);
  EXPECT_EQ(read_all(*open_euroc(recording(), {.read_reference = false})).size(), 3U);
  std::filesystem::remove_all(recording() / "mav0/state_groundtruth_estimate0");
  EXPECT_EQ(read_all(*open_euroc(recording())).size(), 3U) << "a reference is not needed";
}

TEST_F(Euroc, reads_a_magnetometer) {
  folder_.write("r/mav0/mag0/data.csv", "#timestamp [ns],mx [uT],my [uT],mz [uT]\n1403715273267143168,20,0,-40\n");
  const auto all = read_all(*open_euroc(recording()));
  ASSERT_EQ(all.size(), 5U);
  EXPECT_TRUE((std::get<MagnetometerMeasurement>(all[1]).magnetic_field - Eigen::Vector3d(2e-5, 0, -4e-5)).norm() <
              1e-18);
}

TEST_F(Euroc, reads_gps_and_odometry_beside_it) {
  folder_.write("r/mav0/gps0/data.csv",
                "#timestamp [ns],latitude [deg],longitude [deg],altitude [m]\n1403715273267143168,45,6,300\n");
  folder_.write("r/mav0/odometry0/data.csv",
                "#timestamp [ns],odo_px [unit],odo_py [unit],odo_pz [unit]\n1403715273267143168,1,2,3\n"
                "1403715273272142848,2,3,4\n");
  const auto source = open_euroc(recording());
  const auto all = read_all(*source);
  ASSERT_EQ(all.size(), 7U);
  EXPECT_TRUE(std::holds_alternative<GpsMeasurement>(all[1])) << "the order of equal times";
  EXPECT_TRUE(std::holds_alternative<OdometryMeasurement>(all[2]));
  EXPECT_TRUE(std::holds_alternative<ReferenceMeasurement>(all[3]));
  EXPECT_EQ(std::get<OdometryMeasurement>(all[5]).position, Eigen::Vector3d(2, 3, 4));
  EXPECT_EQ(stamp_of(all[5]).sequence, 1);
  EXPECT_EQ(count(source->counts(), "gps.read"), 1);
  EXPECT_EQ(count(source->counts(), "odometry.read"), 2);
  EXPECT_EQ(read_all(*open_euroc(recording(), {.read_gps = false, .read_odometry = false})).size(), 4U);
  folder_.write("r/mav0/gps0/data.csv", kReference);
  expect_data_error([&] { open_euroc(recording()); }, {"gps0/data.csv", "no columns of gps"});
}

TEST_F(Euroc, what_is_missing_or_wrong_is_told) {
  expect_data_error([&] { open_euroc(folder_.path() / "none"); }, {"none", "no such folder"});
  expect_data_error([&] { open_euroc(folder_.path()); }, {"imu0/data.csv", "no such file"});
  folder_.write("r/mav0/imu0/data.csv", "");
  expect_data_error([&] { open_euroc(recording()); }, {"imu0/data.csv", "empty"});
  folder_.write("r/mav0/imu0/data.csv", kImu.substr(0, kImu.find('\n') + 1));
  expect_data_error([&] { open_euroc(recording()); }, {"no complete row"});
  std::string degrees = kImu;
  degrees.replace(degrees.find("rad s^-1"), 8, "rev s^-1");
  folder_.write("r/mav0/imu0/data.csv", degrees);
  expect_data_error([&] { open_euroc(recording()); }, {"data.csv:1", "w_RS_S_x", "revs^-1"});
  folder_.write("r/mav0/imu0/data.csv", kReference);
  expect_data_error([&] { open_euroc(recording()); }, {"no columns of imu"});
}

TEST_F(Euroc, paths_that_cannot_be_followed_are_told) {
  const auto field = recording() / "mav0/mag0";
  std::filesystem::create_symlink("mag0", field);
  expect_data_error([&] { open_euroc(recording()); }, {"mag0/data.csv", "symbolic links"});
  EXPECT_NO_THROW(open_euroc(recording(), {.read_magnetometer = false}));
  const auto loop = folder_.path() / "loop";
  std::filesystem::create_symlink("loop", loop);
  expect_data_error([&] { open_euroc(loop); }, {"loop", "symbolic links"});
  expect_data_error([&] { open_euroc(folder_.path() / std::string(300, 'n')); }, {"nnn", "name too long"});
  expect_data_error([&] { open_euroc(recording() / "mav0/imu0/data.csv"); }, {"data.csv", "no such folder"});
}

TEST_F(Euroc, rows_without_any_value_are_counted) {
  folder_.write("r/mav0/imu0/data.csv", kImu + "1403715273277142848,,,,,,\n");
  const auto source = open_euroc(recording());
  EXPECT_EQ(only<ImuMeasurement>(read_all(*source)).size(), 3U);
  EXPECT_EQ(count(source->counts(), "imu.skipped.empty"), 1);
}

TEST_F(Euroc, a_bad_row_is_told_after_the_rows_before_it) {
  folder_.write("r/mav0/imu0/data.csv", kImu + "1403715273277142848,-0.004,0.02,zero,8.3,-0.3,-2.7\n");
  const auto source = open_euroc(recording());
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(source->next());
  expect_data_error([&] { source->next(); }, {"imu0/data.csv:5", "w_RS_S_z", "zero"});
}

TEST_F(Euroc, repeated_and_shuffled_rows_are_counted) {
  folder_.write("r/mav0/imu0/data.csv", kImu + kImu.substr(kImu.find('\n') + 1));
  const auto source = open_euroc(recording());
  EXPECT_EQ(only<ImuMeasurement>(read_all(*source)).size(), 3U);
  EXPECT_EQ(count(source->counts(), "imu.skipped.time_not_increasing"), 3);
  EXPECT_EQ(std::ranges::count(source->counts(), "imu.skipped.time_not_increasing", &NamedCount::name), 1);
}

TEST_F(Euroc, cut_at_any_byte_gives_an_error_or_a_part_of_the_rows) {
  const auto whole = only<ImuMeasurement>(read_all(*open_euroc(recording())));
  for (std::size_t size = 0; size < kImu.size(); ++size) {
    SCOPED_TRACE(size);
    folder_.write("r/mav0/imu0/data.csv", kImu.substr(0, size));
    try {
      const auto part = only<ImuMeasurement>(read_all(*open_euroc(recording())));
      ASSERT_LT(part.size(), whole.size());
      for (std::size_t i = 0; i < part.size(); ++i) {
        EXPECT_EQ(part[i].time_ns, whole[i].time_ns);
        EXPECT_EQ(part[i].specific_force, whole[i].specific_force);
      }
    } catch (const DataError&) {
    }
  }
}

}  // namespace
}  // namespace loc
