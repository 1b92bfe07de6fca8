#include "libloc/sensors/measurements.hpp"

namespace loc {

const char* stream_name(StreamKind kind) {
  switch (kind) {
    case StreamKind::kImu:
      return "imu";
    case StreamKind::kMagnetometer:
      return "magnetometer";
    case StreamKind::kImage:
      return "image";
    case StreamKind::kGps:
      return "gps";
    case StreamKind::kReference:
      return "reference";
    case StreamKind::kOdometry:
      return "odometry";
    case StreamKind::kFeatures:
      return "features";
  }
  return "unknown";
}

}  // namespace loc
