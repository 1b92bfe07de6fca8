// loc-driver with pictures from files; a live camera: stamps, newest wins, unplugging and replugging with a grabber
// that the test controls; and OpenCV's own V4L2 code on a camera that is preloaded (fake_v4l2.cpp). No device is
// needed, and none was used.
#include <gtest/gtest.h>

#include <atomic>
#include <deque>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <thread>

#include "libloc/core/check.hpp"
#include "libloc/vision/feature_video.hpp"
#include "libloc/vision/image_codec.hpp"
#include "libloc/vision/image_file.hpp"
#include "loc/source_status_t.hpp"
#include "msgs/convert.hpp"
#include "msgs/decode.hpp"
#include "program_test.hpp"
#include "support/sources.hpp"
#include "tools/support/camera_source.hpp"
#include "tools/support/lcm_link.hpp"
#include "tools/support/open_source.hpp"
#include "tools/support/program.hpp"

namespace loc::test {
namespace {

/// A camera in the hands of the test.
struct TestCamera {
  std::mutex mutex;
  std::deque<CameraFrame> frames;
  std::atomic<bool> plugged = true;
  std::atomic<int> opened = 0;

  void send(std::uint8_t value, TimeNs device_ns) {
    CameraFrame frame;
    frame.image.width_px = 2;
    frame.image.height_px = 1;
    frame.image.row_stride_bytes = 2;
    frame.image.data = std::make_shared<const std::vector<std::uint8_t>>(2, value);
    frame.device_ns = device_ns;
    const std::lock_guard lock(mutex);
    frames.push_back(std::move(frame));
  }
  bool all_taken() {
    const std::lock_guard lock(mutex);
    return frames.empty();
  }

  CameraConnection connection() {
    return {.name = "test camera", .open = [this]() -> std::unique_ptr<CameraGrabber> {
              if (!plugged) throw CameraError("is the camera plugged in?");
              ++opened;
              return std::make_unique<Grabber>(*this);
            }};
  }

  class Grabber final : public CameraGrabber {
   public:
    explicit Grabber(TestCamera& camera) : camera_(camera) {}
    std::optional<CameraFrame> grab() override {
      if (!camera_.plugged) throw CameraError("no such device");
      if (camera_.all_taken()) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return std::nullopt;
      }
      const std::lock_guard lock(camera_.mutex);
      CameraFrame frame = std::move(camera_.frames.front());
      camera_.frames.pop_front();
      return frame;
    }
    std::string description() const override { return "2x1"; }

   private:
    TestCamera& camera_;
  };
};

class LiveCamera : public ::testing::Test {
 protected:
  LiveCamera() {
    options_.reconnect_s = 0.05;
    options_.on_trouble = [this](const std::string& text) { troubles_.push_back(text); };
  }
  std::unique_ptr<MeasurementSource> open() { return open_camera(camera_.connection(), options_); }
  static ImageMeasurement next(MeasurementSource& source) {
    const auto measurement = source.next();
    return measurement ? std::get<ImageMeasurement>(*measurement) : ImageMeasurement{};
  }

