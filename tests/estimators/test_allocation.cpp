// Nothing on the way of a sample to its estimate allocates once it is warm: counts the calls of operator new while
// samples go through.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "libloc/estimators/madgwick.hpp"
#include "libloc/sensors/stream.hpp"
#include "support/simulated_imu.hpp"

namespace {
std::atomic<long> allocations{0};
}

void* operator new(std::size_t size) {
  ++allocations;
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept {
  std::free(p);
}
void operator delete(void* p, std::size_t /*size*/) noexcept {
  std::free(p);
}

namespace loc {
namespace {

TEST(Allocation, TheCounterCounts) {
  const long before = allocations;
  // Called by name: a new-expression may be optimised away.
  ::operator delete(::operator new(1));
  EXPECT_EQ(allocations, before + 1);
}

TEST(Allocation, MadgwickDoesNotAllocatePerSample) {
  MadgwickFilter filter(MadgwickOptions::robust());
  test::SimulatedImu sim;
  const long before = allocations;
  for (int i = 0; i < 1000; ++i) {
    sim.step({0.1, 0.2, 0.3});
    filter.process(sim.magnetometer);
    filter.process(sim.imu);
    const Estimate estimate = filter.estimate();
    ASSERT_TRUE(estimate.q_world_body.coeffs().allFinite());
  }
  EXPECT_EQ(allocations, before);
}

TEST(Allocation, TheStreamMergerKeepsItsMemory) {
  StreamMerger merger;
  test::SimulatedImu sim;
  long warm = 0;
  int out = 0;
  for (int i = 0; i < 2000; ++i) {
    if (i == 200) warm = allocations;
    sim.step({0.1, 0.2, 0.3});
    merger.push(sim.imu);
    if (i % 7 == 0) merger.push(sim.magnetometer);
    while (merger.pop()) ++out;
  }
  EXPECT_EQ(allocations, warm);
  EXPECT_GT(out, 2000);
}

}  // namespace
}  // namespace loc
