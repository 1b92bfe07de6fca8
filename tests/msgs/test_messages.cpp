// The message types: fingerprints are frozen, conversions lose nothing, wrong bytes are refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <numbers>

#include "libloc/core/check.hpp"
#include "libloc/core/random.hpp"
#include "loc/estimator_status_t.hpp"
#include "loc/map_points_t.hpp"
#include "loc/source_status_t.hpp"
#include "loc/statistics_t.hpp"
#include "loc/tracks_t.hpp"
#include "msgs/convert.hpp"

namespace loc {
namespace {

// Published types are frozen: recordings that exist must stay readable. A change of fields is a new type (imu2_t).
TEST(Messages, FingerprintsAreFrozen) {
  const auto hash = [](std::int64_t value) { return static_cast<std::uint64_t>(value); };
  EXPECT_EQ(hash(imu_t::getHash()), 0x6e15af9aa7f2f0bdU);
  EXPECT_EQ(hash(magnetometer_t::getHash()), 0x939b1e83f8a696d2U);
  EXPECT_EQ(hash(image_t::getHash()), 0xca5a4d4cb4b858c2U);
  EXPECT_EQ(hash(gps_fix_t::getHash()), 0x64d7e0398f38fe74U);
  EXPECT_EQ(hash(reference_t::getHash()), 0x120581a61696ae36U);
  EXPECT_EQ(hash(estimate_t::getHash()), 0xa4e5476eef3b739bU);
  EXPECT_EQ(hash(tracks_t::getHash()), 0x950a197598a1b7d6U);
  EXPECT_EQ(hash(map_points_t::getHash()), 0xcff528ac74639d5fU);
  EXPECT_EQ(hash(statistics_t::getHash()), 0x2f2b80d43dc8bfd9U);
  EXPECT_EQ(hash(source_status_t::getHash()), 0xd63ab9362bc56f14U);
  EXPECT_EQ(hash(odometry_t::getHash()), 0x1157247bdae507a3U);
  EXPECT_EQ(hash(fusion_t::getHash()), 0x50f7ee53ce7e222dU);
  EXPECT_EQ(hash(estimator_status_t::getHash()), 0xfe8191c6f75d653bU);
  EXPECT_EQ(hash(clock_t::getHash()), 0xafbc08ec99f516dbU);
}

template <class T>
std::vector<std::uint8_t> encoded(const T& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  EXPECT_EQ(message.encode(bytes.data(), 0, static_cast<int>(bytes.size())), static_cast<int>(bytes.size()));
  return bytes;
}

/// Measurement to message to bytes to message: what arrives at the other end.
template <class T>
T over_the_wire(const T& message) {
  const std::vector<std::uint8_t> bytes = encoded(message);
  T out{};
  EXPECT_EQ(out.decode(bytes.data(), 0, static_cast<int>(bytes.size())), static_cast<int>(bytes.size()));
  return out;
}

void fill_stamp(Random& random, Stamp& stamp) {
  stamp.time_ns = static_cast<TimeNs>(random.uniform(-4e18, 4e18));
  stamp.host_time_ns = static_cast<TimeNs>(random.uniform(-4e18, 4e18));
  stamp.sequence = static_cast<std::int64_t>(random.uniform(0, 1e15));
}

Eigen::Vector3d any_vector(Random& random) {
  return {random.uniform(-1e3, 1e3), random.uniform(-1e-9, 1e-9), random.uniform(-1e300, 1e300)};
}

Eigen::Matrix3d any_matrix(Random& random) {
  Eigen::Matrix3d m;
  for (double& x : m.reshaped()) x = random.uniform(-1, 1);
  return m;
}

void expect_same_stamp(const Stamp& a, const Stamp& b) {
  EXPECT_EQ(a.time_ns, b.time_ns);
  EXPECT_EQ(a.host_time_ns, b.host_time_ns);
  EXPECT_EQ(a.sequence, b.sequence);
}

TEST(Messages, ImuAndMagnetometerRoundTrip) {
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    ImuMeasurement imu;
    fill_stamp(random, imu);
    imu.angular_velocity = any_vector(random);
    imu.specific_force = any_vector(random);
    const ImuMeasurement back = from_message(over_the_wire(to_message(imu)));
    expect_same_stamp(imu, back);
    EXPECT_EQ(imu.angular_velocity, back.angular_velocity);
    EXPECT_EQ(imu.specific_force, back.specific_force);

    MagnetometerMeasurement field;
    fill_stamp(random, field);
    field.magnetic_field = any_vector(random);
    const MagnetometerMeasurement field_back = from_message(over_the_wire(to_message(field)));
    expect_same_stamp(field, field_back);
    EXPECT_EQ(field.magnetic_field, field_back.magnetic_field);
  }
}

TEST(Messages, NotANumberPasses) {
  ImuMeasurement imu;
  imu.time_ns = 1;
  imu.angular_velocity.setConstant(std::numeric_limits<double>::quiet_NaN());
  imu.specific_force.setConstant(-std::numeric_limits<double>::infinity());
  const ImuMeasurement back = from_message(over_the_wire(to_message(imu)));
  EXPECT_TRUE(back.angular_velocity.array().isNaN().all());
  EXPECT_EQ(back.specific_force, imu.specific_force);
}

TEST(Messages, ImageRoundTrip) {
  ImageMeasurement image;
  Random random(4);
  fill_stamp(random, image);
  image.camera = 1;
  image.width_px = 3;
  image.height_px = 2;
  image.row_stride_bytes = 4;
  image.format = PixelFormat::kGray;
  image.exposure_ns = 5'000'000;
  image.data = std::make_shared<const std::vector<std::uint8_t>>(std::vector<std::uint8_t>{1, 2, 3, 0, 4, 5, 6});
  const ImageMeasurement back = from_message(over_the_wire(to_message(image)));
  expect_same_stamp(image, back);
  EXPECT_EQ(back.camera, 1);
  EXPECT_EQ(back.width_px, 3);
  EXPECT_EQ(back.height_px, 2);
  EXPECT_EQ(back.row_stride_bytes, 4);
  EXPECT_EQ(back.format, PixelFormat::kGray);
  EXPECT_EQ(back.exposure_ns, 5'000'000);
  EXPECT_EQ(*back.data, *image.data);
}

TEST(Messages, GpsRoundTrip) {
  GpsMeasurement gps;
  Random random(5);
  fill_stamp(random, gps);
  gps.fix = GpsFixType::kFixed;
  gps.satellites = 17;
  gps.gps_time_ns = 1'300'000'000'123'456'789;
  gps.latitude = 0.6;
  gps.longitude = -1.5;
  gps.altitude = 301.25;
  gps.position_cov = any_matrix(random);
  gps.velocity_enu = any_vector(random);
  gps.velocity_cov = any_matrix(random);
  const GpsMeasurement back = from_message(over_the_wire(to_message(gps)));
  expect_same_stamp(gps, back);
  EXPECT_EQ(back.fix, GpsFixType::kFixed);
  EXPECT_EQ(back.satellites, 17);
  EXPECT_EQ(back.gps_time_ns, gps.gps_time_ns);
  EXPECT_EQ(back.latitude, gps.latitude);
  EXPECT_EQ(back.longitude, gps.longitude);
  EXPECT_EQ(back.altitude, gps.altitude);
  EXPECT_EQ(back.position_cov, gps.position_cov);
  EXPECT_EQ(back.velocity_enu, gps.velocity_enu);
  EXPECT_EQ(back.velocity_cov, gps.velocity_cov);
}

TEST(Messages, ReferenceRoundTripKeepsTheOrderOfTheQuaternion) {
  ReferenceMeasurement reference;
  Random random(6);
  fill_stamp(random, reference);
  reference.q_world_body = Eigen::Quaterniond(0.1, 0.2, 0.3, 0.4).normalized();
  reference.position = any_vector(random);
  reference.velocity = any_vector(random);
  reference.score = false;
  const reference_t message = over_the_wire(to_message(reference));
  EXPECT_EQ(message.q_world_body_wxyz[0], reference.q_world_body.w());
  EXPECT_EQ(message.q_world_body_wxyz[3], reference.q_world_body.z());
  const ReferenceMeasurement back = from_message(message);
  expect_same_stamp(reference, back);
  EXPECT_EQ(back.q_world_body.coeffs(), reference.q_world_body.coeffs());
  EXPECT_EQ(back.position, reference.position);
  EXPECT_EQ(back.velocity, reference.velocity);
  EXPECT_FALSE(back.score);
}

TEST(Messages, OdometryRoundTripKeepsOrdersAndWhetherItIsRelative) {
  OdometryMeasurement odometry;
  Random random(9);
  fill_stamp(random, odometry);
  odometry.start_time_ns = odometry.time_ns - 5;
  odometry.position = any_vector(random);
  odometry.rotation = Eigen::Quaterniond(0.1, 0.2, 0.3, 0.4).normalized();
  odometry.position_cov = any_matrix(random);
  odometry.orientation_cov = any_matrix(random);
  const odometry_t message = over_the_wire(to_message(odometry));
  EXPECT_EQ(message.q_wxyz[0], odometry.rotation.w());
  EXPECT_EQ(message.position_cov[0][2], odometry.position_cov(0, 2));
  const OdometryMeasurement back = from_message(message);
  expect_same_stamp(odometry, back);
  EXPECT_EQ(back.start_time_ns, odometry.start_time_ns);
  EXPECT_EQ(back.position, odometry.position);
  EXPECT_EQ(back.rotation.coeffs(), odometry.rotation.coeffs());
  EXPECT_EQ(back.position_cov, odometry.position_cov);
  EXPECT_EQ(back.orientation_cov, odometry.orientation_cov);

  odometry.start_time_ns = kNoTime;
  EXPECT_EQ(from_message(over_the_wire(to_message(odometry))).start_time_ns, kNoTime);
  const OdometryMeasurement nothing = from_message(over_the_wire(to_message([] {
    OdometryMeasurement empty;
    empty.time_ns = 1;
    return empty;
  }())));
  EXPECT_TRUE(nothing.rotation.coeffs().array().isNaN().all()) << "an odometry of positions only";
  EXPECT_TRUE(nothing.position_cov.array().isNaN().all());
}

TEST(Messages, FeaturesRoundTrip) {
  FeaturesMeasurement features;
  Random random(10);
  fill_stamp(random, features);
  features.camera = 3;
  features.sigma_px = 0.75;
  for (int i = 0; i < 1000; ++i) {
    features.features.push_back({1'000'000'000'000 - 7 * i, {random.uniform(-1, 800), random.uniform(-1, 600)}});
  }
  const FeaturesMeasurement back = from_message(over_the_wire(to_message(features)));
  expect_same_stamp(features, back);
  EXPECT_EQ(back.camera, 3);
  EXPECT_EQ(back.sigma_px, 0.75);
  ASSERT_EQ(back.features.size(), features.features.size());
  for (std::size_t i = 0; i < back.features.size(); ++i) {
    EXPECT_EQ(back.features[i].id, features.features[i].id);
    EXPECT_EQ(back.features[i].pixel_px, features.features[i].pixel_px);
  }
  features.features.clear();
  EXPECT_TRUE(from_message(over_the_wire(to_message(features))).features.empty())
      << "a frame in which nothing was seen";
}

TEST(Messages, EstimateRoundTripWithCovariance) {
  Random random(7);
  Estimate estimate;
  estimate.time_ns = 42;
  estimate.host_time_ns = 43;
  estimate.sequence = 44;
  estimate.valid = kValidOrientation | kValidCovariance;
  estimate.status = kMagnetometerDisturbed | kGap;
  estimate.q_world_body = Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5);
  estimate.position = any_vector(random);
  estimate.velocity = any_vector(random);
  estimate.angular_velocity = any_vector(random);
  estimate.gyroscope_bias = any_vector(random);
  estimate.accelerometer_bias = any_vector(random);
  estimate.covariance.setRandom();
  estimate.covariance_dim = 6;
  const estimate_t message = over_the_wire(to_message(estimate, "madgwick", "ENU"));
  EXPECT_EQ(message.method, "madgwick");
  EXPECT_EQ(message.world, "ENU");
  const Estimate back = from_message(message);
  EXPECT_EQ(back.time_ns, 42);
  EXPECT_EQ(back.host_time_ns, 43);
  EXPECT_EQ(back.sequence, 44);
  EXPECT_EQ(back.valid, estimate.valid);
  EXPECT_EQ(back.status, estimate.status);
  EXPECT_EQ(back.q_world_body.coeffs(), estimate.q_world_body.coeffs());
  EXPECT_EQ(back.position, estimate.position);
  EXPECT_EQ(back.velocity, estimate.velocity);
  EXPECT_EQ(back.angular_velocity, estimate.angular_velocity);
  EXPECT_EQ(back.gyroscope_bias, estimate.gyroscope_bias);
  EXPECT_EQ(back.accelerometer_bias, estimate.accelerometer_bias);
  EXPECT_EQ(back.covariance_dim, 6);
  EXPECT_EQ((back.covariance.topLeftCorner<6, 6>()), (estimate.covariance.topLeftCorner<6, 6>()));
}

