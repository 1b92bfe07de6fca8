#include "libloc/filter/large_covariance.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "libloc/core/check.hpp"
#include "libloc/filter/blas.hpp"

namespace loc {
namespace {

using blas::Transpose;

// Columns begin at multiples of a cache line, and not at multiples of a page, where they would fight for one set.
int leading_dimension(int capacity) {
  const int rounded = (capacity + 7) / 8 * 8;
  return rounded % 128 == 0 ? rounded + 8 : rounded;
}

std::size_t size(int rows, int columns) {
  return static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
}

}  // namespace

template <class Scalar>
LargeCovariance<Scalar>::LargeCovariance(int head_dim, int capacity, int max_rows)
    : head_(head_dim), capacity_(capacity), max_rows_(max_rows), leading_(leading_dimension(std::max(capacity, 1))) {
  require(head_dim >= 1 && head_dim <= kMaxHeadDim, "head_dim must be in [1, 32], got " + std::to_string(head_dim));
  require(capacity >= head_dim,
          "capacity must be at least the head's " + std::to_string(head_dim) + ", got " + std::to_string(capacity));
  require(max_rows >= kMaxRows, "max_rows must be at least 6, got " + std::to_string(max_rows));
  p_.resize(size(leading_, capacity_));
  pht_.resize(size(leading_, max_rows_));
  gain_.resize(size(leading_, max_rows_));
  s_.resize(size(max_rows_, max_rows_));
  chol_.resize(size(max_rows_, max_rows_));
  h_.resize(size(kMaxHeadDim, max_rows_));
  work_.resize(size(leading_ + max_rows_, 2 * kMaxHeadDim));
}

template <class Scalar>
void LargeCovariance<Scalar>::mirror_head() {
  for (int j = 0; j < head_; ++j) {
    for (int i = j + 1; i < head_; ++i) p_[index(j, i)] = p_[index(i, j)];
  }
}

template <class Scalar>
void LargeCovariance<Scalar>::reset(const Eigen::MatrixXd& covariance) {
  require(covariance.rows() == head_ && covariance.cols() == head_, "covariance must be as large as the head");
  set_dense(covariance);
}

template <class Scalar>
Eigen::MatrixXd LargeCovariance<Scalar>::dense() const {
  Eigen::MatrixXd out(dim_, dim_);
  read(0, 0, out);
  return out;
}

template <class Scalar>
void LargeCovariance<Scalar>::set_dense(const Eigen::MatrixXd& covariance) {
  require(covariance.rows() == covariance.cols() && covariance.rows() >= head_ && covariance.rows() <= capacity_,
          "covariance must be square, and between the head and the capacity large");
  dim_ = static_cast<int>(covariance.rows());
  for (int j = 0; j < dim_; ++j) {
    for (int i = j; i < dim_; ++i) p_[index(i, j)] = static_cast<Scalar>(covariance(i, j));
  }
  mirror_head();
}

template <class Scalar>
void LargeCovariance<Scalar>::propagate(const Eigen::MatrixXd& f, const Eigen::MatrixXd& q) {
  Scalar* const factor = work_.data() + size(leading_, kMaxHeadDim);
  for (int j = 0; j < head_; ++j) {
    for (int i = 0; i < head_; ++i) factor[size(head_, j) + static_cast<std::size_t>(i)] = static_cast<Scalar>(f(i, j));
  }
  // Columns of the head, all rows: X = P(:, head) F^T.
  blas::gemm(Transpose::kNo, Transpose::kYes, dim_, head_, head_, Scalar(1), p_.data(), leading_, factor, head_,
             Scalar(0), work_.data(), leading_);
  blas::gemm(Transpose::kNo, Transpose::kNo, head_, head_, head_, Scalar(1), factor, head_, work_.data(), leading_,
             Scalar(0), p_.data(), leading_);
  for (int j = 0; j < head_; ++j) {
    std::copy_n(work_.data() + index(head_, j), dim_ - head_, p_.data() + index(head_, j));
    for (int i = j; i < head_; ++i) p_[index(i, j)] += static_cast<Scalar>(q(i, j));
  }
  mirror_head();
}

template <class Scalar>
int LargeCovariance<Scalar>::append(const Eigen::Ref<const Eigen::MatrixXd>& jacobian,
                                    const Eigen::Ref<const Eigen::MatrixXd>& noise_cov) {
  const int rows = static_cast<int>(jacobian.rows());
  if (dim_ + rows > capacity_) {
    throw std::length_error("the covariance is full: " + std::to_string(capacity_) + " errors");
  }
  const int first = dim_;
  Scalar* const j_new = work_.data();
  for (int j = 0; j < head_; ++j) {
    for (int i = 0; i < rows; ++i)
      j_new[size(rows, j) + static_cast<std::size_t>(i)] = static_cast<Scalar>(jacobian(i, j));
  }
  // Rows of the new block: J P(head, :).
  blas::gemm(Transpose::kNo, Transpose::kYes, rows, dim_, head_, Scalar(1), j_new, rows, p_.data(), leading_, Scalar(0),
             p_.data() + index(first, 0), leading_);
  blas::gemm(Transpose::kNo, Transpose::kYes, rows, rows, head_, Scalar(1), p_.data() + index(first, 0), leading_,
             j_new, rows, Scalar(0), p_.data() + index(first, first), leading_);
  for (int j = 0; j < rows; ++j) {
    for (int i = j; i < rows; ++i) p_[index(first + i, first + j)] += static_cast<Scalar>(noise_cov(i, j));
  }
  dim_ += rows;
  return first;
}

template <class Scalar>
void LargeCovariance<Scalar>::replace(int first, const Eigen::Ref<const Eigen::MatrixXd>& jacobian) {
  const int rows = static_cast<int>(jacobian.rows());
  const int columns = static_cast<int>(jacobian.cols());
  Eigen::Matrix<double, kMaxBlockDim, kMaxBlockDim> own;
  Eigen::Matrix<double, kMaxBlockDim, 1> before;
  for (int j = 0; j < columns; ++j) {
    for (int i = 0; i < columns; ++i) own(i, j) = (*this)(first + i, first + j);
  }
  const Eigen::Matrix<double, kMaxBlockDim, kMaxBlockDim> j_full = [&] {
    Eigen::Matrix<double, kMaxBlockDim, kMaxBlockDim> out = Eigen::Matrix<double, kMaxBlockDim, kMaxBlockDim>::Zero();
    out.topLeftCorner(rows, columns) = jacobian;
    return out;
  }();
  for (int other = 0; other < dim_; ++other) {
    if (other >= first && other < first + columns) continue;
    before.setZero();
    for (int i = 0; i < columns; ++i) before[i] = (*this)(first + i, other);
    const Eigen::Matrix<double, kMaxBlockDim, 1> after = j_full.lazyProduct(before);
    for (int i = 0; i < rows; ++i) {
      p_[other < first ? index(first + i, other) : index(other, first + i)] = static_cast<Scalar>(after[i]);
    }
  }
  for (int j = 0; j < rows; ++j) {
    for (int i = j; i < rows; ++i) {
      double sum = 0;
      for (int a = 0; a < columns; ++a) {
        for (int b = 0; b < columns; ++b) sum += jacobian(i, a) * own(a, b) * jacobian(j, b);
      }
      p_[index(first + i, first + j)] = static_cast<Scalar>(sum);
    }
  }
}

template <class Scalar>
void LargeCovariance<Scalar>::remove(std::span<const CovarianceRange> ranges) {
  if (ranges.empty()) return;
  int to = ranges.front().first;
  // Pieces that stay, each moved to where the ones before it end: column by column, its rows piece by piece.
  const auto for_each_piece = [&](auto&& move) {
    int target = to;
    for (std::size_t k = 0; k < ranges.size(); ++k) {
      const int begin = ranges[k].first + ranges[k].count;
      const int end = k + 1 < ranges.size() ? ranges[k + 1].first : dim_;
      move(begin, end, target);
      target += end - begin;
    }
    return target;
  };
  const auto move_rows = [&](int from_column, int to_column) {
    for_each_piece([&](int begin, int end, int target) {
      const Scalar* const source = p_.data() + index(begin, from_column);
      if (end > begin) std::copy(source, source + (end - begin), p_.data() + index(target, to_column));
    });
  };
  for (int column = 0; column < to; ++column) move_rows(column, column);
  const int dim = for_each_piece([&](int begin, int end, int target) {
    for (int column = begin; column < end; ++column) {
      // Above the diagonal there is nothing of use; what moves along does no harm.
      move_rows(column, target + column - begin);
    }
  });
  dim_ = dim;
}

template <class Scalar>
Eigen::Matrix<double, kMaxRows, kMaxRows> LargeCovariance<Scalar>::innovation_cov(
    const BlockMeasurement& measurement) const {
  const int rows = measurement.rows;
  const int width = measurement.block < 0 ? 0 : measurement.block_dim;
  Eigen::Matrix<double, kMaxRows, kMaxHeadDim> head = Eigen::Matrix<double, kMaxRows, kMaxHeadDim>::Zero();
  Eigen::Matrix<double, kMaxRows, kMaxBlockDim> block = Eigen::Matrix<double, kMaxRows, kMaxBlockDim>::Zero();
  // H P, by the columns of the head and of the block.
  for (int j = 0; j < head_; ++j) {
    for (int k = 0; k < head_; ++k) {
      const auto p = static_cast<double>(p_[index(k, j)]);
      for (int i = 0; i < rows; ++i) head(i, j) += measurement.head(i, k) * p;
    }
    for (int k = 0; k < width; ++k) {
      const auto p = static_cast<double>(p_[index(measurement.block + k, j)]);
      for (int i = 0; i < rows; ++i) {
        head(i, j) += measurement.block_jacobian(i, k) * p;
        block(i, k) += measurement.head(i, j) * p;
      }
    }
  }
  for (int j = 0; j < width; ++j) {
    for (int k = 0; k < width; ++k) {
      const double p = (*this)(measurement.block + k, measurement.block + j);
      for (int i = 0; i < rows; ++i) block(i, j) += measurement.block_jacobian(i, k) * p;
    }
  }
  Eigen::Matrix<double, kMaxRows, kMaxRows> s = Eigen::Matrix<double, kMaxRows, kMaxRows>::Zero();
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = measurement.noise_cov(i, j);
      for (int k = 0; k < head_; ++k) sum += head(i, k) * measurement.head(j, k);
      for (int k = 0; k < width; ++k) sum += block(i, k) * measurement.block_jacobian(j, k);
      s(i, j) = s(j, i) = sum;
    }
  }
  return s;
}

