// A queue that keeps its memory: once it has been as long as it gets, nothing is allocated any more. (std::deque
// allocates and frees a block for every few large elements that pass through.)
#pragma once

#include <cassert>
#include <cstddef>
#include <utility>
#include <vector>

namespace loc {

/// T must be default constructible and movable. References are valid until the next change.
template <class T>
class Fifo {
 public:
  bool empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }

  /// Counted from the front.
  T& operator[](std::size_t i) {
    assert(i < size_);
    return slots_[(first_ + i) & (slots_.size() - 1)];
  }
  const T& operator[](std::size_t i) const {
    assert(i < size_);
    return slots_[(first_ + i) & (slots_.size() - 1)];
  }
  const T& front() const { return (*this)[0]; }
  const T& back() const { return (*this)[size_ - 1]; }

  void push_back(T value) {
    if (size_ == slots_.size()) grow();
    ++size_;
    (*this)[size_ - 1] = std::move(value);
  }

  /// Puts value in front of the element with this index; moves those from there to the end.
  void insert(std::size_t index, T value) {
    assert(index <= size_);
    push_back(std::move(value));
    for (std::size_t i = size_ - 1; i > index; --i) std::swap((*this)[i], (*this)[i - 1]);
  }

  /// A slot at the end, as it was left by whoever had it: to be filled by assignment, which keeps its memory.
  T& push_slot() {
    if (size_ == slots_.size()) grow();
    ++size_;
    return (*this)[size_ - 1];
  }
  /// Gives the first slot up as it is; it keeps its memory for who comes next.
  void drop_front() {
    assert(size_ > 0);
    first_ = (first_ + 1) & (slots_.size() - 1);
    --size_;
  }

  /// Takes the first element out. It must not be empty.
  T pop_front() {
    T value = std::move((*this)[0]);
    first_ = (first_ + 1) & (slots_.size() - 1);
    --size_;
    return value;
  }

 private:
  void grow() {
    std::vector<T> larger(slots_.empty() ? 8 : 2 * slots_.size());  // a power of two, for the mask
    for (std::size_t i = 0; i < size_; ++i) larger[i] = std::move((*this)[i]);
    slots_ = std::move(larger);
    first_ = 0;
  }

  std::vector<T> slots_;
  std::size_t first_ = 0;
  std::size_t size_ = 0;
};

}  // namespace loc
