// ASPN-23 messages: fingerprints as in recordings, axes, periods, covariances.
#include <gtest/gtest.h>

#include <GeographicLib/Geocentric.hpp>
#include <cmath>
#include <numbers>

#include "aspn23_lcm/measurement_IMU.hpp"
#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"
#include "msgs/decode.hpp"
#include "tests/support/lcm_messages.hpp"

namespace loc {
namespace {

using test::encode;

TEST(Aspn23, fingerprints_are_those_of_the_published_types) {
  EXPECT_EQ(static_cast<std::uint64_t>(aspn23_lcm::measurement_IMU::getHash()), 0x65dffde4327866e5U);
  EXPECT_EQ(static_cast<std::uint64_t>(aspn23_lcm::measurement_position::getHash()), 0xfad58d35af47d004U);
  EXPECT_EQ(static_cast<std::uint64_t>(aspn23_lcm::measurement_position_velocity_attitude::getHash()),
            0xfbef5797c713556cU);
}

TEST(Aspn23, integrated_samples_are_divided_by_their_period) {
  MeasurementDecoder decoder;
  EXPECT_FALSE(decoder.decode("/imu", encode(test::aspn_imu(1'000'000'000, 5)))) << "has no period";
  const auto m = decoder.decode("/imu", encode(test::aspn_imu(1'010'000'000, 6)), 42);
  ASSERT_TRUE(m);
  const auto& imu = std::get<ImuMeasurement>(*m);
  EXPECT_NEAR(imu.angular_velocity.x(), 0.01, 1e-15);
  EXPECT_NEAR(imu.specific_force.z(), -9.8, 1e-12);
  EXPECT_EQ(imu.time_ns, 1'010'000'000);
  EXPECT_EQ(imu.host_time_ns, 42);
  EXPECT_EQ(imu.sequence, 6);
  // Two samples are lost: the integral still covers 10 ms.
  const auto after_gap = decoder.decode("/imu", encode(test::aspn_imu(1'040'000'000, 9)));
  EXPECT_NEAR(std::get<ImuMeasurement>(*after_gap).specific_force.z(), -9.8, 1e-12);
  // The clock is set back: no period for the first sample, then as before.
  EXPECT_FALSE(decoder.decode("/imu", encode(test::aspn_imu(500'000'000, 10))));
  EXPECT_TRUE(decoder.decode("/imu", encode(test::aspn_imu(510'000'000, 11))));
  ASSERT_EQ(decoder.counts().size(), 1U);
  EXPECT_EQ(decoder.counts()[0].name, "imu.skipped.no_period");
  EXPECT_EQ(decoder.counts()[0].value, 2);
}

TEST(Aspn23, sampled_values_pass_as_they_are_and_other_kinds_are_refused) {
  auto m = test::aspn_imu(1, 1);
  m.imu_type = aspn23_lcm::measurement_IMU::IMU_TYPE_SAMPLED;
  m.meas_accel[2] = -9.8;
  MeasurementDecoder decoder;
  EXPECT_EQ(std::get<ImuMeasurement>(*decoder.decode("/imu", encode(m))).specific_force.z(), -9.8);
  m.imu_type = 2;
  EXPECT_THROW(decoder.decode("/imu", encode(m)), DataError);
}

TEST(Aspn23, times_that_are_farther_apart_than_an_integer_holds_do_no_harm) {
  MeasurementDecoder decoder;
  EXPECT_FALSE(decoder.decode("/imu", encode(test::aspn_imu(kNoTime + 1, 1))));
  EXPECT_FALSE(decoder.decode("/imu", encode(test::aspn_imu(std::numeric_limits<TimeNs>::max(), 2))));
  EXPECT_THROW(decoder.decode("/imu", encode(test::aspn_imu(kNoTime, 3))), DataError);
}

TEST(Aspn23, without_attitude_it_is_a_fix_in_east_north_up) {
  MeasurementDecoder decoder;
  const auto m = decoder.decode("/gps", encode(test::aspn_pva(9, false)));
  ASSERT_TRUE(m);
  const auto& fix = std::get<GpsMeasurement>(*m);
  EXPECT_EQ(fix.fix, GpsFixType::k3d);
  EXPECT_EQ(fix.latitude, std::numbers::pi / 4);
  EXPECT_EQ(fix.longitude, 1);
  EXPECT_EQ(fix.velocity_enu, Eigen::Vector3d(2, 1, -3));
  // Message: position north 10, east 11, up 12; velocity north 13, east 14, down 15; mixed terms 0.1 (i + j).
  EXPECT_EQ(fix.position_cov.diagonal(), Eigen::Vector3d(11, 10, 12));
  EXPECT_DOUBLE_EQ(fix.position_cov(0, 2), 0.3) << "east-up: the message gives up already";
  EXPECT_EQ(fix.velocity_cov.diagonal(), Eigen::Vector3d(14, 13, 15));
  EXPECT_DOUBLE_EQ(fix.velocity_cov(0, 1), 0.7);
  EXPECT_DOUBLE_EQ(fix.velocity_cov(0, 2), -0.9) << "east-down turns its sign";
  EXPECT_DOUBLE_EQ(fix.velocity_cov(2, 1), -0.8);
}

TEST(Aspn23, terms_that_were_not_measured_stay_nan) {
  auto message = test::aspn_pva(9, false);
  message.v3 = std::numeric_limits<double>::quiet_NaN();
  message.num_meas = 5;
  message.covariance.assign(5, std::vector<double>(5, 2.0));
  MeasurementDecoder decoder;
  const auto fix = std::get<GpsMeasurement>(*decoder.decode("/gps", encode(message)));
  EXPECT_EQ(fix.velocity_enu.head<2>(), Eigen::Vector2d(2, 1));
  EXPECT_TRUE(std::isnan(fix.velocity_enu.z()));
  EXPECT_EQ(fix.velocity_cov(1, 1), 2);
  EXPECT_TRUE(std::isnan(fix.velocity_cov(2, 2)));
  EXPECT_TRUE(std::isnan(fix.velocity_cov(2, 0)));

  message.num_meas = 4;
  message.covariance.assign(4, std::vector<double>(4, 2.0));
  EXPECT_THROW(decoder.decode("/gps", encode(message)), DataError) << "four rows for five values";
}

TEST(Aspn23, earth_centred_frames_and_impossible_latitudes_are_refused) {
  MeasurementDecoder decoder;
  auto m = test::aspn_pva(9, false);
  m.reference_frame = 0;
  EXPECT_THROW(decoder.decode("/gps", encode(m)), DataError);
  m = test::aspn_pva(9, false);
  m.p1 = 45;  // degrees by mistake
  EXPECT_THROW(decoder.decode("/gps", encode(m)), DataError);
}

TEST(Aspn23, a_position_alone_is_taken_from_a_named_channel_only) {
  aspn23_lcm::measurement_position m{};
  m.time_of_validity.elapsed_nsec = 3;
  m.reference_frame = aspn23_lcm::measurement_position::REFERENCE_FRAME_GEODETIC;
  m.term1 = 0.5;
  m.num_meas = 3;
  m.covariance.assign(3, std::vector<double>(3, 1.0));
  MeasurementDecoder unnamed;
  EXPECT_FALSE(unnamed.decode("/position", encode(m)));
  DecodeOptions options;
  options.channels[static_cast<std::size_t>(StreamKind::kGps)] = "/position";
  MeasurementDecoder named(options);
  const auto fix = std::get<GpsMeasurement>(*named.decode("/position", encode(m)));
  EXPECT_EQ(fix.latitude, 0.5);
  EXPECT_TRUE(fix.velocity_enu.array().isNaN().all());
  EXPECT_EQ(fix.sequence, -1) << "an empty header counts nothing";
}

TEST(Aspn23, a_level_vehicle_heading_north_has_its_axes_where_they_belong) {
  MeasurementDecoder decoder;
  const auto m = decoder.decode("/ins", encode(test::aspn_pva(9, true)));
  ASSERT_TRUE(m);
  const auto& reference = std::get<ReferenceMeasurement>(*m);
  const auto in_world = [&](double x, double y, double z) {
    return Eigen::Vector3d(reference.q_world_body * Eigen::Vector3d(x, y, z));
  };
  EXPECT_LT((in_world(1, 0, 0) - Eigen::Vector3d(0, 1, 0)).norm(), 1e-12) << "forward is north";
  EXPECT_LT((in_world(0, 1, 0) - Eigen::Vector3d(1, 0, 0)).norm(), 1e-12) << "right is east";
  EXPECT_LT((in_world(0, 0, 1) - Eigen::Vector3d(0, 0, -1)).norm(), 1e-12) << "down is down";
  EXPECT_LT((reference.velocity - Eigen::Vector3d(2, 1, -3)).norm(), 1e-12);
  EXPECT_LT(reference.position.norm(), 1e-9) << "the first position is the origin";
  EXPECT_NEAR(decoder.origin()->latitude, std::numbers::pi / 4, 1e-15);
}

TEST(Aspn23, a_quaternion_turns_north_east_down_into_the_axes_of_the_sensor) {
  auto message = test::aspn_pva(9, true);
  // 90 degrees about down: forward is east.
  message.quaternion[0] = std::sqrt(0.5);
  message.quaternion[3] = std::sqrt(0.5);
  MeasurementDecoder decoder;
  const auto reference = std::get<ReferenceMeasurement>(*decoder.decode("/ins", encode(message)));
  EXPECT_LT((reference.q_world_body * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitX()).norm(), 1e-12);
}

TEST(Aspn23, world_is_one_plane_for_position_velocity_and_orientation) {
  MeasurementDecoder decoder;
  ASSERT_TRUE(decoder.decode("/ins", encode(test::aspn_pva(9, true))));
  auto message = test::aspn_pva(10, true);
  message.p1 += 0.001;  // 6.4 km north
  const auto there = std::get<ReferenceMeasurement>(*decoder.decode("/ins", encode(message)));

  // By earth-centred coordinates: up at the second place, seen in the axes at the first.
  const GeographicLib::Geocentric& earth = GeographicLib::Geocentric::WGS84();
  std::vector<double> at0(9);
  std::vector<double> at1(9);
  Eigen::Vector3d p0;
  Eigen::Vector3d p1;
  const double degrees = 180 / std::numbers::pi;
  earth.Forward(45, degrees, 100, p0.x(), p0.y(), p0.z(), at0);
  earth.Forward(message.p1 * degrees, degrees, 100, p1.x(), p1.y(), p1.z(), at1);
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R0(at0.data());
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R1(at1.data());
  EXPECT_LT((there.position - R0.transpose() * (p1 - p0)).norm(), 1e-6);
  const Eigen::Vector3d up = R0.transpose() * R1.col(2);
  EXPECT_GT(std::acos(up.z()), 0.0009);
  EXPECT_LT((there.q_world_body * Eigen::Vector3d(0, 0, -1) - up).norm(), 1e-9);
  EXPECT_LT((there.velocity - R0.transpose() * R1 * Eigen::Vector3d(2, 1, -3)).norm(), 1e-9);
}

TEST(Aspn23, a_quaternion_that_is_none_is_refused) {
  auto message = test::aspn_pva(9, true);
  message.quaternion[0] = 0.9;
  MeasurementDecoder decoder;
  EXPECT_THROW(decoder.decode("/ins", encode(message)), DataError);
}

TEST(Aspn23, every_cut_and_every_length_is_refused) {
  const Bytes imu = encode(test::aspn_imu(1, 1));
  const Bytes pva = encode(test::aspn_pva(1, true));
  for (const Bytes& whole : {imu, pva}) {
    MeasurementDecoder decoder;
    for (std::size_t size = 8; size < whole.size(); ++size) {
      EXPECT_THROW(decoder.decode("/x", std::span(whole).first(size)), DataError) << size;
    }
    for (std::size_t at = 8; at + 2 <= whole.size(); ++at) {
      for (const int high : {0x7f, 0x80, 0xff}) {
        Bytes changed = whole;
        changed[at] = static_cast<std::uint8_t>(high);
        changed[at + 1] = 0xff;
        try {
          decoder.decode("/x", changed);
        } catch (const DataError&) {
        }
      }
    }
  }
}

}  // namespace
}  // namespace loc
