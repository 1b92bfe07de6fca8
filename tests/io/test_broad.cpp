// BROAD trials: units, times, absent variables, cut files.
#include <gtest/gtest.h>
#include <matio.h>

#include <cmath>

#include "libloc/io/broad.hpp"
#include "tests/support/data.hpp"
#include "tests/support/sources.hpp"
#include "tests/support/temp_folder.hpp"

namespace loc {
namespace {

using test::count;
using test::expect_data_error;
using test::only;
using test::read_all;

// A small trial, written by matio itself.
struct Trial {
  std::size_t rows = 4;
  double rate = 285.714285714;
  std::string leave_out = {};
  std::size_t short_columns = 0;  // of imu_acc
  bool compressed = false;
};

std::filesystem::path write_trial(const std::filesystem::path& path, const Trial& t) {
  mat_t* file = Mat_CreateVer(path.c_str(), nullptr, MAT_FT_MAT5);
  const auto put = [&](const char* name, std::size_t rows, std::size_t columns, auto value) {
    if (t.leave_out == name) return;
    std::vector<double> data(rows * columns);
    for (std::size_t j = 0; j < columns; ++j) {
      for (std::size_t i = 0; i < rows; ++i) data[j * rows + i] = value(i, j);
    }
    std::array<std::size_t, 2> dims{rows, columns};
    matvar_t* variable = Mat_VarCreate(name, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, dims.data(), data.data(), 0);
    Mat_VarWrite(file, variable, t.compressed ? MAT_COMPRESSION_ZLIB : MAT_COMPRESSION_NONE);
    Mat_VarFree(variable);
  };
  const auto cell = [](std::size_t i, std::size_t j) { return static_cast<double>(10 * i + j + 1); };
  put("imu_gyr", t.rows, 3, cell);
  put("imu_acc", t.rows, 3 - t.short_columns, cell);
  put("imu_mag", t.rows, 3, [](std::size_t i, std::size_t j) { return static_cast<double>(10 * (i / 2) + j); });
  put("opt_quat", t.rows, 4, [](std::size_t i, std::size_t j) { return i == 1 ? std::nan("") : (j == 0 ? 1.0 : 0.0); });
  put("opt_pos", t.rows, 3, cell);
  put("sampling_rate", 1, 1, [&](std::size_t, std::size_t) { return t.rate; });
  if (t.leave_out != "movement") {
    std::vector<std::uint8_t> flags(t.rows);
    for (std::size_t i = 0; i < t.rows; ++i) flags[i] = i % 2;
    std::array<std::size_t, 2> dims{t.rows, 1};
    matvar_t* variable =
        Mat_VarCreate("movement", MAT_C_UINT8, MAT_T_UINT8, 2, dims.data(), flags.data(), MAT_F_LOGICAL);
    Mat_VarWrite(file, variable, MAT_COMPRESSION_NONE);
    Mat_VarFree(variable);
  }
  Mat_Close(file);
  return path;
}

class Broad : public testing::Test {
 protected:
  std::filesystem::path write(const Trial& t) const { return write_trial(folder_.path() / "t.mat", t); }
  test::TempFolder folder_;
};

TEST_F(Broad, rows_units_and_times) {
  const BroadTrial trial = read_broad_trial(write({}));
  ASSERT_EQ(trial.time_ns.size(), 4U);
  EXPECT_EQ(trial.time_ns[0], 0);
  EXPECT_EQ(trial.time_ns[1], 3'500'000);
  EXPECT_EQ(trial.time_ns[3], 10'500'000);
  EXPECT_EQ(trial.angular_velocity.row(2), Eigen::RowVector3d(21, 22, 23));
  EXPECT_DOUBLE_EQ(trial.magnetic_field(2, 1), 11e-6);
  EXPECT_TRUE(std::isnan(trial.q_world_body_wxyz(1, 0)));
  EXPECT_FALSE(trial.score(0));
  EXPECT_TRUE(trial.score(1));
}

TEST_F(Broad, as_a_stream) {
  const auto source = open_broad(write({.compressed = true}), {.start_ns = 1'000'000'000});
  const auto all = read_all(*source);
  ASSERT_EQ(all.size(), 12U);
  const auto imu = only<ImuMeasurement>(all);
  EXPECT_EQ(imu[1].time_ns, 1'003'500'000);
  EXPECT_EQ(imu[1].specific_force, Eigen::Vector3d(11, 12, 13));
  EXPECT_EQ(imu[3].sequence, 3);
  const auto reference = only<ReferenceMeasurement>(all);
  EXPECT_EQ(reference[0].q_world_body.w(), 1);
  EXPECT_TRUE(reference[1].score);
  EXPECT_TRUE(std::isnan(reference[1].q_world_body.w()));
  EXPECT_EQ(count(source->counts(), "reference.not_finite"), 1);
  EXPECT_EQ(count(source->counts(), "imu.read"), 4);
}

TEST_F(Broad, repeated_values_of_the_magnetometer_can_be_left_out) {
  const auto source = open_broad(write({}), {.read_reference = false, .drop_repeated_field = true});
  EXPECT_EQ(only<MagnetometerMeasurement>(read_all(*source)).size(), 2U);
  EXPECT_EQ(count(source->counts(), "magnetometer.skipped.repeated"), 2);
}

TEST_F(Broad, what_is_missing_or_wrong_is_told) {
  expect_data_error([&] { read_broad_trial(folder_.path() / "none.mat"); }, {"none.mat", "no such file"});
  expect_data_error([&] { read_broad_trial(folder_.path()); }, {"cannot be read"});
  expect_data_error([&] { read_broad_trial(folder_.write("e.mat", "")); }, {"not a MATLAB"});
  expect_data_error([&] { read_broad_trial(folder_.write("e.mat", std::string(1000, 'x'))); }, {"not a MATLAB"});
  for (const char* name : {"imu_gyr", "imu_acc", "imu_mag", "opt_quat", "opt_pos", "sampling_rate", "movement"}) {
    expect_data_error([&] { read_broad_trial(write({.leave_out = name})); }, {"t.mat", name, "missing"});
  }
  expect_data_error([&] { read_broad_trial(write({.short_columns = 1})); }, {"imu_acc", "size"});
  expect_data_error([&] { read_broad_trial(write({.rate = 0})); }, {"sampling_rate", "positive"});
  expect_data_error([&] { read_broad_trial(write({.rate = std::nan("")})); }, {"sampling_rate"});
}

TEST_F(Broad, cut_at_any_byte_is_refused) {
  for (const bool compressed : {false, true}) {
    const std::string text = test::read_file(write({.compressed = compressed}));
    for (std::size_t size = 0; size < text.size(); ++size) {
      EXPECT_THROW(read_broad_trial(folder_.write("cut.mat", std::string_view(text).substr(0, size))), DataError)
          << size;
    }
  }
}

TEST_F(Broad, reads_a_real_trial) {
  LOC_DATA_OR_SKIP(file, "broad/01_undisturbed_slow_rotation_A.mat");
  const BroadTrial trial = read_broad_trial(file);
  EXPECT_EQ(trial.angular_velocity.rows(), 56940);
  EXPECT_NEAR(trial.specific_force.row(0).norm(), 9.93, 0.02);
  EXPECT_NEAR(trial.magnetic_field.row(0).norm(), 41.5e-6, 0.5e-6);
  EXPECT_NEAR(trial.q_world_body_wxyz(0, 0), 0.99973274, 1e-7);
  EXPECT_EQ(trial.q_world_body_wxyz.array().isNaN().count(), 648);
  EXPECT_EQ(trial.time_ns.back(), std::llround(56939 / trial.rate_hz * 1e9));
  EXPECT_GT(trial.score.count(), 10000);
}

}  // namespace
}  // namespace loc
