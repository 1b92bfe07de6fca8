// LargeCovariance of the precision that is chosen at run time.
#pragma once

#include <utility>
#include <variant>

#include "libloc/filter/large_covariance.hpp"

namespace loc {

/// See LargeCovariance for what each of them does.
class MapCovariance {
 private:
  using Variant = std::variant<LargeCovariance<double>, LargeCovariance<float>>;

  template <class Function>
  auto visit(Function&& function) {
    return std::visit(std::forward<Function>(function), p_);
  }
  template <class Function>
  auto visit(Function&& function) const {
    return std::visit(std::forward<Function>(function), p_);
  }

 public:
  /// @param single float in place of double
  MapCovariance(bool single, int head_dim, int capacity, int max_rows)
      : p_(single ? Variant(std::in_place_type<LargeCovariance<float>>, head_dim, capacity, max_rows)
                  : Variant(std::in_place_type<LargeCovariance<double>>, head_dim, capacity, max_rows)) {}

  int dim() const {
    return visit([](const auto& p) { return p.dim(); });
  }
  int capacity() const {
    return visit([](const auto& p) { return p.capacity(); });
  }
  void reset(const Eigen::MatrixXd& covariance) {
    visit([&](auto& p) { p.reset(covariance); });
  }
  double operator()(int row, int column) const {
    return visit([&](const auto& p) { return p(row, column); });
  }
  template <class Derived>
  void read(int row, int column, Eigen::MatrixBase<Derived>& out) const {
    visit([&](const auto& p) { p.read(row, column, out); });
  }
  Eigen::MatrixXd dense() const {
    return visit([](const auto& p) { return p.dense(); });
  }
  void set_dense(const Eigen::MatrixXd& covariance) {
    visit([&](auto& p) { p.set_dense(covariance); });
  }
  void propagate(const Eigen::MatrixXd& f, const Eigen::MatrixXd& q) {
    visit([&](auto& p) { p.propagate(f, q); });
  }
  int append(const Eigen::Ref<const Eigen::MatrixXd>& jacobian, const Eigen::Ref<const Eigen::MatrixXd>& noise_cov) {
    return visit([&](auto& p) { return p.append(jacobian, noise_cov); });
  }
  void replace(int first, const Eigen::Ref<const Eigen::MatrixXd>& jacobian) {
    visit([&](auto& p) { p.replace(first, jacobian); });
  }
  void remove(std::span<const CovarianceRange> ranges) {
    visit([&](auto& p) { p.remove(ranges); });
  }
  Eigen::Matrix<double, kMaxRows, kMaxRows> innovation_cov(const BlockMeasurement& measurement) const {
    return visit([&](const auto& p) { return p.innovation_cov(measurement); });
  }
  void innovate(std::span<const BlockMeasurement> measurements, std::span<const int> which) {
    visit([&](auto& p) { p.innovate(measurements, which); });
  }
  double s(int row, int column) const {
    return visit([&](const auto& p) { return p.s(row, column); });
  }
  bool correction(std::span<const int> accepted, std::span<const double> residual, Eigen::VectorXd& dx) {
    return visit([&](auto& p) { return p.correction(accepted, residual, dx); });
  }
  bool update(std::span<const int> accepted, std::span<const double> residual, Eigen::VectorXd& dx, double& nis,
              int from = 0) {
    return visit([&](auto& p) { return p.update(accepted, residual, dx, nis, from); });
  }
  void shear(int first, const Eigen::MatrixX3d& u) {
    visit([&](auto& p) { p.shear(first, u); });
  }
  void inflate(int first, int count, double variance) {
    visit([&](auto& p) { p.inflate(first, count, variance); });
  }

 private:
  Variant p_;
};

}  // namespace loc
