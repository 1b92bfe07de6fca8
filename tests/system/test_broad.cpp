// Accuracy of the Madgwick filter on real recordings with optical truth: the trials of BROAD in the data folder, scored
// with BROAD's own metric. The bounds are those that libloc promises for BROAD as a whole, wider where the folder's
// trials are known to be harder than the whole (the raw gyroscope, whose bias is largest here).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <numbers>
#include <string>
#include <vector>

#include "libloc/core/statistics.hpp"
#include "libloc/estimators/madgwick.hpp"
#include "libloc/eval/orientation_error.hpp"
#include "libloc/io/broad.hpp"
#include "support/data.hpp"

namespace loc {
namespace {

OrientationError run(const BroadTrial& trial, const MadgwickOptions& options, bool with_magnetometer) {
  MadgwickFilter filter(options);
  std::vector<Eigen::Quaterniond> estimate;
  std::vector<Eigen::Quaterniond> reference;
  std::vector<std::uint8_t> mask;
  for (std::size_t k = 0; k < trial.time_ns.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    MagnetometerMeasurement magnetometer;
    ImuMeasurement imu;
    magnetometer.time_ns = imu.time_ns = trial.time_ns[k];
    magnetometer.magnetic_field = trial.magnetic_field.row(row);
    imu.angular_velocity = trial.angular_velocity.row(row);
    imu.specific_force = trial.specific_force.row(row);
    if (with_magnetometer) filter.update(magnetometer);
    filter.update(imu);
    estimate.push_back(filter.orientation());
    const Eigen::RowVector4d q = trial.q_world_body_wxyz.row(row);
    reference.emplace_back(q[0], q[1], q[2], q[3]);
    mask.push_back(trial.score[row] ? 1 : 0);
  }
  return orientation_error(estimate, reference, mask);
}

struct Setting {
  const char* name;
  MadgwickOptions options;
  bool with_magnetometer;
  double max_mean_total_deg;
  double max_worst_total_deg;
  double max_mean_inclination_deg;
};

TEST(Broad, AccuracyOnEveryTrialAtHand) {
  const std::filesystem::path folder = test::data_folder() / "broad";
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP() << folder << " is absent; LIBLOC_DATA names the folder of the recordings";
  }
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".mat") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  ASSERT_FALSE(files.empty()) << folder;

  MadgwickOptions rest = MadgwickOptions::report();
  rest.rest_bias = true;
  rest.beta = 0.041;
  const MadgwickOptions report = MadgwickOptions::report();
  const MadgwickOptions robust = MadgwickOptions::robust();
  const std::vector<Setting> settings = {{"report, beta 0.1", report, true, 5.5, 11, 4},
                                         {"report, rest bias, beta 0.041", rest, true, 3.6, 8, 3},
                                         {"robust", robust, true, 2.3, 7.5, 1.1},
                                         {"robust, 6 axes", robust, false, 10, 20, 1.1}};
  constexpr double kDegrees = 180 / std::numbers::pi;
  for (const Setting& setting : settings) {
    std::vector<double> total;
    std::vector<double> heading;
    std::vector<double> inclination;
    for (const auto& file : files) {
      const OrientationError error = run(read_broad_trial(file), setting.options, setting.with_magnetometer);
      total.push_back(error.total_rmse * kDegrees);
      heading.push_back(error.heading_rmse * kDegrees);
      inclination.push_back(error.inclination_rmse * kDegrees);
    }
    const double worst = *std::max_element(total.begin(), total.end());
    std::printf("%-30s %zu trials: total %.2f, heading %.2f, inclination %.2f deg, worst total %.2f\n", setting.name,
                files.size(), mean(total), mean(heading), mean(inclination), worst);
    EXPECT_LT(mean(total), setting.max_mean_total_deg) << setting.name;
    EXPECT_LT(worst, setting.max_worst_total_deg) << setting.name;
    EXPECT_LT(mean(inclination), setting.max_mean_inclination_deg) << setting.name;
  }
}

}  // namespace
}  // namespace loc