TEST(Messages, FusionRoundTrip) {
  Estimate estimate;
  estimate.time_ns = 42;
  estimate.sequence = 44;
  EXPECT_FALSE(to_fusion_message(estimate)) << "nothing to say";
  estimate.valid = kValidScale;
  estimate.scale = 2.125;
  estimate.scale_sigma = 0.25;
  estimate.origin = {0.6, -1.5, 301};
  const fusion_t message = over_the_wire(*to_fusion_message(estimate));
  Estimate back;
  back.time_ns = 42;
  back.sequence = 44;
  add_message(message, back);
  EXPECT_EQ(back.scale, 2.125);
  EXPECT_EQ(back.scale_sigma, 0.25);
  EXPECT_EQ(back.origin.longitude, -1.5);
  EXPECT_EQ(back.origin.altitude, 301);
  estimate.valid = 0;
  EXPECT_TRUE(to_fusion_message(estimate)) << "an origin alone";
  const auto refused = [&](auto change, const std::string& what) {
    fusion_t wrong = message;
    change(wrong);
    EXPECT_THROW(add_message(wrong, back), DataError) << what;
  };
  refused([](fusion_t& m) { m.time_ns = 43; }, "another estimate");
  refused([](fusion_t& m) { m.sequence = 43; }, "another estimate");
  refused([](fusion_t& m) { m.origin_latitude = 48; }, "degrees");
  refused([](fusion_t& m) { m.scale_sigma = -1; }, "scale_sigma");
}

