// Parts of the ellipsoid fit that only its own files and tests use. Readings are centred on their mean and divided by
// their spread here, so that numbers are near 1 whatever the unit and the offset.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace loc::detail {

using Readings = Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>;
using Vector9 = Eigen::Matrix<double, 9, 1>;
using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Vector10 = Eigen::Matrix<double, 10, 1>;
using Matrix10 = Eigen::Matrix<double, 10, 10>;

/// |matrix (z - centre)| = 1, matrix symmetric and positive definite.
struct Ellipsoid {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
};

/// Readings that count, normalised: z = (x - origin) / scale; columns.
struct NormalisedReadings {
  Eigen::Matrix3Xd z;
  Eigen::VectorXd weights;           ///< mean 1
  std::vector<Eigen::Index> spread;  ///< readings that tell the scale: of no direction far more than of the others
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double scale = 1;
};

/// Sums of x^p y^q z^r, p + q + r <= 4, over points with weights: all that the algebraic fits need.
class QuarticMoments {
 public:
  void add(const Eigen::Vector3d& z, double weight);
  /// Scatter matrix of (x^2, y^2, z^2, xy, xz, yz, x, y, z, 1), corrected for isotropic Gaussian noise of this variance
  /// (0: the plain one), over the sum of the weights.
  Matrix10 scatter(double noise_variance = 0) const;

 private:
  static constexpr int index(int p, int q, int r) { return (p * 5 + q) * 5 + r; }
  std::array<double, 125> sums_{};
};

/// The ellipsoid of a quadric (coefficients in the order of QuarticMoments::scatter); nullopt when it is none.
std::optional<Ellipsoid> ellipsoid_of(const Vector10& quadric);

/// The source's form "= 1" by least squares.
std::optional<Ellipsoid> fit_lsq(const QuarticMoments& moments);
/// Li and Griffiths, kJ - I^2 = 1 with k = 4: always an ellipsoid, unless the data are degenerate to rounding.
std::optional<Ellipsoid> fit_li_griffiths(const QuarticMoments& moments);
/// Markovsky et al. with unknown noise variance.
std::optional<Ellipsoid> fit_als(const QuarticMoments& moments);

/// Sampson distance of z from the surface, and its derivative by centre (3) and matrix (xx, yy, zz, xy, xz, yz).
/// false at the centre, where it is not defined.
bool sampson_distance(const Ellipsoid& e, const Eigen::Vector3d& z, double& distance, Vector9* jacobian);

/// Least median of squares over small subsets, sharpened on the better half.
std::optional<Ellipsoid> fit_lmeds(const NormalisedReadings& readings, std::uint64_t seed);

struct RobustFit {
  Ellipsoid ellipsoid;
  bool converged = false;
  int iterations = 0;
  double sigma = 0;  ///< robust scale of the residuals
};
struct RobustOptions {
  double tukey_c = 4.685;
  double shape_prior_sigma = 0;  ///< 0: none
  int max_iterations = 100;
  bool sphere = false;
};
RobustFit refine(const NormalisedReadings& readings, const Ellipsoid& start, const RobustOptions& options);

/// Residuals times the root of their weight. @param out of the size of the readings
void residuals(const NormalisedReadings& readings, const Ellipsoid& e, std::span<double> out);
/// robust_scale() of the residuals of those that tell it. @param all of all readings @param buffer for its work
double scale_of(const NormalisedReadings& readings, std::span<const double> all, int parameters,
                std::vector<double>& buffer);
/// 1.4826 times the median of |r|, with the small-sample factor for that many parameters. Reorders its argument.
double robust_scale(std::span<double> residuals, int parameters);
/// Deviation of the relative axis lengths from their mean, divided by sigma: six residuals and their derivative by the
/// six elements of the matrix.
void shape_prior(const Ellipsoid& e, double sigma, Eigen::Matrix<double, 6, 1>& residual,
                 Eigen::Matrix<double, 6, 6>& jacobian);

}  // namespace loc::detail
