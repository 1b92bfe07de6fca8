// TUM trajectories: order of the quaternion, exact times, damage.
#include <gtest/gtest.h>

#include "libloc/core/random.hpp"
#include "libloc/io/tum.hpp"
#include "tests/support/data.hpp"
#include "tests/support/sources.hpp"
#include "tests/support/temp_folder.hpp"

namespace loc {
namespace {

using test::count;
using test::expect_data_error;

class Tum : public testing::Test {
 protected:
  TumFile read(const std::string& text) { return read_tum(folder_.write("a.tum", text)); }
  void expect_error(const std::string& text, const std::vector<std::string>& parts) {
    expect_data_error([&] { read(text); }, parts);
  }
  test::TempFolder folder_;
};

TEST_F(Tum, the_quaternion_is_x_y_z_w) {
  const Trajectory read_back = read("# comment\n1403715274.302142975 1 2 3 0.1 0.2 0.3 0.927361849549570\n").trajectory;
  ASSERT_EQ(read_back.size(), 1U);
  EXPECT_EQ(read_back.times_ns[0], 1403715274302142975);
  EXPECT_EQ(read_back.poses[0].translation, Eigen::Vector3d(1, 2, 3));
  EXPECT_NEAR(read_back.poses[0].rotation.x(), 0.1, 1e-12);
  EXPECT_NEAR(read_back.poses[0].rotation.w(), 0.92736184954957, 1e-12);
}

TEST_F(Tum, what_is_written_is_read_to_the_last_bit) {
  Random random(3);
  Trajectory trajectory;
  for (int i = 0; i < 50; ++i) {
    trajectory.push_back(1403715274302142975 + i * 5'000'001LL, {random.rotation(), random.normal3()});
  }
  const auto path = folder_.path() / "b.tum";
  write_tum(path, trajectory);
  const Trajectory back = read_tum(path).trajectory;
  ASSERT_EQ(back.times_ns, trajectory.times_ns);
  for (std::size_t i = 0; i < back.size(); ++i) {
    EXPECT_EQ(back.poses[i].translation, trajectory.poses[i].translation);
    EXPECT_LT((back.poses[i].rotation.coeffs() - trajectory.poses[i].rotation.coeffs()).norm(), 3e-16);
  }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_.path()), {}), 1) << "nothing temporary is left";
}

TEST_F(Tum, errors_name_line_and_value) {
  const std::string good = "1 0 0 0 0 0 0 1\n";
  expect_data_error([&] { read_tum(folder_.path() / "none"); }, {"no such file"});
  expect_error("", {"empty"});
  expect_error("# timestamp tx ty tz qx qy qz qw\n", {"no complete pose"});
  expect_error(good + "2 0 0 zero 0 0 0 1\n", {"a.tum:2", "tz", "zero"});
  expect_error(good + "x 0 0 0 0 0 0 1\n", {"a.tum:2", "'x'"});
  expect_error(good + "nan 0 0 0 0 0 0 1\n", {"a.tum:2", "nan"});
  expect_error(good + "2 0 0 nan 0 0 0 1\n", {"tz", "nan"});
  expect_error(good + "2 0 inf 0 0 0 0 1\n", {"ty", "inf"});
  expect_error(good + "2 0 0 0 0 0 0\n", {"qw is missing"});
  expect_error(good + "2 0 0 0 0 0 0 1 9\n", {"more than 8"});
  expect_error(good + "2 0 0 0 0 0 0 0.98\n", {"a.tum:2", "norm"});
  expect_error(good + "2,0,0,0,0,0,0,1\n", {"a.tum:2"});
}

TEST_F(Tum, repeated_and_shuffled_poses_are_counted) {
  const TumFile file = read("1 0 0 0 0 0 0 1\r\n1 0 0 0 0 0 0 1\r\n3 0 0 0 0 0 0 1\r\n2 0 0 0 0 0 0 1\r\n");
  EXPECT_EQ(file.trajectory.size(), 2U);
  EXPECT_EQ(count(file.counts, "tum.skipped.time_not_increasing"), 2);
}

TEST_F(Tum, cut_at_any_byte_gives_an_error_or_a_part) {
  const std::string text = "\xEF\xBB\xBF# t\n10.5 1.25 2.5 3.75 0 0 0 1\n20.5 1.25 2.5 3.75 0 0 0.6 0.8\n";
  for (std::size_t size = 0; size < text.size(); ++size) {
    SCOPED_TRACE(size);
    try {
      const Trajectory part = read(text.substr(0, size)).trajectory;
      ASSERT_EQ(part.size(), 1U);
      EXPECT_EQ(part.times_ns[0], 10'500'000'000);
      EXPECT_EQ(part.poses[0].translation.z(), 3.75);
    } catch (const DataError&) {
    }
  }
  EXPECT_EQ(count(read(text.substr(0, text.size() - 1)).counts, "tum.skipped.no_line_end"), 1);
}

TEST_F(Tum, a_pose_that_is_not_finite_is_not_written) {
  Trajectory trajectory;
  trajectory.push_back(1, {Eigen::Quaterniond::Identity(), {std::nan(""), 0, 0}});
  EXPECT_THROW(write_tum(folder_.path() / "c.tum", trajectory), DataError);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "c.tum"));
  EXPECT_THROW(write_tum(folder_.path() / "none" / "c.tum", {}), DataError);
}

TEST_F(Tum, reads_a_real_trajectory) {
  LOC_DATA_OR_SKIP(file, "euroc-mh01-images/groundtruth.tum");
  const TumFile tum = read_tum(file);
  EXPECT_GT(tum.trajectory.size(), 5000U);
  EXPECT_EQ(tum.counts.size(), 1U);
}

}  // namespace
}  // namespace loc