template <class Scalar>
void LargeCovariance<Scalar>::innovate(std::span<const BlockMeasurement> measurements, std::span<const int> which) {
  rows_ = 0;
  for (const int m : which) {
    const BlockMeasurement& measurement = measurements[static_cast<std::size_t>(m)];
    if (rows_ + measurement.rows > max_rows_) {
      throw std::length_error("more than " + std::to_string(max_rows_) + " numbers in one update");
    }
    for (int i = 0; i < measurement.rows; ++i) {
      Scalar* const h = h_.data() + size(kMaxHeadDim, rows_ + i);
      for (int k = 0; k < head_; ++k) h[k] = static_cast<Scalar>(measurement.head(i, k));
    }
    rows_ += measurement.rows;
  }
  if (rows_ == 0) return;
  // PHt: the columns of the head for all measurements at once, then each one's own block.
  blas::gemm(Transpose::kNo, Transpose::kNo, dim_, rows_, head_, Scalar(1), p_.data(), leading_, h_.data(), kMaxHeadDim,
             Scalar(0), pht_.data(), leading_);
  Scalar block[kMaxRows * kMaxBlockDim];  // block_jacobian^T
  Scalar own[kMaxBlockDim * kMaxBlockDim];
  int column = 0;
  for (const int m : which) {
    const BlockMeasurement& measurement = measurements[static_cast<std::size_t>(m)];
    const int first = measurement.block;
    const int width = measurement.block_dim;
    if (first >= 0) {
      for (int i = 0; i < measurement.rows; ++i) {
        for (int k = 0; k < width; ++k)
          block[i * kMaxBlockDim + k] = static_cast<Scalar>(measurement.block_jacobian(i, k));
      }
      for (int j = 0; j < width; ++j) {
        for (int k = 0; k < width; ++k)
          own[j * kMaxBlockDim + k] = p_[index(first + std::max(j, k), first + std::min(j, k))];
      }
      Scalar* const out = pht_.data() + index(0, column);
      blas::gemm(Transpose::kYes, Transpose::kNo, first, measurement.rows, width, Scalar(1),
                 p_.data() + index(first, 0), leading_, block, kMaxBlockDim, Scalar(1), out, leading_);
      blas::gemm(Transpose::kNo, Transpose::kNo, width, measurement.rows, width, Scalar(1), own, kMaxBlockDim, block,
                 kMaxBlockDim, Scalar(1), out + first, leading_);
      const int below = dim_ - first - width;
      if (below > 0) {
        blas::gemm(Transpose::kNo, Transpose::kNo, below, measurement.rows, width, Scalar(1),
                   p_.data() + index(first + width, first), leading_, block, kMaxBlockDim, Scalar(1),
                   out + first + width, leading_);
      }
    }
    column += measurement.rows;
  }
  // S = H PHt + R, both triangles.
  blas::gemm(Transpose::kYes, Transpose::kNo, rows_, rows_, head_, Scalar(1), h_.data(), kMaxHeadDim, pht_.data(),
             leading_, Scalar(0), s_.data(), max_rows_);
  int row = 0;
  for (const int m : which) {
    const BlockMeasurement& measurement = measurements[static_cast<std::size_t>(m)];
    if (measurement.block >= 0) {
      for (int i = 0; i < measurement.rows; ++i) {
        for (int k = 0; k < measurement.block_dim; ++k) {
          block[i * kMaxBlockDim + k] = static_cast<Scalar>(measurement.block_jacobian(i, k));
        }
      }
      blas::gemm(Transpose::kYes, Transpose::kNo, measurement.rows, rows_, measurement.block_dim, Scalar(1), block,
                 kMaxBlockDim, pht_.data() + measurement.block, leading_, Scalar(1), s_.data() + row, max_rows_);
    }
    for (int i = 0; i < measurement.rows; ++i) {
      for (int j = 0; j < measurement.rows; ++j) {
        s_[size(max_rows_, row + j) + static_cast<std::size_t>(row + i)] +=
            static_cast<Scalar>(measurement.noise_cov(i, j));
      }
    }
    row += measurement.rows;
  }
}

