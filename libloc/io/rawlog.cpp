#include "libloc/io/rawlog.hpp"

#include <mrpt/img/CImage.h>
#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/obs/CObservationGPS.h>
#include <mrpt/obs/CObservationIMU.h>
#include <mrpt/obs/CObservationImage.h>
#include <mrpt/obs/CRawlog.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "libloc/core/check.hpp"
#include "libloc/core/gps_time.hpp"
#include "libloc/vision/image_codec.hpp"

namespace loc {
namespace {

namespace fs = std::filesystem;
namespace obs = mrpt::obs;

constexpr double kTeslaPerGauss = 1e-4;
constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kKnot = 1852.0 / 3600;
constexpr std::int64_t kTicksTo1970 = 116'444'736'000'000'000;  // from 1601
constexpr TimeNs kTickNs = 100;

using Vector3Fields = std::array<obs::TIMUDataIndex, 3>;
constexpr Vector3Fields kAngularVelocity{obs::IMU_WX, obs::IMU_WY, obs::IMU_WZ};
constexpr Vector3Fields kAcceleration{obs::IMU_X_ACC, obs::IMU_Y_ACC, obs::IMU_Z_ACC};
constexpr Vector3Fields kMagneticField{obs::IMU_MAG_X, obs::IMU_MAG_Y, obs::IMU_MAG_Z};

TimeNs time_of(const obs::CObservation& observation) {
  const std::int64_t ticks = observation.timestamp.time_since_epoch().count() - kTicksTo1970;
  constexpr std::int64_t kMost = std::numeric_limits<TimeNs>::max() / kTickNs;
  return ticks > -kMost && ticks < kMost ? ticks * kTickNs : kNoTime;
}

mrpt::Clock::time_point ticks_of(TimeNs time_ns) {
  const TimeNs ticks =
      time_ns / kTickNs + (time_ns % kTickNs >= kTickNs / 2 ? 1 : 0) - (time_ns % kTickNs < -kTickNs / 2 ? 1 : 0);
  return mrpt::Clock::time_point(mrpt::Clock::duration(ticks + kTicksTo1970));
}

bool has(const obs::CObservationIMU& imu, const Vector3Fields& fields) {
  return std::ranges::all_of(fields, [&](obs::TIMUDataIndex field) { return imu.has(field); });
}

Eigen::Vector3d get(const obs::CObservationIMU& imu, const Vector3Fields& fields) {
  return {imu.get(fields[0]), imu.get(fields[1]), imu.get(fields[2])};
}

void set(obs::CObservationIMU& imu, const Vector3Fields& fields, const Eigen::Vector3d& values) {
  for (int i = 0; i < 3; ++i) imu.set(fields[static_cast<std::size_t>(i)], values[i]);
}

ImageMeasurement picture_of(const mrpt::img::CImage& image) {
  ImageMeasurement out;
  out.width_px = static_cast<std::int32_t>(image.getWidth());
  out.height_px = static_cast<std::int32_t>(image.getHeight());
  out.format = image.isColor() ? PixelFormat::kBgr : PixelFormat::kGray;
  out.row_stride_bytes = out.width_px * (image.isColor() ? 3 : 1);
  auto bytes = std::make_shared<std::vector<std::uint8_t>>();
  bytes->reserve(static_cast<std::size_t>(out.row_stride_bytes) * static_cast<std::size_t>(out.height_px));
  for (std::int32_t row = 0; row < out.height_px; ++row) {
    const auto* line = image.ptrLine<std::uint8_t>(static_cast<unsigned>(row));
    bytes->insert(bytes->end(), line, line + out.row_stride_bytes);
  }
  out.data = std::move(bytes);
  return out;
}

GpsFixType fix_of(std::uint8_t quality) {
  switch (quality) {
    case 1:
    case 3:
      return GpsFixType::k3d;
    case 2:
      return GpsFixType::kDifferential;
    case 4:
      return GpsFixType::kFixed;
    case 5:
      return GpsFixType::kFloat;
    default:
      return GpsFixType::kNone;  // 6 to 8: nothing was measured
  }
}

std::uint8_t quality_of(GpsFixType fix) {
  switch (fix) {
    case GpsFixType::k2d:
    case GpsFixType::k3d:
      return 1;
    case GpsFixType::kDifferential:
      return 2;
    case GpsFixType::kFixed:
      return 4;
    case GpsFixType::kFloat:
      return 5;
    default:
      return 0;
  }
}

TimeNs gps_time_of(const obs::gnss::Message_NMEA_RMC& rmc) {
  if (rmc.fields.date_year > 99) return kNoTime;
  UtcTime utc;
  utc.date = {full_year(rmc.fields.date_year), rmc.fields.date_month, rmc.fields.date_day};
  utc.hour = rmc.fields.UTCTime.hour;
  utc.minute = rmc.fields.UTCTime.minute;
  const double second = rmc.fields.UTCTime.sec;
  if (!is_date(utc.date) || !(second >= 0 && second < 61)) return kNoTime;
  const auto ns = std::llround(second * 1e9);
  utc.second = static_cast<std::int32_t>(ns / 1'000'000'000);
  utc.nanosecond = static_cast<std::int32_t>(ns % 1'000'000'000);
  return gps_from_utc(utc).value_or(kNoTime);
}

// MRPT's own function for that does not compile for a constant observation.
template <class Message>
const Message* message_of(const obs::CObservationGPS& gps) {
  return gps.hasMsgClass<Message>() ? &gps.getMsgByClass<Message>() : nullptr;
}

std::optional<GpsMeasurement> fix_from(const obs::CObservationGPS& gps) {
  const auto* gga = message_of<obs::gnss::Message_NMEA_GGA>(gps);
  const auto* rmc = message_of<obs::gnss::Message_NMEA_RMC>(gps);
  if (gga == nullptr && rmc == nullptr) return std::nullopt;
  GpsMeasurement out;
  const bool rmc_valid = rmc != nullptr && rmc->fields.validity_char == 'A';
  out.fix = gga != nullptr ? fix_of(gga->fields.fix_quality) : rmc_valid ? GpsFixType::k2d : GpsFixType::kNone;
  if (gga != nullptr) out.satellites = static_cast<std::int32_t>(gga->fields.satellitesUsed);
  if (rmc_valid) out.gps_time_ns = gps_time_of(*rmc);
  if (out.fix == GpsFixType::kNone) return out;
  const double latitude_deg = gga != nullptr ? gga->fields.latitude_degrees : rmc->fields.latitude_degrees;
  const double longitude_deg = gga != nullptr ? gga->fields.longitude_degrees : rmc->fields.longitude_degrees;
  if (!(std::abs(latitude_deg) <= 90) || !(std::abs(longitude_deg) <= 180)) {
    out.fix = GpsFixType::kNone;
    return out;
  }
  out.latitude = latitude_deg / kDegrees;
  out.longitude = longitude_deg / kDegrees;
  if (gga != nullptr) out.altitude = gga->fields.altitude_meters + gga->fields.geoidal_distance;
  if (rmc_valid) {
    const double speed = rmc->fields.speed_knots * kKnot;
    const double course = rmc->fields.direction_degrees / kDegrees;
    out.velocity_enu.head<2>() = speed * Eigen::Vector2d(std::sin(course), std::cos(course));
  }
  return out;
}

// Objects of a file, one by one. MRPT throws at the end of a file, and where it is cut off.
class RawlogReader {
 public:
  explicit RawlogReader(fs::path path) : path_(std::move(path)) {
    std::error_code error;
    if (!fs::is_regular_file(path_, error)) throw DataError(path_.string() + ": no such file");
    if (!stream_.open(path_.string())) throw DataError(path_.string() + ": cannot be read");
  }

  mrpt::serialization::CSerializable::Ptr next() {
    if (ended_) return nullptr;
    const auto begin = stream_.getPosition();
    try {
      auto archive = mrpt::serialization::archiveFrom(stream_);
      auto object = archive.ReadObject();
      ++objects_;
      return object;
    } catch (const mrpt::serialization::CExceptionEOF&) {
      ended_ = true;
      cut_off_ = stream_.getPosition() != begin;
    } catch (const std::exception& error) {
      ended_ = true;
      const std::string why = error.what();
      if (objects_ > 0) {
        throw DataError(path_.string() + ": object " + std::to_string(objects_) +
                        " cannot be read: " + why.substr(0, why.find('\n')));
      }
    }
    if (objects_ == 0) throw DataError(path_.string() + ": is no rawlog: not one object can be read");
    return nullptr;
  }
  std::int64_t objects() const { return objects_; }
  bool cut_off() const { return cut_off_; }

 private:
  fs::path path_;
  mrpt::io::CFileGZInputStream stream_;
  std::int64_t objects_ = 0;
  bool ended_ = false;
  bool cut_off_ = false;
};

class RawlogSource final : public MeasurementSource {
 public:
  explicit RawlogSource(const fs::path& path) : reader_(path) {
    mrpt::img::CImage::setImagesPathBase(obs::CRawlog::detectImagesDirectory(path.string()));
    read_one();  // what is no rawlog is found out here
  }

  std::optional<Measurement> next() override {
    while (waiting_.empty() && more_) read_one();
    if (waiting_.empty()) return std::nullopt;
    Measurement out = std::move(waiting_.front());
    waiting_.pop_front();
    return out;
  }

  NamedCounts counts() const override {
    NamedCounts out;
    for (const auto& [name, value] : counts_) out.push_back({name, value});
    if (reader_.cut_off()) out.push_back({"rawlog.cut_off", 1});
    return out;
  }

 private:
  void read_one() {
    const auto object = reader_.next();
    more_ = object != nullptr;
    if (!more_) return;
    if (const auto frame = std::dynamic_pointer_cast<obs::CSensoryFrame>(object)) {
      for (const auto& observation : *frame) take(*observation);
    } else if (const auto observation = std::dynamic_pointer_cast<obs::CObservation>(object)) {
      take(*observation);
    } else {
      ++counts_["rawlog.not_used"];
    }
  }

  void take(const obs::CObservation& observation) {
    const TimeNs time_ns = time_of(observation);
    if (const auto* imu = dynamic_cast<const obs::CObservationIMU*>(&observation)) {
      take_imu(*imu, time_ns);
    } else if (const auto* image = dynamic_cast<const obs::CObservationImage*>(&observation)) {
      take_image(*image, time_ns);
    } else if (const auto* gps = dynamic_cast<const obs::CObservationGPS*>(&observation)) {
      const auto fix = fix_from(*gps);
      if (!fix) {
        ++counts_["gps.skipped.empty"];
      } else if (is_first_sensor(StreamKind::kGps, observation.sensorLabel)) {
        keep(*fix, time_ns);
      }
    } else {
      ++counts_["rawlog.not_used"];
    }
  }

  void take_imu(const obs::CObservationIMU& imu, TimeNs time_ns) {
    const bool gyroscope = has(imu, kAngularVelocity);
    const bool accelerometer = has(imu, kAcceleration);
    const bool magnetometer = has(imu, kMagneticField);
    if (magnetometer && is_first_sensor(StreamKind::kMagnetometer, imu.sensorLabel)) {
      MagnetometerMeasurement out;
      out.magnetic_field = get(imu, kMagneticField) * kTeslaPerGauss;
      keep(out, time_ns);
    }
    if (gyroscope && accelerometer) {
      if (!is_first_sensor(StreamKind::kImu, imu.sensorLabel)) return;
      ImuMeasurement out;
      out.angular_velocity = get(imu, kAngularVelocity);
      out.specific_force = get(imu, kAcceleration);
      keep(out, time_ns);
    } else if (gyroscope || accelerometer || !magnetometer) {
      ++counts_["imu.skipped.incomplete"];
    }
  }

  void take_image(const obs::CObservationImage& observation, TimeNs time_ns) {
    const auto camera =
        cameras_.try_emplace(observation.sensorLabel, static_cast<std::int32_t>(cameras_.size())).first->second;
    ImageMeasurement image;
    try {
      image = picture_of(observation.image);
    } catch (const std::exception&) {  // MRPT loads a picture beside the file when it is asked for it
      ++counts_["image.skipped.damaged"];
      return;
    }
    image.camera = camera;
    keep(std::move(image), time_ns);
    observation.image.unload();
  }

  bool is_first_sensor(StreamKind kind, const std::string& label) {
    if (labels_.try_emplace(kind, label).first->second == label) return true;
    ++counts_[std::string(stream_name(kind)) + ".skipped.other_sensor"];
    return false;
  }

  void keep(Measurement measurement, TimeNs time_ns) {
    const std::string name = stream_name(kind_of(measurement));
    Stream& stream = streams_[{kind_of(measurement), camera_of(measurement)}];
    if (time_ns == kNoTime || time_ns <= stream.last_ns) {
      ++counts_[name + ".skipped.time_not_increasing"];
      return;
    }
    stream.last_ns = time_ns;
    stamp_of(measurement).time_ns = time_ns;
    stamp_of(measurement).sequence = stream.next++;
    ++counts_[name + ".read"];
    waiting_.push_back(std::move(measurement));
  }

  struct Stream {
    TimeNs last_ns = kNoTime;
    std::int64_t next = 0;
  };

  RawlogReader reader_;
  std::deque<Measurement> waiting_;
  std::map<std::pair<StreamKind, std::int32_t>, Stream> streams_;
  std::map<StreamKind, std::string> labels_;
  std::map<std::string, std::int32_t> cameras_;
  std::map<std::string, std::int64_t> counts_;
  bool more_ = true;
};

struct DamagedPicture {};  // a JPEG that cannot be decoded: the others are written all the same

class RawlogWriter final : public RecordingWriter {
 public:
  explicit RawlogWriter(const fs::path& path) : file_(path) {
    if (!stream_.open(file_.path().string())) throw DataError(path.string() + ": cannot be written");
  }

  void write(const Measurement& measurement) override {
    const std::string name = stream_name(kind_of(measurement));
    try {
      const bool room = std::visit([this](const auto& m) { return put(m); }, measurement);
      ++counts_[name + (room ? ".written" : ".no_room")];
    } catch (const DamagedPicture&) {
      ++counts_[name + ".skipped.damaged"];
    }
  }
  void write(const ReferenceMeasurement& /*reference*/, const ReferenceBiases& /*biases*/) override {
    ++counts_["reference.no_room"];
  }

  void finish() override {
    stream_.close();
    RawlogReader reader(file_.path());
    while (objects_ > 0 && reader.next() != nullptr) {
    }
    if (reader.objects() != objects_) {
      throw DataError(file_.path().string() + ": " + std::to_string(reader.objects()) + " objects can be read of " +
                      std::to_string(objects_) + " that were written");
    }
    file_.keep();
  }
  NamedCounts counts() const override {
    NamedCounts out;
    for (const auto& [name, value] : counts_) out.push_back({name, value});
    return out;
  }
  fs::path unfinished() const override { return file_.path(); }

 private:
  template <class Observation>
  bool put_observation(Observation& observation, const Stamp& stamp, const std::string& label) {
    observation.timestamp = ticks_of(stamp.time_ns);
    observation.sensorLabel = label;
    try {
      mrpt::serialization::archiveFrom(stream_) << observation;
    } catch (const std::exception& error) {
      throw DataError(file_.path().string() + ": cannot be written: " + error.what());
    }
    ++objects_;
    return true;
  }

  bool put(const ImuMeasurement& m) {
    obs::CObservationIMU out;
    set(out, kAngularVelocity, m.angular_velocity);
    set(out, kAcceleration, m.specific_force);
    return put_observation(out, m, "imu");
  }
  bool put(const MagnetometerMeasurement& m) {
    obs::CObservationIMU out;
    set(out, kMagneticField, m.magnetic_field / kTeslaPerGauss);
    return put_observation(out, m, "magnetometer");
  }
  bool put(const ImageMeasurement& m) {
    const bool colour = m.format == PixelFormat::kBgr || m.format == PixelFormat::kRgb;
    ImageMeasurement image;
    try {
      image = decode_image(m, colour ? PixelFormat::kBgr : PixelFormat::kGray);
    } catch (const DataError&) {
      throw DamagedPicture();
    }
    const bool grey = image.format == PixelFormat::kGray;
    obs::CObservationImage out;
    out.image = mrpt::img::CImage(static_cast<unsigned>(image.width_px), static_cast<unsigned>(image.height_px),
                                  grey ? mrpt::img::CH_GRAY : mrpt::img::CH_RGB);
    const std::size_t row_bytes = static_cast<std::size_t>(image.width_px) * (grey ? 1 : 3);
    for (std::int32_t row = 0; row < image.height_px; ++row) {
      const auto* line = image.data->data() + static_cast<std::ptrdiff_t>(row) * image.row_stride_bytes;
      std::copy_n(line, row_bytes, out.image.ptrLine<std::uint8_t>(static_cast<unsigned>(row)));
    }
    return put_observation(out, m, "camera" + std::to_string(m.camera));
  }
  bool put(const GpsMeasurement& m) {
    obs::CObservationGPS out;
    obs::gnss::Message_NMEA_GGA gga;
    gga.fields.fix_quality = std::isfinite(m.latitude) ? quality_of(m.fix) : 0;
    gga.fields.satellitesUsed = static_cast<std::uint32_t>(std::max(m.satellites, 0));
    if (gga.fields.fix_quality > 0) {
      gga.fields.latitude_degrees = m.latitude * kDegrees;
      gga.fields.longitude_degrees = m.longitude * kDegrees;
      gga.fields.altitude_meters = m.altitude;
    }
    if (m.gps_time_ns != kNoTime) {
      const UtcTime utc = utc_from_gps(m.gps_time_ns);
      gga.fields.UTCTime.hour = static_cast<std::uint8_t>(utc.hour);
      gga.fields.UTCTime.minute = static_cast<std::uint8_t>(utc.minute);
      gga.fields.UTCTime.sec = utc.second + utc.nanosecond * 1e-9;
      obs::gnss::Message_NMEA_RMC rmc;
      rmc.fields.UTCTime = gga.fields.UTCTime;
      rmc.fields.validity_char = 'A';
      rmc.fields.latitude_degrees = gga.fields.latitude_degrees;
      rmc.fields.longitude_degrees = gga.fields.longitude_degrees;
      rmc.fields.date_day = static_cast<std::uint8_t>(utc.date.day);
      rmc.fields.date_month = static_cast<std::uint8_t>(utc.date.month);
      rmc.fields.date_year = static_cast<std::uint8_t>(utc.date.year % 100);
      // Without a velocity the fields are NaN, which reads back as such.
      rmc.fields.speed_knots = m.velocity_enu.head<2>().norm() / kKnot;
      rmc.fields.direction_degrees = std::atan2(m.velocity_enu.x(), m.velocity_enu.y()) * kDegrees;
      out.setMsg(rmc);
    }
    out.setMsg(gga);
    out.has_satellite_timestamp = false;  // the time of the observation is the recording's
    return put_observation(out, m, "gps");
  }
  bool put(const ReferenceMeasurement& /*m*/) { return false; }
  bool put(const OdometryMeasurement& /*m*/) { return false; }
  bool put(const FeaturesMeasurement& /*m*/) { return false; }

  Unfinished file_;
  mrpt::io::CFileGZOutputStream stream_;
  std::map<std::string, std::int64_t> counts_;
  std::int64_t objects_ = 0;
};

}  // namespace

std::unique_ptr<MeasurementSource> open_rawlog(const fs::path& path) {
  return std::make_unique<RawlogSource>(path);
}

std::unique_ptr<RecordingWriter> create_rawlog(const fs::path& path) {
  return std::make_unique<RawlogWriter>(path);
}

}  // namespace loc
