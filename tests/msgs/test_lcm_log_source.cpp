// A recorded log as measurements.
#include <gtest/gtest.h>

#include "libloc/io/lcm_log.hpp"
#include "msgs/lcm_log_source.hpp"
#include "tests/support/lcm_messages.hpp"
#include "tests/support/sources.hpp"
#include "tests/support/temp_folder.hpp"

namespace loc {
namespace {

using test::count;
using test::encode;
using test::only;
using test::read_all;

class LogSource : public testing::Test {
 protected:
  std::filesystem::path file() const { return folder_.path() / "a.log"; }
  test::TempFolder folder_;
};

TEST_F(LogSource, gives_every_stream_with_the_time_of_its_messages) {
  LcmLogWriter writer(file());
  writer.write(1, "LOC_IMU", encode(to_message(test::imu_sample(1000, 0))));
  writer.write(2, "LOC_GPS", encode(to_message(test::gps_sample())));
  writer.write(3, "LOC_IMU", encode(to_message(test::imu_sample(2000, 1))));
  writer.write(4, "LOC_ESTIMATE", encode(test::estimate_message()));
  writer.write(5, "LOC_ODOMETRY", encode(to_message(test::odometry_sample())));
  writer.write(6, "LOC_TRACKS", encode(to_message(test::features_sample())));
  writer.flush();
  const auto source = open_lcm_log(file());
  const auto all = read_all(*source);
  ASSERT_EQ(all.size(), 5U);
  EXPECT_EQ(count(source->counts(), "odometry.read"), 1);
  EXPECT_EQ(count(source->counts(), "features.read"), 1);
  EXPECT_EQ(stamp_of(all[0]).time_ns, 1000);
  EXPECT_EQ(count(source->counts(), "imu.read"), 2);
  EXPECT_EQ(count(source->counts(), "gps.read"), 1);
  EXPECT_EQ(count(source->counts(), "ignored:LOC_ESTIMATE"), 1);
  EXPECT_FALSE(source->origin());
}

TEST_F(LogSource, the_time_of_the_log_is_the_arrival_of_messages_that_have_none) {
  LcmLogWriter writer(file());
  writer.write(50, "/imu", encode(test::aspn_imu(1'000'000'000, 1)));
  writer.write(60, "/imu", encode(test::aspn_imu(1'010'000'000, 2)));
  writer.write(70, "/ins", encode(test::aspn_pva(1'020'000'000, true)));
  writer.flush();
  const auto source = open_lcm_log(file());
  const auto all = read_all(*source);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(stamp_of(all[0]).time_ns, 1'010'000'000);
  EXPECT_EQ(stamp_of(all[0]).host_time_ns, 60'000);
  EXPECT_EQ(count(source->counts(), "imu.skipped.no_period"), 1);
  EXPECT_EQ(count(source->counts(), "ignored:/imu"), 0);
  EXPECT_TRUE(source->origin());
}

TEST_F(LogSource, messages_that_cannot_be_decoded_are_counted_per_channel) {
  LcmLogWriter writer(file());
  const Bytes imu = encode(to_message(test::imu_sample()));
  writer.write(1, "LOC_IMU", Bytes{1, 2, 3});
  writer.write(2, "LOC_IMU", encode(to_message(test::gps_sample())));
  writer.write(3, "LOC_IMAGE", Bytes(30, 1));
  writer.write(4, "LOC_IMU", imu);
  writer.write(5, "other", Bytes(40, 7));
  writer.flush();
  const auto source = open_lcm_log(file());
  EXPECT_EQ(read_all(*source).size(), 1U);
  EXPECT_EQ(count(source->counts(), "undecodable:LOC_IMU"), 2);
  EXPECT_EQ(count(source->counts(), "undecodable:LOC_IMAGE"), 1);
  EXPECT_EQ(count(source->counts(), "ignored:other"), 1);
}

TEST_F(LogSource, shuffled_and_repeated_messages_pass_as_they_would_live) {
  LcmLogWriter writer(file());
  for (const TimeNs t : {1000, 3000, 2000, 2000}) writer.write(t, "LOC_IMU", encode(to_message(test::imu_sample(t))));
  writer.flush();
  const auto imu = only<ImuMeasurement>(read_all(*open_lcm_log(file())));
  ASSERT_EQ(imu.size(), 4U);
  EXPECT_EQ(imu[2].time_ns, 2000);
}

TEST_F(LogSource, cut_at_any_byte_it_gives_the_whole_messages) {
  const Bytes imu = encode(to_message(test::imu_sample()));
  {
    LcmLogWriter writer(file());
    for (int i = 0; i < 3; ++i) writer.write(i, "LOC_IMU", imu);
    writer.flush();
  }
  const std::string text = test::read_file(file());
  const std::size_t event = text.size() / 3;
  for (std::size_t size = 0; size <= text.size(); ++size) {
    SCOPED_TRACE(size);
    const auto cut = folder_.write("cut.log", std::string_view(text).substr(0, size));
    if (size < event) {
      EXPECT_THROW(open_lcm_log(cut), DataError);
      continue;
    }
    const auto source = open_lcm_log(cut);
    const auto all = read_all(*source);
    EXPECT_EQ(all.size(), size / event);
    for (const Measurement& m : all)
      EXPECT_EQ(std::get<ImuMeasurement>(m).specific_force, test::imu_sample().specific_force);
    EXPECT_EQ(count(source->counts(), "log.truncated_bytes"), static_cast<std::int64_t>(size % event));
  }
}

TEST_F(LogSource, a_log_with_nothing_for_us_says_so_in_its_counts) {
  LcmLogWriter writer(file());
  writer.write(1, "x", Bytes(10, 1));
  writer.flush();
  const auto source = open_lcm_log(file());
  EXPECT_FALSE(source->next());
  EXPECT_EQ(count(source->counts(), "ignored:x"), 1);
}

}  // namespace
}  // namespace loc
