// What a GPS fix says about a place in a local world, and how far its word goes: for every estimator that takes fixes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "libloc/geometry/geodesy.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

/// Errors of a receiver. A base of the options of those who use it.
struct GpsErrorModel {
  Eigen::Vector3d gps_antenna = Eigen::Vector3d::Zero();  ///< lever arm in body axes [m]
  /// Deviations of a fix that does not say: horizontal of a stand-alone fix, and parts of it for better ones and up.
  double gps_sigma = 5;                ///< [m]
  double gps_differential_part = 0.3;  ///< of gps_sigma
  double gps_float_part = 0.1;         ///< of gps_sigma
  double gps_fixed_part = 0.006;       ///< of gps_sigma
  double gps_vertical_factor = 2;      ///< up against horizontal
  double gps_velocity_sigma = 0.3;     ///< [m/s]
  /// A receiver's covariance says how much fixes scatter. What they have in common for minutes (atmosphere, multipath)
  /// and an error of their time stamps is not in it: deviations are at least these (RTK: as stated), and the way that
  /// the body goes in the time is added.
  double gps_sigma_floor = 0;           ///< horizontal, vertical by gps_vertical_factor [m]
  double gps_velocity_sigma_floor = 0;  ///< [m/s]
  double gps_time_sigma = 0;            ///< [s]
  /// How long the error of a position lasts, with a fix below RTK. Fixes dt apart count as white ones of (1 + phi)/(1 -
  /// phi) times the variance, phi = exp(-dt/this): as little as they tell together. 0: white. [s]
  double gps_correlation_time_s = 0;

  /// For real receivers: floors, correlation, error of the time stamps.
  void make_robust();
  /// @throws std::invalid_argument naming the field and its value.
  void check_gps() const;
};

/// Why a fix is of no use.
enum class GpsRefusal : std::uint8_t { kNone, kNoFix, kNotFinite, kOutOfRange, kBadCovariance, kRepeated };

/// How a refusal is counted and told. kNone is no refusal: @throws std::invalid_argument.
struct GpsRefusalNote {
  const char* count;
  std::uint32_t status;  ///< EstimateStatus
};
GpsRefusalNote note_of(GpsRefusal refusal);

/// A fix in the axes of a local world.
struct GpsPosition {
  TimeNs time_ns = kNoTime;
  Eigen::Vector3d position =
      Eigen::Vector3d::Constant(kUnknown);  ///< of the antenna [m]; z is that of altitude 0 where it is not known
  Eigen::Matrix3d position_cov = Eigen::Matrix3d::Constant(kUnknown);  ///< [m^2]
  bool has_height = false;
  Eigen::Vector3d velocity = Eigen::Vector3d::Constant(kUnknown);      ///< [m/s]; NaN: not known
  Eigen::Matrix3d velocity_cov = Eigen::Matrix3d::Constant(kUnknown);  ///< [m^2/s^2]
};

/// The place that a fix gives, with altitude 0 where it has none. @returns why it gives none
GpsRefusal gps_place(const GpsMeasurement& gps, GeodeticPoint& place);

/// A fix with its errors. What the way of the body in gps_time_sigma adds is left to the caller, who knows it.
/// @param before_ns of the fix before this one, kNoTime for the first: that one says all it can
GpsRefusal gps_in_world(const GpsMeasurement& gps, const GpsErrorModel& errors, const LocalFrame& world,
                        TimeNs before_ns, GpsPosition& out);

/// Symmetric, positive definite, and small enough to reckon with.
bool is_usable_covariance(const Eigen::Matrix3d& cov);

}  // namespace loc
