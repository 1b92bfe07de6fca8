// Mean and variance of the last N vectors of a stream, O(1) amortised and without allocation. No running sums are kept:
// the window is put together from two parts (the end of the last full chunk and the beginning of the present one), so
// that one huge value spoils the windows that hold it and no other.
// Source: van Herk, "A fast algorithm for local minimum and maximum filters", 1992, for the two parts; Chan, Golub,
// LeVeque, "Updating formulae and a pairwise algorithm for computing sample variances", 1979, for joining them.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "libloc/core/check.hpp"

namespace loc {

class SlidingMoments {
 public:
  /// @param window N, at least 2
  explicit SlidingMoments(int window) {
    require(window >= 2, "window", window, "must be at least 2");
    chunk_.resize(static_cast<std::size_t>(window));
    suffix_.resize(static_cast<std::size_t>(window));
  }

  void push(const Eigen::Vector3d& value) {
    chunk_[filled_] = value;
    prefix_.add(value);
    if (++filled_ < chunk_.size()) return;
    Moments moments;
    for (std::size_t i = chunk_.size(); i-- > 0;) {
      moments.add(chunk_[i]);
      suffix_[i] = moments;
    }
    prefix_ = {};
    filled_ = 0;
    full_ = true;
  }

  void reset() {
    prefix_ = {};
    filled_ = 0;
    full_ = false;
  }

  /// False: fewer than N values so far; mean() and variance() must not be asked.
  bool full() const { return full_; }
  Eigen::Vector3d mean() const { return window().mean; }
  /// Of a sample: divided by N - 1.
  Eigen::Vector3d variance() const { return window().squares / static_cast<double>(chunk_.size() - 1); }

 private:
  struct Moments {
    double count = 0;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Vector3d squares = Eigen::Vector3d::Zero();  ///< sum of squared deviations from the mean

    void add(const Eigen::Vector3d& value) {
      count += 1;
      const Eigen::Vector3d delta = value - mean;
      mean += delta / count;
      squares += delta.cwiseProduct(value - mean);
    }
  };

  Moments window() const {
    const Moments& a = suffix_[filled_];
    const Moments& b = prefix_;
    Moments joined;
    joined.count = a.count + b.count;
    const Eigen::Vector3d delta = b.mean - a.mean;
    joined.mean = a.mean + delta * (b.count / joined.count);
    joined.squares = a.squares + b.squares + delta.cwiseAbs2() * (a.count * b.count / joined.count);
    return joined;
  }

  std::vector<Eigen::Vector3d> chunk_;  ///< values since the last full chunk
  std::vector<Moments> suffix_;         ///< [i]: of the last full chunk from its i-th value on
  Moments prefix_;                      ///< of the values in chunk_
  std::size_t filled_ = 0;
  bool full_ = false;
};

}  // namespace loc
