#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>

#include "libloc/calib/dense.hpp"
#include "libloc/calib/ellipsoid_detail.hpp"

namespace loc::detail {
namespace {

// Exponents of the monomials of a quadric.
constexpr std::array<std::array<int, 3>, 10> kMonomials = {
    {{2, 0, 0}, {0, 2, 0}, {0, 0, 2}, {1, 1, 0}, {1, 0, 1}, {0, 1, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};

// t_n(x), whose mean over noise of variance v is x^n without noise: sum over c of kCorrection[n][c] x^(n-2c) (-v)^c
// (Hermite polynomials; Markovsky et al., section 3).
constexpr std::array<std::array<double, 3>, 5> kCorrection = {{{1, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 3, 0}, {1, 6, 3}}};

}  // namespace

void QuarticMoments::add(const Eigen::Vector3d& z, double weight) {
  double x = weight;
  for (int p = 0; p <= 4; ++p, x *= z.x()) {
    double xy = x;
    for (int q = 0; p + q <= 4; ++q, xy *= z.y()) {
      double xyz = xy;
      for (int r = 0; p + q + r <= 4; ++r, xyz *= z.z()) sums_[index(p, q, r)] += xyz;
    }
  }
}

Matrix10 QuarticMoments::scatter(double noise_variance) const {
  const double total = sums_[0];
  const auto corrected = [&](int p, int q, int r) {
    double sum = 0;
    double vp = 1;
    for (int a = 0; 2 * a <= p; ++a, vp *= -noise_variance) {
      double vq = vp;
      for (int b = 0; 2 * b <= q; ++b, vq *= -noise_variance) {
        double vr = vq;
        for (int c = 0; 2 * c <= r; ++c, vr *= -noise_variance) {
          sum += kCorrection[p][a] * kCorrection[q][b] * kCorrection[r][c] * vr *
                 sums_[index(p - 2 * a, q - 2 * b, r - 2 * c)];
        }
      }
    }
    return sum / total;
  };
  Matrix10 s;
  for (int i = 0; i < 10; ++i) {
    for (int j = 0; j <= i; ++j) {
      const auto& m = kMonomials[i];
      const auto& n = kMonomials[j];
      s(i, j) = s(j, i) = corrected(m[0] + n[0], m[1] + n[1], m[2] + n[2]);
    }
  }
  return s;
}

std::optional<Ellipsoid> ellipsoid_of(const Vector10& q) {
  if (!q.allFinite()) return std::nullopt;
  Eigen::Matrix3d a;
  a << q[0], q[3] / 2, q[4] / 2, q[3] / 2, q[1], q[5] / 2, q[4] / 2, q[5] / 2, q[2];
  const Eigen::Vector3d b = q.segment<3>(6);
  const Eigen::ColPivHouseholderQR<Eigen::Matrix3d> qr(a);
  if (qr.rank() < 3) return std::nullopt;
  Ellipsoid e;
  e.centre = -0.5 * qr.solve(b);
  const double k = e.centre.dot(a * e.centre) - q[9];
  if (!(std::abs(k) > 0) || !e.centre.allFinite()) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(a / k);
  const Eigen::Vector3d values = eigen.eigenvalues();
  if (!(values[0] > 0) || !values.allFinite() || values[2] > 1e12 * values[0]) return std::nullopt;
  const Eigen::Matrix3d root = eigen.operatorSqrt();
  e.matrix = (root + root.transpose()) / 2;
  return e;
}

std::optional<Ellipsoid> fit_lsq(const QuarticMoments& moments) {
  // The mean of points of an ellipsoid lies inside it, hence in centred readings "= 1" has a solution.
  const Matrix10 s = moments.scatter();
  const auto solution = dense::solve_definite(s.topLeftCorner<9, 9>(), s.topRightCorner<9, 1>(), 1e-14);
  if (!solution) return std::nullopt;
  Vector10 quadric;
  quadric << solution->col(0), -1;
  return ellipsoid_of(quadric);
}

std::optional<Ellipsoid> fit_li_griffiths(const QuarticMoments& moments) {
  // With q = (q1: second order, q2: the rest), q2 is eliminated; what remains is q1' S q1 = min under q1' C q1 = 1.
  const Matrix10 s = moments.scatter();
  const Eigen::LDLT<Eigen::Matrix4d> ldlt(s.bottomRightCorner<4, 4>());
  if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 1e-14)) return std::nullopt;
  const Eigen::Matrix<double, 4, 6> to_rest = -ldlt.solve(s.bottomLeftCorner<4, 6>());
  Eigen::Matrix<double, 6, 6> reduced = s.topLeftCorner<6, 6>() + s.topRightCorner<6, 4>() * to_rest;
  // Exact data make it singular; the smallest addition that keeps the Cholesky factor real does not move the result.
  reduced.diagonal().array() += 1e-13 * reduced.trace();
  Eigen::Matrix<double, 6, 6> constraint = Eigen::Matrix<double, 6, 6>::Zero();
  constraint.topLeftCorner<3, 3>() << -1, 1, 1, 1, -1, 1, 1, 1, -1;
  constraint.diagonal().tail<3>().setConstant(-1);  // -k f^2 = -(2f)^2: the mixed terms are written 2f yz
  const auto eigen = dense::generalised_eigen(constraint, reduced);
  if (!eigen || !(eigen->values[5] > 0)) return std::nullopt;
  const Eigen::Matrix<double, 6, 1> q1 = eigen->vectors.col(5);
  Vector10 quadric;
  quadric << q1, to_rest * q1;
  return ellipsoid_of(quadric);
}

std::optional<Ellipsoid> fit_als(const QuarticMoments& moments) {
  // The noise variance is where the corrected scatter matrix becomes singular; it grows out of definiteness only once
  // below the smallest variance of the readings themselves.
  const auto smallest = [&](double variance) { return dense::symmetric_eigenvalues(moments.scatter(variance))[0]; };
  const Matrix10 plain = moments.scatter();
  Eigen::Matrix3d second;
  second << plain(0, 9), plain(3, 9), plain(4, 9), plain(3, 9), plain(1, 9), plain(5, 9), plain(4, 9), plain(5, 9),
      plain(2, 9);
  const Eigen::Vector3d mean = plain.block<3, 1>(6, 9);
  const Eigen::Matrix3d covariance = second - mean * mean.transpose();
  double high = dense::symmetric_eigenvalues(covariance)[0];
  if (!(high > 0)) return std::nullopt;
  double low = 0;
  // The first root: from below in steps that double.
  for (double probe = high * 1e-9; probe < high; probe *= 2) {
    if (smallest(probe) < 0) {
      high = probe;
      break;
    }
    low = probe;
  }
  if (smallest(high) > 0) return std::nullopt;
  for (int i = 0; i < 60 && high - low > 1e-13 * high; ++i) {
    const double middle = (low + high) / 2;
    (smallest(middle) > 0 ? low : high) = middle;
  }
  return ellipsoid_of(dense::symmetric_eigen(moments.scatter((low + high) / 2)).vectors.col(0));
}

}  // namespace loc::detail
