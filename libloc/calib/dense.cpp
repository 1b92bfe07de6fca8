#include "libloc/calib/dense.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace loc::dense {

SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& a) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(a);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& a) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(a, Eigen::EigenvaluesOnly).eigenvalues();
}

std::optional<SymmetricEigen> generalised_eigen(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  // With b = L L^T: the symmetric problem of L^-1 a L^-T, whose vectors are L^T v.
  const Eigen::LLT<Eigen::MatrixXd> llt(b);
  Eigen::MatrixXd reduced = a;
  llt.matrixL().solveInPlace(reduced);
  reduced.transposeInPlace();
  llt.matrixL().solveInPlace(reduced);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(reduced);
  if (llt.info() != Eigen::Success || solver.info() != Eigen::Success) return std::nullopt;
  SymmetricEigen out{solver.eigenvalues(), solver.eigenvectors()};
  llt.matrixU().solveInPlace(out.vectors);
  return out;
}

Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return Eigen::LDLT<Eigen::MatrixXd>(a).solve(b);
}

std::optional<Eigen::MatrixXd> solve_definite(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, double least_pivot) {
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(a);
  const Eigen::VectorXd pivots = ldlt.vectorD();
  if (ldlt.info() != Eigen::Success || !(pivots.minCoeff() > least_pivot * pivots.maxCoeff())) return std::nullopt;
  return ldlt.solve(b);
}

Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  return Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(a).solve(b);
}

std::optional<Eigen::MatrixXd> cholesky(const Eigen::MatrixXd& a) {
  const Eigen::LLT<Eigen::MatrixXd> llt(a);
  if (llt.info() != Eigen::Success) return std::nullopt;
  return Eigen::MatrixXd(llt.matrixL());
}

Eigen::MatrixXd solve_lower(const Eigen::MatrixXd& l, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd x = b;
  l.triangularView<Eigen::Lower>().solveInPlace(x);
  return x;
}

Eigen::VectorXd singular_values(const Eigen::MatrixXd& a) {
  return Eigen::JacobiSVD<Eigen::MatrixXd>(a).singularValues();
}

Eigen::Matrix3d nearest_orthogonal(const Eigen::Matrix3d& m) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a * b;
}

Eigen::MatrixXd gram(const Eigen::MatrixXd& a) {
  return a.transpose() * a;
}

Eigen::MatrixXd propagate(const Eigen::MatrixXd& b, const Eigen::MatrixXd& m) {
  const Eigen::MatrixXd bm = b * m;
  return bm * b.transpose();
}

Eigen::MatrixXd compose(const Eigen::MatrixXd& vectors, const Eigen::VectorXd& values) {
  const Eigen::MatrixXd scaled = vectors * values.asDiagonal();
  return scaled * vectors.transpose();
}

}  // namespace loc::dense
