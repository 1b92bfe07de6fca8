#include "libloc/estimators/slam_ransac.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "libloc/core/random.hpp"
#include "libloc/core/statistics.hpp"

namespace loc {
namespace {

Eigen::Matrix2d block_of(const MapCovariance& covariance, int i, int j) {
  Eigen::Matrix2d out;
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 2; ++column) out(row, column) = covariance.s(2 * i + row, 2 * j + column);
  }
  return out;
}

Eigen::Vector2d pair_of(const std::vector<double>& residual, int j) {
  const std::size_t first = 2 * static_cast<std::size_t>(j);
  return {residual[first], residual[first + 1]};
}

}  // namespace

OnePointRansac::OnePointRansac(const SlamAssociationOptions& options, SlamMotion motion, int capacity)
    : options_(options), gate_(chi_square_quantile(options.gate(motion), 2)) {
  best_.reserve(static_cast<std::size_t>(capacity));
  agrees_.reserve(static_cast<std::size_t>(capacity));
  order_.reserve(static_cast<std::size_t>(capacity));
  taken_.reserve(static_cast<std::size_t>(capacity));
  distance_.reserve(static_cast<std::size_t>(capacity));
  rows_.reserve(row_start(2 * static_cast<std::size_t>(capacity)));
  y_.reserve(2 * static_cast<std::size_t>(capacity));
}

double OnePointRansac::cost(const MapCovariance& covariance, const std::vector<double>& residual, double sigma, int by,
                            std::vector<char>& agrees) {
  const int count = static_cast<int>(agrees.size());
  const auto r = [&](int j) { return pair_of(residual, j); };
  Eigen::Matrix2d inverse = Eigen::Matrix2d::Zero();
  double sum = 0;
  if (by >= 0) {
    inverse = block_of(covariance, by, by).inverse();
    sum = r(by).dot(inverse * r(by));
  }
  for (int j = 0; j < count; ++j) {
    if (j == by) {
      agrees[static_cast<std::size_t>(j)] = 1;
      continue;
    }
    Eigen::Vector2d left = r(j);
    if (by >= 0) left -= block_of(covariance, j, by) * inverse * r(by);
    const double distance = left.squaredNorm() / (sigma * sigma);
    const bool near = distance < gate_;
    agrees[static_cast<std::size_t>(j)] = near ? 1 : 0;
    sum += near ? distance : gate_;
  }
  return sum;
}

const std::vector<char>& OnePointRansac::run(const MapCovariance& covariance, const std::vector<double>& residual,
                                             double sigma, std::uint64_t draw) {
  const auto count = residual.size() / 2;
  best_.assign(count, 0);
  agrees_.assign(count, 0);
  order_.resize(count);
  std::iota(order_.begin(), order_.end(), 0);
  Random random(options_.seed ^ draw);
  hypotheses_ = 0;
  // Before all others: the prior is right, and no measurement is needed to correct it.
  double least = cost(covariance, residual, sigma, -1, best_);
  const auto needed_for = [&](const std::vector<char>& agrees) {
    const auto right = static_cast<double>(std::count(agrees.begin(), agrees.end(), 1)) / static_cast<double>(count);
    if (right >= 1) return 0.0;
    if (right <= 0) return static_cast<double>(options_.max_hypotheses);
    return std::min<double>(options_.max_hypotheses, std::log(1 - options_.ransac_probability) / std::log(1 - right));
  };
  double needed = needed_for(best_);
  for (std::size_t k = 0; k < count && static_cast<double>(hypotheses_) < needed; ++k) {
    const auto other = k + static_cast<std::size_t>(random.uniform() * static_cast<double>(count - k));
    std::swap(order_[k], order_[other]);
    ++hypotheses_;
    const double sum = cost(covariance, residual, sigma, order_[k], agrees_);
    if (sum >= least) continue;
    least = sum;
    best_ = agrees_;
    needed = needed_for(best_);
  }
  return best_;
}

const std::vector<char>& OnePointRansac::compatible(const MapCovariance& covariance,
                                                    const std::vector<double>& residual) {
  const auto count = residual.size() / 2;
  best_.assign(count, 0);
  order_.resize(count);
  std::iota(order_.begin(), order_.end(), 0);
  distance_.resize(count);
  for (std::size_t j = 0; j < count; ++j) {
    const Eigen::Vector2d r(residual[2 * j], residual[2 * j + 1]);
    const int at = static_cast<int>(j);
    distance_[j] = r.dot(block_of(covariance, at, at).inverse() * r);
  }
  std::sort(order_.begin(), order_.end(), [&](int a, int b) {
    return distance_[static_cast<std::size_t>(a)] < distance_[static_cast<std::size_t>(b)];
  });
  // Cholesky factor of S of those taken, row by row, and y = L^-1 r: what the next one is expected to read, and how
  // well.
  rows_.clear();
  y_.clear();
  taken_.clear();
  for (const int j : order_) {
    if (!(distance_[static_cast<std::size_t>(j)] < gate_)) break;
    const std::size_t before = y_.size();
    const std::size_t start = rows_.size();
    rows_.resize(start + 2 * (before + 2), 0.0);
    Eigen::Matrix2d cov = block_of(covariance, j, j);
    Eigen::Vector2d left = pair_of(residual, j);
    double* const first = rows_.data() + start;
    double* const second = first + before + 2;
    for (std::size_t k = 0; k < before; ++k) {
      const double* const row = rows_.data() + row_start(k);
      const int other = 2 * taken_[k / 2] + static_cast<int>(k % 2);
      double a = covariance.s(2 * j, other);
      double b = covariance.s(2 * j + 1, other);
      for (std::size_t i = 0; i < k; ++i) {
        a -= row[i] * first[i];
        b -= row[i] * second[i];
      }
      first[k] = a / row[k];
      second[k] = b / row[k];
      left[0] -= first[k] * y_[k];
      left[1] -= second[k] * y_[k];
      cov(0, 0) -= first[k] * first[k];
      cov(1, 0) -= second[k] * first[k];
      cov(1, 1) -= second[k] * second[k];
    }
    cov(0, 1) = cov(1, 0);
    const double distance = left.dot(cov.inverse() * left);
    const double pivot = cov(0, 0);
    const double corner = cov(1, 1) - cov(1, 0) * cov(1, 0) / pivot;
    if (!(distance >= 0 && distance < gate_ && pivot > 0 && corner > 0)) {
      rows_.resize(start);
      continue;
    }
    first[before] = std::sqrt(pivot);
    second[before] = cov(1, 0) / first[before];
    second[before + 1] = std::sqrt(corner);
    y_.push_back(left[0] / first[before]);
    y_.push_back((left[1] - second[before] * y_.back()) / second[before + 1]);
    taken_.push_back(j);
    best_[static_cast<std::size_t>(j)] = 1;
  }
  return best_;
}

// Rows come in pairs of equal length: two of 2, two of 4, …
std::size_t OnePointRansac::row_start(std::size_t row) {
  const std::size_t pair = row / 2;
  return 2 * pair * (pair + 1) + (row % 2) * 2 * (pair + 1);
}

}  // namespace loc
