#include "libloc/io/slam_yaml.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>
#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/io/text_file.hpp"
#include "libloc/io/yaml_block.hpp"

namespace loc {
namespace {

constexpr const char* kFormat = "libloc-slam-1";
constexpr std::array<const char*, 2> kMotions = {"constant-velocity", "inertial"};
constexpr std::array<const char*, 3> kConsistencies = {"plain", "first-estimate", "invariant"};
constexpr std::array<const char*, 2> kSamplings = {"point", "interval-mean"};
constexpr std::array<const char*, 2> kPrecisions = {"double", "float"};

// One list of the fields, for reading and writing. The names are those of the structs.
template <class Visitor, class Options>
void visit_fields(Visitor& v, Options& o) requires std::is_same_v<std::remove_const_t<Options>, ImuNoise> {
  v.field("gyroscope_noise_density", o.gyroscope_noise_density);
  v.field("gyroscope_random_walk", o.gyroscope_random_walk);
  v.field("accelerometer_noise_density", o.accelerometer_noise_density);
  v.field("accelerometer_random_walk", o.accelerometer_random_walk);
  v.field("gyroscope_bias_sigma", o.gyroscope_bias_sigma);
  v.field("accelerometer_bias_sigma", o.accelerometer_bias_sigma);
}

template <class Visitor, class Options>
void visit_fields(Visitor& v, Options& o) requires std::is_same_v<std::remove_const_t<Options>, KnownLandmark> {
  v.field("id", o.id);
  v.field("position", o.position);
  v.field("sigma", o.sigma);
}

template <class Visitor, class Options>
void visit_fields(Visitor& v, Options& o) requires std::is_same_v<std::remove_const_t<Options>, SlamMapOptions> {
  v.field("max_features", o.max_features);
  v.field("max_measured", o.max_measured);
  v.field("min_visible", o.min_visible);
  v.field("max_added", o.max_added);
  v.field("steer_after_frames", o.steer_after_frames);
  v.field("cover_radius", o.cover_radius);
  v.field("grid_columns", o.grid_columns);
  v.field("grid_rows", o.grid_rows);
  v.field("min_separation_px", o.min_separation_px);
  v.field("border_px", o.border_px);
  v.field("inverse_depth", o.inverse_depth);
  v.field("sigma_inverse_depth", o.sigma_inverse_depth);
  v.field("depth_from_neighbours", o.depth_from_neighbours);
  v.field("max_linearity_index", o.max_linearity_index);
  v.field("delete_after_tries", o.delete_after_tries);
  v.field("delete_below_ratio", o.delete_below_ratio);
}

template <class Visitor, class Options>
void visit_fields(Visitor& v,
                  Options& o) requires std::is_same_v<std::remove_const_t<Options>, SlamAssociationOptions> {
  v.field("gate_probability", o.gate_probability);
  v.field("ransac", o.ransac);
  v.field("ransac_probability", o.ransac_probability);
  v.field("max_hypotheses", o.max_hypotheses);
  v.field("seed", o.seed);
}

template <class Visitor, class Options>
void visit_fields(Visitor& v, Options& o) requires std::is_same_v<std::remove_const_t<Options>, FusionStartOptions> {
  v.field("duration_s", o.duration_s);
  v.field("max_gap_s", o.max_gap_s);
  v.field("moving_acceleration_sigma", o.moving_acceleration_sigma);
  v.field("moving_velocity_sigma", o.moving_velocity_sigma);
  v.field("still_velocity_sigma", o.still_velocity_sigma);
  v.field("tilt_sigma_floor", o.tilt_sigma_floor);
  v.field("still_bias_sigma_floor", o.still_bias_sigma_floor);
  v.field("position_sigma", o.position_sigma);
  v.field("heading", o.heading);
  v.field("heading_sigma", o.heading_sigma);
  v.field("magnetic_declination", o.magnetic_declination);
  v.field("magnetic_heading_sigma", o.magnetic_heading_sigma);
}

template <class Visitor, class Options>
void visit_fields(Visitor& v, Options& o) requires std::is_same_v<std::remove_const_t<Options>, SlamStartOptions> {
  v.field("min_duration_s", o.min_duration_s);
  v.field("max_duration_s", o.max_duration_s);
  v.field("min_frames", o.min_frames);
  v.field("max_frames", o.max_frames);
  v.field("min_features", o.min_features);
  v.field("max_features", o.max_features);
  v.field("min_observations", o.min_observations);
  v.field("max_gap_s", o.max_gap_s);
  v.field("sigma_px", o.sigma_px);
  v.field("max_sigma_ratio", o.max_sigma_ratio);
  v.field("min_inliers", o.min_inliers);
  v.field("min_parallax", o.min_parallax);
  v.field("max_scale_sigma", o.max_scale_sigma);
  v.field("velocity_floor", o.velocity_floor);
  v.field("max_tilt_sigma", o.max_tilt_sigma);
  v.field("max_condition", o.max_condition);
  v.field("gyroscope_bias_sigma", o.gyroscope_bias_sigma);
  v.choice("sampling", o.sampling, kSamplings);
}

template <class Visitor, class Options>
void visit_fields(Visitor& v, Options& o) requires std::is_same_v<std::remove_const_t<Options>, StandStillOptions> {
  v.field("window_s", o.window_s);
  v.field("min_duration_s", o.min_duration_s);
  v.field("threshold", o.threshold);
  v.field("force_sigma_floor", o.force_sigma_floor);
  v.field("rate_sigma_floor", o.rate_sigma_floor);
  v.field("max_angular_velocity", o.max_angular_velocity);
  v.field("max_force_error", o.max_force_error);
  v.field("max_force_change", o.max_force_change);
  v.field("max_rate_change", o.max_rate_change);
  v.field("min_speed", o.min_speed);
}

template <class Visitor, class Options>
void visit_fields(Visitor& v, Options& o) requires std::is_same_v<std::remove_const_t<Options>, SlamOptions> {
  v.choice("motion", o.motion, kMotions);
  v.choice("consistency", o.consistency, kConsistencies);
  v.choice("precision", o.precision, kPrecisions);
  v.field("max_iterations", o.max_iterations);
  v.field("camera_index", o.camera_index);
  v.field("position", o.position);
  v.field("q_world_body", o.q_world_body);
  v.field("velocity", o.velocity);
  v.field("angular_velocity", o.angular_velocity);
  v.field("sigma_position", o.sigma_position);
  v.field("sigma_orientation", o.sigma_orientation);
  v.field("sigma_velocity", o.sigma_velocity);
  v.field("sigma_angular_velocity", o.sigma_angular_velocity);
  v.field("acceleration_density", o.acceleration_density);
  v.field("angular_acceleration_density", o.angular_acceleration_density);
  v.block("imu_noise", o.imu_noise);
  v.choice("imu_sampling", o.imu_sampling, kSamplings);
  v.field("vibration_part", o.vibration_part);
  v.field("gravity", o.gravity);
  v.field("sigma_px", o.sigma_px);
  v.field("override_sigma", o.override_sigma);
  v.field("second_order_noise", o.second_order_noise);
  v.field("estimate_extrinsics", o.estimate_extrinsics);
  v.field("sigma_extrinsic_rotation", o.sigma_extrinsic_rotation);
  v.field("sigma_extrinsic_position", o.sigma_extrinsic_position);
  v.field("estimate_time_offset", o.estimate_time_offset);
  v.field("sigma_time_offset", o.sigma_time_offset);
  v.list("landmarks", o.landmarks);
  v.block("map", o.map);
  v.block("association", o.association);
  v.field("max_gap_s", o.max_gap_s);
  v.block("start", o.start);
  v.block("moving_start", o.moving_start);
  v.field("moving_start_factor", o.moving_start_factor);
  v.block("stand_still", o.stand_still);
  v.field("zero_velocity", o.zero_velocity);
  v.field("zero_velocity_sigma", o.zero_velocity_sigma);
  v.field("zero_rate_sigma_floor", o.zero_rate_sigma_floor);
  v.field("still_picture_px", o.still_picture_px);
  v.field("still_picture_s", o.still_picture_s);
  v.field("max_imu_step_s", o.max_imu_step_s);
  v.field("max_imu_bridge_s", o.max_imu_bridge_s);
  v.field("gap_acceleration_sigma", o.gap_acceleration_sigma);
  v.field("gap_angular_velocity_sigma", o.gap_angular_velocity_sigma);
  v.field("max_angular_velocity", o.max_angular_velocity);
  v.field("max_specific_force", o.max_specific_force);
  v.field("recover_after", o.recover_after);
  v.field("lost_after_s", o.lost_after_s);
  v.field("relocate_s", o.relocate_s);
}

class Reader {
 public:
  explicit Reader(io::YamlBlock& block) : block_(block) {}

