#include "libloc/calib/chain_system.hpp"

#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/filter/blas.hpp"

namespace loc::calib {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// L x = b for all columns, in place; L the lower triangle of a factor's upper left part.
template <class Factor>
void solve_lower(const Factor& factor, Index size, Eigen::Ref<MatrixXd> b) {
  factor.topLeftCorner(size, size).template triangularView<Eigen::Lower>().solveInPlace(b);
}

template <class Factor>
void solve_lower_transposed(const Factor& factor, Index size, Eigen::Ref<VectorXd> b) {
  factor.topLeftCorner(size, size).transpose().template triangularView<Eigen::Upper>().solveInPlace(b);
}

int size_of(Index n) {
  return static_cast<int>(n);
}

}  // namespace

ChainSystem::ChainSystem(ChainLayout layout) : layout_(std::move(layout)) {
  require(layout_.windows() > 0, "windows", 0, "must be positive");
  require(layout_.node >= 0 && layout_.shared >= 0, "node, shared: must not be negative");
  const auto windows = static_cast<std::size_t>(layout_.windows());
  for (std::size_t w = 0; w < windows; ++w) {
    require(layout_.inner[w] >= 0, "inner", layout_.inner[w], "must not be negative");
    const int n = layout_.local_size(static_cast<int>(w));
    matrices_.emplace_back(MatrixXd::Zero(n, n));
    gradients_.emplace_back(VectorXd::Zero(n));
  }
  factors_.resize(windows);
  node_factors_.resize(windows + 1);
  node_couplings_.resize(windows + 1);
}

void ChainSystem::clear() {
  for (MatrixXd& m : matrices_) m.setZero();
  for (VectorXd& g : gradients_) g.setZero();
}

void ChainSystem::eliminate_inner(double damping) {
  inner_positive_ = true;
  for (std::size_t w = 0; w < factors_.size(); ++w) {
    MatrixXd& F = factors_[w];
    F = matrices_[w];
    F.diagonal() *= 1 + damping;
    const int n = size_of(F.rows());
    const int inner = layout_.inner[w];
    if (inner == 0) continue;
    if (!blas::cholesky_lower(inner, F.data(), n)) {
      inner_positive_ = false;
      return;
    }
    blas::solve_right_lower_transposed(n - inner, inner, F.data(), n, F.data() + inner, n);
    blas::syrk_lower(n - inner, inner, -1, F.data() + inner, n,
                     F.data() + inner + static_cast<std::ptrdiff_t>(inner) * n, n);
  }
}

bool ChainSystem::eliminate_nodes() {
  const Index k = layout_.node;
  const Index m = layout_.shared;
  MatrixXd shared = MatrixXd::Zero(m, m);
  // Of the node that is next: its own block, and the shared unknowns' rows.
  MatrixXd block = MatrixXd::Zero(k, k);
  MatrixXd border = MatrixXd::Zero(m, k);
  for (std::size_t w = 0; w <= factors_.size(); ++w) {
    MatrixXd& L = node_factors_[w];
    MatrixXd& C = node_couplings_[w];
    L = block;
    C = MatrixXd::Zero(k + m, k);
    C.bottomRows(m) = border;
    block.setZero();
    border.setZero();
    if (w < factors_.size()) {
      const auto rest = factors_[w].bottomRightCorner(2 * k + m, 2 * k + m);
      L += rest.topLeftCorner(k, k);
      C.topRows(k) = rest.block(k, 0, k, k);
      C.bottomRows(m) += rest.block(2 * k, 0, m, k);
      block = rest.block(k, k, k, k);
      border = rest.block(2 * k, k, m, k);
      shared += rest.bottomRightCorner(m, m);
    }
    if (k == 0) continue;
    if (!blas::cholesky_lower(size_of(k), L.data(), size_of(k))) return false;
    blas::solve_right_lower_transposed(size_of(k + m), size_of(k), L.data(), size_of(k), C.data(), size_of(k + m));
    block.noalias() -= C.topRows(k) * C.topRows(k).transpose();
    border.noalias() -= C.bottomRows(m) * C.topRows(k).transpose();
    shared.noalias() -= C.bottomRows(m) * C.bottomRows(m).transpose();
  }
  shared_ = shared.selfadjointView<Eigen::Lower>();
  return true;
}

bool ChainSystem::reduce(double damping) {
  solved_ = false;
  eliminate_inner(damping);
  reduced_ = inner_positive_ && eliminate_nodes();
  return reduced_;
}

bool ChainSystem::reduce() {
  return reduce(0);
}

