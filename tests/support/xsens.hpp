// The raw recording that Tedaldi, Pretto and Menegatti published with "A robust and easy to implement method for IMU
// calibration without external equipments", ICRA 2014: an Xsens MTi, 100 Hz, ADC counts, put down in 38 poses.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "libloc/core/time.hpp"

namespace loc::test {

struct XsensRecording {
  std::vector<TimeNs> times_ns;
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> gyroscope;      // counts
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> accelerometer;  // counts
};

inline std::vector<double> read_numbers(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path.string() + " cannot be read");
  std::vector<double> numbers;
  for (double value = 0; file >> value;) numbers.push_back(value);
  if (!file.eof() || numbers.size() % 4 != 0) throw std::runtime_error(path.string() + " is not rows of four numbers");
  return numbers;
}

/// @param folder holds xsens_acc.mat and xsens_gyro.mat: text in spite of the name, rows of seconds, x, y, z.
inline XsensRecording read_xsens(const std::filesystem::path& folder) {
  const std::vector<double> a = read_numbers(folder / "xsens_acc.mat");
  const std::vector<double> g = read_numbers(folder / "xsens_gyro.mat");
  if (a.size() != g.size()) throw std::runtime_error("the two files differ in length");
  XsensRecording r;
  const auto rows = static_cast<Eigen::Index>(a.size() / 4);
  r.gyroscope.resize(rows, 3);
  r.accelerometer.resize(rows, 3);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto at = static_cast<std::size_t>(4 * i);
    if (a[at] != g[at]) throw std::runtime_error("the two files differ in time");
    r.times_ns.push_back(from_seconds(a[at]));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      r.accelerometer(i, static_cast<Eigen::Index>(axis)) = a[at + 1 + axis];
      r.gyroscope(i, static_cast<Eigen::Index>(axis)) = g[at + 1 + axis];
    }
  }
  return r;
}

/// When the device lay in each of the 38 poses, in seconds: read off a picture of the recording.
inline const std::vector<std::pair<double, double>>& xsens_poses() {
  static const std::vector<std::pair<double, double>> poses = {
      {1, 51},      {55.5, 63},   {68, 75.7},   {80.5, 88},   {93.5, 102}, {106.5, 113}, {117, 124.5}, {129.5, 135},
      {139.5, 147}, {154, 160},   {165.5, 168}, {177, 187},   {193, 203},  {208.8, 211}, {217, 220},   {225.5, 231},
      {235, 238.5}, {245.5, 251}, {256, 261},   {267, 275},   {281, 284},  {291, 296},   {305, 310},   {316, 321.5},
      {328, 335},   {341, 346.5}, {352, 357},   {363, 371},   {376, 386},  {394, 401},   {406, 413},   {418, 425},
      {432, 441},   {446, 456},   {461, 468},   {475, 482.5}, {488, 493},  {498, 507.5}};
  return poses;
}

}  // namespace loc::test