  TestCamera camera_;
  LiveCameraOptions options_;
  std::vector<std::string> troubles_;
};

TEST_F(LiveCamera, StampsOfTheKernelAreBroughtToTheHostsClock) {
  const auto source = open();
  const TimeNs before = host_now();
  const TimeNs stamp = steady_now() - 30 * kMs;
  camera_.send(1, stamp);
  const ImageMeasurement monotonic = next(*source);
  EXPECT_NEAR(to_seconds(monotonic.time_ns - before), -0.03, 0.02);
  EXPECT_EQ(monotonic.host_time_ns, monotonic.time_ns);
  // A second picture with a stamp 20 ms later is 20 ms later, however long it took to come.
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  camera_.send(2, stamp + 20 * kMs);
  EXPECT_NEAR(to_seconds(next(*source).time_ns - monotonic.time_ns), 0.02, 1e-3);
  const TimeNs of_day = host_now() - 5 * kMs;
  camera_.send(3, of_day);
  EXPECT_EQ(next(*source).time_ns, of_day);
  camera_.send(4, 1234);  // a counter of its own
  const ImageMeasurement other = next(*source);
  EXPECT_NEAR(to_seconds(other.time_ns - host_now()), 0, 0.5);
  EXPECT_EQ(other.sequence, 3);
  camera_.send(5, kNoTime);
  camera_.send(6, steady_now() - 1500 * kMs);  // older than the one before it
  camera_.send(7, kNoTime);
  EXPECT_EQ((*next(*source).data)[0], 5);
  EXPECT_EQ((*next(*source).data)[0], 7);
  EXPECT_EQ(count(source->counts(), "camera.stamped_by_kernel"), 4);
  EXPECT_EQ(count(source->counts(), "camera.stamped_at_arrival"), 3);
  EXPECT_EQ(count(source->counts(), "image.skipped.time_not_increasing"), 1);
  EXPECT_EQ(count(source->counts(), "image.read"), 6);
}

TEST_F(LiveCamera, TheNewestPicturesWinAndTheOthersAreCounted) {
  const auto source = open();
  for (int i = 0; i < 10; ++i) camera_.send(static_cast<std::uint8_t>(i), kNoTime);
  ASSERT_TRUE(
      wait_until([&] { return camera_.all_taken() && count(source->counts(), "camera.dropped") == 6; }, kSecond));
  for (const int expected : {6, 7, 8, 9}) EXPECT_EQ((*next(*source).data)[0], expected);
}

TEST_F(LiveCamera, AnUnpluggedCameraComesBack) {
  const auto source = open();
  camera_.send(1, kNoTime);
  EXPECT_EQ((*next(*source).data)[0], 1);
  for (int round = 0; round < 2; ++round) {
    camera_.plugged = false;
    std::thread plug([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
      camera_.plugged = true;
      camera_.send(2, kNoTime);
    });
    EXPECT_EQ((*next(*source).data)[0], 2);
    plug.join();
  }
  EXPECT_EQ(camera_.opened, 3);
  EXPECT_EQ(count(source->counts(), "camera.connections"), 3);
  EXPECT_EQ(count(source->counts(), "camera.connections_lost"), 2);
  EXPECT_GT(count(source->counts(), "camera.connections_failed"), 0);
  EXPECT_EQ(count(source->counts(), "image.read"), 3);
  ASSERT_EQ(troubles_.size(), 6U) << "each time: lost, not there, well again";
  EXPECT_NE(troubles_[0].find("test camera: lost: no such device"), std::string::npos);
  EXPECT_NE(troubles_[1].find("plugged in?"), std::string::npos);
  EXPECT_EQ(troubles_[2], "");
}

TEST_F(LiveCamera, AbsentAtTheStart) {
  camera_.plugged = false;
  EXPECT_THROW(open(), CameraError);
  options_.wait = true;
  const auto source = open();
  std::thread plug([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(150));
    camera_.send(9, kNoTime);
    camera_.plugged = true;
  });
  EXPECT_EQ((*next(*source).data)[0], 9);
  plug.join();
  EXPECT_EQ(count(source->counts(), "camera.connections"), 1);
  EXPECT_EQ(count(source->counts(), "camera.connections_lost"), 0);
}

TEST_F(LiveCamera, DamagedPicturesAreLeftOutAndSilenceIsTold) {
  options_.silence_s = 0.1;
  options_.convert = [](ImageMeasurement image) {
    if ((*image.data)[0] == 13) throw DataError("JPEG is damaged");
    return image;
  };
  MeasurementSource* running = nullptr;
  options_.on_idle = [&] {
    if (running != nullptr && !troubles_.empty() && !troubles_.back().empty()) running->stop();
  };
  const auto source = open();
  camera_.send(13, kNoTime);
  camera_.send(14, kNoTime);
  EXPECT_EQ((*next(*source).data)[0], 14);
  EXPECT_EQ(count(source->counts(), "image.skipped.damaged"), 1);
  running = source.get();
  EXPECT_FALSE(source->next()) << "stopped from on_idle, when it was told";
  EXPECT_NE(troubles_.back().find("sends no pictures"), std::string::npos);
  options_.camera = -1;
  EXPECT_THROW(open(), std::invalid_argument);
}

