// Symmetric positive definite systems whose matrix is zero away from the diagonal: what smoothing and spline fits end
// in. Internal to calib.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "libloc/core/check.hpp"

namespace loc::calib {

/// Lower triangle of A, diagonal by diagonal; A(i, j) = 0 for i - j > bandwidth. To be summed up, then solved once.
class BandSystem {
 public:
  BandSystem(Eigen::Index size, Eigen::Index bandwidth) : bands_(Eigen::MatrixXd::Zero(bandwidth + 1, size)) {}

  Eigen::Index size() const { return bands_.cols(); }
  Eigen::Index bandwidth() const { return bands_.rows() - 1; }
  /// i >= j >= i - bandwidth.
  double& at(Eigen::Index i, Eigen::Index j) { return bands_(i - j, j); }

  /// Puts x with A x = b in place of b (one right side a column); A is replaced by its factor.
  /// @throws DataError when A is not positive definite.
  void solve(Eigen::Ref<Eigen::MatrixXd> b) {
    const Eigen::Index n = size();
    const Eigen::Index w = bandwidth();
    for (Eigen::Index j = 0; j < n; ++j) {  // A = L L^T, column by column
      if (!(bands_(0, j) > 0)) throw DataError("the samples do not determine the spline");
      const double root = std::sqrt(bands_(0, j));
      const Eigen::Index below = std::min(w, n - 1 - j);
      bands_.col(j).head(below + 1) /= root;
      for (Eigen::Index k = 1; k <= below; ++k) {
        bands_.col(j + k).head(below - k + 1) -= bands_(k, j) * bands_.col(j).segment(k, below - k + 1);
      }
    }
    for (Eigen::Index j = 0; j < n; ++j) {
      b.row(j) /= bands_(0, j);
      for (Eigen::Index k = 1; k <= std::min(w, n - 1 - j); ++k) b.row(j + k) -= bands_(k, j) * b.row(j);
    }
    for (Eigen::Index j = n; j-- > 0;) {
      for (Eigen::Index k = 1; k <= std::min(w, n - 1 - j); ++k) b.row(j) -= bands_(k, j) * b.row(j + k);
      b.row(j) /= bands_(0, j);
    }
  }

 private:
  Eigen::MatrixXd bands_;
};

}  // namespace loc::calib
