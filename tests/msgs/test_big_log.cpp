// A log of hundreds of megabytes is read in constant memory: one that is generated, or the pntOS drive when
// LIBLOC_PNTOS_LOG names it.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <cstdlib>

#include "libloc/io/lcm_log.hpp"
#include "msgs/lcm_log_source.hpp"
#include "tests/support/lcm_messages.hpp"
#include "tests/support/sources.hpp"
#include "tests/support/temp_folder.hpp"

namespace loc {
namespace {

long peak_kb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

TEST(BigLog, memory_stays_flat) {
  const test::TempFolder folder;
  const auto file = folder.path() / "big.log";
  constexpr int kEvents = 2'000'000;
  {
    LcmLogWriter writer(file);
    for (int i = 0; i < kEvents; ++i) {
      writer.write(i, "LOC_IMU", test::encode(to_message(test::imu_sample(1'000'000LL * (i + 1), i))));
    }
    writer.flush();
  }
  ASSERT_GT(std::filesystem::file_size(file), 200'000'000U);
  const auto source = open_lcm_log(file);
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(source->next());
  const long before = peak_kb();
  std::int64_t last = 0;
  while (const auto m = source->next()) last = stamp_of(*m).sequence;
  EXPECT_EQ(last, kEvents - 1);
  EXPECT_LT(peak_kb() - before, 4096) << "kB more at the end than at the beginning";
}

TEST(BigLog, the_pntos_drive_reads_whole) {
  const char* path = std::getenv("LIBLOC_PNTOS_LOG");
  if (path == nullptr) GTEST_SKIP() << "LIBLOC_PNTOS_LOG does not name cobra_gps_ins_example_data.log";
  const auto source = open_lcm_log(path);
  const long before = peak_kb();
  std::int64_t still = 0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  TimeNs first = kNoTime;
  double farthest = 0;
  double path_length = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  while (const auto m = source->next()) {
    if (first == kNoTime) first = stamp_of(*m).time_ns;
    if (const auto* imu = std::get_if<ImuMeasurement>(&*m); imu != nullptr && imu->time_ns - first < 100'000'000'000) {
      force += imu->specific_force;
      ++still;
    }
    if (const auto* reference = std::get_if<ReferenceMeasurement>(&*m)) {
      path_length += (reference->position - position).norm();
      position = reference->position;
      farthest = std::max(farthest, position.norm());
    }
  }
  EXPECT_LT(peak_kb() - before, 8192) << "kB";
  EXPECT_EQ(test::count(source->counts(), "imu.read"), 260203);
  EXPECT_EQ(test::count(source->counts(), "gps.read"), 2602);
  EXPECT_EQ(test::count(source->counts(), "reference.read"), 520411);
  EXPECT_EQ(test::count(source->counts(), "log.gaps"), 0);
  force /= static_cast<double>(still);
  EXPECT_NEAR(force.norm(), 9.81, 0.1) << "at rest";
  EXPECT_LT(force.z(), -9.7) << "forward-right-down";
  EXPECT_NEAR(path_length, 19'600, 400) << "m driven";
  EXPECT_LT(farthest, 20'000);
}

}  // namespace
}  // namespace loc