  void field(const char* key, double& value) {
    if (block_.has(key)) value = block_.number(key);
  }
  void field(const char* key, bool& value) {
    if (!block_.has(key)) return;
    const std::string text = block_.text(key);
    if (text != "true" && text != "false") block_.fail(key, "'" + text + "' must be true or false");
    value = text == "true";
  }
  template <class Integer>
  void field(const char* key, Integer& value) requires std::is_integral_v<Integer> {
    if (!block_.has(key)) return;
    const std::int64_t read = block_.integer(key);
    if (!std::in_range<Integer>(read)) block_.fail(key, std::to_string(read) + " is out of range");
    value = static_cast<Integer>(read);
  }
  void field(const char* key, Eigen::Vector3d& value) {
    if (block_.has(key)) value = block_.vector3(key);
  }
  void field(const char* key, Eigen::Quaterniond& value) {
    if (!block_.has(key)) return;
    const std::vector<double> wxyz = block_.numbers(key, 4);
    value = {wxyz[0], wxyz[1], wxyz[2], wxyz[3]};
    if (!(std::abs(value.norm() - 1) < 1e-2)) block_.fail(key, "norm " + to_text(value.norm()) + ", must be 1");
    if (std::abs(value.norm() - 1) > 1e-9) value.normalize();
  }
  template <class Value>
  void field(const char* key, std::optional<Value>& value) {
    if (block_.has(key)) field(key, value.emplace());
  }
  template <class Enum, std::size_t kNames>
  void choice(const char* key, Enum& value, const std::array<const char*, kNames>& names) {
    if (!block_.has(key)) return;
    const std::string text = block_.text(key);
    std::string known;
    for (std::size_t i = 0; i < kNames; ++i) {
      if (text == names[i]) {
        value = static_cast<Enum>(i);
        return;
      }
      known += (i == 0 ? "" : ", ") + std::string(names[i]);
    }
    block_.fail(key, "'" + text + "' must be one of: " + known);
  }
  template <class Options>
  void block(const char* key, Options& options) {
    if (!block_.has(key)) return;
    io::YamlBlock inner = block_.block(key);
    Reader reader(inner);
    visit_fields(reader, options);
    inner.finish();
  }
  template <class Options>
  void list(const char* key, std::vector<Options>& options) {
    if (!block_.has(key)) return;
    options.clear();
    for (io::YamlBlock& inner : block_.blocks(key)) {
      Reader reader(inner);
      visit_fields(reader, options.emplace_back());
      inner.finish();
    }
  }