// The bits of a message are those of the library: from_message() and to_message() pass them on as a number.
TEST(Messages, BitsAreThoseOfTheLibrary) {
  EXPECT_EQ(estimate_t::VALID_ORIENTATION, static_cast<int>(kValidOrientation));
  EXPECT_EQ(estimate_t::VALID_HEADING, static_cast<int>(kValidHeading));
  EXPECT_EQ(estimate_t::VALID_COVARIANCE, static_cast<int>(kValidCovariance));
  EXPECT_EQ(estimate_t::STATUS_INITIALISING, static_cast<int>(kInitialising));
  EXPECT_EQ(estimate_t::STATUS_MAGNETOMETER_DISTURBED, static_cast<int>(kMagnetometerDisturbed));
  EXPECT_EQ(estimate_t::STATUS_NOT_FINITE, static_cast<int>(kNotFinite));
  EXPECT_EQ(estimate_t::STATUS_GAP, static_cast<int>(kGap));
  EXPECT_EQ(estimate_t::VALID_SCALE, static_cast<int>(kValidScale));
  EXPECT_EQ(estimate_t::STATUS_BRIDGED, static_cast<int>(kBridged));
  EXPECT_EQ(estimate_t::STATUS_GPS_REJECTED, static_cast<int>(kGpsRejected));
  EXPECT_EQ(estimate_t::STATUS_ODOMETRY_REJECTED, static_cast<int>(kOdometryRejected));
  EXPECT_EQ(estimate_t::STATUS_RECOVERED, static_cast<int>(kRecovered));
  EXPECT_EQ(estimate_t::STATUS_TOO_LATE, static_cast<int>(kTooLate));
  EXPECT_EQ(estimate_t::STATUS_BAD_COVARIANCE, static_cast<int>(kBadCovariance));
  EXPECT_EQ(estimate_t::STATUS_LOST, static_cast<int>(kLost));
  EXPECT_EQ(estimate_t::STATUS_STAMPS_DOUBTFUL, static_cast<int>(kStampsDoubtful));
  EXPECT_EQ(estimate_t::STATUS_MAP_LINK_UNKNOWN, static_cast<int>(kMapLinkUnknown));
  EXPECT_EQ(estimate_t::STATUS_GPS_STAMPS_DOUBTFUL, static_cast<int>(kGpsStampsDoubtful));
  EXPECT_EQ(image_t::PIXEL_FORMAT_GRAY, static_cast<int>(PixelFormat::kGray));
  EXPECT_EQ(image_t::PIXEL_FORMAT_BGR, static_cast<int>(PixelFormat::kBgr));
  EXPECT_EQ(image_t::PIXEL_FORMAT_RGB, static_cast<int>(PixelFormat::kRgb));
  EXPECT_EQ(image_t::PIXEL_FORMAT_MJPEG, static_cast<int>(PixelFormat::kMjpeg));
  EXPECT_EQ(gps_fix_t::FIX_FIXED, static_cast<int>(GpsFixType::kFixed));
}

