// MRPT rawlogs: what is written reads back, files as MRPT's own programs write them, damage.
#include <gtest/gtest.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CObservationGPS.h>
#include <mrpt/obs/CObservationIMU.h>
#include <mrpt/obs/CObservationImage.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/system/datetime.h>

#include <cmath>

#include "libloc/core/check.hpp"
#include "libloc/core/gps_time.hpp"
#include "libloc/io/rawlog.hpp"
#include "tests/support/sources.hpp"
#include "tests/support/temp_folder.hpp"

namespace loc {
namespace {

using test::count;
using test::only;
using test::read_all;

constexpr TimeNs kTime = 1'700'000'000'123'456'700;

ImageMeasurement picture(PixelFormat format) {
  ImageMeasurement image;
  const int channels = format == PixelFormat::kGray ? 1 : 3;
  image.width_px = 33;
  image.height_px = 20;
  image.row_stride_bytes = 33 * channels;
  image.format = format;
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(33 * channels * 20));
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * 7);
  image.data = std::make_shared<const std::vector<std::uint8_t>>(bytes);
  return image;
}

template <class M>
M at(M measurement, TimeNs time_ns) {
  measurement.time_ns = time_ns;
  return measurement;
}

class Rawlog : public ::testing::Test {
 protected:
  std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }
  test::TempFolder folder_;
};

TEST_F(Rawlog, WhatIsWrittenReadsBack) {
  ImuMeasurement imu;
  imu.angular_velocity = {0.1, -0.2, 0.3};
  imu.specific_force = {1.1, 2.2, 9.8};
  MagnetometerMeasurement magnetometer;
  magnetometer.magnetic_field = {2e-5, -1e-5, 4e-5};
  GpsMeasurement gps;
  gps.fix = GpsFixType::kFixed;
  gps.satellites = 11;
  gps.latitude = -0.55;
  gps.longitude = 2.6;
  gps.altitude = 123.456;
  gps.gps_time_ns = *gps_from_utc({{2026, 11, 22}, 12, 34, 56, 789'000'000});
  gps.velocity_enu = {-3, 4, 0.5};
  const auto writer = create_rawlog(path("a.rawlog"));
  for (int i = 0; i < 5; ++i) writer->write(at(imu, kTime + i * 5'000'000));
  writer->write(at(magnetometer, kTime));
  writer->write(at(picture(PixelFormat::kGray), kTime + 1));
  ImageMeasurement second = picture(PixelFormat::kBgr);
  second.camera = 1;
  writer->write(at(second, kTime + 199));
  writer->write(at(gps, kTime));
  writer->write(at(GpsMeasurement{}, kTime + 100));
  writer->write(at(FeaturesMeasurement{}, kTime));
  writer->write(ReferenceMeasurement{}, {});
  EXPECT_FALSE(std::filesystem::exists(path("a.rawlog"))) << "not before it is whole";
  writer->finish();
  EXPECT_EQ(count(writer->counts(), "features.no_room"), 1);
  EXPECT_EQ(count(writer->counts(), "reference.no_room"), 1);
  EXPECT_THROW(create_rawlog(path("a.rawlog")), DataError);

  const auto source = open_rawlog(path("a.rawlog"));
  const auto all = read_all(*source);
  const auto imus = only<ImuMeasurement>(all);
  ASSERT_EQ(imus.size(), 5U);
  EXPECT_EQ(imus[4].time_ns, kTime + 20'000'000);
  EXPECT_EQ(imus[4].sequence, 4);
  EXPECT_EQ(imus[2].angular_velocity, imu.angular_velocity) << "x, y, z are not in MRPT's order";
  EXPECT_EQ(imus[2].specific_force, imu.specific_force);
  EXPECT_LT((only<MagnetometerMeasurement>(all).at(0).magnetic_field - magnetometer.magnetic_field).norm(), 1e-18);
  const auto images = only<ImageMeasurement>(all);
  ASSERT_EQ(images.size(), 2U);
  EXPECT_EQ(images[0].time_ns, kTime) << "to 100 ns";
  EXPECT_EQ(images[1].time_ns, kTime + 200);
  EXPECT_EQ(*images[0].data, *picture(PixelFormat::kGray).data);
  EXPECT_EQ(*images[1].data, *second.data);
  EXPECT_EQ(images[1].format, PixelFormat::kBgr);
  EXPECT_EQ(images[1].camera, 1);
  const auto fixes = only<GpsMeasurement>(all);
  ASSERT_EQ(fixes.size(), 2U);
  EXPECT_EQ(fixes[0].fix, GpsFixType::kFixed);
  EXPECT_EQ(fixes[0].satellites, 11);
  EXPECT_NEAR(fixes[0].latitude, gps.latitude, 1e-15);
  EXPECT_NEAR(fixes[0].longitude, gps.longitude, 1e-15);
  EXPECT_DOUBLE_EQ(fixes[0].altitude, gps.altitude);
  EXPECT_EQ(fixes[0].gps_time_ns, gps.gps_time_ns);
  EXPECT_NEAR(fixes[0].velocity_enu.x(), -3, 1e-12);
  EXPECT_NEAR(fixes[0].velocity_enu.y(), 4, 1e-12);
  EXPECT_TRUE(std::isnan(fixes[0].velocity_enu.z()));
  EXPECT_EQ(fixes[1].fix, GpsFixType::kNone);
  EXPECT_TRUE(std::isnan(fixes[1].latitude));
  EXPECT_EQ(count(source->counts(), "rawlog.cut_off"), 0);
}

