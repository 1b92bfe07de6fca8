// The update of a Kalman filter with at most six numbers at a time: innovation, gate, Joseph form. The only door to a
// covariance besides propagation.
//   S = H P H^T + R,  NIS = r^T S^-1 r,  K = P H^T S^-1,  dx = K r
//   P = (I - K H) P (I - K H)^T + K R K^T
// The Joseph form stays symmetric and positive semidefinite when the state is known far worse than it is measured,
// where P - K H P loses both to rounding. H is given by its entries that are not zero: a pose touches a dozen of a
// hundred. Nothing is allocated. Source: G. Bierman, "Factorization Methods for Discrete Sequential Estimation", 1977,
// chapter II.
#pragma once

#include <Eigen/Core>
#include <array>

namespace loc {

inline constexpr int kMaxUpdateDim = 6;   ///< numbers in one measurement
inline constexpr int kMaxFilterDim = 64;  ///< errors in the state

/// A linearised measurement: residual z - h(x), H, R.
class Observation {
 public:
  struct Entry {
    int row, column;
    double value;
  };

  /// Empties it. @param dim 1 to kMaxUpdateDim
  void begin(int dim);
  int dim() const { return dim_; }

  /// Entries may be added in any order, also twice (they sum up); zeros are left out.
  void add(int row, int column, double value) {
    if (value != 0) entries_[count_++] = {row, column, value};
  }
  void add3(int row, int column, const Eigen::Matrix3d& block);
  void add3(int row, int column, double diagonal);

  const Entry* entries() const { return entries_.data(); }
  int count() const { return count_; }

  Eigen::Matrix<double, kMaxUpdateDim, 1> residual;               ///< the first dim()
  Eigen::Matrix<double, kMaxUpdateDim, kMaxUpdateDim> noise_cov;  ///< R, the first dim() rows and columns

 private:
  int dim_ = 0;
  int count_ = 0;
  std::array<Entry, static_cast<std::size_t>(2 * kMaxUpdateDim * kMaxFilterDim)> entries_;
};

/// What an update is made of; the arrays hold matrices column by column.
struct Innovation {
  int dim = 0;
  double nis = 0;
  std::array<double, kMaxUpdateDim * kMaxUpdateDim> cov;   ///< S
  std::array<double, kMaxFilterDim * kMaxUpdateDim> pht;   ///< P H^T
  std::array<double, kMaxFilterDim * kMaxUpdateDim> gain;  ///< K
};

/// Innovation of a measurement; the covariance is symmetric and at most kMaxFilterDim square.
/// @returns false when S is not positive definite.
bool innovate(const Eigen::MatrixXd& covariance, const Observation& observation, Innovation& innovation);

/// P after the measurement. @param innovation of this very covariance and observation
/// @param correction dx, as long as the error state
void joseph_update(Eigen::MatrixXd& covariance, const Observation& observation, const Innovation& innovation,
                   Eigen::VectorXd& correction);

}  // namespace loc
