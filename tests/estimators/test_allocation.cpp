// Nothing on the way of a sample to its estimate allocates once it is warm: counts the calls of operator new while
// samples go through.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "libloc/estimators/madgwick.hpp"
#include "libloc/sensors/clock_gps.hpp"
#include "libloc/sensors/stream.hpp"
#include "libloc/sim/clock.hpp"
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

TEST(Allocation, ClocksDoNotAllocate) {
  ClockChain chain;
  ClockSimulation simulation = ClockSimulation::usb_imu();
  simulation.events = {{ClockEvent::Kind::kDeviceReset, 50, 0}};
  const auto samples = simulate_clock(simulation, 200, Random(1));
  const auto gps = simulate_gps_time({}, 250, Random(2));
  const long before = allocations;
  std::size_t next = 0;
  int answered = 0;
  for (const ClockSample& s : samples) {
    for (; gps.events[next].host_time_ns < s.host_time_ns; ++next) chain.update(gps.events[next]);
    chain.update(s.device_time_ns, s.host_time_ns);
    answered += chain.convert(s.device_time_ns) ? 1 : 0;
  }
  EXPECT_EQ(allocations, before) << "resets, fits and pairing included";
  EXPECT_GT(answered, 39'000);
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
