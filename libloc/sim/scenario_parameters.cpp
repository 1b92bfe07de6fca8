#include "libloc/sim/scenario_parameters.hpp"

#include <charconv>
#include <cmath>
#include <stdexcept>
#include <type_traits>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

[[noreturn]] void refuse(std::string_view name, std::string_view value, std::string_view rule) {
  throw std::invalid_argument(std::string(name) + " = '" + std::string(value) + "': " + std::string(rule));
}

// Pieces between blanks, commas, colons and brackets.
std::vector<std::string_view> pieces(std::string_view text) {
  constexpr std::string_view kSeparators = " \t\r\n,;:[]()";
  std::vector<std::string_view> out;
  for (std::size_t at = text.find_first_not_of(kSeparators); at != std::string_view::npos;
       at = text.find_first_not_of(kSeparators, at)) {
    const std::size_t end = std::min(text.find_first_of(kSeparators, at), text.size());
    out.push_back(text.substr(at, end - at));
    at = end;
  }
  return out;
}

template <typename Number>
Number number(std::string_view name, std::string_view value, std::string_view text) {
  Number out{};
  // from_chars knows no plus sign.
  if (text.size() > 1 && text.front() == '+' && text[1] != '-') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (error != std::errc{} || end != text.data() + text.size()) {
    refuse(name, value, std::is_integral_v<Number> ? "must be a whole number" : "must be a number");
  }
  return out;
}

std::vector<double> numbers(std::string_view name, std::string_view value) {
  std::vector<double> out;
  for (const std::string_view piece : pieces(value)) out.push_back(number<double>(name, value, piece));
  return out;
}

template <typename Number>
Number only(std::string_view name, std::string_view value) {
  const auto found = pieces(value);
  if (found.size() != 1) refuse(name, value, "must be one number");
  return number<Number>(name, value, found.front());
}

void parse(std::string_view name, std::string_view value, double& out) {
  out = only<double>(name, value);
}
void parse(std::string_view name, std::string_view value, int& out) {
  out = only<int>(name, value);
}
void parse(std::string_view name, std::string_view value, TimeNs& out) {
  out = only<TimeNs>(name, value);
}
void parse(std::string_view name, std::string_view value, bool& out) {
  if (value == "true" || value == "on" || value == "yes" || value == "1") {
    out = true;
  } else if (value == "false" || value == "off" || value == "no" || value == "0") {
    out = false;
  } else {
    refuse(name, value, "must be true or false");
  }
}
void parse(std::string_view name, std::string_view value, Eigen::Vector3d& out) {
  const std::vector<double> v = numbers(name, value);
  if (v.size() == 1) {
    out.setConstant(v[0]);
  } else if (v.size() == 3) {
    out = {v[0], v[1], v[2]};
  } else {
    refuse(name, value, "must be three numbers, or one for all");
  }
}
void parse(std::string_view name, std::string_view value, Eigen::Matrix3d& out) {
  const std::vector<double> v = numbers(name, value);
  if (v.size() == 1) {
    out = v[0] * Eigen::Matrix3d::Identity();
  } else if (v.size() == 3) {
    out = Eigen::Vector3d(v[0], v[1], v[2]).asDiagonal();
  } else if (v.size() == 9) {
    for (int i = 0; i < 9; ++i) out(i / 3, i % 3) = v[static_cast<std::size_t>(i)];
  } else {
    refuse(name, value, "must be nine numbers, three for the diagonal, or one");
  }
}
void parse(std::string_view name, std::string_view value, std::vector<TimeInterval>& out) {
  const std::vector<double> v = numbers(name, value);
  if (v.size() % 2 != 0) refuse(name, value, "must be begin:end in seconds, as often as needed");
  out.clear();
  for (std::size_t i = 0; i < v.size(); i += 2) out.push_back({v[i], v[i + 1]});
}
void parse(std::string_view name, std::string_view value, ImuSampleModel& out) {
  try {
    out = parse_sampling(std::string(value));
  } catch (const std::invalid_argument&) {
    refuse(name, value, "must be point, interval-mean or increment");
  }
}

std::string text_of(double x) {
  return to_text(x);
}
std::string text_of(int x) {
  return std::to_string(x);
}
std::string text_of(TimeNs x) {
  return std::to_string(x);
}
std::string text_of(bool x) {
  return x ? "true" : "false";
}
std::string text_of(const Eigen::Vector3d& v) {
  return to_text(v.x()) + ", " + to_text(v.y()) + ", " + to_text(v.z());
}
std::string text_of(const Eigen::Matrix3d& m) {
  std::string out;
  for (int i = 0; i < 9; ++i) out += (i == 0 ? "" : ", ") + to_text(m(i / 3, i % 3));
  return out;
}
std::string text_of(const std::vector<TimeInterval>& intervals) {
  std::string out;
  for (const TimeInterval& i : intervals) {
    out += (out.empty() ? "" : ", ") + to_text(i.begin_s) + ":" + to_text(i.end_s);
  }
  return out;
}
std::string text_of(ImuSampleModel s) {
  return sampling_name(s);
}

