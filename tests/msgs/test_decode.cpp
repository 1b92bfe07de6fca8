// Messages that come over the wire: right ones, cut ones, garbage, wrong types, renamed channels.
#include <gtest/gtest.h>

#include <cstring>
#include <numbers>

#include "libloc/core/check.hpp"
#include "libloc/core/random.hpp"
#include "loc/map_points_t.hpp"
#include "loc/source_status_t.hpp"
#include "loc/statistics_t.hpp"
#include "loc/tracks_t.hpp"
#include "msgs/convert.hpp"
#include "msgs/decode.hpp"
#include "tests/support/lcm_messages.hpp"

namespace loc {
namespace {

using test::encode;

TEST(DecodeMessage, gives_back_every_type_of_the_package) {
  const auto check = [](auto m) {
    const Bytes bytes = encode(m);
    EXPECT_EQ(encode(decode_message<decltype(m)>(bytes)), bytes);
  };
  check(to_message(test::imu_sample()));
  check(to_message(test::image_sample()));
  check(test::estimate_message());
  check(test::tracks_message());
  check(test::map_points_message());
  check(test::statistics_message());
  check(test::source_status_message());
  check(test::estimator_status_message());
  check(test::clock_message());
  check(to_message(test::gps_sample()));
  check(to_message(test::reference_sample()));
  check(to_message(test::magnetometer_sample()));
  check(to_message(test::odometry_sample()));
  check(to_message(test::features_sample()));
  check(fusion_t{});
}

template <class T>
void expect_cut_or_longer_is_refused(const T& m) {
  const Bytes whole = encode(m);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_THROW(decode_message<T>(std::span(whole).first(size)), DataError) << T::getTypeName() << " cut to " << size;
  }
  Bytes longer = whole;
  longer.push_back(0);
  EXPECT_THROW(decode_message<T>(longer), DataError) << T::getTypeName();
}

TEST(DecodeMessage, refuses_a_message_cut_at_any_byte_or_with_a_byte_too_many) {
  expect_cut_or_longer_is_refused(to_message(test::imu_sample()));
  expect_cut_or_longer_is_refused(to_message(test::image_sample()));
  expect_cut_or_longer_is_refused(test::estimate_message());
  expect_cut_or_longer_is_refused(test::tracks_message());
  expect_cut_or_longer_is_refused(test::map_points_message());
  expect_cut_or_longer_is_refused(test::statistics_message());
  expect_cut_or_longer_is_refused(test::source_status_message());
  expect_cut_or_longer_is_refused(test::estimator_status_message());
  expect_cut_or_longer_is_refused(test::clock_message());
  expect_cut_or_longer_is_refused(to_message(test::odometry_sample()));
  expect_cut_or_longer_is_refused(to_message(test::features_sample()));
  expect_cut_or_longer_is_refused(fusion_t{});
}

// Every int32 of the message in turn becomes a length that no message has: nothing may be allocated for it, nothing
// read past the end. (The sanitizers see the latter; an allocation of 2^31 doubles would show as std::bad_alloc.)
template <class T>
void expect_no_harm_from_lengths(const T& m) {
  for (const std::int32_t length : {-1, -2147483647 - 1, 2147483647, 1 << 29, 1 << 28, 46341, 65536}) {
    Bytes bytes = encode(m);
    for (std::size_t at = 8; at + 4 <= bytes.size(); ++at) {
      Bytes changed = bytes;
      for (int i = 0; i < 4; ++i) {
        changed[at + static_cast<std::size_t>(i)] =
            static_cast<std::uint8_t>(static_cast<std::uint32_t>(length) >> (24 - 8 * i));
      }
      try {
        EXPECT_EQ(decode_message<T>(changed).getEncodedSize(), static_cast<int>(changed.size()));
      } catch (const DataError&) {
      }
    }
  }
}

TEST(DecodeMessage, impossible_lengths_do_no_harm) {
  expect_no_harm_from_lengths(to_message(test::image_sample()));
  expect_no_harm_from_lengths(test::estimate_message());
  expect_no_harm_from_lengths(test::tracks_message());
  expect_no_harm_from_lengths(test::map_points_message());
  expect_no_harm_from_lengths(test::statistics_message());
  expect_no_harm_from_lengths(test::source_status_message());
  expect_no_harm_from_lengths(test::estimator_status_message());
  expect_no_harm_from_lengths(test::clock_message());
}

TEST(DecodeMessage, a_length_that_overflows_an_int_is_refused) {
  // 2^29 doubles are 2^32 bytes, which an int sees as 0: the generated decoder would read past the end.
  tracks_t m = test::tracks_message();
  Bytes bytes = encode(m);
  const std::size_t at = 8 + 24 + 4 + 8;
  bytes[at] = 0x20;
  bytes[at + 1] = bytes[at + 2] = bytes[at + 3] = 0;
  EXPECT_THROW(decode_message<tracks_t>(bytes), DataError);
}

TEST(MeasurementDecoder, decodes_the_default_channels) {
  MeasurementDecoder decoder;
  const auto imu = decoder.decode("LOC_IMU", encode(to_message(test::imu_sample())), 5);
  ASSERT_TRUE(imu);
  const auto& sample = std::get<ImuMeasurement>(*imu);
  EXPECT_EQ(sample.time_ns, test::imu_sample().time_ns);
  EXPECT_EQ(sample.host_time_ns, test::imu_sample().host_time_ns) << "the message's own arrival time goes first";
  EXPECT_EQ(sample.specific_force, test::imu_sample().specific_force);
  EXPECT_TRUE(std::holds_alternative<MagnetometerMeasurement>(
      *decoder.decode("LOC_MAGNETOMETER", encode(to_message(test::magnetometer_sample())))));
  EXPECT_TRUE(
      std::holds_alternative<ImageMeasurement>(*decoder.decode("LOC_IMAGE", encode(to_message(test::image_sample())))));
  EXPECT_TRUE(
      std::holds_alternative<GpsMeasurement>(*decoder.decode("LOC_GPS", encode(to_message(test::gps_sample())))));
  EXPECT_TRUE(std::holds_alternative<ReferenceMeasurement>(
      *decoder.decode("LOC_REFERENCE", encode(to_message(test::reference_sample())))));
  EXPECT_TRUE(std::holds_alternative<OdometryMeasurement>(
      *decoder.decode("LOC_ODOMETRY", encode(to_message(test::odometry_sample())))));
  EXPECT_TRUE(std::holds_alternative<FeaturesMeasurement>(
      *decoder.decode("LOC_TRACKS", encode(to_message(test::features_sample())))));
  EXPECT_TRUE(decoder.counts().empty());
}

TEST(MeasurementDecoder, the_arrival_time_given_fills_in_for_a_message_without_one) {
  auto m = test::imu_sample();
  m.host_time_ns = kNoTime;
  MeasurementDecoder decoder;
  EXPECT_EQ(stamp_of(*decoder.decode("LOC_IMU", encode(to_message(m)), 77)).host_time_ns, 77);
}

TEST(MeasurementDecoder, wrong_type_on_our_channel_is_an_error_that_names_both) {
  MeasurementDecoder decoder;
  const Bytes bytes = encode(to_message(test::magnetometer_sample()));
  try {
    decoder.decode("LOC_IMU", bytes);
    FAIL() << "accepted";
  } catch (const DataError& error) {
    EXPECT_NE(std::string(error.what()).find("LOC_IMU"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("imu_t"), std::string::npos) << error.what();
  }
  EXPECT_TRUE(decoder.decode("LOC_IMU", encode(to_message(test::imu_sample())))) << "must stay usable";
}

TEST(MeasurementDecoder, messages_of_others_are_left_alone) {
  MeasurementDecoder decoder;
  EXPECT_FALSE(decoder.decode("OTHER", Bytes{}));
  EXPECT_FALSE(decoder.decode("OTHER", Bytes{1, 2, 3}));
  EXPECT_FALSE(decoder.decode("OTHER", Bytes(100, 0xAB)));
  EXPECT_FALSE(decoder.decode("LOC_ESTIMATE", encode(test::estimate_message())));
  EXPECT_TRUE(decoder.counts().empty());
}

TEST(MeasurementDecoder, a_renamed_channel_is_found_by_its_type_and_keeps_the_stream) {
  const Bytes imu = encode(to_message(test::imu_sample()));
  MeasurementDecoder decoder;
  EXPECT_TRUE(decoder.decode("robot/imu", imu));
  EXPECT_FALSE(decoder.decode("second/imu", imu));
  EXPECT_TRUE(decoder.decode("robot/imu", imu));
  ASSERT_EQ(decoder.counts().size(), 1U);
  EXPECT_EQ(decoder.counts()[0].name, "imu.skipped.other_channel");
  EXPECT_EQ(decoder.counts()[0].value, 1);

  EXPECT_TRUE(decoder.decode("LOC_IMU", imu)) << "the default channel goes first";
  EXPECT_FALSE(decoder.decode("robot/imu", imu));
}

TEST(MeasurementDecoder, garbage_with_a_good_fingerprint_does_not_take_the_stream) {
  const Bytes imu = encode(to_message(test::imu_sample()));
  MeasurementDecoder decoder;
  EXPECT_THROW(decoder.decode("broken", std::span(imu).first(20)), DataError);
  EXPECT_TRUE(decoder.decode("robot/imu", imu));
}

TEST(MeasurementDecoder, a_named_channel_is_the_only_one) {
  DecodeOptions options;
  options.channels[static_cast<std::size_t>(StreamKind::kImu)] = "b";
  MeasurementDecoder decoder(options);
  const Bytes imu = encode(to_message(test::imu_sample()));
  EXPECT_FALSE(decoder.decode("LOC_IMU", imu));
  EXPECT_FALSE(decoder.decode("a", imu));
  EXPECT_TRUE(decoder.decode("b", imu));
  EXPECT_THROW(decoder.decode("b", Bytes(30, 1)), DataError);
  options.channels[static_cast<std::size_t>(StreamKind::kGps)] = "b";
  EXPECT_THROW(MeasurementDecoder{options}, std::invalid_argument);
}

TEST(MeasurementDecoder, pictures_come_on_several_channels) {
  const Bytes image = encode(to_message(test::image_sample()));
  MeasurementDecoder decoder;
  EXPECT_TRUE(decoder.decode("left", image));
  EXPECT_TRUE(decoder.decode("right", image));
}

TEST(MeasurementDecoder, so_do_features_but_odometry_is_one_stream) {
  const Bytes features = encode(to_message(test::features_sample()));
  const Bytes odometry = encode(to_message(test::odometry_sample()));
  MeasurementDecoder decoder;
  EXPECT_TRUE(decoder.decode("left", features));
  EXPECT_TRUE(decoder.decode("right", features));
  EXPECT_TRUE(decoder.decode("vo", odometry));
  EXPECT_FALSE(decoder.decode("wheels", odometry));
  ASSERT_EQ(decoder.counts().size(), 1U);
  EXPECT_EQ(decoder.counts()[0].name, "odometry.skipped.other_channel");
}

TEST(MeasurementDecoder, survives_random_damage) {
  Random random(20);
  const std::vector<std::pair<std::string, Bytes>> good{
      {"LOC_IMU", encode(to_message(test::imu_sample()))},
      {"LOC_IMAGE", encode(to_message(test::image_sample()))},
      {"LOC_GPS", encode(to_message(test::gps_sample()))},
      {"/imu", encode(test::aspn_imu(1'000'000'000, 1))},
      {"/pva", encode(test::aspn_pva(1'000'000'000, true))},
      {"LOC_ODOMETRY", encode(to_message(test::odometry_sample()))},
      {"LOC_TRACKS", encode(to_message(test::features_sample()))},
  };
  MeasurementDecoder decoder;
  int refused = 0;
  for (int i = 0; i < 20000; ++i) {
    auto [channel, bytes] = good[static_cast<std::size_t>(i) % good.size()];
    const int changes = 1 + static_cast<int>(random.uniform(0, 4));
    for (int k = 0; k < changes; ++k) {
      bytes[static_cast<std::size_t>(random.uniform(8, static_cast<double>(bytes.size())))] =
          static_cast<std::uint8_t>(random.uniform(0, 256));
    }
    bytes.resize(bytes.size() - static_cast<std::size_t>(random.uniform(0, 2)));
    try {
      decoder.decode(channel, bytes);
    } catch (const DataError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 5000);
}

}  // namespace
}  // namespace loc
