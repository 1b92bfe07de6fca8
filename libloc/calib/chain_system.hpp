// Normal equations of a long recording cut into windows: each window has unknowns of its own, shares a node of unknowns
// with the window before and one with the window behind, and all have a few in common.
//
//        node 0 ─ inner 0 ─ node 1 ─ inner 1 ─ node 2 …          and the shared ones with all of them
//
// Eliminated in that order (inner, then nodes along the chain), the cost grows with the number of windows, and the
// covariance of the shared unknowns comes with it. It is the sparse Cholesky factorisation with the order that a
// trajectory asks for, made of dense blocks (Bunch, Rose (editors), "Sparse matrix computations", 1976: one-way
// dissection).
//
// Local order of the unknowns in window w: inner w, node w, node w + 1, shared.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace loc::calib {

struct ChainLayout {
  std::vector<int> inner;  ///< unknowns that only this window has, for each window
  int node = 0;            ///< unknowns of each of the nodes
  int shared = 0;          ///< unknowns that all have

  int windows() const { return static_cast<int>(inner.size()); }
  int local_size(int window) const { return inner[static_cast<std::size_t>(window)] + 2 * node + shared; }
};

/// A change of the unknowns.
struct ChainStep {
  std::vector<Eigen::VectorXd> inner;  ///< for each window
  std::vector<Eigen::VectorXd> node;   ///< one more than windows
  Eigen::VectorXd shared;
};

class ChainSystem {
 public:
  /// @throws std::invalid_argument for no windows, or sizes that are negative.
  explicit ChainSystem(ChainLayout layout);

  const ChainLayout& layout() const { return layout_; }
  /// To zero.
  void clear();
  /// Lower triangle of H = J^T J and g = J^T r of a window, to be summed up. Different windows may be filled by
  /// different threads. @{
  Eigen::MatrixXd& matrix(int window) { return matrices_[static_cast<std::size_t>(window)]; }
  Eigen::VectorXd& gradient(int window) { return gradients_[static_cast<std::size_t>(window)]; }
  /// @}

  /// Eliminates all but the shared unknowns from H. @returns false when what is eliminated is not positive definite.
  bool reduce();
  /// What is left of H for the shared unknowns: their information. Of the last reduce() or solve().
  const Eigen::MatrixXd& shared_information() const { return shared_; }

  /// Solves (H + damping diag(H)) x = -g. @returns false when the matrix is not positive definite; step is left as it
  /// is.
  bool solve(double damping, ChainStep& step);
  /// g^T x and x^T diag(H) x of a step: for the gain ratio. @{
  double slope(const ChainStep& step) const;
  double damped_square(const ChainStep& step) const;
  /// @}

  /// Inverse of shared_information(): the covariance of the shared unknowns, in units of the residuals' variance.
  /// @throws std::invalid_argument unless the last solve() found a solution.
  Eigen::MatrixXd shared_covariance() const;
  /// What each group of windows alone adds to the gradient of the shared unknowns when the others are eliminated, one
  /// column a group. Of the last reduce() or solve(). @param group of each window, in [0, groups)
  /// @throws std::invalid_argument unless that succeeded, and for groups that cannot be.
  Eigen::MatrixXd shared_pulls(const std::vector<int>& group, int groups) const;

 private:
  bool reduce(double damping);
  void eliminate_inner(double damping);
  bool eliminate_nodes();

  ChainLayout layout_;
  std::vector<Eigen::MatrixXd> matrices_;
  std::vector<Eigen::VectorXd> gradients_;
  // Factors. In each window's: L of the inner ones, below it what couples the others to them; the rest is what remains.
  std::vector<Eigen::MatrixXd> factors_;
  bool inner_positive_ = false;
  bool reduced_ = false;
  bool solved_ = false;
  std::vector<Eigen::MatrixXd> node_factors_;    // L of each node
  std::vector<Eigen::MatrixXd> node_couplings_;  // of the next node and the shared ones to it: (node + shared) x node
  Eigen::MatrixXd shared_;
  Eigen::MatrixXd shared_factor_;
};

}  // namespace loc::calib