bool ChainSystem::solve(double damping, ChainStep& step) {
  if (!reduce(damping)) return false;
  const Index k = layout_.node;
  const Index m = layout_.shared;
  shared_factor_ = shared_;
  if (m > 0 && !blas::cholesky_lower(size_of(m), shared_factor_.data(), size_of(m))) return false;
  solved_ = true;
  const std::size_t windows = factors_.size();
  // Forwards: L y = -g.
  ChainStep x;
  x.inner.resize(windows);
  x.node.assign(windows + 1, VectorXd::Zero(k));
  x.shared = VectorXd::Zero(m);
  for (std::size_t w = 0; w < windows; ++w) {
    const Index inner = layout_.inner[w];
    x.inner[w] = -gradients_[w].head(inner);
    solve_lower(factors_[w], inner, x.inner[w]);
    const VectorXd rest = -gradients_[w].tail(2 * k + m) - factors_[w].bottomLeftCorner(2 * k + m, inner) * x.inner[w];
    x.node[w] += rest.head(k);
    x.node[w + 1] += rest.segment(k, k);
    x.shared += rest.tail(m);
  }
  for (std::size_t w = 0; w <= windows; ++w) {
    solve_lower(node_factors_[w], k, x.node[w]);
    if (w < windows) x.node[w + 1].noalias() -= node_couplings_[w].topRows(k) * x.node[w];
    x.shared.noalias() -= node_couplings_[w].bottomRows(m) * x.node[w];
  }
  solve_lower(shared_factor_, m, x.shared);
  // Backwards: L^T x = y.
  solve_lower_transposed(shared_factor_, m, x.shared);
  for (std::size_t w = windows + 1; w-- > 0;) {
    if (w < windows) x.node[w].noalias() -= node_couplings_[w].topRows(k).transpose() * x.node[w + 1];
    x.node[w].noalias() -= node_couplings_[w].bottomRows(m).transpose() * x.shared;
    solve_lower_transposed(node_factors_[w], k, x.node[w]);
  }
  for (std::size_t w = 0; w < windows; ++w) {
    const Index inner = layout_.inner[w];
    VectorXd rest(2 * k + m);
    rest << x.node[w], x.node[w + 1], x.shared;
    x.inner[w].noalias() -= factors_[w].bottomLeftCorner(2 * k + m, inner).transpose() * rest;
    solve_lower_transposed(factors_[w], inner, x.inner[w]);
  }
  step = std::move(x);
  return true;
}

double ChainSystem::slope(const ChainStep& step) const {
  const Index k = layout_.node;
  double sum = 0;
  for (std::size_t w = 0; w < gradients_.size(); ++w) {
    const VectorXd& g = gradients_[w];
    const Index inner = layout_.inner[w];
    sum += g.head(inner).dot(step.inner[w]) + g.segment(inner, k).dot(step.node[w]) +
           g.segment(inner + k, k).dot(step.node[w + 1]) + g.tail(layout_.shared).dot(step.shared);
  }
  return sum;
}

double ChainSystem::damped_square(const ChainStep& step) const {
  const Index k = layout_.node;
  double sum = 0;
  for (std::size_t w = 0; w < matrices_.size(); ++w) {
    const VectorXd d = matrices_[w].diagonal();
    const Index inner = layout_.inner[w];
    sum += d.head(inner).dot(step.inner[w].cwiseAbs2()) + d.segment(inner, k).dot(step.node[w].cwiseAbs2()) +
           d.segment(inner + k, k).dot(step.node[w + 1].cwiseAbs2()) +
           d.tail(layout_.shared).dot(step.shared.cwiseAbs2());
  }
  return sum;
}

MatrixXd ChainSystem::shared_covariance() const {
  require(solved_, "shared_covariance: the last solve() must have found a solution");
  MatrixXd inverse = MatrixXd::Identity(layout_.shared, layout_.shared);
  solve_lower(shared_factor_, layout_.shared, inverse);
  return inverse.transpose() * inverse;
}

MatrixXd ChainSystem::shared_pulls(const std::vector<int>& group, int groups) const {
  require(reduced_, "shared_pulls: the last reduce() or solve() must have succeeded");
  const std::size_t windows = factors_.size();
  require(group.size() == windows, "group", static_cast<double>(group.size()), "must have one number a window");
  const Index k = layout_.node;
  const Index m = layout_.shared;
  std::vector<MatrixXd> node(windows + 1, MatrixXd::Zero(k, groups));
  MatrixXd shared = MatrixXd::Zero(m, groups);
  for (std::size_t w = 0; w < windows; ++w) {
    require(group[w] >= 0 && group[w] < groups, "group", group[w], "must be one of the groups");
    const Index inner = layout_.inner[w];
    VectorXd own = gradients_[w].head(inner);
    solve_lower(factors_[w], inner, own);
    const VectorXd rest = gradients_[w].tail(2 * k + m) - factors_[w].bottomLeftCorner(2 * k + m, inner) * own;
    node[w].col(group[w]) += rest.head(k);
    node[w + 1].col(group[w]) += rest.segment(k, k);
    shared.col(group[w]) += rest.tail(m);
  }
  for (std::size_t w = 0; w <= windows; ++w) {
    solve_lower(node_factors_[w], k, node[w]);
    if (w < windows) node[w + 1].noalias() -= node_couplings_[w].topRows(k) * node[w];
    shared.noalias() -= node_couplings_[w].bottomRows(m) * node[w];
  }
  return shared;
}

}  // namespace loc::calib
