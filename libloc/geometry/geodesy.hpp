// Latitude, longitude and altitude to metres east, north and up of an origin, and back.
// Frames: local is the plane that touches the ellipsoid WGS 84 below the origin, moved to the origin's altitude: x
// east, y north, z up, right-angled and not curved. A point 1 km away at the same altitude is 0.08 m below the plane.
// Valid at any distance. Computed through the Earth's centre by GeographicLib's Geocentric (Karney, "Transverse
// Mercator with an accuracy of a few nanometers", 2011, appendix B), to 1e-8 m near the ground.
#pragma once

#include <Eigen/Core>

namespace loc {

/// A place on the Earth or above it.
struct GeodeticPoint {
  double latitude = 0;   ///< [rad], WGS 84, in [-pi/2, pi/2]
  double longitude = 0;  ///< [rad]; results are in [-pi, pi]
  double altitude = 0;   ///< [m] above the ellipsoid

  /// @throws std::invalid_argument naming the field and its value: not finite, latitude out of range.
  void check() const;
};

/// Coordinates in the Earth's axes [m]: x towards latitude 0 and longitude 0, z towards the north pole.
/// @throws std::invalid_argument as GeodeticPoint::check
Eigen::Vector3d earth_from_geodetic(const GeodeticPoint& point);
/// @throws std::invalid_argument when not finite.
GeodeticPoint geodetic_from_earth(const Eigen::Vector3d& position);
/// Columns: east, north and up of a place, in the Earth's axes. At the poles east is that of the given longitude.
/// @throws std::invalid_argument as GeodeticPoint::check
Eigen::Matrix3d R_earth_enu(const GeodeticPoint& point);

/// The local axes of an origin.
class LocalFrame {
 public:
  /// @throws std::invalid_argument as GeodeticPoint::check
  explicit LocalFrame(const GeodeticPoint& origin);
  LocalFrame(double latitude, double longitude, double altitude)
      : LocalFrame(GeodeticPoint{latitude, longitude, altitude}) {}

  const GeodeticPoint& origin() const { return origin_; }

  /// East, north, up of the origin [m]. @throws std::invalid_argument as GeodeticPoint::check
  Eigen::Vector3d to_local(const GeodeticPoint& point) const;
  Eigen::Vector3d to_local(double latitude, double longitude, double altitude) const {
    return to_local(GeodeticPoint{latitude, longitude, altitude});
  }
  /// @throws std::invalid_argument when position is not finite.
  GeodeticPoint to_geodetic(const Eigen::Vector3d& position) const;

  /// Takes east, north, up of a place to the axes of this frame: v_local = R_local_enu * v_enu. They differ by the
  /// curvature of the Earth, 1.6e-4 rad a kilometre.
  /// @throws std::invalid_argument as GeodeticPoint::check
  Eigen::Matrix3d R_local_enu(const GeodeticPoint& point) const;

 private:
  GeodeticPoint origin_;
  Eigen::Vector3d origin_in_earth_;
  Eigen::Matrix3d R_earth_local_;
};

}  // namespace loc
