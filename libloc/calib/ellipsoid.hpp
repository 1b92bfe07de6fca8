// Ellipsoid calibration of a magnetometer or an accelerometer: in a constant field the raw readings x of a turned triad
// lie on an ellipsoid; its centre C is the bias (hard iron), its shape the scale, cross-axis and soft-iron error:
//
//   corrected = W (x - C),   |corrected| = reference norm of the field
//
// W is symmetric: a rotation of the corrected readings is not observable from their norm (calib/magnetometer_alignment
// finds it with the help of the IMU). An accelerometer gives such readings only while it does not move
// (calib/stillness).
//
// Methods and their sources:
//   lsq     the nine-parameter form a1 x^2 + a2 y^2 + a3 z^2 + a4 xy + a5 xz + a6 yz + a7 x + a8 y + a9 z = 1 by least
//           squares, on readings that are centred and scaled first: the bare form has no solution when the origin lies
//           outside the ellipsoid.
//   als     adjusted least squares: Markovsky, Kukush, Van Huffel, "Consistent least squares fitting of ellipsoids",
//           Numerische Mathematik 98, 2004. Without bias for clean data that cover a part of the sphere.
//   robust  maximum likelihood for noise across the surface (Sampson distance) with Tukey's loss, by Levenberg and
//           Marquardt; starts from Li, Griffiths, "Least squares ellipsoid specific fitting", GMP 2004, or, where
//           outliers are likely, from the least median of squares of such fits. A weak prior that the shape is near a
//           sphere holds what the data do not determine.
//   sphere  centre and radius only, same loss; its covariance holds what a shape near a sphere does to the centre.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "libloc/calib/sphere_coverage.hpp"
#include "libloc/core/quality.hpp"
#include "libloc/sensors/rig.hpp"

namespace loc {

enum class EllipsoidMethod : std::uint8_t { kLsq, kRobust, kAls, kSphere };
/// "lsq", "robust", "als", "sphere"
const char* ellipsoid_method_name(EllipsoidMethod method);
/// @throws std::invalid_argument naming the text.
EllipsoidMethod parse_ellipsoid_method(const std::string& name);

struct EllipsoidOptions {
  EllipsoidMethod method = EllipsoidMethod::kRobust;
  double reference_norm = 0;  ///< |corrected|, in the unit wanted: 9.80665, 48e-6; 0: the readings' own mean radius
  double shape_prior_sigma =
      0.2;                 ///< of the relative axis lengths from a sphere; 0: robust has no prior, sphere is believed
  double tukey_c = 4.685;  ///< robust, sphere: residuals beyond this many sigma do not count
  double outlier_share = 0.02;  ///< robust: above this share the start is the least median of squares
  int max_iterations = 100;
  std::uint64_t seed = 1;          ///< of the subsets of the least median of squares
  double ok_centre_sigma = 0.003;  ///< predicted deviation of the centre over the radius: up to here ok, …
  double fair_centre_sigma = 0.01;
  double warn_centre_sigma = 0.02;  ///< beyond: refused

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// Order of the nine parameters in EllipsoidFit::cov.
enum EllipsoidParameter { kCentreX, kCentreY, kCentreZ, kWxx, kWyy, kWzz, kWxy, kWxz, kWyz, kEllipsoidParameters };

struct EllipsoidFit {
  EllipsoidMethod method = EllipsoidMethod::kRobust;
  bool is_ellipsoid = false;  ///< false: the data determine none; centre and matrix are NaN then
  bool converged = false;
  int iterations = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Constant(kUnknown);  ///< C, in the readings' unit
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Constant(kUnknown);  ///< W, symmetric, positive definite
  double radius = kUnknown;          ///< mean radius of the raw ellipsoid (geometric), in the readings' unit
  double reference_norm = kUnknown;  ///< |corrected|
  /// Of centre and W, order EllipsoidParameter; from the curvature of the cost and the residuals. Readings that are
  /// correlated in time make it too small.
  Eigen::Matrix<double, kEllipsoidParameters, kEllipsoidParameters> cov =
      Eigen::Matrix<double, kEllipsoidParameters, kEllipsoidParameters>::Constant(kUnknown);
  double noise_sigma = kUnknown;   ///< of a reading across the surface, robust estimate, in the readings' unit
  double residual_rms = kUnknown;  ///< of |corrected| - reference norm over the inliers, over the reference norm
  double norm_variation_before = kUnknown;  ///< standard deviation of |x| over its mean
  double norm_variation_after = kUnknown;   ///< the same of |corrected|, over all readings
  std::int64_t readings = 0;                ///< taken
  std::int64_t not_finite = 0;              ///< left out
  std::int64_t inliers = 0;                 ///< within tukey_c sigma
  double centre_sigma = kUnknown;        ///< largest standard deviation of the centre, any direction, over the radius
  double axis_ratio = kUnknown;          ///< longest over shortest axis
  double centre_over_radius = kUnknown;  ///< |C| / R
  SphereCoverage coverage;               ///< of the corrected directions
  Quality quality;

  /// For the rig. @throws DataError with the reasons when there is no ellipsoid.
  TriadCalibration triad() const;
};

/// @param readings N rows, any unit. @param weights empty, or one per reading: its information relative to the others
/// (a mean of n readings has weight n); not negative.
/// @throws std::invalid_argument for wrong options or sizes. Bad data do not throw: see EllipsoidFit::quality.
EllipsoidFit fit_ellipsoid(const Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>& readings,
                           const EllipsoidOptions& options = {}, std::span<const double> weights = {});

/// What to do next while readings are collected, in words for a person.
struct EllipsoidAdvice {
  bool enough = false;
  Eigen::Vector3d missing_direction =
      Eigen::Vector3d::Constant(kUnknown);  ///< body axes, length 1: point it along the field
  Eigen::Vector3d turn_axis =
      Eigen::Vector3d::Constant(kUnknown);  ///< body axes, length 1: from the last reading there
  std::string text;
};

/// Collects readings one by one, in bounded memory, for a calibration that a person watches while turning the device.
/// Each direction keeps its latest readings, so that a device that lies still does not push out what was seen before.
class EllipsoidCollector {
 public:
  /// @param readings_per_cell kept for each of the cells of SphereCoverage
  /// @throws std::invalid_argument naming the option and its value.
  explicit EllipsoidCollector(EllipsoidOptions options = {}, int readings_per_cell = 20);
  /// false when it is not finite: counted and left out.
  bool add(const Eigen::Vector3d& reading);
  /// Of what is kept now; computed anew at each call (some ms).
  EllipsoidFit fit() const;
  EllipsoidAdvice advice(const EllipsoidFit& fit) const;
  std::int64_t received() const { return received_; }
  /// The readings that fit() uses, in order of arrival.
  std::vector<Eigen::Vector3d> kept() const;

 private:
  std::size_t capacity() const;

  EllipsoidOptions options_;
  int readings_per_cell_;
  std::vector<Eigen::Vector3d> buffer_;
  std::int64_t received_ = 0;
  std::int64_t not_finite_ = 0;
};

}  // namespace loc
