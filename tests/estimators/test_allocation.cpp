// Nothing on the way of a sample to its estimate allocates once it is warm: counts the calls of operator new while
// samples go through.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "libloc/estimators/error_state_filter.hpp"
#include "libloc/estimators/fusion_preset.hpp"
#include "libloc/estimators/inertial_slam.hpp"
#include "libloc/estimators/madgwick.hpp"
#include "libloc/sensors/clock_gps.hpp"
#include "libloc/sensors/stream.hpp"
#include "libloc/sim/clock.hpp"
#include "support/simulated_imu.hpp"
#include "support/slam_ride.hpp"

namespace {
std::atomic<long> allocations{0};
}

// Not inlined, or the compiler sees malloc and delete, and free and new, and warns.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* p) noexcept {
  std::free(p);
}
[[gnu::noinline]] void operator delete(void* p, std::size_t /*size*/) noexcept {
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

TEST(Allocation, ErrorStateFilterDoesNotAllocate) {
  for (const int clones : {0, 2}) {
    FusionPreset preset = FusionPreset::drift();
    preset.options.clones = clones;
    ErrorStateFilter filter(preset.options);
    filter.start(0, {}, Eigen::MatrixXd::Identity(filter.layout().size, filter.layout().size));
    const Eigen::Matrix3d cov = 0.01 * Eigen::Matrix3d::Identity();
    ImuMeasurement imu;
    imu.angular_velocity = {0.01, 0, 0};
    imu.specific_force = {0, 0, 9.81};
    long before = 0;
    for (int i = 0; i < 2000; ++i) {
      if (i == 1000) before = allocations;  // by then every queue has been as long as it gets
      imu.time_ns = i * 10'000'000LL;
      filter.predict(imu);
      // In time, between two samples, late, newer than the IMU.
      filter.fuse_vo(imu.time_ns, Eigen::Vector3d::Zero(), cov, Eigen::Quaterniond::Identity(), cov);
      filter.fuse_gps(imu.time_ns - 123'456'789, Eigen::Vector3d::Zero(), 100 * cov);
      filter.fuse_height(imu.time_ns + 3'000'000, 0, 1);
      if (clones > 0 && i % 10 == 9) {
        filter.fuse_vo_relative(imu.time_ns - 100'000'000, imu.time_ns, Eigen::Vector3d::Zero(), cov,
                                Eigen::Quaterniond::Identity(), cov);
      }
    }
    EXPECT_EQ(allocations, before) << clones;
    EXPECT_TRUE(filter.covariance().allFinite());
  }
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

// Features come and go, are converted, rejected, rescued: none of it allocates.
TEST(Allocation, SlamDoesNotAllocatePerFrame) {
  test::SlamRideOptions ride;
  ride.outlier_rate = 0.1;
  for (const SlamConsistency consistency : {SlamConsistency::kFirstEstimate, SlamConsistency::kInvariant}) {
    SlamOptions options = test::ride_options(SlamMotion::kInertial);
    options.consistency = consistency;
    options.map.max_features = 40;
    InertialSlam slam(options);
    std::vector<Measurement> recording;
    test::SlamRide(ride).run(14, [&](const Measurement& m) { recording.push_back(m); });
    long before = 0;
    std::int64_t added = 0;
    for (const Measurement& m : recording) {
      const auto* frame = std::get_if<FeaturesMeasurement>(&m);
      const bool warm = test::SlamRide::time_s(stamp_of(m).time_ns) > 9;
      if (frame != nullptr) {
        slam.process(m);  // the frame is copied into the queue, and moved out of it: its own memory
        continue;
      }
      before = allocations;
      slam.process(m);
      const Estimate estimate = slam.estimate();
      if (!warm) continue;
      ASSERT_TRUE(estimate.position.allFinite());
      for (const SlamFrame& done : slam.frames()) added += done.counts.added;
      ASSERT_EQ(allocations, before) << test::SlamRide::time_s(stamp_of(m).time_ns);
    }
    EXPECT_GT(added, 10);
  }
}

}  // namespace
}  // namespace loc