// Calls visit(name, field, unit) for each parameter. This is the list of what can be set.
template <typename Model, typename Visit>
void visit_triad(const std::string& at, Model& m, const std::string& u, const Visit& visit) {
  visit(at + "noise_density", m.noise_density, u + "/sqrt(Hz)");
  visit(at + "random_walk", m.random_walk, u + "/s/sqrt(Hz)");
  visit(at + "instability_sigma", m.instability_sigma, u);
  visit(at + "instability_time_s", m.instability_time_s, "s");
  visit(at + "turn_on_bias_sigma", m.turn_on_bias_sigma, u);
  visit(at + "constant_bias", m.constant_bias, u);
  visit(at + "matrix", m.matrix, "matrix");
  visit(at + "range", m.range, u);
  visit(at + "resolution", m.resolution, u);
}

template <typename Model, typename Visit>
void visit_clock(const std::string& at, Model& m, const Visit& visit) {
  visit(at + "offset_s", m.offset_s, "s");
  visit(at + "constant_ppm", m.oscillator.constant_ppm, "ppm");
  visit(at + "wave_ppm", m.oscillator.wave_ppm, "ppm");
  visit(at + "wave_period_s", m.oscillator.wave_period_s, "s");
  visit(at + "skew_walk", m.oscillator.skew_walk, "1/sqrt(s)");
  visit(at + "delay_minimum_ns", m.delay.minimum_ns, "ns");
  visit(at + "delay_exponential_ns", m.delay.exponential_ns, "ns");
  visit(at + "delay_outlier_fraction", m.delay.outlier_fraction, "share");
  visit(at + "delay_outlier_max_ns", m.delay.outlier_max_ns, "ns");
  visit(at + "loss_fraction", m.loss_fraction, "share");
}

