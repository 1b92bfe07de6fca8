// Covariance of a state that holds a map: a head (the moving body) and a block of each feature. The only door to it:
// propagate the head, append, replace and remove blocks, update with many measurements at once.
//   PHt = P H^T,  S = H PHt + R = L L^T,  W = PHt L^-T,  P = P - W W^T,  dx = W L^-1 r
// A measurement touches the head and at most one block, so that PHt and S cost 26 n m and not n^2 m (n errors, m
// numbers measured); P - W W^T costs n^2 m and is all that counts for a large map. Only the lower triangle is kept up.
// The memory is that of the capacity, once; nothing is allocated afterwards. Joseph's form would cost twice as much. P
// stays positive definite without it as long as measurements are not far more precise than rounding: a relative 1e-12
// of double, 1e-5 of float, of the variances that they are measured against. Source: J. Civera, A. Davison, J. Montiel,
// "Inverse depth parametrization for monocular SLAM", 2008 (blocks); G. Bierman, "Factorization methods for discrete
// sequential estimation", 1977 (W).
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace loc {

inline constexpr int kMaxHeadDim = 32;
inline constexpr int kMaxBlockDim = 6;
inline constexpr int kMaxRows = 6;  ///< numbers in one measurement

/// A linearised measurement: r = z - h(x), H by the head and by one block, R.
struct BlockMeasurement {
  int rows = 0;
  Eigen::Matrix<double, kMaxRows, kMaxHeadDim> head;  ///< the first rows rows and head_dim columns
  int block = -1;                                     ///< column where the block begins; -1: none
  int block_dim = 0;                                  ///< columns of the block
  Eigen::Matrix<double, kMaxRows, kMaxBlockDim> block_jacobian;
  Eigen::Matrix<double, kMaxRows, 1> residual;
  Eigen::Matrix<double, kMaxRows, kMaxRows> noise_cov;  ///< R
};

/// Rows and columns that leave.
struct CovarianceRange {
  int first;
  int count;
};

/// Scalar is double or float; what goes in and out is double.
template <class Scalar>
class LargeCovariance {
 public:
  /// @param capacity largest number of errors @param max_rows largest number of numbers in one update
  /// @throws std::invalid_argument for sizes that are not positive or a head above kMaxHeadDim.
  LargeCovariance(int head_dim, int capacity, int max_rows);

  int head_dim() const { return head_; }
  int dim() const { return dim_; }
  int capacity() const { return capacity_; }
  int max_rows() const { return max_rows_; }

  /// The head alone. @param covariance head_dim square
  void reset(const Eigen::MatrixXd& covariance);

  double operator()(int row, int column) const {
    return static_cast<double>(row >= column ? p_[index(row, column)] : p_[index(column, row)]);
  }
  /// A part of P, as large as out, wherever it is.
  template <class Derived>
  void read(int row, int column, Eigen::MatrixBase<Derived>& out) const {
    for (Eigen::Index j = 0; j < out.cols(); ++j) {
      for (Eigen::Index i = 0; i < out.rows(); ++i) {
        out(i, j) = (*this)(row + static_cast<int>(i), column + static_cast<int>(j));
      }
    }
  }
  /// All of P, symmetric. For tests and for files: allocates.
  Eigen::MatrixXd dense() const;
  /// The other way round: head and blocks. @throws std::invalid_argument when larger than the capacity.
  void set_dense(const Eigen::MatrixXd& covariance);

  /// P_hh = F P_hh F^T + Q, P_mh = P_mh F^T. @param f, q head_dim square
  void propagate(const Eigen::MatrixXd& f, const Eigen::MatrixXd& q);

  /// A block x_new = g(head) + noise. @param jacobian of g, block x head_dim @param noise_cov block square
  /// @returns where it begins. @throws std::length_error past the capacity.
  int append(const Eigen::Ref<const Eigen::MatrixXd>& jacobian, const Eigen::Ref<const Eigen::MatrixXd>& noise_cov);

  /// The block at first becomes J times itself, of J.rows() <= J.cols() errors; the rows left over are to be removed.
  void replace(int first, const Eigen::Ref<const Eigen::MatrixXd>& jacobian);

  /// Ranges ascend and do not overlap. What follows moves up.
  void remove(std::span<const CovarianceRange> ranges);

  /// Innovation covariance of one measurement alone, rows square. @returns S in the first rows.
  Eigen::Matrix<double, kMaxRows, kMaxRows> innovation_cov(const BlockMeasurement& measurement) const;

  /// PHt and S of these measurements, in their order. @param which indices into measurements
  void innovate(std::span<const BlockMeasurement> measurements, std::span<const int> which);
  int rows() const { return rows_; }
  /// Entry of S, of the last innovate().
  double s(int row, int column) const {
    return static_cast<double>(
        s_[static_cast<std::size_t>(column) * static_cast<std::size_t>(max_rows_) + static_cast<std::size_t>(row)]);
  }
  /// Entry of PHt, of the last innovate().
  double pht(int row, int column) const { return static_cast<double>(pht_[index(row, column)]); }

  /// The correction that update() would make, P untouched: for iterated updates. @returns false as update().
  bool correction(std::span<const int> accepted, std::span<const double> residual, Eigen::VectorXd& dx);

  /// Takes rows of the last innovate() for true. @param accepted the rows that are used, ascending @param residual of
  /// these rows @param dx dim() long @param nis r^T S^-1 r of these rows
  /// @param from errors before it keep their values and covariance (their gain is zero, which is suboptimal for them
  /// and right for the others: Schmidt's consider filter)
  /// @returns false, and leaves P as it is, when their S is not positive definite.
  bool update(std::span<const int> accepted, std::span<const double> residual, Eigen::VectorXd& dx, double& nis,
              int from = 0);

  /// P = T P T^T with T = I + U E^T: the errors get U times the three errors at first.
  /// @param u dim() x 3
  void shear(int first, const Eigen::MatrixX3d& u);

  /// Adds to the diagonal.
  void inflate(int first, int count, double variance);

 private:
  std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(column) * static_cast<std::size_t>(leading_) + static_cast<std::size_t>(row);
  }
  void mirror_head();
  bool factorise(std::span<const int> accepted);

  int head_;
  int capacity_;
  int max_rows_;
  int leading_;
  int dim_ = 0;
  int rows_ = 0;
  std::vector<Scalar> p_;     // capacity square, lower triangle; that of the head both triangles
  std::vector<Scalar> pht_;   // capacity x max_rows
  std::vector<Scalar> s_;     // max_rows square
  std::vector<Scalar> h_;     // head x max_rows, H^T by the head
  std::vector<Scalar> gain_;  // capacity x max_rows
  std::vector<Scalar> chol_;  // max_rows square
  std::vector<Scalar> work_;  // capacity x 2 kMaxHeadDim
};

extern template class LargeCovariance<double>;
extern template class LargeCovariance<float>;

}  // namespace loc