TEST_F(Rawlog, AsMrptsProgramsWriteThem) {
  namespace obs = mrpt::obs;
  {
    mrpt::io::CFileGZOutputStream file(path("m.rawlog").string());
    auto out = mrpt::serialization::archiveFrom(file);
    obs::CSensoryFrame frame;
    const auto imu = obs::CObservationIMU::Create();
    imu->timestamp = mrpt::system::time_tToTimestamp(1'700'000'000.0);
    imu->sensorLabel = "XSens";
    for (const auto field : {obs::IMU_X_ACC, obs::IMU_Y_ACC, obs::IMU_Z_ACC, obs::IMU_MAG_X, obs::IMU_MAG_Y,
                             obs::IMU_MAG_Z, obs::IMU_PITCH_VEL, obs::IMU_ROLL_VEL, obs::IMU_YAW_VEL}) {
      imu->set(field, 1 + static_cast<double>(field));
    }
    frame.insert(imu);
    const auto gps = obs::CObservationGPS::Create();
    gps->timestamp = imu->timestamp;
    obs::gnss::Message_NMEA_GGA gga;
    gga.fields.fix_quality = 2;
    gga.fields.latitude_degrees = 36.7;
    gga.fields.longitude_degrees = -4.4;
    gga.fields.altitude_meters = 50;
    gga.fields.geoidal_distance = 47;
    gps->setMsg(gga);
    frame.insert(gps);
    out << frame << obs::CActionCollection();
    obs::CObservationIMU other = *imu;
    other.sensorLabel = "another";
    out << other;
    obs::CObservationIMU half;
    half.timestamp = imu->timestamp + std::chrono::seconds(1);
    half.sensorLabel = "XSens";
    half.set(obs::IMU_WX, 1);
    out << half << *imu;
    obs::CObservationImage image;
    image.timestamp = imu->timestamp;
    image.image.setExternalStorage("gone.png");
    out << image;
    obs::CObservationGPS nowhere;
    nowhere.timestamp = imu->timestamp + std::chrono::seconds(1);
    gga.fields.latitude_degrees = 112;
    nowhere.setMsg(gga);
    out << nowhere;
  }
  const auto source = open_rawlog(path("m.rawlog"));
  const auto all = read_all(*source);
  const auto imus = only<ImuMeasurement>(all);
  ASSERT_EQ(imus.size(), 1U);
  EXPECT_EQ(imus[0].time_ns, 1'700'000'000'000'000'000);
  EXPECT_EQ(imus[0].angular_velocity, Eigen::Vector3d(6, 5, 4)) << "roll, pitch, yaw rates";
  EXPECT_EQ(imus[0].specific_force, Eigen::Vector3d(1, 2, 3));
  EXPECT_NEAR(only<MagnetometerMeasurement>(all).at(0).magnetic_field.x(),
              (1 + static_cast<double>(obs::IMU_MAG_X)) * 1e-4, 1e-12);
  const auto fixes = only<GpsMeasurement>(all);
  ASSERT_EQ(fixes.size(), 2U);
  EXPECT_EQ(fixes[0].altitude, 97) << "above the ellipsoid";
  EXPECT_EQ(fixes[0].fix, GpsFixType::kDifferential);
  EXPECT_EQ(fixes[1].fix, GpsFixType::kNone) << "a latitude of 112 degrees";
  const NamedCounts counts = source->counts();
  EXPECT_EQ(count(counts, "rawlog.not_used"), 1);
  EXPECT_EQ(count(counts, "imu.skipped.other_sensor"), 1);
  EXPECT_EQ(count(counts, "imu.skipped.incomplete"), 1);
  EXPECT_EQ(count(counts, "imu.skipped.time_not_increasing"), 1);
  EXPECT_EQ(count(counts, "image.skipped.damaged"), 1);
}

TEST_F(Rawlog, DamagedFilesAreTold) {
  const auto writer = create_rawlog(path("a.rawlog"));
  for (int i = 0; i < 200; ++i) {
    ImuMeasurement imu = at(ImuMeasurement{}, kTime + i * 5'000'000);
    imu.angular_velocity.setConstant(std::sin(i));
    imu.specific_force.setConstant(std::cos(3 * i));
    writer->write(imu);
  }
  writer->finish();
  const std::string bytes = test::read_file(path("a.rawlog"));
  for (const std::size_t part : {2U, 4U, 10U}) {
    const auto cut = open_rawlog(folder_.write("cut.rawlog", bytes.substr(0, bytes.size() * part / 11)));
    std::size_t read = 0;
    try {
      while (cut->next()) ++read;
      EXPECT_EQ(count(cut->counts(), "rawlog.cut_off"), 1) << part;
    } catch (const DataError& error) {
      EXPECT_NE(std::string(error.what()).find("cut.rawlog"), std::string::npos) << error.what();
    }
    EXPECT_GT(read, 0U);
    EXPECT_LT(read, 200U);
  }
  test::expect_data_error([&] { open_rawlog(folder_.write("text.rawlog", "no rawlog at all")); }, {"text.rawlog"});
  test::expect_data_error([&] { open_rawlog(folder_.write("empty.rawlog", "")); }, {"empty.rawlog"});
  test::expect_data_error([&] { open_rawlog(path("none.rawlog")); }, {"none.rawlog", "no such file"});
  for (std::size_t i = 20; i < bytes.size(); i += bytes.size() / 5) {  // MRPT takes 0.3 s for an error
    std::string changed = bytes;
    changed[i] = static_cast<char>(changed[i] ^ 0x55);
    try {
      const auto source = open_rawlog(folder_.write("changed.rawlog", changed));
      while (source->next()) {
      }
    } catch (const DataError& error) {
      EXPECT_NE(std::string(error.what()).find("changed.rawlog"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace loc
