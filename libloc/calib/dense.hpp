// Algorithms on small dense matrices for the calibrations, compiled once: each of them takes the compiler seconds, and
// once more for every pair of sizes that it is given. Where sizes are known and time counts, Eigen is used directly.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace loc::dense {

struct SymmetricEigen {
  Eigen::VectorXd values;   ///< ascending
  Eigen::MatrixXd vectors;  ///< columns, of length 1
};

/// Of a symmetric matrix, whose lower triangle is read.
SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& a);
/// Its eigenvalues alone, ascending.
Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& a);
/// a v = lambda b v with v^T b v = 1; a symmetric, b symmetric and positive definite. nullopt when it does not
/// converge.
std::optional<SymmetricEigen> generalised_eigen(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// a^-1 b by Cholesky with pivots; a symmetric (definite or nearly so).
Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
/// The same, and nullopt when the least pivot is not above this share of the largest one.
std::optional<Eigen::MatrixXd> solve_definite(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, double least_pivot);
/// Least squares of a x = b by QR with column pivots.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
/// L of a = L L^T; nullopt when a is not positive definite.
std::optional<Eigen::MatrixXd> cholesky(const Eigen::MatrixXd& a);
/// L^-1 b.
Eigen::MatrixXd solve_lower(const Eigen::MatrixXd& l, const Eigen::MatrixXd& b);
/// Singular values, descending.
Eigen::VectorXd singular_values(const Eigen::MatrixXd& a);
/// The orthogonal matrix that is nearest to m (Frobenius); its determinant has the sign of that of m.
Eigen::Matrix3d nearest_orthogonal(const Eigen::Matrix3d& m);

/// a b
Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
/// a^T a
Eigen::MatrixXd gram(const Eigen::MatrixXd& a);
/// b m b^T: a covariance m after the linear map b.
Eigen::MatrixXd propagate(const Eigen::MatrixXd& b, const Eigen::MatrixXd& m);
/// vectors diag(values) vectors^T
Eigen::MatrixXd compose(const Eigen::MatrixXd& vectors, const Eigen::VectorXd& values);

}  // namespace loc::dense