/// Hears what loc-driver publishes.
class PictureDriver : public ::testing::Test {
 protected:
  PictureDriver() : hub_(folder_), receiver_(hub_.url) {
    receiver_.subscribe("LOC_IMAGE",
                        [this](auto, auto data) { images_.push_back(from_message(decode_message<image_t>(data))); });
    receiver_.subscribe("LOC_IMU", [this](auto, auto) { ++imu_samples_; });
    receiver_.subscribe(kSourceStatusChannel,
                        [this](auto, auto data) { troubles_ += decode_message<source_status_t>(data).message + "\n"; });
    receiver_.handle(50);
  }
  void start_driver(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--lcm-url", hub_.url});
    driver_.emplace(start("loc-driver", arguments, folder_.path("driver.err")));
  }
  std::string log() const { return text_of(folder_.path("driver.err")); }
  bool wait_for(const std::function<bool()>& condition, TimeNs patience = 10 * kSecond) {
    const TimeNs give_up = steady_now() + patience;
    while (!condition()) {
      if (steady_now() > give_up) return false;
      receiver_.handle(10);
    }
    return true;
  }
  /// Until the driver has ended and all has come.
  void hear_all() {
    EXPECT_TRUE(wait_for([&] { return !driver_->running(); })) << log();
    EXPECT_TRUE(driver_->succeeded()) << log();
    while (receiver_.handle(100)) {
    }
  }
  std::int64_t end_and_count(const std::string& name) {
    if (driver_->running()) {
      EXPECT_TRUE(driver_->stop(3 * kSecond)) << log();
    }
    return figure(log(), "event=ended", name);
  }
  /// A picture with its number as its brightness.
  static ImageMeasurement picture(int number) {
    ImageMeasurement image;
    image.width_px = image.row_stride_bytes = 320;
    image.height_px = 240;
    std::vector<std::uint8_t> pixels(320 * 240);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      pixels[i] = static_cast<std::uint8_t>(static_cast<std::size_t>(number) + i % 320 / 160);
    }
    image.data = std::make_shared<const std::vector<std::uint8_t>>(std::move(pixels));
    return image;
  }

  TemporaryFolder folder_;
  RunningHub hub_;
  LcmReceiver receiver_;
  std::vector<ImageMeasurement> images_;
  int imu_samples_ = 0;
  std::string troubles_;
  std::optional<ChildProcess> driver_;
};

TEST_F(PictureDriver, AFolderOfPicturesAsGreyAndAsJpeg) {
  std::filesystem::create_directories(folder_.path("p"));
  for (int i = 0; i < 10; ++i) {
    write_image(folder_.path("p/" + std::to_string(i) + (i < 5 ? ".jpg" : ".png")), picture(10 * i));
  }
  start_driver({"images", folder_.path("p"), "--rate-hz", "50", "--camera", "2"});
  hear_all();
  ASSERT_EQ(images_.size(), 10U) << log();
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(images_[i].time_ns, static_cast<TimeNs>(i) * 20 * kMs);
    EXPECT_EQ(images_[i].camera, 2);
    EXPECT_EQ(images_[i].format, PixelFormat::kGray);
    EXPECT_NEAR((*images_[i].data)[0], 10 * static_cast<double>(i), 2);
  }
  images_.clear();
  start_driver({"images", folder_.path("p"), "--rate-hz", "50", "--format", "jpeg", "--speed", "5"});
  hear_all();
  ASSERT_EQ(images_.size(), 10U) << log();
  for (std::size_t i = 0; i < 10; ++i) {
    ASSERT_EQ(images_[i].format, PixelFormat::kMjpeg);
    EXPECT_NEAR((*decode_image(images_[i]).data)[0], 10 * static_cast<double>(i), 2);
  }
  const std::string stored = text_of(folder_.path("p/3.jpg"));
  EXPECT_EQ(std::string(images_[3].data->begin(), images_[3].data->end()), stored) << "not decoded";
  EXPECT_EQ(guess_source_kind(folder_.path("p")), "images");
  std::filesystem::create_directories(folder_.path("euroc/mav0"));
  write_image(folder_.path("euroc/preview.png"), picture(1));
  EXPECT_EQ(guess_source_kind(folder_.path("euroc")), "euroc");
  EXPECT_EQ(guess_source_kind(folder_.path("drive.MP4")), "video");
  EXPECT_EQ(guess_source_kind(folder_.path("drive.rawlog")), "rawlog");
  const auto usage = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "images");
    return run("loc-driver", arguments, folder_.path("driver.err"));
  };
  EXPECT_EQ(usage({folder_.path("p")}), 1) << "when were they taken?";
  EXPECT_NE(log().find("needs a rate"), std::string::npos) << log();
  EXPECT_EQ(usage({folder_.path("none"), "--rate-hz", "5"}), 2);
  EXPECT_EQ(usage({folder_.path("p"), "--rate-hz", "5", "--names", "ns"}), 2);
}

