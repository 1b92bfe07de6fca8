// loc-estimator --images as a process: the pictures of a log off line, and live from a driver; damaged ones, those of
// other cameras, and what cannot be had together.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>

#include "libloc/eval/trajectory_error.hpp"
#include "libloc/io/lcm_log.hpp"
#include "libloc/io/rig_yaml.hpp"
#include "libloc/io/tum.hpp"
#include "libloc/vision/image_codec.hpp"
#include "msgs/decode.hpp"
#include "msgs/lcm_log_writer.hpp"
#include "msgs/slam_messages.hpp"
#include "program_test.hpp"
#include "tests/support/rendered_ride.hpp"
#include "tests/support/temp_folder.hpp"

namespace loc::test {
namespace {

constexpr double kSeconds = 2.5;
constexpr double kFrame = 0.05;
constexpr int kDamaged = 30;

// At rest for a second, so that the start with an IMU is the simple one.
Pose3 ride(double t) {
  const double moving = std::max(0.0, t - 1);
  return swaying(moving * moving / (moving + 0.5));
}

class SlamPictures : public ::testing::Test {
 protected:
  void SetUp() override {
    RoomCamera room(small_camera());
    Rig rig;
    rig.cameras.push_back(room.calibration());
    write_rig(path("rig.yaml"), rig);
    std::vector<Measurement> all;
    for (int i = 0; i < static_cast<int>(kSeconds / kFrame); ++i) {
      ImageMeasurement image = room.at(ride(i * kFrame), from_seconds(i * kFrame) + from_seconds(100));
      truth_.times_ns.push_back(image.time_ns);
      truth_.poses.push_back(ride(i * kFrame));
      if (i % 2 == 1) image = encode_jpeg(image, 95);
      if (i == kDamaged) {
        image = encode_jpeg(image);
        auto bytes = std::make_shared<std::vector<std::uint8_t>>(*image.data);
        bytes->erase(bytes->begin() + static_cast<std::ptrdiff_t>(bytes->size() / 2),
                     bytes->begin() + static_cast<std::ptrdiff_t>(bytes->size() / 2 + 100));
        image.data = bytes;
      }
      all.emplace_back(image);
      if (i % 10 != 0) continue;
      // Right after the sample that completes the frame.
      ImageMeasurement other = room.at(ride(0), image.time_ns + from_seconds(0.002));
      other.camera = 1;
      other.sequence = i / 10;
      all.emplace_back(other);
    }
    for (int i = 0; i < static_cast<int>(kSeconds / 0.005); ++i) {
      ImuMeasurement imu = imu_of(ride, i * 0.005);
      imu.time_ns += from_seconds(100);
      imu.sequence = i;
      all.emplace_back(imu);
    }
    std::stable_sort(all.begin(), all.end(), [](const Measurement& a, const Measurement& b) {
      return stamp_of(a).time_ns < stamp_of(b).time_ns;
    });
    const auto log = create_lcm_log(path("ride.lcm"));
    for (const Measurement& m : all) log->write(m);
    log->finish();
  }
  std::string path(const std::string& name) const { return folder_.path(name); }
  std::string errors() const { return text_of(path("err")); }
  int offline(const std::string& method, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"--method", method,           "--images", "--input",    path("ride.lcm"),
                                          "--config", path("rig.yaml"), "--output", path("e.tum")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run("loc-estimator", arguments, path("err"));
  }

  TemporaryFolder folder_;
  Trajectory truth_;
};

TEST_F(SlamPictures, OffLineAndLiveFindTheWay) {
  constexpr int kPictures = static_cast<int>(kSeconds / kFrame);
  for (const std::string method : {"mono-slam", "inertial-slam"}) {
    ASSERT_EQ(offline(method, {}), 0) << errors();
    EXPECT_EQ(figure(errors(), "event=ended", "pictures"), kPictures - 1) << errors();
    EXPECT_EQ(figure(errors(), "event=ended", "pictures.skipped.damaged"), 1);
    const Trajectory found = read_tum(path("e.tum")).trajectory;
    AssociationOptions association;
    association.max_difference_ns = 1'000'000;
    const Association pairs = associate(found, truth_, association);
    EXPECT_GE(pairs.estimate.times_ns.size(), static_cast<std::size_t>(kPictures - 2)) << method;
    const bool metric = method == "inertial-slam";
    EXPECT_LT(absolute_error(pairs.estimate, pairs.reference, metric ? AlignmentMode::kSe3 : AlignmentMode::kSim3)
                  .translation.rmse,
              0.03)
        << method;
  }
}

// As fast as the estimator takes them, with nothing else to go by than the pictures themselves.
TEST_F(SlamPictures, ACameraAloneAsFastAsItGoes) {
  ASSERT_EQ(offline("mono-slam", {"--map-out", path("offline.slam")}), 0) << errors();
  ASSERT_EQ(
      run("loc-live",
          {"lcm-log", path("ride.lcm"), "--config", path("rig.yaml"), "--transport", "hub", "--speed", "max", "--log",
           path("live.lcm"), "--estimator-args", "--method mono-slam --images --map-out " + path("live.slam")},
          path("err")),
      0)
      << errors();
  EXPECT_EQ(figure(errors(), " image.dropped=", "image.dropped"), 0) << errors();
  EXPECT_EQ(figure(errors(), "program=loc-driver pid", "window.outstanding"), 0) << errors();
  EXPECT_EQ(read_file(path("live.slam")), read_file(path("offline.slam")));
}

TEST_F(SlamPictures, LiveIsTheSameWhenNothingIsDropped) {
  ASSERT_EQ(offline("inertial-slam", {"--map-out", path("offline.slam")}), 0) << errors();
  ASSERT_EQ(
      run("loc-live",
          {"lcm-log", path("ride.lcm"), "--config", path("rig.yaml"), "--transport", "hub", "--speed", "max", "--log",
           path("live.lcm"), "--estimator-args", "--method inertial-slam --images --map-out " + path("live.slam")},
          path("err")),
      0)
      << errors();
  EXPECT_EQ(figure(errors(), " image.dropped=", "image.dropped"), 0) << errors();
  EXPECT_EQ(read_file(path("live.slam")), read_file(path("offline.slam")));
  // Each frame once, though pictures of another camera and a damaged one stand between.
  std::vector<TimeNs> times;
  LcmLogReader reader(path("live.lcm"));
  while (const LcmLogEvent* event = reader.next()) {
    if (event->channel == kSlamFrameChannel) times.push_back(decode_message<slam_frame_t>(event->data).time_ns);
  }
  EXPECT_EQ(times.size(), static_cast<std::size_t>(kSeconds / kFrame) - 1);
  EXPECT_EQ(std::ranges::adjacent_find(times, std::greater_equal<>()), times.end());
}

TEST_F(SlamPictures, WhatCannotBeIsRefused) {
  EXPECT_EQ(offline("inertial-slam", {"--map-in", path("rig.yaml")}), 2);
  EXPECT_NE(errors().find("--map-in"), std::string::npos) << errors();
  EXPECT_EQ(offline("madgwick", {}), 2);
  EXPECT_NE(errors().find("--images"), std::string::npos) << errors();
}

}  // namespace
}  // namespace loc::test