template <typename AnyScenario, typename Visit>
void visit_all(AnyScenario& s, const Visit& visit) {
  visit("start_time_ns", s.start_time_ns, "ns since 1970");
  visit("streams.imu", s.streams.imu, "switch");
  visit("streams.magnetometer", s.streams.magnetometer, "switch");
  visit("streams.odometry", s.streams.odometry, "switch");
  visit("streams.gps", s.streams.gps, "switch");
  visit("streams.features", s.streams.features, "switch");
  visit("streams.reference", s.streams.reference, "switch");
  visit("reference.rate_hz", s.reference_rate_hz, "Hz");

  visit("imu.rate_hz", s.imu.rate_hz, "Hz");
  visit("imu.sampling", s.imu.sampling, "point, interval-mean, increment");
  visit("imu.accelerometer_sign", s.imu.accelerometer_sign, "1 or -1");
  visit("imu.gravity", s.imu.gravity, "m/s^2");
  visit_triad("imu.gyroscope.", s.imu.gyroscope, "rad/s", visit);
  visit_triad("imu.accelerometer.", s.imu.accelerometer, "m/s^2", visit);
  visit_clock("imu.clock.", s.imu_clock, visit);

  visit("magnetometer.rate_hz", s.magnetometer.rate_hz, "Hz");
  visit("magnetometer.field", s.magnetometer.field, "T");
  visit("magnetometer.hard_iron", s.magnetometer.hard_iron, "T");
  visit("magnetometer.soft_iron", s.magnetometer.soft_iron, "matrix");
  visit("magnetometer.sigma", s.magnetometer.sigma, "T");
  visit("magnetometer.range", s.magnetometer.range, "T");
  visit("magnetometer.resolution", s.magnetometer.resolution, "T");
  visit_clock("magnetometer.clock.", s.magnetometer_clock, visit);

  visit("odometry.rate_hz", s.odometry.rate_hz, "Hz");
  visit("odometry.scale", s.odometry.scale, "unit/m");
  visit("odometry.scale_walk", s.odometry.scale_walk, "1/sqrt(s)");
  visit("odometry.sigma_position", s.odometry.sigma_position, "unit");
  visit("odometry.sigma_orientation", s.odometry.sigma_orientation, "rad");
  visit("odometry.drift_sigma", s.odometry.drift_sigma, "unit");
  visit("odometry.drift_frames", s.odometry.drift_frames, "frames");
  visit("odometry.drift_start", s.odometry.drift_start, "unit");
  visit("odometry.outlier_fraction", s.odometry.outlier_fraction, "share");
  visit("odometry.outlier_position", s.odometry.outlier_position, "unit");
  visit("odometry.outlier_orientation", s.odometry.outlier_orientation, "rad");
  visit("odometry.latency_s", s.odometry.latency_s, "s");
  visit("odometry.stamp_delay_s", s.odometry.stamp_delay_s, "s");
  visit("odometry.outages", s.odometry.outages, "s");
  visit("odometry.relative", s.odometry.relative, "switch");
  visit("odometry.told_sigma_position", s.odometry.told_sigma_position, "unit");
  visit("odometry.told_sigma_orientation", s.odometry.told_sigma_orientation, "rad");
  visit_clock("odometry.clock.", s.odometry_clock, visit);

  visit("gps.rate_hz", s.gps.rate_hz, "Hz");
  visit("gps.sigma_horizontal", s.gps.sigma_horizontal, "m");
  visit("gps.sigma_vertical", s.gps.sigma_vertical, "m");
  visit("gps.coloured_sigma_horizontal", s.gps.coloured_sigma_horizontal, "m");
  visit("gps.coloured_sigma_vertical", s.gps.coloured_sigma_vertical, "m");
  visit("gps.coloured_time_s", s.gps.coloured_time_s, "s");
  visit("gps.with_velocity", s.gps.with_velocity, "switch");
  visit("gps.sigma_velocity_horizontal", s.gps.sigma_velocity_horizontal, "m/s");
  visit("gps.sigma_velocity_vertical", s.gps.sigma_velocity_vertical, "m/s");
  visit("gps.antenna_in_body", s.gps.antenna_in_body, "m");
  visit("gps.latency_s", s.gps.latency_s, "s");
  visit("gps.stamp_delay_s", s.gps.stamp_delay_s, "s");
  visit("gps.outages", s.gps.outages, "s");
  visit("gps.origin.latitude", s.gps.origin.latitude, "rad");
  visit("gps.origin.longitude", s.gps.origin.longitude, "rad");
  visit("gps.origin.altitude", s.gps.origin.altitude, "m");
  visit_clock("gps.clock.", s.gps_clock, visit);

  for (auto& c : s.cameras) {
    visit("camera.rate_hz", c.model.rate_hz, "Hz");
    visit("camera.time_offset_s", c.calibration.time_offset_s, "s");
    visit("camera.stamp_jitter_s", c.model.stamp_jitter_s, "s");
    visit("camera.latency_s", c.latency_s, "s");
    visit("camera.sigma_px", c.model.sigma_px, "px");
    visit("camera.max_features", c.model.max_features, "number");
    visit("camera.occlusion", c.model.occlusion, "switch");
    visit("camera.outlier_rate", c.model.outlier_rate, "share");
    visit("camera.wrong_id_rate", c.model.wrong_id_rate, "share");
    visit("camera.loss_rate", c.model.loss_rate, "share");
    visit("camera.reappear_rate", c.model.reappear_rate, "share");
    visit("camera.new_id_rate", c.model.new_id_rate, "share");
    visit_clock("camera.clock.", c.clock, visit);
  }
}

// The last part of a name, by which a misspelt or shortened one may be found.
std::string_view last_part(std::string_view name) {
  const std::size_t dot = name.rfind('.');
  return dot == std::string_view::npos ? name : name.substr(dot + 1);
}

}  // namespace

std::vector<ScenarioParameter> parameters(const Scenario& scenario) {
  std::vector<ScenarioParameter> out;
  visit_all(scenario, [&](const std::string& name, const auto& field, const std::string& unit) {
    for (const ScenarioParameter& p : out) {
      if (p.name == name) return;  // of a further camera
    }
    out.push_back({name, text_of(field), unit});
  });
  return out;
}

void set_parameter(Scenario& scenario, std::string_view name, std::string_view value) {
  bool found = false;
  std::string alike;
  visit_all(scenario, [&](const std::string& known, auto& field, const std::string&) {
    if (known == name) {
      parse(name, value, field);
      found = true;
    } else if (!found && last_part(known) == last_part(name) && alike.find(known) == std::string::npos) {
      alike += (alike.empty() ? "" : ", ") + known;
    }
  });
  if (!found) {
    throw std::invalid_argument("there is no parameter '" + std::string(name) + "'" +
                                (alike.empty() ? "" : "; did you mean " + alike + "?"));
  }
}

}  // namespace loc