TEST_F(PictureDriver, EurocWithItsPicturesAndAVideoWithItsImu) {
  const std::string cam = folder_.path("r/mav0/cam0");
  std::filesystem::create_directories(cam + "/data");
  std::ofstream list(cam + "/data.csv");
  list << "#timestamp [ns],filename\n";
  for (int i = 0; i < 4; ++i) {
    write_image(cam + "/data/" + std::to_string(i) + ".png", picture(i));
    list << i * 50'000'000 << ',' << i << ".png\n";
  }
  list.close();
  std::filesystem::create_directories(folder_.path("r/mav0/imu0"));
  write_recording(folder_.path("r/mav0/imu0/data.csv"), 200, 0.2, 1000);
  start_driver({"euroc", folder_.path("r")});
  hear_all();
  EXPECT_TRUE(images_.empty());
  EXPECT_GT(imu_samples_, 35);
  EXPECT_NE(log().find("--images publishes them"), std::string::npos) << log();
  imu_samples_ = 0;
  start_driver({"euroc", folder_.path("r"), "--images", "--speed", "5"});
  hear_all();
  EXPECT_EQ(images_.size(), 4U) << log();
  EXPECT_GT(imu_samples_, 35);

  VideoFile video(folder_.path("v.avi"), 320, 240, 20);
  for (int i = 0; i < 4; ++i) video.add(picture(40 * i));
  video.finish();
  write_recording(folder_.path("imu.csv"), 200, 0.3);
  images_.clear();
  imu_samples_ = 0;
  start_driver({"video", folder_.path("v.avi"), "--imu", folder_.path("imu.csv"), "--start-time", "imu"});
  hear_all();
  ASSERT_EQ(images_.size(), 4U) << log();
  EXPECT_EQ(images_[3].time_ns - images_[0].time_ns, 150 * kMs);
  EXPECT_NEAR((*images_[3].data)[0], 120, 2);
  EXPECT_GT(imu_samples_, 55);
  EXPECT_EQ(
      run("loc-driver", {"video", folder_.path("v.avi"), "--imu", folder_.path("imu.csv"), "--start-time", "soon"},
          folder_.path("driver.err")),
      2);
  start_driver({"video", folder_.path("v.avi"), "--imu", folder_.path("imu.csv"), "--start-time", "-5000"});
  ASSERT_TRUE(wait_for([&] { return !driver_->running(); })) << log();
  EXPECT_NE(log().find("they are not on one clock"), std::string::npos) << log();
}

/// loc-driver in a process that believes in a camera.
class V4l2Driver : public PictureDriver {
 protected:
  V4l2Driver() : device_(folder_.path("camera")) { ::setenv("FAKE_V4L2", device_.c_str(), 1); }
  ~V4l2Driver() override {
    for (const char* name : {"LD_PRELOAD", "FAKE_V4L2", "FAKE_V4L2_JPEG", "FAKE_V4L2_STAMPS"}) ::unsetenv(name);
  }
  void plug() const { std::ofstream(device_) << "camera"; }
  void unplug() const { std::filesystem::remove(device_); }
  void start_driver(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"camera", device_, "--width", "320", "--height", "240"});
    ::setenv("LD_PRELOAD", LOC_FAKE_V4L2, 1);
    PictureDriver::start_driver(arguments);
    ::unsetenv("LD_PRELOAD");
  }

  std::string device_;
};

