// The parts of the programs, each for itself.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <thread>

#include "libloc/core/check.hpp"
#include "libloc/io/tum.hpp"
#include "loc/estimate_t.hpp"
#include "loc/statistics_t.hpp"
#include "support/temp_folder.hpp"
#include "tools/support/any_estimator.hpp"
#include "tools/support/channels.hpp"
#include "tools/support/estimate_output.hpp"
#include "tools/support/flow_control.hpp"
#include "tools/support/input_queues.hpp"
#include "tools/support/lcm_link.hpp"
#include "tools/support/pacer.hpp"
#include "tools/support/pipeline.hpp"
#include "tools/support/program.hpp"
#include "tools/support/slam_options.hpp"
#include "tools/support/unit_check.hpp"

namespace loc {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr TimeNs kMs = 1'000'000;

template <class Message>
Bytes encoded(const Message& message) {
  Bytes bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

TEST(InputQueues, GivesBackInOrderOfArrivalOverAllInputs) {
  InputQueues queues({{"a", 4, 100}, {"b", 4, 100}});
  queues.push(1, Bytes{1}, 10);
  queues.push(0, Bytes{2}, 11);
  queues.push(1, Bytes{3}, 12);
  RawMessage message;
  for (const std::uint8_t expected : Bytes{1, 2, 3}) {
    ASSERT_TRUE(queues.pop(message, 0));
    EXPECT_EQ(message.bytes, Bytes{expected});
    EXPECT_EQ(message.input, expected == 2 ? 0U : 1U);
    EXPECT_EQ(message.receive_time_ns, 9 + expected);
  }
  EXPECT_FALSE(queues.pop(message, kMs));
}

TEST(InputQueues, FullQueuesDropAsTold) {
  InputQueues queues({{"imu", 2, 100}, {"image", 2, 100, 0, WhenFull::kDropOldest}});
  for (std::uint8_t i = 0; i < 5; ++i) {
    EXPECT_EQ(queues.push(0, Bytes{i}, 0), i < 2);
    EXPECT_EQ(queues.push(1, Bytes{i}, 0), i < 2);
  }
  EXPECT_FALSE(queues.push(0, Bytes(101), 0));
  RawMessage message;
  std::vector<int> imu;
  std::vector<int> image;
  while (queues.pop(message, 0)) (message.input == 0 ? imu : image).push_back(message.bytes[0]);
  EXPECT_EQ(imu, (std::vector<int>{0, 1}));
  EXPECT_EQ(image, (std::vector<int>{3, 4}));
  EXPECT_EQ(queues.dropped(0), 3);
  EXPECT_EQ(queues.dropped(1), 3);
  EXPECT_EQ(format_counts(queues.counts()),
            "imu.dropped=3 imu.oversized=1 imu.waiting_max=2 image.dropped=3 image.oversized=0 image.waiting_max=2");
}

// Thousands of IMU messages may wait, a few pictures: the memory of pictures must not wander into the IMU's queue.
TEST(InputQueues, BuffersStayInTheirQueue) {
  InputQueues queues({{"imu", 64, 1 << 20}, {"image", 2, 1 << 20, 0, WhenFull::kDropOldest}});
  RawMessage message;
  for (int i = 0; i < 300; ++i) {
    queues.push(1, Bytes(100'000, 1), 0);
    queues.push(0, Bytes(10, 2), 0);
    ASSERT_TRUE(queues.pop(message, 0));
    EXPECT_EQ(message.bytes, Bytes(100'000, 1));
    ASSERT_TRUE(queues.pop(message, 0));
    EXPECT_EQ(message.bytes, Bytes(10, 2));
    ASSERT_LT(message.bytes.capacity(), 1000U) << i;
  }
}

TEST(InputQueues, WakesTheOneThatWaits) {
  InputQueues queues({{"a", 4, 100}});
  std::thread sender([&] { queues.push(0, Bytes{7}, 0); });
  RawMessage message;
  EXPECT_TRUE(queues.pop(message, 5'000 * kMs));
  sender.join();
}

TEST(Pacer, WaitsByTheTimeStamps) {
  Pacer real_time(1);
  EXPECT_EQ(real_time.wait_ns(1000 * kMs, 5 * kMs), 0);
  EXPECT_EQ(real_time.wait_ns(1010 * kMs, 5 * kMs), 10 * kMs);
  EXPECT_EQ(real_time.wait_ns(1010 * kMs, 12 * kMs), 3 * kMs);
  EXPECT_EQ(real_time.wait_ns(1020 * kMs, 40 * kMs), 0);
  EXPECT_EQ(real_time.max_lag_ns(), 15 * kMs);
  Pacer fast(4);
  EXPECT_EQ(fast.wait_ns(0, 0), 0);
  EXPECT_EQ(fast.wait_ns(100 * kMs, 0), 25 * kMs);
  Pacer all_at_once(0);
  EXPECT_EQ(all_at_once.wait_ns(0, 0), 0);
  EXPECT_EQ(all_at_once.wait_ns(1'000'000 * kMs, 0), 0);
}

TEST(Pacer, ALateSampleDoesNotChangeThePace) {
  // GPS fixes that arrive 200 ms after their time, between the samples of an IMU.
  Pacer pacer(1);
  pacer.wait_ns(0, 0);
  EXPECT_EQ(pacer.wait_ns(1000 * kMs, 1000 * kMs), 0);
  EXPECT_EQ(pacer.wait_ns(800 * kMs, 1000 * kMs), 0) << "at once";
  EXPECT_EQ(pacer.wait_ns(1010 * kMs, 1000 * kMs), 10 * kMs);
  EXPECT_EQ(pacer.restarts(), 0);
  EXPECT_EQ(pacer.max_lag_ns(), 0);
}

TEST(Pacer, TakesUpThePaceAfterAStepOfTheClock) {
  Pacer pacer(1);
  pacer.wait_ns(500'000 * kMs, 0);
  EXPECT_EQ(pacer.wait_ns(100 * kMs, 10 * kMs), 0) << "set back";
  EXPECT_EQ(pacer.wait_ns(110 * kMs, 10 * kMs), 10 * kMs);
  EXPECT_EQ(pacer.wait_ns(std::numeric_limits<TimeNs>::max(), 20 * kMs), 0) << "a time from nowhere";
  EXPECT_EQ(pacer.wait_ns(std::numeric_limits<TimeNs>::min() + 1, 20 * kMs), 0);
  EXPECT_EQ(pacer.restarts(), 3);
  EXPECT_THROW(Pacer(-1), std::invalid_argument);
  EXPECT_THROW(Pacer(std::nan("")), std::invalid_argument);
}

Bytes answer(std::int64_t imu_sequence, int process_id = 1) {
  statistics_t message{};
  message.program = kEstimatorProgram;
  message.process_id = process_id;
  message.name = {sequence_name(StreamKind::kImu)};
  message.value = {static_cast<double>(imu_sequence)};
  message.size = 1;
  return encoded(message);
}

TEST(FlowControl, KeepsTheWindow) {
  FlowControl flow(StreamKind::kImu, 3);
  for (std::int64_t i = 0; i < 3; ++i) {
    EXPECT_TRUE(flow.may_send());
    flow.sent(i);
  }
  EXPECT_FALSE(flow.may_send());
  estimate_t estimate{};
  estimate.sequence = 900;
  flow.on_estimate(encoded(estimate));
  EXPECT_FALSE(flow.may_send()) << "that sample was never sent by us";
  estimate.sequence = 0;
  flow.on_estimate(encoded(estimate));
  EXPECT_TRUE(flow.may_send());
  EXPECT_EQ(flow.outstanding(), 2);
  flow.on_statistics(answer(2), 0);
  EXPECT_EQ(flow.outstanding(), 0);
  EXPECT_EQ(flow.abandoned(), 0);
}

TEST(FlowControl, GivesUpSamplesThatWereLost) {
  FlowControl flow(StreamKind::kImu, 2);
  flow.sent(0);
  flow.sent(1);
  flow.on_statistics(answer(0), 0);
  flow.sent(2);
  flow.on_statistics(answer(0), FlowControl::kLostAfterNs / 2);
  flow.on_statistics(answer(0), FlowControl::kLostAfterNs * 5 / 4);
  EXPECT_FALSE(flow.may_send()) << "it was sent to in between";
  flow.on_statistics(answer(0), FlowControl::kLostAfterNs * 2);
  EXPECT_TRUE(flow.may_send());
  EXPECT_EQ(flow.abandoned(), 2);
}

TEST(FlowControl, AnEstimatorThatWasStartedAnewKnowsNothingOfTheOldWindow) {
  FlowControl flow(StreamKind::kImu, 2);
  flow.on_statistics(answer(-1, 100), 0);
  flow.sent(0);
  flow.sent(1);
  flow.on_statistics(answer(-1, 200), 1);
  EXPECT_TRUE(flow.may_send());
  EXPECT_EQ(flow.abandoned(), 2);
}

// Pictures are acknowledged by answers only, and not waited for where the estimator takes none.
TEST(FlowControl, FollowsPicturesWhereTheEstimatorTakesThem) {
  FlowControl flow(StreamKind::kImage, 2);
  flow.sent(0);
  flow.sent(1);
  estimate_t estimate{};
  estimate.sequence = 1;
  flow.on_estimate(encoded(estimate));
  EXPECT_FALSE(flow.may_send()) << "nobody has answered yet";
  EXPECT_TRUE(flow.waits());
  statistics_t message{};
  message.program = kEstimatorProgram;
  message.name = {"imu.sequence", "image.sequence"};
  message.value = {7, 0};
  message.size = 2;
  flow.on_statistics(encoded(message), 0);
  EXPECT_EQ(flow.outstanding(), 1);
  EXPECT_TRUE(flow.may_send());
  flow.sent(2);
  EXPECT_FALSE(flow.may_send());
  flow.on_statistics(answer(8), 0);  // another method now: without pictures
  EXPECT_TRUE(flow.may_send());
  EXPECT_FALSE(flow.waits());
}

TEST(FlowControl, PicturesOfOtherCamerasHaveArrivedWhenALaterOneHas) {
  FlowControl flow(StreamKind::kImage, 4);
  flow.sent(10, 0);
  flow.sent(2, 1);
  flow.sent(11, 0);
  flow.sent(3, 1);
  statistics_t message{};
  message.program = kEstimatorProgram;
  message.name = {"image.sequence", "image.camera"};
  message.value = {11, 0};
  message.size = 2;
  flow.on_statistics(encoded(message), 0);
  EXPECT_EQ(flow.outstanding(), 1);
  message.value = {3, 1};
  flow.on_statistics(encoded(message), 0);
  EXPECT_EQ(flow.outstanding(), 0);
}

TEST(FlowControl, GarbageChangesNothing) {
  FlowControl flow(StreamKind::kImu, 1);
  flow.sent(0);
  flow.on_estimate(Bytes(200, 0xff));
  flow.on_statistics(Bytes{1, 2, 3}, 0);
  statistics_t other{};
  other.program = "loc-hub";
  flow.on_statistics(encoded(other), 0);
  EXPECT_FALSE(flow.may_send());
  EXPECT_FALSE(flow.answered());
  EXPECT_EQ(flow.garbage(), 2);
  for (const double value : {std::nan(""), 1e300, -HUGE_VAL}) {
    statistics_t absurd{};
    absurd.program = kEstimatorProgram;
    absurd.name = {"imu.sequence", "imu.camera"};
    absurd.value = {value, value};
    absurd.size = 2;
    flow.on_statistics(encoded(absurd), 0);
  }
  EXPECT_EQ(flow.garbage(), 8);
  EXPECT_EQ(flow.outstanding(), 1);
}

ImuMeasurement imu_sample(TimeNs time, std::int64_t sequence) {
  ImuMeasurement imu;
  imu.time_ns = time;
  imu.sequence = sequence;
  imu.angular_velocity = {0.1, 0.2, -0.1};
  imu.specific_force = {0, 0, 9.80665};
  return imu;
}

std::int64_t value_of(const NamedCounts& counts, const std::string& name) {
  for (const NamedCount& count : counts) {
    if (count.name == name) return count.value;
  }
  ADD_FAILURE() << "no count " << name << " in " << format_counts(counts);
  return -1;
}

struct PipelineFixture {
  std::vector<Estimate> estimates;
  EstimatorPipeline pipeline{make_estimator({}), {}, {}, [this](const Estimate& e) { estimates.push_back(e); }};
};

TEST(Pipeline, CountsLossesRepeatsAndRestarts) {
  PipelineFixture f;
  TimeNs time = 0;
  for (const std::int64_t sequence : {0, 1, 2, 5, 5, 6, 0, 1}) f.pipeline.push(imu_sample(time += 5 * kMs, sequence));
  f.pipeline.end();
  const NamedCounts counts = f.pipeline.counts();
  EXPECT_EQ(value_of(counts, "imu.received"), 8);
  EXPECT_EQ(value_of(counts, "imu.lost"), 2);
  EXPECT_EQ(value_of(counts, "imu.repeated"), 1);
  EXPECT_EQ(value_of(counts, "imu.restarts"), 1);
  EXPECT_EQ(value_of(counts, "estimates"), 8);
}

TEST(SequenceCheck, EachCameraCountsForItself) {
  SequenceCheck check;
  for (std::int64_t i = 0; i < 10; ++i) {
    for (const std::int32_t camera : {0, 1}) {
      FeaturesMeasurement features;
      features.camera = camera;
      features.sequence = camera == 0 ? i : 5 * i;
      check.see(features);
    }
    OdometryMeasurement odometry;
    odometry.sequence = i == 9 ? 3 : i;
    check.see(odometry);
  }
  EXPECT_EQ(check.counts(StreamKind::kFeatures).received, 20);
  EXPECT_EQ(check.counts(StreamKind::kFeatures).lost, 9 * 4);
  EXPECT_EQ(check.counts(StreamKind::kFeatures).restarts, 0);
  EXPECT_EQ(check.counts(StreamKind::kOdometry).restarts, 1);
  EXPECT_EQ(check.last(StreamKind::kOdometry), 3);
  EXPECT_EQ(check.last(StreamKind::kFeatures), 45);
  EXPECT_EQ(check.last_camera(StreamKind::kFeatures), 1);
  EXPECT_EQ(SequenceCheck().last(StreamKind::kFeatures), -1);
  EXPECT_EQ(SequenceCheck().last(StreamKind::kOdometry), -1);
}

TEST(Pipeline, AbsurdSequenceNumbersDoNotOverflow) {
  PipelineFixture f;
  f.pipeline.push(imu_sample(1, 0));
  f.pipeline.push(imu_sample(2, std::numeric_limits<std::int64_t>::max()));
  f.pipeline.push(imu_sample(3, 0));
  f.pipeline.push(imu_sample(4, std::numeric_limits<std::int64_t>::max()));
  EXPECT_EQ(value_of(f.pipeline.counts(), "imu.lost"), std::numeric_limits<std::int64_t>::max());
}

TEST(Pipeline, ClockSetBackStartsTheEstimatorAnew) {
  PipelineFixture f;
  for (int i = 0; i < 100; ++i) f.pipeline.push(imu_sample(1'000'000 * kMs + i * 5 * kMs, i));
  for (int i = 100; i < 200; ++i) f.pipeline.push(imu_sample(i * 5 * kMs, i));
  f.pipeline.end();
  const NamedCounts counts = f.pipeline.counts();
  EXPECT_EQ(value_of(counts, "clock.resets"), 1);
  EXPECT_EQ(value_of(counts, "imu.skipped.time_not_increasing"), 0) << "the estimator was not reset";
  EXPECT_EQ(value_of(counts, "imu.late") + static_cast<std::int64_t>(f.estimates.size()), 200);
  EXPECT_EQ(f.estimates.back().time_ns, 199 * 5 * kMs);
}

TEST(Pipeline, RecordingAfterRecording) {
  PipelineFixture f;
  for (int recording = 0; recording < 2; ++recording) {
    for (int i = 0; i < 50; ++i) f.pipeline.push(imu_sample(i * 5 * kMs, i));
    f.pipeline.end();
  }
  EXPECT_EQ(f.estimates.size(), 100U);
  EXPECT_EQ(f.estimates[0].q_world_body.coeffs(), f.estimates[50].q_world_body.coeffs());
  EXPECT_EQ(f.estimates[49].q_world_body.coeffs(), f.estimates[99].q_world_body.coeffs());
}

TEST(Pipeline, RigIsApplied) {
  Rig rig;
  rig.imu.emplace();
  rig.imu->gyroscope.bias = {0.1, 0.2, -0.1};
  Estimate last;
  EstimatorSettings settings;
  settings.madgwick = MadgwickOptions::report();
  EstimatorPipeline pipeline(make_estimator(settings), rig, {}, [&](const Estimate& e) { last = e; });
  for (int i = 0; i < 10; ++i) pipeline.push(imu_sample(i * 5 * kMs, i));
  pipeline.end();
  EXPECT_LT(last.angular_velocity.norm(), 1e-12);
}

TEST(Pipeline, LateFixesGoToAnEstimatorThatCanUseThem) {
  for (const char* method : {"error-state", "madgwick"}) {
    EstimatorSettings settings;
    settings.method = method;
    EstimatorPipeline pipeline(make_estimator(settings), {}, {}, [](const Estimate&) {});
    GpsMeasurement fix;
    fix.fix = GpsFixType::k3d;
    fix.latitude = 0.8;
    fix.longitude = 0.1;
    fix.altitude = 100;
    for (int i = 0; i < 600; ++i) {
      ImuMeasurement imu = imu_sample(i * 5 * kMs, i);
      imu.angular_velocity.setZero();
      pipeline.push(imu);
      if (i % 100 == 90) {
        fix.time_ns = imu.time_ns - 300 * kMs;
        fix.sequence = i / 100;
        pipeline.push(fix);
      }
    }
    pipeline.end();
    const NamedCounts counts = pipeline.counts();
    EXPECT_EQ(value_of(counts, "estimates") > 300, true);
    if (pipeline.estimator().takes(StreamKind::kGps)) {
      EXPECT_EQ(value_of(counts, "gps.received"), 6);
      EXPECT_EQ(value_of(counts, "gps.passed_late"), 6);
      EXPECT_EQ(value_of(counts, "gps.late"), 0);
      EXPECT_GE(value_of(counts, "gps.accepted"), 4);
    }
  }
}

TEST(AnyEstimator, NamesLeadToEstimators) {
  for (const std::string& name : estimator_methods()) {
    EstimatorSettings settings;
    settings.method = name;
    if (name.find("slam") != std::string::npos) {
      EXPECT_THROW(make_estimator(settings), std::invalid_argument) << "there is no camera";
      settings.slam.camera.width_px = 640;
      settings.slam.camera.height_px = 480;
      settings.slam.camera.intrinsics_px = {400, 400, 320, 240};
      settings.slam.motion = name == "mono-slam" ? SlamMotion::kConstantVelocity : SlamMotion::kInertial;
    }
    EXPECT_EQ(make_estimator(settings).method(), name);
  }
  EstimatorSettings wrong;
  wrong.method = "kalman";
  EXPECT_THROW(make_estimator(wrong), std::invalid_argument);
  EstimatorSettings six_axes;
  six_axes.use_magnetometer = false;
  EXPECT_FALSE(make_estimator(six_axes).takes(StreamKind::kMagnetometer));
  six_axes.method = "error-state";
  EXPECT_FALSE(make_estimator(six_axes).takes(StreamKind::kMagnetometer));
  EXPECT_TRUE(make_estimator(six_axes).takes(StreamKind::kGps));
  EXPECT_TRUE(make_estimator(six_axes).takes_late(StreamKind::kOdometry));
  EXPECT_FALSE(make_estimator(six_axes).takes_late(StreamKind::kImu));
  six_axes.fusion.use_gps = false;
  EXPECT_FALSE(make_estimator(six_axes).takes(StreamKind::kGps));
}

TEST(SlamSettings, OfPicturesHaveTheRulesForPictures) {
  Rig rig;
  CameraCalibration camera;
  camera.width_px = 400;
  camera.height_px = 300;
  camera.intrinsics_px = {300, 300, 200, 150};
  rig.cameras = {camera, camera};
  rig.cameras[1].width_px = 600;
  SlamArguments arguments;
  EXPECT_EQ(slam_options(arguments, "mono-slam", rig).map.cover_radius, 0);
  arguments.images = true;
  // What hides the map is not built in, whatever the size of the picture.
  const SlamOptions mono = slam_options(arguments, "mono-slam", rig);
  EXPECT_GT(mono.map.cover_radius, 0.05);
  EXPECT_LT(mono.map.cover_radius, 0.2);
  EXPECT_GT(mono.map.steer_after_frames, 0);
  EXPECT_GT(mono.relocate_s, 0);
  EXPECT_TRUE(mono.second_order_noise);
  EXPECT_EQ(mono.camera.width_px, 400);
  arguments.camera = 1;
  const SlamOptions second = slam_options(arguments, "mono-slam", rig);
  EXPECT_EQ(second.map.cover_radius, mono.map.cover_radius);
  EXPECT_EQ(second.camera_index, 1);
  EXPECT_EQ(second.camera.width_px, 600);
  const SlamOptions inertial = slam_options(arguments, "inertial-slam", rig);
  EXPECT_EQ(inertial.motion, SlamMotion::kInertial);
  EXPECT_EQ(inertial.map.cover_radius, 0);
  EXPECT_GT(inertial.relocate_s, 0);
  EXPECT_FALSE(inertial.second_order_noise);
  // The file has the last word.
  test::TempFolder folder;
  arguments.config = (folder.path() / "slam.yaml").string();
  std::ofstream(arguments.config) << "format: libloc-slam-1\nmap:\n  cover_radius: 0.15\n";
  EXPECT_EQ(slam_options(arguments, "mono-slam", rig).map.cover_radius, 0.15);
  std::ofstream(arguments.config) << "format: libloc-slam-1\nmap:\n  cover_radius: 40\n";
  EXPECT_THROW(slam_options(arguments, "mono-slam", rig), std::invalid_argument);
}

TEST(Channels, AreParsedStrictly) {
  EXPECT_EQ(parse_channels({"imu=A", "gps=B=C"})[0], "A");
  EXPECT_EQ(parse_channels({"imu=A", "gps=B=C"})[3], "B=C");
  EXPECT_EQ(parse_channels({"odometry=O", "features=F"})[5], "O");
  EXPECT_EQ(parse_channels({"odometry=O", "features=F"})[6], "F");
  for (const std::string wrong : {"imu", "imu=", "sonar=X", "=X"}) EXPECT_THROW(parse_channels({wrong}), UsageError);
  EXPECT_THROW(parse_channels({"imu=" + std::string(64, 'x')}), UsageError);
}

TEST(LcmLink, SaysWhatIsWrongWithTheUrl) {
  for (const std::string wrong : {"127.0.0.1:7700", "http://127.0.0.1", "tcpq://localhost:7700", "tcpq://127.0.0.1:0",
                                  "tcpq://127.0.0.1:99999", "udpm://239.255.76.67:x"}) {
    EXPECT_THROW(open_lcm(wrong), UsageError) << wrong;
  }
  try {
    open_lcm("tcpq://127.0.0.1:1");
    FAIL() << "nobody listens there";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("loc-hub"), std::string::npos) << error.what();
  }
}

TEST(EstimateOutput, TumKeepsOneTimeLineAndLosesNothingElse) {
  test::TempFolder folder;
  const std::string path = (folder.path() / "a.tum").string();
  const auto output = open_estimate_output(path, "madgwick", "ENU");
  Estimate estimate;
  estimate.valid = kValidOrientation;
  estimate.q_world_body.setIdentity();
  for (const TimeNs time_ns : {TimeNs{10}, TimeNs{20}, TimeNs{5}, TimeNs{30}}) {
    estimate.time_ns = time_ns;
    output->write(estimate);
  }
  output->finish();
  EXPECT_EQ(read_tum(path).trajectory.times_ns, (std::vector<TimeNs>{10, 20, 30}));
}

TEST(UnitCheck, DoubtsUnitsThatPhysicsExcludes) {
  const auto doubts = [](double force, double field, int samples = 100) {
    UnitCheck check;
    for (int i = 0; i < samples; ++i) {
      ImuMeasurement imu;
      imu.specific_force = {0, 0, force};
      MagnetometerMeasurement magnetometer;
      magnetometer.magnetic_field = {field, 0, 0};
      check.see(imu);
      check.see(magnetometer);
    }
    return check.doubts();
  };
  EXPECT_TRUE(doubts(9.8, 50e-6).empty());
  EXPECT_TRUE(doubts(std::nan(""), std::nan("")).empty());
  EXPECT_TRUE(doubts(1, 50, 99).empty()) << "too few to tell";
  ASSERT_EQ(doubts(1, 50e-6).size(), 1U);  // g
  EXPECT_NE(doubts(1, 50e-6)[0].find("force is 1 m/s^2"), std::string::npos);
  ASSERT_EQ(doubts(9.8 * 9.8, 48).size(), 2U);  // m/s^2 read as g, uT read as T
  EXPECT_NE(doubts(9.8, 48)[0].find("field is 48 T"), std::string::npos);
}

}  // namespace
}  // namespace loc
