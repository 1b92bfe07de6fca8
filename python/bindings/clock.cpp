// sensors/clock and calib/time_offset: clock models on arrays, their simulation, latency of a position stream.
#include "libloc/sensors/clock.hpp"

#include <pybind11/stl.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "libloc/calib/time_offset.hpp"
#include "libloc/sensors/clock_calibration.hpp"
#include "libloc/sensors/clock_counter.hpp"
#include "libloc/sensors/clock_gps.hpp"
#include "libloc/sim/clock.hpp"

namespace locpy {
namespace {

using loc::ClockCalibrationResult;
using loc::ClockChain;
using loc::ClockCounts;
using loc::ClockLine;
using loc::ClockModel;
using loc::ClockModelOptions;
using loc::ClockStamp;
using loc::CounterUnwrapper;
using loc::GpsClock;
using loc::GpsClockCounts;
using loc::GpsClockOptions;
using loc::GpsTimeEvent;
using loc::TimeNs;
using loc::TimeOffsetOptions;
using loc::TimeOffsetResult;

using Stamps = std::pair<py::array_t<TimeNs>, py::array_t<double>>;

void require_same(std::size_t size, const char* name, std::size_t expected, const char* like) {
  require_rows(static_cast<py::ssize_t>(size), name, static_cast<py::ssize_t>(expected), like);
}

/// Calls answer(i) for each of count rows without the GIL; no answer: INT64_MIN and NaN.
template <class Answer>
Stamps stamps(std::size_t count, Answer answer) {
  py::array_t<TimeNs> times(static_cast<py::ssize_t>(count));
  py::array_t<double> sigmas(static_cast<py::ssize_t>(count));
  TimeNs* time = times.mutable_data();
  double* sigma = sigmas.mutable_data();
  {
    const py::gil_scoped_release release;
    for (std::size_t i = 0; i < count; ++i) {
      if (i % kSignalInterval == kSignalInterval - 1) check_signals();
      const std::optional<ClockStamp> stamp = answer(i);
      time[i] = stamp ? stamp->time_ns : loc::kNoTime;
      sigma[i] = stamp ? stamp->sigma_ns : std::numeric_limits<double>::quiet_NaN();
    }
  }
  return {times, sigmas};
}

constexpr const char* kStampsDoc =
    "Returns (times_ns, sigma_ns): int64 (N,) and float64 (N,); INT64_MIN (libloc.NO_TIME) and NaN where there is no "
    "answer.";

template <class T>
void set(T& field, const py::handle& value) {
  field = value.cast<T>();
}

ClockModelOptions model_options(const py::kwargs& kwargs) {
  ClockModelOptions o;
  for (const auto& [key, value] : kwargs) {
    const auto name = key.cast<std::string>();
    if (name == "window_s")
      set(o.window_s, value);
    else if (name == "skew_sigma_ppm")
      set(o.skew_sigma_ppm, value);
    else if (name == "initial_sigma_ns")
      set(o.initial_sigma_ns, value);
    else if (name == "skew_walk")
      set(o.skew_walk, value);
    else if (name == "min_step_ns")
      set(o.min_step_ns, value);
    else if (name == "step_samples")
      set(o.step_samples, value);
    else if (name == "step_s")
      set(o.step_s, value);
    else if (name == "early_samples")
      set(o.early_samples, value);
    else if (name == "reset_samples")
      set(o.reset_samples, value);
    else if (name == "reset_step_ns")
      set(o.reset_step_ns, value);
    else if (name == "max_extrapolation_s")
      set(o.max_extrapolation_s, value);
    else
      throw py::type_error("unexpected option '" + name + "'");
  }
  o.check();
  return o;
}

GpsClockOptions gps_options(const py::kwargs& kwargs) {
  GpsClockOptions o;
  for (const auto& [key, value] : kwargs) {
    const auto name = key.cast<std::string>();
    if (name == "label") {
      const auto label = value.cast<std::string>();
      if (label != "previous" && label != "next") {
        throw py::value_error("label = '" + label + "': must be 'previous' or 'next'");
      }
      o.label = label == "next" ? loc::PulseLabel::kNext : loc::PulseLabel::kPrevious;
    } else if (name == "pulse_gate_ns")
      set(o.pulse_gate_ns, value);
    else if (name == "pulse_delay_ns")
      set(o.pulse_delay_ns, value);
    else if (name == "sigma_pulse_delay_ns")
      set(o.sigma_pulse_delay_ns, value);
    else if (name == "pairing_delay_ns")
      set(o.pairing_delay_ns, value);
    else if (name == "label_delay_ns")
      set(o.label_delay_ns, value);
    else if (name == "sigma_label_delay_ns")
      set(o.sigma_label_delay_ns, value);
    else if (name == "max_pulse_extrapolation_s")
      set(o.max_pulse_extrapolation_s, value);
    else if (name == "max_label_extrapolation_s")
      set(o.max_label_extrapolation_s, value);
    else
      throw py::type_error("unexpected option '" + name + "'");
  }
  o.check();
  return o;
}

py::dict counts_dict(const ClockCounts& c) {
  py::dict d;
  d["samples"] = c.samples;
  d["used"] = c.used;
  d["invalid"] = c.invalid;
  d["duplicates"] = c.duplicates;
  d["out_of_order"] = c.out_of_order;
  d["suspects"] = c.suspects;
  d["gaps"] = c.gaps;
  d["device_resets"] = c.device_resets;
  d["device_jumps"] = c.device_jumps;
  d["host_steps_forward"] = c.host_steps_forward;
  d["host_steps_back"] = c.host_steps_back;
  return d;
}

py::dict counts_dict(const GpsClockCounts& c) {
  py::dict d;
  d["pulses"] = c.pulses;
  d["pulses_used"] = c.pulses_used;
  d["pulses_missing"] = c.pulses_missing;
  d["pulses_spurious"] = c.pulses_spurious;
  d["pulse_locks"] = c.pulse_locks;
  d["labels"] = c.labels;
  d["labels_disagreeing"] = c.labels_disagreeing;
  d["labels_ambiguous"] = c.labels_ambiguous;
  d["label_jumps"] = c.label_jumps;
  d["week_rollovers"] = c.week_rollovers;
  d["invalid"] = c.invalid;
  return d;
}

void bind_line(py::module_& m) {
  py::class_<ClockLine>(m, "ClockLine",
                        "One clock in terms of another: output = output_ref + (input - input_ref) * (1 + skew).")
      .def_readonly("input_ref_ns", &ClockLine::input_ref_ns)
      .def_readonly("output_ref_ns", &ClockLine::output_ref_ns)
      .def_readonly("skew", &ClockLine::skew, "relative frequency error; 1e-6 is 1 ppm")
      .def_property_readonly("skew_ppm", &ClockLine::skew_ppm)
      .def_property_readonly("offset_ns", &ClockLine::offset_ns, "output - input at the reference")
      .def_readonly("sigma_ns", &ClockLine::sigma_ns, "standard deviation of the output at input_ref_ns")
      .def_readonly("sigma_skew", &ClockLine::sigma_skew)
      .def_readonly("valid_from_ns", &ClockLine::valid_from_ns, "span of the input for which the line holds")
      .def_readonly("valid_to_ns", &ClockLine::valid_to_ns)
      .def("inverse", &ClockLine::inverse, "The line from output to input.")
      .def(
          "convert",
          [](const ClockLine& self, const TimeArray& input) {
            const auto times = times_view(input, "input_ns");
            return stamps(times.size(), [&](std::size_t i) {
              return std::optional(ClockStamp{self.convert(times[i]), self.sigma_at_ns(times[i])});
            });
          },
          py::arg("input_ns"), "(times_ns, sigma_ns) of int64 (N,); also outside the span, where sigma grows.");
}

void bind_model(py::module_& m) {
  py::class_<ClockModel>(
      m, "ClockModel",
      "Device clock to host clock, from stamps and arrivals: a line under a sliding window of samples that are only "
      "ever "
      "late. Gives true time + minimum delay. Survives resets, jumps, steps, gaps; times never step back.")
      .def(py::init([](const py::kwargs& kwargs) { return ClockModel(model_options(kwargs)); }),
           "Options as keywords: window_s=120, skew_sigma_ppm=100, initial_sigma_ns=10_000_000, skew_walk=1.5e-8, "
           "min_step_ns=200_000, step_samples=20, step_s=5, early_samples=5, reset_samples=3, "
           "reset_step_ns=1_000_000_000, max_extrapolation_s=60. ValueError names one that is out of range.")
      .def(
          "update",
          [](ClockModel& self, const TimeArray& device, const TimeArray& host) {
            const auto d = times_view(device, "device_times_ns");
            const auto h = times_view(host, "host_times_ns");
            require_same(h.size(), "host_times_ns", d.size(), "device_times_ns");
            const py::gil_scoped_release release;
            for (std::size_t i = 0; i < d.size(); ++i) self.update(d[i], h[i]);
          },
          py::arg("device_times_ns"), py::arg("host_times_ns"), "Samples in the order of arrival, int64 (N,) each.")
      .def(
          "convert",
          [](ClockModel& self, const TimeArray& device) {
            const auto d = times_view(device, "device_times_ns");
            return stamps(d.size(), [&](std::size_t i) { return self.convert(d[i]); });
          },
          py::arg("device_times_ns"), kStampsDoc)
      .def(
          "process",
          [](ClockModel& self, const TimeArray& device, const TimeArray& host) {
            const auto d = times_view(device, "device_times_ns");
            const auto h = times_view(host, "host_times_ns");
            require_same(h.size(), "host_times_ns", d.size(), "device_times_ns");
            return stamps(d.size(), [&](std::size_t i) {
              self.update(d[i], h[i]);
              return self.convert(d[i]);
            });
          },
          py::arg("device_times_ns"), py::arg("host_times_ns"),
          "As live: each sample is taken in, then converted with what is known by then. Returns (times_ns, sigma_ns) "
          "as "
          "convert().")
      .def_property_readonly("ready", &ClockModel::ready)
      .def_property_readonly(
          "line", [](const ClockModel& self) { return self.line(); }, "What is known now, a copy.")
      .def_property_readonly("mean_jitter_ns", &ClockModel::mean_jitter_ns)
      .def_property_readonly("epoch", &ClockModel::epoch, "Lines started so far.")
      .def_property_readonly(
          "counts", [](const ClockModel& self) { return counts_dict(self.counts()); }, "What it has survived: a dict.")
      .def("reset", &ClockModel::reset, "Forgets everything but the counts.");

  py::class_<CounterUnwrapper>(m, "CounterUnwrapper",
                               "Counters of devices as nanoseconds that do not wrap around. A tick lasts "
                               "tick_numerator_ns / tick_denominator.")
      .def(py::init([](int bits, std::int64_t numerator, std::int64_t denominator) {
             return CounterUnwrapper({bits, numerator, denominator});
           }),
           py::arg("bits") = 32, py::arg("tick_numerator_ns") = 1000, py::arg("tick_denominator") = 1)
      .def(
          "unwrap",
          [](CounterUnwrapper& self, const TimeArray& counts) {
            const auto c = times_view(counts, "counts");
            py::array_t<TimeNs> out(static_cast<py::ssize_t>(c.size()));
            TimeNs* data = out.mutable_data();
            for (std::size_t i = 0; i < c.size(); ++i) data[i] = self.unwrap(static_cast<std::uint64_t>(c[i]));
            return out;
          },
          py::arg("counts"), "int64 (N,) counts in, int64 (N,) nanoseconds out.")
      .def_property_readonly("wraps", &CounterUnwrapper::wraps);

  py::class_<ClockCalibrationResult>(m, "ClockCalibrationResult", "What a recording tells about its clock.")
      .def_readonly("skew_ppm", &ClockCalibrationResult::skew_ppm, "mean; seconds of the host per second, less 1")
      .def_readonly("skew_sigma_ppm", &ClockCalibrationResult::skew_sigma_ppm, "its wandering included")
      .def_readonly("skew_min_ppm", &ClockCalibrationResult::skew_min_ppm)
      .def_readonly("skew_max_ppm", &ClockCalibrationResult::skew_max_ppm)
      .def_readonly("offset_ns", &ClockCalibrationResult::offset_ns, "host - device at the last sample")
      .def_readonly("sigma_ns", &ClockCalibrationResult::sigma_ns, "of a time put on the host's clock")
      .def_readonly("jitter_rms_ns", &ClockCalibrationResult::jitter_rms_ns, "lateness of arrivals")
      .def_readonly("jitter_median_ns", &ClockCalibrationResult::jitter_median_ns)
      .def_readonly("jitter_p90_ns", &ClockCalibrationResult::jitter_p90_ns)
      .def_readonly("jitter_p99_ns", &ClockCalibrationResult::jitter_p99_ns)
      .def_readonly("jitter_max_ns", &ClockCalibrationResult::jitter_max_ns)
      .def_readonly("duration_s", &ClockCalibrationResult::duration_s)
      .def_readonly("rate_hz", &ClockCalibrationResult::rate_hz)
      .def_readonly("epochs", &ClockCalibrationResult::epochs)
      .def_property_readonly("counts", [](const ClockCalibrationResult& self) { return counts_dict(self.counts); })
      .def_readonly("quality", &ClockCalibrationResult::quality);
  m.def(
      "calibrate_clock",
      [](const TimeArray& device, const TimeArray& host, const py::kwargs& kwargs) {
        const auto d = times_view(device, "times_ns");
        const auto h = times_view(host, "host_times_ns");
        require_same(h.size(), "host_times_ns", d.size(), "times_ns");
        const ClockModelOptions options = model_options(kwargs);
        const py::gil_scoped_release release;
        return loc::calibrate_clock(d, h, options);
      },
      py::arg("times_ns"), py::arg("host_times_ns"),
      "Stamps and arrivals of one stream, int64 (N,) in the order of arrival; options as of ClockModel.");
}

GpsTimeEvent event_of(bool pulse, TimeNs host_ns, TimeNs gps_ns) {
  return {pulse ? GpsTimeEvent::Kind::kPulse : GpsTimeEvent::Kind::kLabel, host_ns, gps_ns};
}

template <class Clock>
void take_events(Clock& self, const BoolArray& pulse, const TimeArray& host, const TimeArray& gps) {
  const auto p = mask_view(pulse, "is_pulse");
  const auto h = times_view(host, "host_times_ns");
  const auto g = times_view(gps, "gps_times_ns");
  require_same(h.size(), "host_times_ns", p.size(), "is_pulse");
  require_same(g.size(), "gps_times_ns", p.size(), "is_pulse");
  const py::gil_scoped_release release;
  for (std::size_t i = 0; i < p.size(); ++i) self.update(event_of(p[i] != 0, h[i], g[i]));
}

void bind_gps(py::module_& m) {
  constexpr const char* kEventsDoc =
      "Events in the order of arrival: bool (N,); int64 (N,) edge of the pulse or arrival of the label; int64 (N,) GPS "
      "time of the label, NO_TIME of a pulse unless its source has paired it.";
  py::class_<GpsClock>(
      m, "GpsClock",
      "Host clock to GPS time (without leap seconds), from pulses per second and labels. Without pulses "
      "sigma says tens of milliseconds.")
      .def(py::init([](const py::kwargs& kwargs) { return GpsClock(gps_options(kwargs)); }),
           "Options as keywords: label='previous' or 'next', pulse_gate_ns=100_000_000, pulse_delay_ns=0, "
           "sigma_pulse_delay_ns=2000, pairing_delay_ns=400_000_000, label_delay_ns=350_000_000, "
           "sigma_label_delay_ns=200_000_000, max_pulse_extrapolation_s=600, max_label_extrapolation_s=60.")
      .def("update", &take_events<GpsClock>, py::arg("is_pulse"), py::arg("host_times_ns"), py::arg("gps_times_ns"),
           kEventsDoc)
      .def(
          "convert",
          [](GpsClock& self, const TimeArray& host) {
            const auto h = times_view(host, "host_times_ns");
            return stamps(h.size(), [&](std::size_t i) { return self.convert(h[i]); });
          },
          py::arg("host_times_ns"), kStampsDoc)
      .def_property_readonly("line", &GpsClock::line, "Host to GPS as it is known now; None when it is not.")
      .def_property_readonly(
          "basis", [](const GpsClock& self) { return loc::basis_name(self.basis()); }, "'none', 'labels' or 'pulses'")
      .def_property_readonly("epoch", &GpsClock::epoch)
      .def_property_readonly("counts", [](const GpsClock& self) { return counts_dict(self.counts()); });

  py::class_<ClockChain>(m, "ClockChain", "Device clock to host clock to GPS time, sigma of both steps.")
      .def(py::init<>())
      .def(
          "update",
          [](ClockChain& self, const TimeArray& device, const TimeArray& host) {
            const auto d = times_view(device, "device_times_ns");
            const auto h = times_view(host, "host_times_ns");
            require_same(h.size(), "host_times_ns", d.size(), "device_times_ns");
            const py::gil_scoped_release release;
            for (std::size_t i = 0; i < d.size(); ++i) self.update(d[i], h[i]);
          },
          py::arg("device_times_ns"), py::arg("host_times_ns"))
      .def("update_gps", &take_events<ClockChain>, py::arg("is_pulse"), py::arg("host_times_ns"),
           py::arg("gps_times_ns"), kEventsDoc)
      .def(
          "convert",
          [](ClockChain& self, const TimeArray& device) {
            const auto d = times_view(device, "device_times_ns");
            return stamps(d.size(), [&](std::size_t i) { return self.convert(d[i]); });
          },
          py::arg("device_times_ns"), kStampsDoc)
      .def_property_readonly("device_counts",
                             [](const ClockChain& self) { return counts_dict(self.device().counts()); })
      .def_property_readonly("gps_counts", [](const ClockChain& self) { return counts_dict(self.gps().counts()); });
}

loc::ClockSimulation scenario(const std::string& name) {
  if (name == "usb_imu") return loc::ClockSimulation::usb_imu();
  if (name == "pps") return loc::ClockSimulation::pps();
  if (name == "nmea_only") return loc::ClockSimulation::nmea_only();
  throw py::value_error("scenario = '" + name + "': must be 'usb_imu', 'pps' or 'nmea_only'");
}

void bind_simulation(py::module_& m) {
  m.def(
      "simulate_clock",
      [](const std::string& name, double duration_s, const loc::Random& random) {
        const auto samples = loc::simulate_clock(scenario(name), duration_s, random);
        const auto n = static_cast<py::ssize_t>(samples.size());
        py::array_t<TimeNs> device(n);
        py::array_t<TimeNs> host(n);
        py::array_t<TimeNs> earliest(n);
        for (py::ssize_t i = 0; i < n; ++i) {
          const loc::ClockSample& s = samples[static_cast<std::size_t>(i)];
          device.mutable_data()[i] = s.device_time_ns;
          host.mutable_data()[i] = s.host_time_ns;
          earliest.mutable_data()[i] = s.earliest_host_ns;
        }
        return py::make_tuple(device, host, earliest);
      },
      py::arg("scenario"), py::arg("duration_s"), py::arg("random"),
      "'usb_imu' (200 Hz), 'pps' or 'nmea_only': (device_times_ns, host_times_ns, truth_ns), int64 (N,) each; the "
      "truth is "
      "true host time + minimum delay.");
  m.def(
      "simulate_gps_time",
      [](double duration_s, const loc::Random& random, bool with_pulses, bool label_next) {
        loc::GpsTimeSimulation simulation;
        simulation.with_pulses = with_pulses;
        simulation.label_next = label_next;
        const loc::SimulatedGpsTime time = loc::simulate_gps_time(simulation, duration_s, random);
        const auto n = static_cast<py::ssize_t>(time.events.size());
        py::array_t<bool> pulse(n);
        py::array_t<TimeNs> host(n);
        py::array_t<TimeNs> gps(n);
        for (py::ssize_t i = 0; i < n; ++i) {
          const GpsTimeEvent& e = time.events[static_cast<std::size_t>(i)];
          pulse.mutable_data()[i] = e.kind == GpsTimeEvent::Kind::kPulse;
          host.mutable_data()[i] = e.host_time_ns;
          gps.mutable_data()[i] = e.gps_time_ns;
        }
        const auto seconds = static_cast<py::ssize_t>(time.gps_time_ns.size());
        return py::make_tuple(pulse, host, gps, py::array_t<TimeNs>(seconds, time.host_time_ns.data()),
                              py::array_t<TimeNs>(seconds, time.gps_time_ns.data()));
      },
      py::arg("duration_s"), py::arg("random"), py::arg("with_pulses") = true, py::arg("label_next") = false,
      "(is_pulse, host_times_ns, gps_times_ns) as GpsClock.update takes them, then the truth second by second: host "
      "times and GPS times, int64 (M,).");
}

loc::PositionStream stream_of(const TimeArray& times, const FloatArray& positions, const py::object& velocities,
                              const py::object& rotations, const std::string& name) {
  const auto t = times_view(times, (name + "times_ns").c_str());
  const auto n = static_cast<py::ssize_t>(t.size());
  loc::PositionStream out;
  out.times_ns.assign(t.begin(), t.end());
  const auto fill = [&](std::vector<Eigen::Vector3d>& rows, const FloatArray& array, const std::string& field) {
    const auto view = rows_view<3>(array, (name + field).c_str(), n, (name + "times_ns").c_str());
    for (Eigen::Index i = 0; i < view.rows(); ++i) rows.emplace_back(view.row(i));
  };
  fill(out.positions, positions, "positions");
  if (!velocities.is_none()) fill(out.velocities, py::reinterpret_borrow<FloatArray>(velocities), "velocities");
  if (!rotations.is_none()) {
    const auto view = rows_view<4>(py::reinterpret_borrow<FloatArray>(rotations), (name + "q_world_body_wxyz").c_str(),
                                   n, (name + "times_ns").c_str());
    for (Eigen::Index i = 0; i < view.rows(); ++i) {
      out.rotations.emplace_back(view(i, 0), view(i, 1), view(i, 2), view(i, 3));
    }
  }
  return out;
}

void bind_time_offset(py::module_& m) {
  py::class_<TimeOffsetResult>(m, "TimeOffsetResult", "t_reference = t_stream + offset_s")
      .def_readonly("offset_s", &TimeOffsetResult::offset_s)
      .def_readonly("sigma_s", &TimeOffsetResult::sigma_s)
      .def_property_readonly(
          "bias", [](const TimeOffsetResult& self) { return to_array(self.bias); }, "stream - reference [m]")
      .def_property_readonly("lever_arm", [](const TimeOffsetResult& self) { return to_array(self.lever_arm); })
      .def_readonly("rms_before_m", &TimeOffsetResult::rms_before_m)
      .def_readonly("rms_after_m", &TimeOffsetResult::rms_after_m)
      .def_readonly("speed_rms", &TimeOffsetResult::speed_rms)
      .def_readonly("speed_deviation", &TimeOffsetResult::speed_deviation)
      .def_readonly("velocity_deviation", &TimeOffsetResult::velocity_deviation)
      .def_readonly("used", &TimeOffsetResult::used)
      .def_readonly("down_weighted", &TimeOffsetResult::down_weighted)
      .def_readonly("outside", &TimeOffsetResult::outside)
      .def_readonly("not_finite", &TimeOffsetResult::not_finite)
      .def_readonly("converged", &TimeOffsetResult::converged)
      .def_readonly("quality", &TimeOffsetResult::quality);
  const TimeOffsetOptions d;
  m.def(
      "estimate_time_offset",
      [](const TimeArray& times, const FloatArray& positions, const TimeArray& reference_times,
         const FloatArray& reference_positions, const py::object& reference_velocities,
         const py::object& reference_rotations, double max_offset_s, bool horizontal, double max_gap_s, bool bias,
         bool lever_arm, const ArrayLike& known_lever_arm, double correlation_s, double bias_sigma_m) {
        const auto stream = stream_of(times, positions, py::none(), py::none(), "");
        const auto reference =
            stream_of(reference_times, reference_positions, reference_velocities, reference_rotations, "reference_");
        TimeOffsetOptions options;
        options.max_offset_s = max_offset_s;
        options.horizontal = horizontal;
        options.max_reference_gap_s = max_gap_s;
        options.estimate_bias = bias;
        options.estimate_lever_arm = lever_arm;
        options.lever_arm = vector3(known_lever_arm, "lever_arm");
        options.correlation_s = correlation_s;
        options.bias_sigma_m = bias_sigma_m;
        const py::gil_scoped_release release;
        return loc::estimate_time_offset(stream, reference, options);
      },
      py::arg("times_ns"), py::arg("positions"), py::arg("reference_times_ns"), py::arg("reference_positions"),
      py::kw_only(), py::arg("reference_velocities") = py::none(), py::arg("reference_q_world_body_wxyz") = py::none(),
      py::arg("max_offset_s") = d.max_offset_s, py::arg("horizontal") = d.horizontal,
      py::arg("max_reference_gap_s") = d.max_reference_gap_s, py::arg("estimate_bias") = d.estimate_bias,
      py::arg("estimate_lever_arm") = d.estimate_lever_arm, py::arg("lever_arm") = py::make_tuple(0.0, 0.0, 0.0),
      py::arg("correlation_s") = d.correlation_s, py::arg("bias_sigma_m") = d.bias_sigma_m,
      "By how much the stamps of a position stream are off against a reference trajectory in the same world (z up): "
      "t_reference = t_stream + offset_s. int64 (N,), float64 (N, 3) [m]; NaN rows are skipped. DataError names the "
      "index where times do not increase.");
}

}  // namespace

void bind_clock(py::module_& m) {
  m.attr("NO_TIME") = loc::kNoTime;
  bind_line(m);
  bind_model(m);
  bind_gps(m);
  bind_simulation(m);
  bind_time_offset(m);
}

}  // namespace locpy