TEST_F(V4l2Driver, PicturesWithTheKernelsStampsAndAnUnpluggedCamera) {
  plug();
  start_driver({"--reconnect", "0.1", "--camera", "1", "--exposure-ms", "5"});
  ASSERT_TRUE(wait_for([&] { return images_.size() >= 20; })) << log();
  for (std::size_t i = 1; i < 20; ++i) {
    const ImageMeasurement& image = images_[i];
    EXPECT_EQ(image.width_px, 320);
    EXPECT_EQ(image.height_px, 240);
    EXPECT_EQ(image.format, PixelFormat::kGray);
    EXPECT_EQ(image.camera, 1);
    EXPECT_EQ(image.exposure_ns, 5 * kMs);
    EXPECT_EQ(image.sequence, images_[i - 1].sequence + 1);
    EXPECT_EQ((*image.data)[0], (*image.data)[320 * 239 + 319]);
    EXPECT_GT(image.time_ns, images_[i - 1].time_ns);
  }
  EXPECT_LT(to_seconds(host_now() - images_.back().time_ns), 5) << "on the host's clock";
  unplug();
  ASSERT_TRUE(wait_for([&] { return troubles_.find("is the camera plugged in?") != std::string::npos; })) << log();
  const std::size_t before = images_.size();
  plug();
  ASSERT_TRUE(wait_for([&] { return images_.size() >= before + 10; })) << log();
  EXPECT_EQ(end_and_count("camera.connections"), 2) << log();
  EXPECT_EQ(end_and_count("camera.connections_lost"), 1);
  EXPECT_GT(end_and_count("camera.stamped_by_kernel"), 25);
  EXPECT_EQ(end_and_count("camera.stamped_at_arrival"), -1);
  EXPECT_NE(log().find("320x240 YUYV 50 Hz"), std::string::npos) << log();
}

TEST_F(V4l2Driver, JpegGoesOnAsTheCameraMadeItAndDamageIsCounted) {
  plug();
  const ImageMeasurement jpeg = encode_jpeg(picture(90));
  const std::string bytes(jpeg.data->begin(), jpeg.data->end());
  const std::string file = folder_.path("picture.jpg");
  std::ofstream(file, std::ios::binary) << bytes;
  ::setenv("FAKE_V4L2_JPEG", file.c_str(), 1);
  ::setenv("FAKE_V4L2_STAMPS", "none", 1);
  start_driver({"--format", "jpeg"});
  ASSERT_TRUE(wait_for([&] { return images_.size() >= 5; })) << log();
  EXPECT_EQ(images_[3].format, PixelFormat::kMjpeg);
  EXPECT_EQ(std::string(images_[3].data->begin(), images_[3].data->end()), bytes);
  EXPECT_GE(end_and_count("camera.stamped_at_arrival"), 5);

  std::ofstream(file, std::ios::binary) << bytes.substr(0, bytes.size() / 2);
  while (receiver_.handle(100)) {
  }
  images_.clear();
  start_driver({"--format", "jpeg"});
  ASSERT_TRUE(wait_for([&] { return log().find("event=picture_damaged") != std::string::npos; })) << log();
  EXPECT_GE(end_and_count("image.skipped.damaged"), 1);
  EXPECT_TRUE(images_.empty());
}

TEST_F(V4l2Driver, ASilentCameraIsToldAndGoesOn) {
  plug();
  start_driver({"--silence", "0.5"});
  ASSERT_TRUE(wait_for([&] { return images_.size() >= 5; })) << log();
  std::ofstream(device_ + ".silent") << "sends nothing";
  ASSERT_TRUE(wait_for([&] { return troubles_.find("is open and sends no pictures") != std::string::npos; })) << log();
  std::filesystem::remove(device_ + ".silent");
  const std::size_t before = images_.size();
  ASSERT_TRUE(wait_for([&] { return images_.size() >= before + 5; })) << log();
  std::ofstream(device_ + ".silent") << "sends nothing";
  EXPECT_EQ(end_and_count("camera.connections"), 1) << "it was never gone, and it ends while it waits";
}

TEST_F(V4l2Driver, WhatIsWrongIsToldAtTheStart) {
  const auto error = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"camera", device_, "--lcm-url", hub_.url};
    arguments.insert(arguments.end(), more.begin(), more.end());
    ::setenv("LD_PRELOAD", LOC_FAKE_V4L2, 1);
    const int code = run("loc-driver", arguments, folder_.path("driver.err"));
    ::unsetenv("LD_PRELOAD");
    EXPECT_EQ(code, 1) << log();
    return log();
  };
  EXPECT_NE(error({}).find("is the camera plugged in?"), std::string::npos) << log();
  plug();
  EXPECT_NE(error({}).find("does not take 640 x 480 pixels, it offers 320 x 240"), std::string::npos) << log();
  EXPECT_NE(error({"--width", "320", "--height", "240", "--pixels", "GREY"}).find("does not give GREY, but YUYV"),
            std::string::npos)
      << log();
  ::unsetenv("FAKE_V4L2");
  EXPECT_NE(error({}).find("is no camera"), std::string::npos) << log();
}
}  // namespace
}  // namespace loc::test