void expect_data_error(const std::function<void()>& action, const std::string& field) {
  try {
    action();
    FAIL() << "accepted although " << field << " is wrong";
  } catch (const DataError& error) {
    EXPECT_NE(std::string(error.what()).find(field), std::string::npos) << error.what();
  }
}

template <class Message, class Change>
Message changed(Message message, Change change) {
  change(message);
  return message;
}

GpsMeasurement any_fix() {
  GpsMeasurement gps;
  gps.time_ns = 1;
  gps.fix = GpsFixType::k3d;
  gps.latitude = 0.6;
  gps.longitude = -1.5;
  return gps;
}

TEST(Messages, DegreesInPlaceOfRadiansAreRefused) {
  const gps_fix_t good = to_message(any_fix());
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto at = [&](double latitude, double longitude) {
    return from_message(changed(good, [&](gps_fix_t& m) {
      m.latitude = latitude;
      m.longitude = longitude;
    }));
  };
  EXPECT_EQ(at(std::numbers::pi / 2, 2 * std::numbers::pi).latitude, std::numbers::pi / 2);
  EXPECT_EQ(at(-std::numbers::pi / 2, -2 * std::numbers::pi).longitude, -2 * std::numbers::pi);
  EXPECT_TRUE(std::isnan(at(kNan, kNan).latitude)) << "no fix yet";
  expect_data_error([&] { at(48.25, 0.2); }, "gps_fix_t.latitude = 48.25: must be in radians, [-pi/2, pi/2]");
  expect_data_error([&] { at(0.8, -11.5); }, "gps_fix_t.longitude = -11.5: must be in radians, [-2 pi, 2 pi]");
  expect_data_error([&] { at(0.8, 11.5); }, "gps_fix_t.longitude");
  expect_data_error([&] { at(-1.58, 0); }, "gps_fix_t.latitude");
  expect_data_error([&] { at(std::numeric_limits<double>::infinity(), 0); }, "gps_fix_t.latitude = inf");
}