// Cholesky factor of the accepted rows of S.
template <class Scalar>
bool LargeCovariance<Scalar>::factorise(std::span<const int> accepted) {
  const int m = static_cast<int>(accepted.size());
  for (int j = 0; j < m; ++j) {
    const int from = accepted[static_cast<std::size_t>(j)];
    for (int i = j; i < m; ++i) {
      chol_[size(max_rows_, j) + static_cast<std::size_t>(i)] =
          s_[size(max_rows_, from) + static_cast<std::size_t>(accepted[static_cast<std::size_t>(i)])];
    }
  }
  return blas::cholesky_lower(m, chol_.data(), max_rows_);
}

template <class Scalar>
bool LargeCovariance<Scalar>::correction(std::span<const int> accepted, std::span<const double> residual,
                                         Eigen::VectorXd& dx) {
  const int m = static_cast<int>(accepted.size());
  dx.setZero(dim_);
  if (m == 0) return true;
  if (!factorise(accepted)) return false;
  const auto l = [&](int i, int k) { return chol_[size(max_rows_, k) + static_cast<std::size_t>(i)]; };
  // L L^T y = r, scattered to all rows of PHt.
  Scalar* const y = work_.data();
  Scalar* const all = work_.data() + size(leading_, kMaxHeadDim);
  for (int i = 0; i < m; ++i) {
    auto sum = static_cast<Scalar>(residual[static_cast<std::size_t>(i)]);
    for (int k = 0; k < i; ++k) sum -= l(i, k) * y[k];
    y[i] = sum / l(i, i);
  }
  std::fill_n(all, rows_, Scalar(0));
  for (int i = m - 1; i >= 0; --i) {
    for (int k = i + 1; k < m; ++k) y[i] -= l(k, i) * y[k];
    y[i] /= l(i, i);
    all[accepted[static_cast<std::size_t>(i)]] = y[i];
  }
  Scalar* const out = all + rows_;
  blas::gemm(Transpose::kNo, Transpose::kNo, dim_, 1, rows_, Scalar(1), pht_.data(), leading_, all, rows_, Scalar(0),
             out, leading_);
  for (int i = 0; i < dim_; ++i) dx[i] = static_cast<double>(out[i]);
  return true;
}

