// The plain structs that every stream is made of. Drivers, readers and the simulator make them, estimators take them:
// an estimator cannot tell which of them it was. SI units and radians. Frames: libloc/README.md. What nobody has filled
// in is NaN.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "libloc/core/time.hpp"

namespace loc {

/// Not measured, not known.
inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// What every measurement carries about its time and its place in the stream.
struct Stamp {
  TimeNs time_ns = kNoTime;       ///< Time of measurement, on the clock that the whole recording shares.
  TimeNs host_time_ns = kNoTime;  ///< Arrival at the host, host clock; kNoTime when unknown.
  std::int64_t sequence = -1;     ///< Counts the samples of one stream from 0; a jump is a loss. -1 when unknown.
};

/// One IMU sample, in the body frame (= axes of the IMU).
struct ImuMeasurement : Stamp {
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Constant(kUnknown);  ///< [rad/s]
  Eigen::Vector3d specific_force = Eigen::Vector3d::Constant(kUnknown);    ///< [m/s^2], at rest +9.81 upwards
};

/// One magnetometer sample, in the body frame once the rig's alignment is applied.
struct MagnetometerMeasurement : Stamp {
  Eigen::Vector3d magnetic_field = Eigen::Vector3d::Constant(kUnknown);  ///< [T]
};

/// Layout of the bytes of an image; the values are the fourcc codes that V4L2 and LCM's bot_core use.
enum class PixelFormat : std::int32_t {
  kGray = 0x59455247,  ///< "GREY", one byte a pixel
  kBgr = 0x33524742,   ///< "BGR3"
  kRgb = 0x33424752,   ///< "RGB3"
  kMjpeg = 0x47504a4d  ///< "MJPG", one JPEG picture
};

/// One picture. Pixel (0,0) is the centre of the top-left pixel.
struct ImageMeasurement : Stamp {
  std::int32_t camera = 0;  ///< Index of the camera in the rig.
  std::int32_t width_px = 0;
  std::int32_t height_px = 0;
  std::int32_t row_stride_bytes = 0;  ///< 0 for JPEG
  PixelFormat format = PixelFormat::kGray;
  TimeNs exposure_ns = 0;  ///< Length of the exposure; 0 when unknown. time_ns is its middle.
  std::shared_ptr<const std::vector<std::uint8_t>> data;
};

enum class GpsFixType : std::int8_t {
  kNone = 0,
  kTime = 1,
  k2d = 2,
  k3d = 3,
  kDifferential = 4,
  kFloat = 5,
  kFixed = 6
};

/// One GPS fix. What a receiver did not say is NaN (or kNoTime, -1).
struct GpsMeasurement : Stamp {
  GpsFixType fix = GpsFixType::kNone;
  std::int32_t satellites = -1;
  TimeNs gps_time_ns = kNoTime;  ///< Since 1980-01-06 00:00:00 UTC, without leap seconds.
  double latitude = kUnknown;    ///< [rad], WGS 84
  double longitude = kUnknown;   ///< [rad]
  double altitude = kUnknown;    ///< [m] above the ellipsoid
  Eigen::Matrix3d position_cov = Eigen::Matrix3d::Constant(kUnknown);  ///< [m^2], east, north, up
  Eigen::Vector3d velocity_enu = Eigen::Vector3d::Constant(kUnknown);  ///< [m/s], east, north, up
  Eigen::Matrix3d velocity_cov = Eigen::Matrix3d::Constant(kUnknown);  ///< [m^2/s^2]
};

/// Pose by a reference system (motion capture, reference INS): truth for evaluation, never seen by an estimator under
/// test. What the reference does not know is NaN.
struct ReferenceMeasurement : Stamp {
  Eigen::Quaterniond q_world_body{kUnknown, kUnknown, kUnknown, kUnknown};
  Eigen::Vector3d position = Eigen::Vector3d::Constant(kUnknown);  ///< of body in world [m]
  Eigen::Vector3d velocity = Eigen::Vector3d::Constant(kUnknown);  ///< in world [m/s]
  bool score = true;  ///< False where the recording says: do not score here.
};

/// Pose by an odometry that knows no metre: visual odometry of one camera, or another one whose scale is off. Lengths
/// are in the odometry's own unit: length = scale * metres. A covariance that is not known is NaN.
struct OdometryMeasurement : Stamp {
  /// kNoTime: absolute, the pose of body in world (its position times the scale). Otherwise relative: the pose of body
  /// at time_ns in the axes of body at this time.
  TimeNs start_time_ns = kNoTime;
  Eigen::Vector3d position = Eigen::Vector3d::Constant(kUnknown);         ///< [odometry's unit]
  Eigen::Quaterniond rotation{kUnknown, kUnknown, kUnknown, kUnknown};    ///< q_world_body, or q_start_body
  Eigen::Matrix3d position_cov = Eigen::Matrix3d::Constant(kUnknown);     ///< [unit^2], axes of position
  Eigen::Matrix3d orientation_cov = Eigen::Matrix3d::Constant(kUnknown);  ///< [rad^2], axes of body at time_ns
};

/// One feature in one frame.
struct FeatureObservation {
  std::int64_t id = -1;                                            ///< the same for the same point of the scene
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Constant(kUnknown);  ///< u, v; distorted, as the camera sees it
};

/// The features of one frame with their identities (tracks).
struct FeaturesMeasurement : Stamp {
  std::int32_t camera = 0;     ///< Index of the camera in the rig.
  double sigma_px = kUnknown;  ///< deviation of one coordinate
  std::vector<FeatureObservation> features;
};

/// One sample of any stream.
using Measurement = std::variant<ImuMeasurement, MagnetometerMeasurement, ImageMeasurement, GpsMeasurement,
                                 ReferenceMeasurement, OdometryMeasurement, FeaturesMeasurement>;

/// Index of the alternatives above; names for reports.
enum class StreamKind : std::uint8_t {
  kImu = 0,
  kMagnetometer = 1,
  kImage = 2,
  kGps = 3,
  kReference = 4,
  kOdometry = 5,
  kFeatures = 6
};
inline constexpr std::size_t kStreamKinds = std::variant_size_v<Measurement>;
const char* stream_name(StreamKind kind);

inline StreamKind kind_of(const Measurement& m) {
  return static_cast<StreamKind>(m.index());
}
inline const Stamp& stamp_of(const Measurement& m) {
  return std::visit([](const auto& x) -> const Stamp& { return x; }, m);
}
inline Stamp& stamp_of(Measurement& m) {
  return std::visit([](auto& x) -> Stamp& { return x; }, m);
}
/// A kind of which each camera has a stream of its own: images, features.
inline bool has_camera(StreamKind kind) {
  return kind == StreamKind::kImage || kind == StreamKind::kFeatures;
}
/// Index of the camera that it comes from; 0 for what comes from none.
inline std::int32_t camera_of(const Measurement& m) {
  if (const auto* image = std::get_if<ImageMeasurement>(&m)) return image->camera;
  if (const auto* features = std::get_if<FeaturesMeasurement>(&m)) return features->camera;
  return 0;
}

}  // namespace loc