TEST(Messages, QuaternionsAreNormalisedOrRefused) {
  Random random(8);
  ReferenceMeasurement reference;
  reference.time_ns = 1;
  const auto back = [&] { return from_message(over_the_wire(to_message(reference))).q_world_body; };
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Quaterniond q = random.rotation();
    reference.q_world_body = q;
    EXPECT_EQ(back().coeffs(), q.coeffs()) << "a unit quaternion stays as it is";
    reference.q_world_body.coeffs() = q.coeffs() * random.uniform(0.991, 1.009);
    EXPECT_LT((back().coeffs() - q.coeffs()).norm(), 1e-15);
  }
  reference.q_world_body.coeffs() *= 1.02;
  reference.q_world_body.normalize();
  reference.q_world_body.coeffs() *= 0.5;
  expect_data_error([&] { back(); }, "reference_t.q_world_body_wxyz: norm = 0.5");
  reference.q_world_body.coeffs().setZero();
  expect_data_error([&] { back(); }, "reference_t.q_world_body_wxyz: norm = 0");
  reference.q_world_body.w() = std::numeric_limits<double>::infinity();
  expect_data_error([&] { back(); }, "norm = inf");
  reference.q_world_body.coeffs().setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(back().coeffs().array().isNaN().all()) << "a reference of positions only";
}

