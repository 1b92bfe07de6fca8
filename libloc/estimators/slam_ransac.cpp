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

}  // namespace

OnePointRansac::OnePointRansac(const SlamAssociationOptions& options, int capacity)
    : options_(options), gate_(chi_square_quantile(options.gate_probability, 2)) {
  best_.reserve(static_cast<std::size_t>(capacity));
  agrees_.reserve(static_cast<std::size_t>(capacity));
  order_.reserve(static_cast<std::size_t>(capacity));
}

int OnePointRansac::vote(const MapCovariance& covariance, const std::vector<double>& residual, int by,
                         std::vector<char>& agrees) {
  const int count = static_cast<int>(agrees.size());
  const auto r = [&](int j) {
    return Eigen::Vector2d(residual[static_cast<std::size_t>(2 * j)], residual[static_cast<std::size_t>(2 * j + 1)]);
  };
  const Eigen::Matrix2d inverse = block_of(covariance, by, by).inverse();
  const Eigen::Vector2d pull = inverse * r(by);
  int votes = 0;
  for (int j = 0; j < count; ++j) {
    if (j == by) {
      // The prior, too, has a word: what it excludes is no hypothesis.
      agrees[static_cast<std::size_t>(j)] = 1;
      ++votes;
      continue;
    }
    const Eigen::Matrix2d cross = block_of(covariance, j, by);
    const Eigen::Vector2d left = r(j) - cross * pull;
    const Eigen::Matrix2d cov = block_of(covariance, j, j) - cross * inverse * cross.transpose();
    const double distance = left.dot(cov.inverse() * left);
    const bool near = distance >= 0 && distance < gate_;
    agrees[static_cast<std::size_t>(j)] = near ? 1 : 0;
    votes += near ? 1 : 0;
  }
  return votes;
}

const std::vector<char>& OnePointRansac::run(const MapCovariance& covariance, const std::vector<double>& residual,
                                             std::uint64_t draw) {
  const auto count = residual.size() / 2;
  best_.assign(count, 0);
  agrees_.assign(count, 0);
  order_.resize(count);
  std::iota(order_.begin(), order_.end(), 0);
  Random random(options_.seed ^ draw);
  hypotheses_ = 0;
  int most = 0;
  double needed = options_.max_hypotheses;
  for (std::size_t k = 0; k < count && static_cast<double>(hypotheses_) < needed; ++k) {
    const auto other = k + static_cast<std::size_t>(random.uniform() * static_cast<double>(count - k));
    std::swap(order_[k], order_[other]);
    ++hypotheses_;
    const int votes = vote(covariance, residual, order_[k], agrees_);
    if (votes <= most) continue;
    most = votes;
    best_ = agrees_;
    const double right = static_cast<double>(votes) / static_cast<double>(count);
    needed = right >= 1 ? 0
                        : std::min<double>(options_.max_hypotheses,
                                           std::log(1 - options_.ransac_probability) / std::log(1 - right));
  }
  return best_;
}

}  // namespace loc
