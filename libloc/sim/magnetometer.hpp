// Simulated magnetometer: the field of the Earth and of things nearby, through a sensor on a device that is magnetic
// itself.
//   reading = round(soft_iron * R^T (field of the world + disturbances) + hard_iron + white noise), within the range
// R is the attitude R_world_body. The calibration that takes it back: matrix = soft_iron^-1, bias = hard_iron.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/core/time.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sensors/rig.hpp"
#include "libloc/sim/motion.hpp"
#include "libloc/sim/noise.hpp"

namespace loc {

/// A field that is there for a while, wherever the body is (a tram goes by).
struct FieldDisturbance {
  TimeInterval when;
  Eigen::Vector3d field = Eigen::Vector3d::Zero();  ///< in world [T]
};

/// A magnet at a place (a car, a steel door). Its field is that of a dipole down to its radius, and no stronger within.
struct MagneticDipole {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< in world [m]
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();    ///< in world [A m^2]; a car: about 100
  double radius = 0.5;                                 ///< [m]

  /// In world [T].
  Eigen::Vector3d field_at(const Eigen::Vector3d& place) const;
};

struct MagnetometerModel {
  double rate_hz = 50;
  Eigen::Vector3d field{0, 22e-6, -42e-6};                  ///< of the world [T]; here: dip 62 degrees, no declination
  Eigen::Vector3d hard_iron = Eigen::Vector3d::Zero();      ///< [T]
  Eigen::Matrix3d soft_iron = Eigen::Matrix3d::Identity();  ///< scale and cross-axis too
  double sigma = 3e-7;                                      ///< [T], white, of a sample, each axis
  double range = std::numeric_limits<double>::infinity();   ///< [T], saturates beyond
  double resolution = 0;                                    ///< [T], step of a reading; 0: not rounded
  std::vector<FieldDisturbance> disturbances;
  std::vector<MagneticDipole> dipoles;

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
  MagnetometerCalibration calibration() const;
};

class MagnetometerSimulator {
 public:
  /// @throws as MagnetometerModel::check
  MagnetometerSimulator(const MagnetometerModel& model, Random random);

  /// time_ns is since the start of the motion.
  MagnetometerMeasurement measure(const MotionState& state);
  /// In world, disturbances included [T].
  Eigen::Vector3d true_field(double time_s, const Eigen::Vector3d& position) const;

  const MagnetometerModel& model() const { return model_; }

 private:
  MagnetometerModel model_;
  Random random_;
};

}  // namespace loc
