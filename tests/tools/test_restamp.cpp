// Measurements stamped on another clock: what leaves, when, with which time, and what is said about it.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <thread>
#include <vector>

#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/sim/clock.hpp"
#include "msgs/convert.hpp"
#include "msgs/decode.hpp"
#include "support/sources.hpp"
#include "tools/support/clock_link.hpp"
#include "tools/support/hub.hpp"
#include "tools/support/program.hpp"
#include "tools/support/restamp.hpp"

namespace loc {
namespace {

constexpr TimeNs kSecond = 1'000'000'000;

/// Gives what it holds; before each measurement it calls a function, as a live source calls its handlers.
class ListSource : public MeasurementSource {
 public:
  std::vector<Measurement> list;
  std::function<void(const Measurement&)> before;

  std::optional<Measurement> next() override {
    if (at_ == list.size()) return std::nullopt;
    if (before) before(list[at_]);
    return list[at_++];
  }
  NamedCounts counts() const override { return {{"list.read", static_cast<std::int64_t>(at_)}}; }

 private:
  std::size_t at_ = 0;
};

ImuMeasurement imu(TimeNs time_ns, TimeNs host_time_ns, std::int64_t sequence = 0) {
  ImuMeasurement m;
  m.time_ns = time_ns;
  m.host_time_ns = host_time_ns;
  m.sequence = sequence;
  return m;
}

struct Recording {
  std::vector<ClockSample> truth;  // by sequence
  std::unique_ptr<ListSource> source = std::make_unique<ListSource>();
};

Recording imu_recording(const ClockSimulation& simulation, double duration_s) {
  Recording r;
  r.truth = simulate_clock(simulation, duration_s, Random(1));
  for (std::size_t i = 0; i < r.truth.size(); ++i) {
    r.source->list.emplace_back(imu(r.truth[i].device_time_ns, r.truth[i].host_time_ns, static_cast<std::int64_t>(i)));
  }
  return r;
}

RestampOptions options_for(TimeBase base) {
  RestampOptions options;
  options.base = base;
  return options;
}

TEST(Restamp, device_time_to_host_time) {
  ClockSimulation simulation = ClockSimulation::usb_imu();
  Recording r = imu_recording(simulation, 200);
  const auto original = r.source->list;
  RestampedSource source(std::move(r.source), options_for(TimeBase::kHost));
  const auto out = test::only<ImuMeasurement>(test::read_all(source));
  ASSERT_EQ(out.size(), original.size());
  std::vector<double> late_us;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto k = static_cast<std::size_t>(out[i].sequence);
    ASSERT_EQ(k, i) << "order of arrival";
    EXPECT_EQ(out[i].host_time_ns, stamp_of(original[k]).host_time_ns) << "stays as it was";
    if (i > 0) {
      EXPECT_GT(out[i].time_ns, out[i - 1].time_ns);
    }
    const double error_us = 1e-3 * static_cast<double>(out[i].time_ns - r.truth[k].earliest_host_ns);
    EXPECT_LT(std::abs(error_us), 200) << "also at the beginning, which has waited for the warm-up";
    if (i > 120 * 200) late_us.push_back(error_us);
  }
  EXPECT_LT(root_mean_square(late_us), 2);
  EXPECT_EQ(test::count(source.counts(), "clock.stamped"), 40'000);
  EXPECT_EQ(test::count(source.counts(), "clock.dropped_unknown"), 0);
  EXPECT_EQ(test::count(source.counts(), "list.read"), 40'000);
  const auto status = source.status();
  ASSERT_EQ(status.size(), 1U);
  EXPECT_EQ(status[0].clock, "imu");
  EXPECT_EQ(status[0].onto, "host");
  EXPECT_NEAR(status[0].skew_ppm, 50.5, 0.6);
  EXPECT_NEAR(status[0].offset_s, 1000, 0.1);
  EXPECT_LT(status[0].sigma_us, 5);
}

TEST(Restamp, reset_of_the_device_loses_nothing_and_steps_nowhere) {
  ClockSimulation simulation = ClockSimulation::usb_imu();
  simulation.events = {{ClockEvent::Kind::kDeviceReset, 30, 0}};
  Recording r = imu_recording(simulation, 60);
  RestampedSource source(std::move(r.source), options_for(TimeBase::kHost));
  const auto out = test::only<ImuMeasurement>(test::read_all(source));
  ASSERT_EQ(out.size(), 12'000U);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto k = static_cast<std::size_t>(out[i].sequence);
    EXPECT_NEAR(static_cast<double>(out[i].time_ns - r.truth[k].earliest_host_ns), 0, 2e6) << i;
    if (i > 0) {
      EXPECT_GT(out[i].time_ns, out[i - 1].time_ns) << i;
    }
  }
  EXPECT_EQ(test::count(source.counts(), "clock.device_resets"), 1);
  EXPECT_EQ(test::count(source.counts(), "clock.steps"), 0);
}

// Poses that join before must join after, though the line moves between samples; one that begins between samples keeps
// its length.
TEST(Restamp, start_of_a_relative_odometry_moves_with_its_end) {
  Recording r = imu_recording(ClockSimulation::usb_imu(), 30);
  std::vector<TimeNs> device;
  for (std::size_t i = 0; i < r.source->list.size(); ++i) {
    OdometryMeasurement odometry;
    static_cast<Stamp&>(odometry) = stamp_of(r.source->list[i]);
    if (i > 0) odometry.start_time_ns = i % 7 == 0 ? odometry.time_ns - 2'500'000 : device.back();
    device.push_back(odometry.time_ns);
    r.source->list[i] = odometry;
  }
  RestampedSource source(std::move(r.source), options_for(TimeBase::kHost));
  const auto out = test::only<OdometryMeasurement>(test::read_all(source));
  ASSERT_EQ(out.size(), device.size());
  EXPECT_EQ(out[0].start_time_ns, kNoTime) << "an absolute one stays absolute";
  for (std::size_t i = 1; i < out.size(); ++i) {
    EXPECT_NE(out[i].time_ns, device[i]);
    if (i % 7 == 0) {
      EXPECT_EQ(out[i].time_ns - out[i].start_time_ns, 2'500'000) << i;
    } else {
      EXPECT_EQ(out[i].start_time_ns, out[i - 1].time_ns) << i;
    }
  }
}

TEST(Restamp, absurd_device_times_are_dropped_and_counted) {
  Recording r = imu_recording(ClockSimulation::usb_imu(), 30);
  for (const std::size_t i : {2000U, 3000U, 4000U}) {
    stamp_of(r.source->list[i]).time_ns = i == 3000 ? 77'000'000 * kSecond : -kSecond;
  }
  RestampedSource source(std::move(r.source), options_for(TimeBase::kHost));
  EXPECT_EQ(test::read_all(source).size(), 5997U);
  EXPECT_EQ(test::count(source.counts(), "clock.dropped_absurd"), 3);
}

TEST(Restamp, without_arrivals_there_is_no_other_time) {
  auto list = std::make_unique<ListSource>();
  list->list.emplace_back(imu(5, kNoTime));
  RestampedSource source(std::move(list), options_for(TimeBase::kHost));
  test::expect_data_error([&] { source.next(); }, {"imu", "time_ns = 5", "host_time_ns", "--time-base"});
}

// An IMU and a receiver on one host. GPS truth: linear between seconds.
struct WithGps {
  Recording imu;
  SimulatedGpsTime gps;

  double gps_error_us(const ImuMeasurement& m) const {
    const TimeNs host = imu.truth[static_cast<std::size_t>(m.sequence)].earliest_host_ns;
    const auto after = std::upper_bound(gps.host_time_ns.begin(), gps.host_time_ns.end(), host);
    const auto i = static_cast<std::size_t>(std::max<std::ptrdiff_t>(1, after - gps.host_time_ns.begin())) - 1;
    const double part = static_cast<double>(host - gps.host_time_ns[i]) /
                        static_cast<double>(gps.host_time_ns[i + 1] - gps.host_time_ns[i]);
    return 1e-3 * (static_cast<double>(m.time_ns - gps.gps_time_ns[i]) - 1e9 * part);
  }
};

WithGps with_gps(bool pulses, double duration_s = 200) {
  WithGps w;
  w.imu = imu_recording(ClockSimulation::usb_imu(), duration_s);
  GpsTimeSimulation simulation;
  simulation.with_pulses = pulses;
  simulation.pulses.host_start_ns = ClockSimulation::usb_imu().host_start_ns;
  w.gps = simulate_gps_time(simulation, duration_s + 10, Random(2));
  return w;
}

TEST(Restamp, device_time_stays_as_it_is_and_the_receiver_is_followed_all_the_same) {
  WithGps w = with_gps(true, 60);
  const auto original = w.imu.source->list;
  ListSource* list = w.imu.source.get();
  RestampOptions options = options_for(TimeBase::kDevice);
  std::vector<clock_t> sent;
  options.send = [&](const clock_t& message) { sent.push_back(message); };
  RestampedSource source(std::move(w.imu.source), options);
  std::size_t next = 0;
  list->before = [&](const Measurement& m) {
    for (; w.gps.events[next].host_time_ns < stamp_of(m).host_time_ns; ++next) source.take(w.gps.events[next]);
  };
  const auto out = test::read_all(source);
  ASSERT_EQ(out.size(), original.size());
  for (std::size_t i = 0; i < out.size(); ++i) EXPECT_EQ(stamp_of(out[i]).time_ns, stamp_of(original[i]).time_ns);
  ASSERT_NEAR(static_cast<double>(sent.size()), 59, 4) << "once a second";
  EXPECT_EQ(sent.front().quality, clock_t::QUALITY_LABELS);
  EXPECT_EQ(sent.back().quality, clock_t::QUALITY_PULSES);
  EXPECT_EQ(sent.back().input_clock, "host");
  const ClockLine line = from_message(sent.back());
  EXPECT_NEAR(static_cast<double>(line.convert(w.gps.host_time_ns[55]) - w.gps.gps_time_ns[55]), 0, 30'000);
}

TEST(Restamp, device_time_to_gps_time_by_pulses) {
  WithGps w = with_gps(true);
  ListSource* list = w.imu.source.get();
  RestampedSource source(std::move(w.imu.source), options_for(TimeBase::kGps));
  std::size_t next = 0;
  list->before = [&](const Measurement& m) {
    for (; w.gps.events[next].host_time_ns < stamp_of(m).host_time_ns; ++next) source.take(w.gps.events[next]);
  };
  const auto out = test::only<ImuMeasurement>(test::read_all(source));
  ASSERT_EQ(out.size(), 40'000U) << "what came before the pulses were paired has waited";
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (i > 0) {
      ASSERT_GT(out[i].time_ns, out[i - 1].time_ns) << i;
    }
    ASSERT_LT(std::abs(w.gps_error_us(out[i])), i < 120 * 200 ? 300 : 15)
        << i << ": one clock from the first sample on";
  }
  const auto status = source.status();
  ASSERT_EQ(status.size(), 2U);
  EXPECT_EQ(status[1].basis, "pulses");
  EXPECT_EQ(test::count(source.counts(), "clock.steps"), 0);
}

TEST(Restamp, labels_only_are_believed_after_waiting_for_pulses) {
  WithGps w = with_gps(false, 60);
  ListSource* list = w.imu.source.get();
  RestampedSource source(std::move(w.imu.source), options_for(TimeBase::kGps));
  std::size_t next = 0;
  list->before = [&](const Measurement& m) {
    for (; w.gps.events[next].host_time_ns < stamp_of(m).host_time_ns; ++next) source.take(w.gps.events[next]);
  };
  auto first = source.next();
  ASSERT_TRUE(first);
  EXPECT_NEAR(static_cast<double>(test::count(source.counts(), "list.read")), 5.2 * 200, 60)
      << "5 s after the first label";
  EXPECT_LT(std::abs(w.gps_error_us(std::get<ImuMeasurement>(*first))), 400'000);
  EXPECT_EQ(test::read_all(source).size(), 12'000U - 1);
  EXPECT_EQ(source.status()[1].basis, "labels");
  EXPECT_GT(source.status()[1].sigma_us, 30'000) << "says how little it knows";
}

TEST(Restamp, pulses_that_come_late_make_time_better_without_a_step_back) {
  WithGps w = with_gps(true, 60);
  ListSource* list = w.imu.source.get();
  RestampedSource source(std::move(w.imu.source), options_for(TimeBase::kGps));
  std::size_t next = 0;
  list->before = [&](const Measurement& m) {
    for (; w.gps.events[next].host_time_ns < stamp_of(m).host_time_ns; ++next) {
      const bool early = w.gps.events[next].host_time_ns < w.gps.host_time_ns[30];
      if (early && w.gps.events[next].kind == GpsTimeEvent::Kind::kPulse) continue;
      source.take(w.gps.events[next]);
    }
  };
  const auto out = test::only<ImuMeasurement>(test::read_all(source));
  ASSERT_EQ(out.size(), 12'000U);
  for (std::size_t i = 1; i < out.size(); ++i) ASSERT_GT(out[i].time_ns, out[i - 1].time_ns) << i;
  EXPECT_LT(std::abs(w.gps_error_us(out.back())), 30);
}

TEST(Restamp, gps_time_that_never_comes) {
  WithGps w = with_gps(true, 60);
  RestampOptions options = options_for(TimeBase::kGps);
  options.wait_s = 10;
  RestampedSource source(std::move(w.imu.source), options);
  test::expect_data_error([&] { source.next(); }, {"--time-base gps", "12000 measurements", "LOC_CLOCK"});
  EXPECT_EQ(test::count(source.counts(), "clock.dropped_unknown"), 12'000);
}

TEST(Restamp, gps_time_that_comes_after_the_longest_wait) {
  WithGps w = with_gps(true, 60);
  ListSource* list = w.imu.source.get();
  RestampOptions options = options_for(TimeBase::kGps);
  options.wait_s = 10;
  RestampedSource source(std::move(w.imu.source), options);
  std::size_t next = 0;
  list->before = [&](const Measurement& m) {
    for (; w.gps.events[next].host_time_ns < stamp_of(m).host_time_ns; ++next) {
      if (w.gps.events[next].host_time_ns > w.gps.host_time_ns[30]) source.take(w.gps.events[next]);
    }
  };
  const auto out = test::only<ImuMeasurement>(test::read_all(source));
  // Known at 35 s, three pulses and three labels later: what came before 25 s is gone, the rest is on one clock.
  EXPECT_NEAR(static_cast<double>(out.size()), 34.5 * 200, 300);
  EXPECT_EQ(test::count(source.counts(), "clock.dropped_unknown") + static_cast<std::int64_t>(out.size()), 12'000);
  for (const ImuMeasurement& m : out) ASSERT_LT(std::abs(w.gps_error_us(m)), 1000);
}

TEST(Restamp, bounded_by_the_number_that_waits) {
  WithGps w = with_gps(true, 60);
  RestampOptions options = options_for(TimeBase::kGps);
  options.max_waiting = 100;
  options.wait_s = 1000;
  RestampedSource source(std::move(w.imu.source), options);
  EXPECT_THROW(source.next(), DataError);
  EXPECT_EQ(test::count(source.counts(), "clock.dropped_unknown"), 12'000);
}

TEST(Restamp, fixes_are_labels_and_get_their_own_time_of_validity) {
  WithGps w = with_gps(false, 60);
  std::vector<Measurement> all = w.imu.source->list;
  for (const GpsTimeEvent& e : w.gps.events) {
    GpsMeasurement fix;
    fix.time_ns = fix.host_time_ns = e.host_time_ns;
    fix.gps_time_ns = e.gps_time_ns;
    all.emplace_back(fix);
  }
  std::stable_sort(all.begin(), all.end(), [](const Measurement& a, const Measurement& b) {
    return stamp_of(a).host_time_ns < stamp_of(b).host_time_ns;
  });
  for (const TimeBase base : {TimeBase::kGps, TimeBase::kHost}) {
    auto list = std::make_unique<ListSource>();
    list->list = all;
    RestampedSource source(std::move(list), options_for(base));
    const auto out = test::read_all(source);
    EXPECT_EQ(out.size(), all.size());
    for (const GpsMeasurement& fix : test::only<GpsMeasurement>(out)) {
      if (base == TimeBase::kGps) {
        EXPECT_EQ(fix.time_ns, fix.gps_time_ns);
      } else {
        EXPECT_LT(std::abs(static_cast<double>(fix.time_ns - fix.host_time_ns)), 0.7e9);
      }
    }
  }
}

// One program has the receiver, the other one the IMU: through LCM.
void expect_gps_time_over_lcm(const std::string& url) {
  WithGps w = with_gps(true, 40);
  ListSource* list = w.imu.source.get();
  // The receiver's program: it has nothing but time events.
  ClockLink sender_link(url);
  RestampOptions sender_options = options_for(TimeBase::kGps);
  std::int64_t sent = 0;
  sender_options.send = [&](const clock_t& message) {
    ++sent;
    sender_link.publish(message);
  };
  sender_options.sender = "receiver";
  RestampedSource sender(std::make_unique<ListSource>(), sender_options);

  ClockLink link(url);
  RestampOptions options = options_for(TimeBase::kGps);
  RestampedSource* self = nullptr;
  options.poll = [&] { link.poll(*self); };
  RestampedSource source(std::move(w.imu.source), options);
  self = &source;
  std::size_t next = 0;
  std::int64_t before = 0;
  list->before = [&](const Measurement& m) {
    for (; w.gps.events[next].host_time_ns < stamp_of(m).host_time_ns; ++next) sender.take(w.gps.events[next]);
    // Simulated time runs faster than messages travel.
    if (sent != before) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    before = sent;
  };
  const auto out = test::only<ImuMeasurement>(test::read_all(source));
  EXPECT_EQ(out.size(), 8000U);
  EXPECT_NEAR(static_cast<double>(sent), 38, 4);
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (i > 0) {
      ASSERT_GT(out[i].time_ns, out[i - 1].time_ns);
    }
    ASSERT_LT(std::abs(w.gps_error_us(out[i])), 300) << i;
  }
  ASSERT_EQ(source.status().size(), 2U);
  EXPECT_EQ(source.status()[1].basis, "other");
}

TEST(Restamp, gps_time_from_another_program_over_a_hub) {
  HubOptions options;
  options.port = 0;
  Hub hub(options);
  std::atomic<bool> stop = false;
  std::thread thread([&] {
    while (!stop) hub.run_once(std::chrono::milliseconds(20));
  });
  expect_gps_time_over_lcm("tcpq://127.0.0.1:" + std::to_string(hub.port()));
  stop = true;
  thread.join();
}

TEST(Restamp, messages_that_are_wrong_or_from_a_third_program) {
  TimeNs now = 0;
  RestampOptions options = options_for(TimeBase::kGps);
  options.steady = [&] { return now; };
  RestampedSource source(std::make_unique<ListSource>(), options);
  clock_t message = to_message(ClockLine{1000 * kSecond, 5 * kSecond, 0, 1000, 1e-9, 1e-8, 0, 2000 * kSecond});
  message.source = "a";
  message.host = host_identity();
  message.time_ns = 1;
  message.input_clock = "host";
  message.output_clock = "gps";
  message.quality = clock_t::QUALITY_PULSES;
  clock_t wrong = message;
  wrong.skew = std::nan("");
  source.take(wrong);
  EXPECT_EQ(test::count(source.counts(), "clock.bad_messages"), 1);
  EXPECT_EQ(source.status()[0].basis, "none");
  wrong = message;
  wrong.output_clock = "device";
  source.take(wrong);
  EXPECT_EQ(source.status()[0].basis, "none");
  wrong = message;
  wrong.host = "another computer";
  source.take(wrong);
  EXPECT_EQ(source.status()[0].basis, "none");
  EXPECT_EQ(test::count(source.counts(), "clock.other_hosts"), 1);
  wrong = message;
  wrong.source = own_name();
  source.take(wrong);
  EXPECT_EQ(source.status()[0].basis, "none") << "what we have said ourselves";
  source.take(message);
  EXPECT_EQ(source.status()[0].basis, "other");
  clock_t third = message;
  third.source = "b";
  third.output_ref_ns += kSecond;
  source.take(third);
  EXPECT_EQ(test::count(source.counts(), "clock.other_sources"), 1);
  EXPECT_NEAR(source.status()[0].offset_s, -995, 1e-6);
  // The first one has nothing new to say; the host's clock was set back, and does not matter.
  now = 3 * kSecond;
  source.take(message);
  now = 6 * kSecond;
  third.input_ref_ns -= 400 * kSecond;
  third.output_ref_ns -= 400 * kSecond;
  source.take(third);
  EXPECT_NEAR(source.status()[0].offset_s, -994, 1e-6);
  EXPECT_EQ(test::count(source.counts(), "clock.other_sources"), 1);
}

TEST(Restamp, a_fix_with_a_wrong_date_does_not_leave) {
  WithGps w = with_gps(false, 60);
  for (const TimeBase base : {TimeBase::kGps, TimeBase::kHost}) {
    auto list = std::make_unique<ListSource>();
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < w.gps.events.size(); ++i) {
      GpsMeasurement fix;
      fix.time_ns = fix.host_time_ns = w.gps.events[i].host_time_ns;
      fix.gps_time_ns = w.gps.events[i].gps_time_ns;
      if (i == 20 || i == 40) fix.gps_time_ns += (i == 20 ? -1 : 1) * 86'400 * kSecond;
      wrong += i == 20 || i == 40 ? 1 : 0;
      list->list.emplace_back(fix);
    }
    ASSERT_EQ(wrong, 2U);
    const std::size_t all = list->list.size();
    RestampedSource source(std::move(list), options_for(base));
    const auto out = test::only<GpsMeasurement>(test::read_all(source));
    EXPECT_EQ(out.size(), all - 2);
    EXPECT_EQ(test::count(source.counts(), "gps.time_disagrees"), 2);
    for (std::size_t i = 1; i < out.size(); ++i) {
      EXPECT_LT(std::abs(to_seconds(out[i].time_ns - out[i - 1].time_ns)), 3) << i;
    }
  }
}

TEST(Restamp, options_are_checked) {
  EXPECT_EQ(parse_time_base("gps"), TimeBase::kGps);
  EXPECT_THROW(parse_time_base("utc"), UsageError);
  const auto refused = [](auto change) {
    RestampOptions options;
    change(options);
    EXPECT_THROW(RestampedSource(std::make_unique<ListSource>(), options), std::invalid_argument);
  };
  refused([](auto& o) { o.wait_s = -1; });
  refused([](auto& o) { o.warm_up_s = std::nan(""); });
  refused([](auto& o) { o.pulse_wait_s = 1e300; });
  refused([](auto& o) { o.max_waiting = 0; });
  refused([](auto& o) { o.clock.window_s = 0; });
  refused([](auto& o) { o.gps.pulse_gate_ns = 0; });
}

}  // namespace
}  // namespace loc