TEST(Messages, EstimatesThatContradictThemselvesAreRefused) {
  Estimate estimate;
  estimate.time_ns = 42;
  estimate.valid = kValidOrientation | kValidCovariance;
  estimate.q_world_body = Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5);
  estimate.covariance.setIdentity();
  estimate.covariance_dim = 3;
  const estimate_t good = to_message(estimate, "madgwick", "ENU");
  EXPECT_NO_THROW(from_message(good));
  const auto refused = [&](auto change, const std::string& what) {
    expect_data_error([&] { from_message(changed(good, change)); }, what);
  };
  refused([](estimate_t& m) { m.time_ns = kNoTime; }, "estimate_t.time_ns");
  refused([](estimate_t& m) { m.q_world_body_wxyz[0] = 0.6; }, "estimate_t.q_world_body_wxyz: norm = 1.0");
  refused([](estimate_t& m) { m.q_world_body_wxyz[2] = std::nan(""); }, "estimate_t.q_world_body_wxyz: norm = nan");
  refused([](estimate_t& m) { m.covariance_dim = 0; }, "estimate_t.covariance_dim = 0");
  refused([](estimate_t& m) { m.covariance_dim = -1; }, "estimate_t.covariance_dim = -1");
  refused([](estimate_t& m) { m.covariance_dim = 2; }, "estimate_t.covariance: 3 rows");
  refused([](estimate_t& m) { m.covariance.pop_back(); }, "estimate_t.covariance: 2 rows");
  refused([](estimate_t& m) { m.covariance[1].pop_back(); }, "estimate_t.covariance[1]: 2 values");
  // What the bits say is not there may be anything.
  EXPECT_NO_THROW(from_message(changed(good, [](estimate_t& m) {
    m.valid = 0;
    std::ranges::fill(m.q_world_body_wxyz, std::nan(""));
    m.covariance_dim = 0;
    m.covariance.clear();
  })));
}