template <class Scalar>
bool LargeCovariance<Scalar>::update(std::span<const int> accepted, std::span<const double> residual,
                                     Eigen::VectorXd& dx, double& nis, int from) {
  const int m = static_cast<int>(accepted.size());
  dx.setZero(dim_);
  nis = 0;
  if (m == 0) return true;
  if (!factorise(accepted)) return false;
  for (int j = 0; j < m; ++j) {
    std::copy_n(pht_.data() + index(0, accepted[static_cast<std::size_t>(j)]), dim_, gain_.data() + index(0, j));
  }
  blas::solve_right_lower_transposed(dim_, m, chol_.data(), max_rows_, gain_.data(), leading_);
  // y = L^-1 r
  Scalar* const y = work_.data();
  for (int i = 0; i < m; ++i) {
    auto sum = static_cast<Scalar>(residual[static_cast<std::size_t>(i)]);
    for (int k = 0; k < i; ++k) sum -= chol_[size(max_rows_, k) + static_cast<std::size_t>(i)] * y[k];
    y[i] = sum / chol_[size(max_rows_, i) + static_cast<std::size_t>(i)];
    nis += static_cast<double>(y[i]) * static_cast<double>(y[i]);
  }
  Scalar* const change = work_.data() + size(leading_, kMaxHeadDim);
  blas::gemm(Transpose::kNo, Transpose::kNo, dim_, 1, m, Scalar(1), gain_.data(), leading_, y, m, Scalar(0), change,
             leading_);
  for (int i = from; i < dim_; ++i) dx[i] = static_cast<double>(change[i]);
  if (!std::isfinite(nis) || !dx.allFinite()) return false;
  if (from > 0) {
    blas::gemm(Transpose::kNo, Transpose::kYes, dim_ - from, from, m, Scalar(-1), gain_.data() + from, leading_,
               gain_.data(), leading_, Scalar(1), p_.data() + index(from, 0), leading_);
  }
  blas::syrk_lower(dim_ - from, m, Scalar(-1), gain_.data() + from, leading_, p_.data() + index(from, from), leading_);
  if constexpr (sizeof(Scalar) == sizeof(float)) {
    // What rounding takes from the smallest of many variances is more than its share: a millionth each time makes up.
    for (int i = from; i < dim_; ++i) p_[index(i, i)] *= Scalar(1 + 1e-6);
  }
  mirror_head();
  return true;
}

template <class Scalar>
void LargeCovariance<Scalar>::shear(int first, const Eigen::MatrixX3d& u) {
  // P + U A^T + A U^T with A = P(:, three) + U P(three, three) / 2
  Scalar* const a = work_.data();
  Scalar* const b = work_.data() + size(leading_, kMaxHeadDim);
  Eigen::Matrix3d own;
  read(first, first, own);
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < dim_; ++i) {
      const double half = 0.5 * (u(i, 0) * own(0, k) + u(i, 1) * own(1, k) + u(i, 2) * own(2, k));
      a[index(i, k)] = static_cast<Scalar>((*this)(i, first + k) + half);
      b[index(i, k)] = static_cast<Scalar>(u(i, k));
    }
  }
  blas::syr2k_lower(dim_, 3, Scalar(1), a, leading_, b, leading_, p_.data(), leading_);
  mirror_head();
}

template <class Scalar>
void LargeCovariance<Scalar>::inflate(int first, int count, double variance) {
  for (int i = first; i < first + count; ++i) p_[index(i, i)] += static_cast<Scalar>(variance);
}

template class LargeCovariance<double>;
template class LargeCovariance<float>;

}  // namespace loc
