#include <gtest/gtest.h>

#include <deque>
#include <memory>

#include "libloc/core/fifo.hpp"
#include "libloc/core/random.hpp"

namespace loc {
namespace {

TEST(Fifo, DoesWhatADequeDoes) {
  Random random(1);
  Fifo<int> fifo;
  std::deque<int> deque;
  for (int i = 0; i < 20000; ++i) {
    const double choice = random.uniform();
    // Grows and shrinks by turns.
    if (choice < (i / 500 % 2 == 0 ? 0.6 : 0.4)) {
      fifo.push_back(i);
      deque.push_back(i);
    } else if (choice < 0.7) {
      const auto index = static_cast<std::size_t>(random.uniform() * static_cast<double>(deque.size() + 1));
      fifo.insert(index, i);
      deque.insert(deque.begin() + static_cast<std::ptrdiff_t>(index), i);
    } else if (!deque.empty()) {
      ASSERT_EQ(fifo.pop_front(), deque.front());
      deque.pop_front();
    }
    ASSERT_EQ(fifo.size(), deque.size());
    ASSERT_EQ(fifo.empty(), deque.empty());
    if (!deque.empty()) {
      ASSERT_EQ(fifo.front(), deque.front());
      ASSERT_EQ(fifo.back(), deque.back());
      const auto index = static_cast<std::size_t>(random.uniform() * static_cast<double>(deque.size()));
      ASSERT_EQ(fifo[index], deque[index]);
    }
  }
}

TEST(Fifo, LetsGoOfWhatIsTakenOut) {
  Fifo<std::shared_ptr<int>> fifo;
  const auto value = std::make_shared<int>(1);
  fifo.push_back(value);
  EXPECT_EQ(value.use_count(), 2);
  fifo.pop_front();
  EXPECT_EQ(value.use_count(), 1);
}

}  // namespace
}  // namespace loc