 private:
  io::YamlBlock& block_;
};

class Writer {
 public:
  Writer(std::string& text, std::string indent) : text_(text), indent_(std::move(indent)) {}

  void field(const char* key, double value) { line(key, number(value)); }
  template <class Value>
  void field(const char* key, const std::optional<Value>& value) {
    if (value) field(key, *value);
  }
  void field(const char* key, bool value) { line(key, value ? "true" : "false"); }
  template <class Integer>
  void field(const char* key, Integer value) requires std::is_integral_v<Integer> {
    line(key, std::to_string(value));
  }
  void field(const char* key, const Eigen::Vector3d& value) {
    line(key, "[" + number(value.x()) + ", " + number(value.y()) + ", " + number(value.z()) + "]");
  }
  void field(const char* key, const Eigen::Quaterniond& q) {
    line(key, "[" + number(q.w()) + ", " + number(q.x()) + ", " + number(q.y()) + ", " + number(q.z()) + "]");
  }
  template <class Enum, std::size_t kNames>
  void choice(const char* key, Enum value, const std::array<const char*, kNames>& names) {
    line(key, names.at(static_cast<std::size_t>(value)));
  }
  template <class Options>
  void block(const char* key, const Options& options) {
    text_ += indent_ + key + ":\n";
    Writer inner(text_, indent_ + "  ");
    visit_fields(inner, options);
  }
  template <class Options>
  void list(const char* key, const std::vector<Options>& options) {
    if (options.empty()) return;
    text_ += indent_ + key + ":\n";
    for (const Options& one : options) {
      std::string item;
      Writer inner(item, indent_ + "    ");
      visit_fields(inner, one);
      item[indent_.size() + 2] = '-';
      text_ += item;
    }
  }

 private:
  static std::string number(double value) {
    if (std::isnan(value)) return ".nan";
    if (std::isinf(value)) return value > 0 ? ".inf" : "-.inf";
    return to_text(value);
  }
  void line(const char* key, const std::string& value) { text_ += indent_ + key + ": " + value + "\n"; }

  std::string& text_;
  std::string indent_;
};

}  // namespace

SlamOptions read_slam_options(const std::filesystem::path& path, SlamOptions options) {
  io::YamlBlock file = io::YamlBlock::load(path, false);
  if (!file.has("format") || file.text("format") != kFormat) {
    throw DataError(path.string() + ": format must be " + std::string(kFormat));
  }
  Reader reader(file);
  visit_fields(reader, options);
  file.finish();
  return options;
}

std::string slam_options_text(const SlamOptions& options) {
  std::string text = "format: " + std::string(kFormat) + "\n";
  Writer writer(text, "");
  visit_fields(writer, options);
  return text;
}

void write_slam_options(const std::filesystem::path& path, const SlamOptions& options) {
  io::AtomicFile file(path);
  file.stream() << slam_options_text(options);
  file.commit();
}

}  // namespace loc