TEST(Messages, RefusesWhatNoSensorCanHaveSent) {
  ImuMeasurement imu;
  imu.time_ns = 1;
  imu_t no_time = to_message(imu);
  no_time.time_ns = kNoTime;
  expect_data_error([&] { from_message(no_time); }, "time_ns");

  image_t image{};
  image.width = 4;
  image.height = 4;
  image.row_stride = 4;
  image.pixelformat = image_t::PIXEL_FORMAT_GRAY;
  image.data.resize(16);
  image.size = 16;
  EXPECT_NO_THROW(from_message(image));
  const auto with = [&](auto change) {
    image_t wrong = image;
    change(wrong);
    return wrong;
  };
  expect_data_error([&] { from_message(with([](image_t& m) { m.width = -4; })); }, "width");
  expect_data_error([&] { from_message(with([](image_t& m) { m.height = 0; })); }, "height");
  expect_data_error([&] { from_message(with([](image_t& m) { m.row_stride = 3; })); }, "row_stride");
  expect_data_error([&] { from_message(with([](image_t& m) { m.height = 2'000'000'000; })); }, "size");
  expect_data_error([&] { from_message(with([](image_t& m) { m.size = 17; })); }, "size");
  expect_data_error([&] { from_message(with([](image_t& m) { m.pixelformat = 7; })); }, "pixelformat");
  expect_data_error([&] { from_message(with([](image_t& m) { m.camera = -1; })); }, "image_t.camera = -1");
  expect_data_error([&] { from_message(with([](image_t& m) { m.exposure_ns = -5; })); }, "image_t.exposure_ns = -5");

  gps_fix_t fix{};
  fix.fix_type = 9;
  expect_data_error([&] { from_message(fix); }, "fix_type");

  OdometryMeasurement odometry;
  odometry.time_ns = 100;
  odometry.rotation.setIdentity();
  const odometry_t relative = to_message(odometry);
  expect_data_error([&] { from_message(changed(relative, [](odometry_t& m) { m.start_time_ns = 100; })); },
                    "odometry_t.start_time_ns = 100: must be before time_ns");
  expect_data_error([&] { from_message(changed(relative, [](odometry_t& m) { m.q_wxyz[0] = 0.5; })); },
                    "odometry_t.q_wxyz: norm = 0.5");
  expect_data_error([&] { from_message(changed(relative, [](odometry_t& m) { m.time_ns = kNoTime; })); },
                    "odometry_t.time_ns");

  FeaturesMeasurement features;
  features.time_ns = 1;
  features.features = {{4, {1, 2}}, {5, {3, 4}}};
  const tracks_t tracks = to_message(features);
  EXPECT_TRUE(std::isnan(from_message(tracks).sigma_px));
  expect_data_error([&] { from_message(changed(tracks, [](tracks_t& m) { m.camera = -1; })); }, "tracks_t.camera = -1");
  expect_data_error([&] { from_message(changed(tracks, [](tracks_t& m) { m.sigma_px = -0.5; })); },
                    "tracks_t.sigma_px = -0.5");
  expect_data_error([&] { from_message(changed(tracks, [](tracks_t& m) { m.size = 3; })); }, "tracks_t.size = 3");
  expect_data_error([&] { from_message(changed(tracks, [](tracks_t& m) { m.u_px.pop_back(); })); }, "tracks_t.size");
  expect_data_error([&] { from_message(changed(tracks, [](tracks_t& m) { m.feature_id[1] = 4; })); },
                    "tracks_t.feature_id = 4: comes twice");

  estimate_t estimate{};
  estimate.time_ns = 1;
  estimate.covariance_dim = 16;
  expect_data_error([&] { from_message(estimate); }, "covariance_dim");
}

TEST(Messages, ClockRoundTripAndWhatIsRefused) {
  const ClockLine line{5, -6, -2e-5, 900, 1e-8, 1.5e-8, -100, 200};
  clock_t message = to_message(line);
  message.quality = clock_t::QUALITY_LABELS;
  const ClockLine back = from_message(over_the_wire(message));
  EXPECT_EQ(back.input_ref_ns, line.input_ref_ns);
  EXPECT_EQ(back.output_ref_ns, line.output_ref_ns);
  EXPECT_EQ(back.skew, line.skew);
  EXPECT_EQ(back.sigma_ns, line.sigma_ns);
  EXPECT_EQ(back.sigma_skew, line.sigma_skew);
  EXPECT_EQ(back.skew_walk, line.skew_walk);
  EXPECT_EQ(back.valid_from_ns, line.valid_from_ns);
  EXPECT_EQ(back.valid_to_ns, line.valid_to_ns);
  const auto refused = [&](auto change) {
    clock_t m = message;
    change(m);
    EXPECT_THROW(from_message(m), DataError);
  };
  refused([](clock_t& m) { m.skew = std::nan(""); });
  refused([](clock_t& m) { m.skew = -1; });
  refused([](clock_t& m) { m.sigma_ns = -1; });
  refused([](clock_t& m) { m.sigma_skew = INFINITY; });
  refused([](clock_t& m) { m.skew_walk = std::nan(""); });
  refused([](clock_t& m) { m.valid_to_ns = m.valid_from_ns - 1; });
  refused([](clock_t& m) { m.quality = 0; });
  refused([](clock_t& m) { m.quality = 3; });
}

}  // namespace
}  // namespace loc
