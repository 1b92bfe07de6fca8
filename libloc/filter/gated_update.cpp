#include "libloc/filter/gated_update.hpp"

#include <Eigen/Cholesky>
#include <cassert>

namespace loc {
namespace {

// The usual sizes are known to the compiler, which makes them several times faster; the others are Eigen::Dynamic.
template <int kRows>
constexpr int max_rows() {
  return kRows == Eigen::Dynamic ? kMaxFilterDim : kRows;
}
template <int kDim>
constexpr int max_dim() {
  return kDim == Eigen::Dynamic ? kMaxUpdateDim : kDim;
}

template <int kRows, int kDim>
struct Sizes {
  using Tall = Eigen::Matrix<double, kRows, kDim, 0, max_rows<kRows>(), max_dim<kDim>()>;
  using Square = Eigen::Matrix<double, kRows, kRows, 0, max_rows<kRows>(), max_rows<kRows>()>;
  using Small = Eigen::Matrix<double, kDim, kDim, 0, max_dim<kDim>(), max_dim<kDim>()>;
  using Residual = Eigen::Matrix<double, kDim, 1, 0, max_dim<kDim>(), 1>;
};

template <int kRows, int kDim>
bool innovate_sized(const Eigen::MatrixXd& covariance, const Observation& o, Innovation& innovation) {
  using Size = Sizes<kRows, kDim>;
  const Eigen::Index n = covariance.rows();
  const int dim = o.dim();
  const Eigen::Map<const typename Size::Square> p(covariance.data(), n, n);
  Eigen::Map<typename Size::Tall> pht(innovation.pht.data(), n, dim);
  Eigen::Map<typename Size::Tall> gain(innovation.gain.data(), n, dim);
  Eigen::Map<typename Size::Small> cov(innovation.cov.data(), dim, dim);

  pht.setZero();
  for (int i = 0; i < o.count(); ++i) {
    const Observation::Entry& e = o.entries()[i];
    pht.col(e.row) += e.value * p.col(e.column);
  }
  cov = o.noise_cov.topLeftCorner(dim, dim);
  for (int i = 0; i < o.count(); ++i) {
    const Observation::Entry& e = o.entries()[i];
    cov.row(e.row) += e.value * pht.row(e.column);
  }
  const Eigen::LLT<typename Size::Small> llt(cov);
  if (llt.info() != Eigen::Success) return false;
  typename Size::Residual whitened = o.residual.head(dim);
  llt.matrixL().solveInPlace(whitened);
  innovation.nis = whitened.squaredNorm();
  gain = pht;
  llt.matrixU().template solveInPlace<Eigen::OnTheRight>(gain);
  llt.matrixL().template solveInPlace<Eigen::OnTheRight>(gain);
  innovation.dim = dim;
  return true;
}

template <int kRows, int kDim>
void update_sized(Eigen::MatrixXd& covariance, const Observation& o, const Innovation& innovation,
                  Eigen::VectorXd& correction) {
  using Size = Sizes<kRows, kDim>;
  const Eigen::Index n = covariance.rows();
  const int dim = o.dim();
  Eigen::Map<typename Size::Square> p(covariance.data(), n, n);
  const Eigen::Map<const typename Size::Tall> pht(innovation.pht.data(), n, dim);
  const Eigen::Map<const typename Size::Tall> gain(innovation.gain.data(), n, dim);

  correction.noalias() = gain.lazyProduct(o.residual.head(dim));
  p.noalias() -= gain.lazyProduct(pht.transpose());  // A = (I - K H) P
  // B = A H^T - K R, so that P = A - B K^T
  typename Size::Tall b(n, dim);
  b.noalias() = -gain.lazyProduct(o.noise_cov.topLeftCorner(dim, dim));
  for (int i = 0; i < o.count(); ++i) {
    const Observation::Entry& e = o.entries()[i];
    b.col(e.row) += e.value * p.col(e.column);
  }
  for (Eigen::Index column = 0; column < n; ++column) {
    const Eigen::Index rest = n - column;
    p.col(column).tail(rest).noalias() -= b.bottomRows(rest).lazyProduct(gain.row(column).transpose());
  }
  p.template triangularView<Eigen::StrictlyUpper>() = p.transpose();
}

template <int kRows>
bool innovate_rows(const Eigen::MatrixXd& covariance, const Observation& o, Innovation& innovation) {
  if (o.dim() == 6) return innovate_sized<kRows, 6>(covariance, o, innovation);
  if (o.dim() == 3) return innovate_sized<kRows, 3>(covariance, o, innovation);
  return innovate_sized<kRows, Eigen::Dynamic>(covariance, o, innovation);
}

template <int kRows>
void update_rows(Eigen::MatrixXd& covariance, const Observation& o, const Innovation& innovation,
                 Eigen::VectorXd& correction) {
  if (o.dim() == 6) {
    update_sized<kRows, 6>(covariance, o, innovation, correction);
  } else if (o.dim() == 3) {
    update_sized<kRows, 3>(covariance, o, innovation, correction);
  } else {
    update_sized<kRows, Eigen::Dynamic>(covariance, o, innovation, correction);
  }
}

}  // namespace

void Observation::begin(int dim) {
  assert(dim >= 1 && dim <= kMaxUpdateDim);
  dim_ = dim;
  count_ = 0;
  noise_cov.setZero();
}

void Observation::add3(int row, int column, const Eigen::Matrix3d& block) {
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) add(row + i, column + j, block(i, j));
  }
}

void Observation::add3(int row, int column, double diagonal) {
  for (int i = 0; i < 3; ++i) add(row + i, column + i, diagonal);
}

bool innovate(const Eigen::MatrixXd& covariance, const Observation& observation, Innovation& innovation) {
  assert(covariance.rows() == covariance.cols() && covariance.rows() <= kMaxFilterDim);
  switch (covariance.rows()) {
    case 15:
      return innovate_rows<15>(covariance, observation, innovation);
    case 16:
      return innovate_rows<16>(covariance, observation, innovation);
    case 19:
      return innovate_rows<19>(covariance, observation, innovation);
    default:
      return innovate_rows<Eigen::Dynamic>(covariance, observation, innovation);
  }
}

void joseph_update(Eigen::MatrixXd& covariance, const Observation& observation, const Innovation& innovation,
                   Eigen::VectorXd& correction) {
  assert(innovation.dim == observation.dim());
  switch (covariance.rows()) {
    case 15:
      return update_rows<15>(covariance, observation, innovation, correction);
    case 16:
      return update_rows<16>(covariance, observation, innovation, correction);
    case 19:
      return update_rows<19>(covariance, observation, innovation, correction);
    default:
      return update_rows<Eigen::Dynamic>(covariance, observation, innovation, correction);
  }
}

}  // namespace loc
