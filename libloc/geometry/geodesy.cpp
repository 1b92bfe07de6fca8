#include "libloc/geometry/geodesy.hpp"

#include <GeographicLib/Geocentric.hpp>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

}  // namespace

void GeodeticPoint::check() const {
  require(std::abs(latitude) <= std::numbers::pi / 2, "latitude", latitude, "must be in [-pi/2, pi/2] rad");
  require_finite("longitude", longitude);
  require_finite("altitude", altitude);
}

Eigen::Vector3d earth_from_geodetic(const GeodeticPoint& point) {
  point.check();
  // The product may be past 90 by rounding, which GeographicLib answers with NaN.
  const double latitude_deg = std::clamp(point.latitude * kDegreesPerRadian, -90.0, 90.0);
  Eigen::Vector3d p;
  GeographicLib::Geocentric::WGS84().Forward(latitude_deg, point.longitude * kDegreesPerRadian, point.altitude, p.x(),
                                             p.y(), p.z());
  return p;
}

GeodeticPoint geodetic_from_earth(const Eigen::Vector3d& position) {
  require(position.allFinite(), "position: must be finite");
  GeodeticPoint point;
  double latitude_deg = 0;
  double longitude_deg = 0;
  GeographicLib::Geocentric::WGS84().Reverse(position.x(), position.y(), position.z(), latitude_deg, longitude_deg,
                                             point.altitude);
  point.latitude = latitude_deg / kDegreesPerRadian;
  point.longitude = longitude_deg / kDegreesPerRadian;
  return point;
}

Eigen::Matrix3d R_earth_enu(const GeodeticPoint& point) {
  point.check();
  const double sin_lat = std::sin(point.latitude);
  const double cos_lat = std::cos(point.latitude);
  const double sin_lon = std::sin(point.longitude);
  const double cos_lon = std::cos(point.longitude);
  Eigen::Matrix3d r;
  r << -sin_lon, -sin_lat * cos_lon, cos_lat * cos_lon,  //
      cos_lon, -sin_lat * sin_lon, cos_lat * sin_lon,    //
      0, cos_lat, sin_lat;
  return r;
}

LocalFrame::LocalFrame(const GeodeticPoint& origin)
    : origin_(origin), origin_in_earth_(earth_from_geodetic(origin)), R_earth_local_(R_earth_enu(origin)) {}

Eigen::Vector3d LocalFrame::to_local(const GeodeticPoint& point) const {
  return R_earth_local_.transpose() * (earth_from_geodetic(point) - origin_in_earth_);
}

GeodeticPoint LocalFrame::to_geodetic(const Eigen::Vector3d& position) const {
  require(position.allFinite(), "position: must be finite");
  return geodetic_from_earth(origin_in_earth_ + R_earth_local_ * position);
}

Eigen::Matrix3d LocalFrame::R_local_enu(const GeodeticPoint& point) const {
  return R_earth_local_.transpose() * R_earth_enu(point);
}

}  // namespace loc
