#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/sensors/stream.hpp"

namespace loc {
namespace {

constexpr TimeNs kMs = 1'000'000;
constexpr TimeNs kSecond = 1000 * kMs;
constexpr TimeNs kEpoch = 1'700'000'000 * kSecond;

template <class T>
Measurement sample(TimeNs time_ns, std::int64_t sequence = 0) {
  T m{};
  m.time_ns = time_ns;
  m.sequence = sequence;
  return m;
}
Measurement imu(TimeNs time_ns, std::int64_t sequence = 0) {
  return sample<ImuMeasurement>(time_ns, sequence);
}
Measurement magnetometer(TimeNs time_ns, std::int64_t sequence = 0) {
  return sample<MagnetometerMeasurement>(time_ns, sequence);
}
Measurement image(TimeNs time_ns, int camera) {
  ImageMeasurement m{};
  m.time_ns = time_ns;
  m.camera = camera;
  return m;
}

Measurement features(TimeNs time_ns, int camera) {
  FeaturesMeasurement m{};
  m.time_ns = time_ns;
  m.camera = camera;
  return m;
}

// Everything that tells samples apart.
using Key = std::tuple<TimeNs, int, int>;
Key key_of(const Measurement& m) {
  constexpr std::array<int, kStreamKinds> kOrder = {6, 0, 1, 3, 5, 4, 2};
  return {stamp_of(m).time_ns, kOrder[m.index()], camera_of(m)};
}

void drain(StreamMerger& merger, std::vector<Key>& out) {
  while (auto m = merger.pop()) out.push_back(key_of(*m));
}

std::vector<Key> merge(const std::vector<Measurement>& arrivals, StreamMergerOptions options, StreamMerger* used) {
  StreamMerger merger(options);
  for (const Measurement& m : arrivals) merger.await(kind_of(m), camera_of(m));
  std::vector<Key> out;
  for (const Measurement& m : arrivals) {
    merger.push(m);
    drain(merger, out);
  }
  merger.finish();
  drain(merger, out);
  EXPECT_EQ(merger.waiting(), 0U);
  if (used != nullptr) *used = merger;
  return out;
}

// All kinds of streams with rates of their own, many equal times, two cameras that share theirs.
std::vector<Measurement> recording() {
  std::vector<Measurement> all;
  for (TimeNs t = 0; t < 2 * kSecond; t += 5 * kMs) all.push_back(imu(kEpoch + t));
  for (TimeNs t = 0; t < 2 * kSecond; t += 10 * kMs) all.push_back(magnetometer(kEpoch + t));
  for (TimeNs t = 0; t < 2 * kSecond; t += 50 * kMs) {
    all.push_back(image(kEpoch + t, 0));
    all.push_back(image(kEpoch + t, 1));
  }
  for (TimeNs t = 0; t < 2 * kSecond; t += 50 * kMs) {
    all.push_back(features(kEpoch + t, 0));
    all.push_back(features(kEpoch + t, 1));
  }
  for (TimeNs t = 0; t < 2 * kSecond; t += 40 * kMs) all.push_back(sample<OdometryMeasurement>(kEpoch + t));
  for (TimeNs t = 0; t < 2 * kSecond; t += 200 * kMs) all.push_back(sample<GpsMeasurement>(kEpoch + t));
  for (TimeNs t = 0; t < 2 * kSecond; t += 7 * kMs) all.push_back(sample<ReferenceMeasurement>(kEpoch + t));
  return all;
}

std::vector<Key> sorted_keys(const std::vector<Measurement>& all) {
  std::vector<Key> keys;
  for (const Measurement& m : all) keys.push_back(key_of(m));
  std::sort(keys.begin(), keys.end());
  return keys;
}

// Each sample arrives up to max_delay after its time; with in_order, a stream does not overtake itself.
std::vector<Measurement> delayed(const std::vector<Measurement>& all, TimeNs max_delay, bool in_order, Random& random) {
  std::vector<std::tuple<TimeNs, double, std::size_t>> order;
  TimeNs last = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    // Both ends of the range often.
    const double share = std::clamp(random.uniform(-0.5, 1.5), 0.0, 1.0);
    TimeNs arrival = stamp_of(all[i]).time_ns + static_cast<TimeNs>(share * static_cast<double>(max_delay));
    const bool same_stream = i > 0 && all[i].index() == all[i - 1].index();
    if (in_order && same_stream) arrival = std::max(arrival, last + 1);
    order.emplace_back(arrival, random.uniform(), i);
    last = arrival;
  }
  std::sort(order.begin(), order.end());
  std::vector<Measurement> arrivals;
  for (const auto& [arrival, tie, i] : order) arrivals.push_back(all[i]);
  return arrivals;
}

TEST(StreamMerger, AnyOrderOfArrivalWithinTheDelayGivesTheSortedSequence) {
  const std::vector<Measurement> all = recording();
  const std::vector<Key> expected = sorted_keys(all);
  Random random(1);
  for (int trial = 0; trial < 60; ++trial) {
    StreamMergerOptions options;
    options.max_delay_ns = (1 + trial) * kMs;
    StreamMerger used;
    ASSERT_EQ(merge(delayed(all, options.max_delay_ns - 1, true, random), options, &used), expected) << trial;
    for (const std::int64_t late : used.counts().late) EXPECT_EQ(late, 0);
    EXPECT_EQ(used.counts().resets, 0);
    EXPECT_EQ(used.counts().forced, 0);
  }
}

TEST(StreamMerger, DisorderWithinAStreamIsSortedOrCounted) {
  const std::vector<Measurement> all = recording();
  Random random(3);
  for (int trial = 0; trial < 20; ++trial) {
    StreamMerger used;
    const std::vector<Key> out = merge(delayed(all, 30 * kMs, false, random), {}, &used);
    const auto earlier = [](const Key& a, const Key& b) { return std::get<0>(a) < std::get<0>(b); };
    EXPECT_TRUE(std::is_sorted(out.begin(), out.end(), earlier));
    const auto& late = used.counts().late;
    EXPECT_EQ(out.size() + std::accumulate(late.begin(), late.end(), std::size_t{0}), all.size());
  }
}

TEST(StreamMerger, EqualTimesOfOneStreamKeepTheirOrder) {
  StreamMerger merger;
  for (int i = 0; i < 5; ++i) merger.push(imu(kEpoch, i));
  merger.finish();
  for (int i = 0; i < 5; ++i) EXPECT_EQ(stamp_of(*merger.pop()).sequence, i);
}

TEST(StreamMerger, ASampleLeavesAsSoonAsAllAwaitedStreamsHavePassedIt) {
  StreamMerger merger;
  merger.await(StreamKind::kMagnetometer);
  merger.push(imu(kEpoch));
  EXPECT_FALSE(merger.pop());
  merger.push(magnetometer(kEpoch + 1));
  EXPECT_EQ(stamp_of(*merger.pop()).time_ns, kEpoch);
  EXPECT_FALSE(merger.pop());  // the IMU may still send something older than the magnetometer's sample
}

// What follows a picture at once need not wait for the next one; what follows late must.
TEST(StreamMerger, ARegularCameraIsNotWaitedForRightAfterAPicture) {
  const auto waits = [](const std::vector<TimeNs>& pictures, TimeNs after) {
    StreamMerger merger({.max_delay_ns = kSecond});
    merger.await(StreamKind::kImu);
    std::vector<Key> out;
    for (const TimeNs time : pictures) {
      merger.push(image(kEpoch + time, 0));
      merger.push(imu(kEpoch + time));
      drain(merger, out);
    }
    merger.push(imu(kEpoch + pictures.back() + after));
    return !merger.pop().has_value();
  };
  std::vector<TimeNs> regular;
  for (int i = 0; i < 20; ++i) regular.push_back(i * 33 * kMs + (i % 3) * kMs);
  EXPECT_FALSE(waits(regular, 5 * kMs));
  EXPECT_FALSE(waits(regular, 12 * kMs));
  EXPECT_TRUE(waits(regular, 15 * kMs));
  // Nothing is expected of the first pictures, and of a camera that takes them as it likes.
  EXPECT_TRUE(waits({regular.begin(), regular.begin() + 10}, 5 * kMs));
  std::vector<TimeNs> irregular;
  for (int i = 0; i < 20; ++i) irregular.push_back(i * 33 * kMs + (i % 2) * 20 * kMs);
  EXPECT_TRUE(waits(irregular, 5 * kMs));
  // Dropped pictures do not make it irregular.
  regular.erase(regular.begin() + 12);
  EXPECT_FALSE(waits(regular, 5 * kMs));
}

TEST(StreamMerger, ASilentStreamHoldsTheOthersForMaxDelayOnly) {
  StreamMerger merger;
  merger.await(StreamKind::kGps);
  merger.push(imu(kEpoch));
  merger.push(imu(kEpoch + 50 * kMs));
  EXPECT_FALSE(merger.pop());
  merger.push(imu(kEpoch + 50 * kMs + 1));
  EXPECT_EQ(stamp_of(*merger.pop()).time_ns, kEpoch);
  EXPECT_FALSE(merger.pop());
}

TEST(StreamMerger, ZeroDelayWaitsForNothing) {
  StreamMergerOptions options;
  options.max_delay_ns = 0;
  StreamMerger merger(options);
  merger.await(StreamKind::kGps);
  merger.push(imu(kEpoch));
  EXPECT_TRUE(merger.pop());
  // Of the same time is not late.
  merger.push(magnetometer(kEpoch));
  EXPECT_TRUE(merger.pop());
  EXPECT_EQ(merger.counts().late[1], 0);
}

TEST(StreamMerger, LateSamplesAreCountedByStreamAndNeverLeave) {
  std::vector<Measurement> arrivals;
  for (int i = 0; i < 100; ++i) {
    arrivals.push_back(imu(kEpoch + i * 10 * kMs));
    if (i % 10 == 9) arrivals.push_back(magnetometer(kEpoch + i * 10 * kMs - 61 * kMs));  // needs 61 ms, has 50
  }
  StreamMerger used;
  const std::vector<Key> out = merge(arrivals, {}, &used);
  EXPECT_TRUE(std::is_sorted(out.begin(), out.end()));
  EXPECT_EQ(out.size(), 100U);
  EXPECT_EQ(used.counts().late[1], 10);
  EXPECT_EQ(used.counts().late[0], 0);
  EXPECT_EQ(used.counts().resets, 0);
}

TEST(StreamMerger, TooManyWaitingForcesTheOldestOut) {
  StreamMergerOptions options;
  options.max_delay_ns = 100 * kSecond;
  options.max_samples = 64;
  StreamMerger merger(options);
  merger.await(StreamKind::kGps);
  std::vector<Key> out;
  for (int i = 0; i < 1000; ++i) {
    merger.push(imu(kEpoch + i * kMs));
    drain(merger, out);
    ASSERT_LE(merger.waiting(), 64U);
  }
  EXPECT_EQ(merger.counts().forced, 1000 - 64);
  EXPECT_EQ(out.size(), 1000U - 64U);
  EXPECT_TRUE(std::is_sorted(out.begin(), out.end()));
}

TEST(StreamMerger, WhatLeavesInItsTurnIsNotCountedAsForced) {
  StreamMergerOptions options;
  options.max_samples = 2;
  StreamMerger merger(options);
  for (int i = 0; i < 10; ++i) merger.push(imu(kEpoch + i * kMs));
  std::vector<Key> out;
  drain(merger, out);
  EXPECT_EQ(out.size(), 10U);
  EXPECT_EQ(merger.counts().forced, 0);
}

TEST(StreamMerger, MemoryStaysBoundedWhateverTheTimesAre) {
  StreamMergerOptions options;
  options.max_samples = 100;
  StreamMerger merger(options);
  Random random(2);
  for (int i = 0; i < 20000; ++i) {
    const auto time = static_cast<TimeNs>(random.uniform(-9e18, 9e18));
    merger.push(random.uniform() < 0.5 ? imu(time) : image(time, static_cast<int>(random.uniform(-5, 1e6))));
    while (merger.pop()) {
    }
    ASSERT_LE(merger.waiting(), 100U);
  }
}

TEST(StreamMerger, AClockSetBackStartsTheSequenceAnew) {
  StreamMergerOptions options;
  options.reset_after = 5;
  StreamMerger merger(options);
  merger.await(StreamKind::kGps);  // so that some samples wait when the clock jumps
  std::vector<Key> out;
  for (int i = 0; i < 100; ++i) {
    merger.push(imu(kEpoch + i * 10 * kMs));
    drain(merger, out);
  }
  EXPECT_GT(merger.waiting(), 0U);
  const TimeNs back = kEpoch - 3600 * kSecond;
  for (int i = 0; i < 100; ++i) {
    merger.push(imu(back + i * 10 * kMs));
    drain(merger, out);
    EXPECT_EQ(merger.counts().resets, i < 4 ? 0 : 1);
  }
  merger.finish();
  drain(merger, out);
  EXPECT_EQ(merger.counts().late[0], 4);
  ASSERT_EQ(out.size(), 196U);
  // All of the old sequence first, in order; then all of the new one.
  for (int i = 0; i < 100; ++i) EXPECT_EQ(std::get<0>(out[static_cast<std::size_t>(i)]), kEpoch + i * 10 * kMs);
  for (int i = 4; i < 100; ++i) EXPECT_EQ(std::get<0>(out[static_cast<std::size_t>(i) + 96]), back + i * 10 * kMs);
}

TEST(StreamMerger, LateSamplesBetweenGoodOnesDoNotReset) {
  StreamMergerOptions options;
  options.reset_after = 3;
  StreamMerger merger(options);
  std::vector<Key> out;
  for (int i = 0; i < 100; ++i) {
    merger.push(imu(kEpoch + i * kSecond));
    drain(merger, out);
    for (int k = 0; k < 2; ++k) merger.push(imu(kEpoch + i * kSecond - 500 * kMs));
  }
  EXPECT_EQ(merger.counts().resets, 0);
  EXPECT_EQ(merger.counts().late[0], 200);
}

class AbsurdTime : public ::testing::TestWithParam<TimeNs> {};

// One sample with a wrong time, at the start or in the middle, in one of two streams: everything else comes through in
// order (less what the reset costs where the wrong one came first).
TEST_P(AbsurdTime, InTheMiddleCostsNothingElse) {
  std::vector<Measurement> arrivals;
  std::vector<Measurement> good;
  for (int i = 0; i < 400; ++i) {
    if (i == 200) arrivals.push_back(imu(GetParam()));
    good.push_back(imu(kEpoch + i * 5 * kMs));
    if (i >= 8 && i % 2 == 0) good.push_back(magnetometer(kEpoch + (i - 8) * 5 * kMs));  // always 40 ms late
    arrivals.insert(arrivals.end(), good.end() - (i >= 8 && i % 2 == 0 ? 2 : 1), good.end());
  }
  StreamMerger used;
  const std::vector<Key> out = merge(arrivals, {}, &used);
  EXPECT_EQ(out, sorted_keys(good));
  EXPECT_EQ(used.counts().late[0] + used.counts().absurd[0], 1);
  EXPECT_EQ(used.counts().late[1], 0);
  EXPECT_EQ(used.counts().resets, 0);
}

TEST_P(AbsurdTime, AtTheStartDoesNotBlockTheStream) {
  std::vector<Measurement> arrivals = {imu(GetParam())};
  for (int i = 0; i < 400; ++i) {
    arrivals.push_back(imu(kEpoch + i * 5 * kMs));
    if (i >= 8 && i % 2 == 0) arrivals.push_back(magnetometer(kEpoch + (i - 8) * 5 * kMs));
  }
  StreamMerger used;
  const std::vector<Key> out = merge(arrivals, {}, &used);
  EXPECT_LE(used.counts().resets, 1);
  const std::int64_t late = used.counts().late[0] + used.counts().late[1];
  EXPECT_LE(late, 40);
  EXPECT_EQ(out.size() + static_cast<std::size_t>(late), arrivals.size());
  // From 1 s on all are there and in order.
  std::vector<Key> tail;
  std::vector<Key> expected;
  for (const Key& key : out) {
    if (std::get<0>(key) >= kEpoch + kSecond && std::get<0>(key) < kEpoch + 3 * kSecond) tail.push_back(key);
  }
  for (const Key& key : sorted_keys(arrivals)) {
    if (std::get<0>(key) >= kEpoch + kSecond && std::get<0>(key) < kEpoch + 3 * kSecond) expected.push_back(key);
  }
  EXPECT_EQ(tail, expected);
}

INSTANTIATE_TEST_SUITE_P(Times, AbsurdTime,
                         ::testing::Values(std::numeric_limits<TimeNs>::max(), std::numeric_limits<TimeNs>::min() + 1,
                                           TimeNs{0}, kEpoch + 3600 * kSecond, kEpoch - 3600 * kSecond));

TEST(StreamMerger, APauseLosesNothing) {
  std::vector<Measurement> arrivals;
  for (int part = 0; part < 3; ++part) {
    const TimeNs start = kEpoch + part * 600 * kSecond;
    for (int i = 0; i < 50; ++i) {
      arrivals.push_back(imu(start + i * 5 * kMs));
      // The magnetometer lags 20 ms: its last samples from before the pause arrive after the IMU's first behind it.
      if (i == 0 && part > 0) {
        for (int k = 46; k < 50; ++k) arrivals.push_back(magnetometer(start - 600 * kSecond + k * 5 * kMs));
      }
      if (i >= 4) arrivals.push_back(magnetometer(start + (i - 4) * 5 * kMs));
    }
  }
  StreamMerger used;
  EXPECT_EQ(merge(arrivals, {}, &used), sorted_keys(arrivals));
  EXPECT_EQ(used.counts().absurd[0] + used.counts().late[0] + used.counts().late[1] + used.counts().resets, 0);
}

TEST(StreamMerger, SamplesFurtherApartThanMaxJumpComeThrough) {
  std::vector<Measurement> arrivals;
  for (int i = 0; i < 10; ++i) arrivals.push_back(imu(kEpoch + i * 60 * kSecond));
  StreamMerger used;
  EXPECT_EQ(merge(arrivals, {}, &used), sorted_keys(arrivals));
}

TEST(StreamMerger, RefusesBadOptionsAndSamplesWithoutTime) {
  StreamMerger merger;
  EXPECT_THROW(merger.push(imu(kNoTime)), std::invalid_argument);
  StreamMergerOptions options;
  options.max_delay_ns = -1;
  EXPECT_THROW(StreamMerger{options}, std::invalid_argument);
  options = {};
  options.max_jump_ns = 0;
  EXPECT_THROW(StreamMerger{options}, std::invalid_argument);
  options = {};
  options.max_samples = 0;
  EXPECT_THROW(StreamMerger{options}, std::invalid_argument);
  options = {};
  options.reset_after = 0;
  EXPECT_THROW(StreamMerger{options}, std::invalid_argument);
}

TEST(StreamMerger, AStreamThatIsAlwaysLateIsCountedAndResetsNothing) {
  // 90 ms behind, where 50 ms are waited for; on another epoch altogether.
  for (const TimeNs behind : {90'000'000LL, 3'600'000'000'000LL}) {
    StreamMerger merger;
    std::int64_t magnetometers = 0;
    TimeNs last = kNoTime;
    for (int i = 0; i < 1000; ++i) {
      ImuMeasurement imu;
      imu.time_ns = i * 10'000'000LL;
      merger.push(imu);
      if (i > 10) {
        MagnetometerMeasurement magnetometer;
        magnetometer.time_ns = imu.time_ns - behind;
        merger.push(magnetometer);
        ++magnetometers;
      }
      while (const auto out = merger.pop()) {
        ASSERT_GE(stamp_of(*out).time_ns, last);
        last = stamp_of(*out).time_ns;
      }
    }
    EXPECT_EQ(merger.counts().resets, 0) << behind;
    EXPECT_GT(merger.counts().late[static_cast<std::size_t>(StreamKind::kMagnetometer)], magnetometers - 20) << behind;
  }
}

}  // namespace
}  // namespace loc
