#include "libloc/io/rig_yaml.hpp"

#include <yaml-cpp/yaml.h>

#include <cmath>

#include "libloc/io/text_file.hpp"
#include "libloc/io/yaml_block.hpp"

namespace loc {
namespace {

using io::YamlBlock;

constexpr const char* kFormat = "libloc-rig-1";
constexpr double kUnitTolerance = 1e-9;

const char* name_of(DistortionModel model) {
  switch (model) {
    case DistortionModel::kNone:
      return "none";
    case DistortionModel::kRadtan:
      return "radtan";
    case DistortionModel::kEquidistant:
      return "equidistant";
  }
  return "none";
}

double optional_number(YamlBlock& block, const char* key) {
  return block.has(key) ? block.number(key) : kUnknown;
}

// What every quality has.
template <class Quality>
void read_origin(YamlBlock& block, Quality& quality) {
  const std::string verdict = block.text("verdict");
  try {
    quality.verdict = parse_verdict(verdict);
  } catch (const std::invalid_argument&) {
    block.fail("verdict", "= '" + verdict + "' is not ok, fair, warn or refused");
  }
  quality.method = block.text("method");
  quality.reasons = block.texts("reasons");
}

TriadQuality read_quality(YamlBlock block) {
  TriadQuality quality;
  read_origin(block, quality);
  quality.samples = block.integer("samples");
  if (block.has("bias_sigma")) quality.bias_sigma = block.vector3("bias_sigma");
  if (block.has("matrix_sigma")) quality.matrix_sigma = block.matrix("matrix_sigma", 3, 3);
  quality.residual_rms = optional_number(block, "residual_rms");
  block.finish();
  return quality;
}

IntrinsicsQuality read_intrinsics_quality(YamlBlock block) {
  IntrinsicsQuality quality;
  read_origin(block, quality);
  quality.pictures = block.integer("pictures");
  const auto sigma = [&](const char* key, Eigen::Vector4d& out) {
    if (block.has(key)) out = Eigen::Map<const Eigen::Vector4d>(block.numbers(key, 4).data());
  };
  sigma("intrinsics_sigma", quality.intrinsics_sigma_px);
  sigma("distortion_sigma", quality.distortion_sigma);
  quality.reprojection_rms_px = optional_number(block, "reprojection_rms_px");
  block.finish();
  return quality;
}

MountingQuality read_mounting_quality(YamlBlock block) {
  MountingQuality quality;
  read_origin(block, quality);
  quality.pictures = block.integer("pictures");
  if (block.has("rotation_sigma")) quality.rotation_sigma = block.vector3("rotation_sigma");
  if (block.has("translation_sigma")) quality.translation_sigma = block.vector3("translation_sigma");
  quality.time_offset_sigma_s = optional_number(block, "time_offset_sigma_s");
  quality.line_delay_s = optional_number(block, "line_delay_s");
  quality.line_delay_sigma_s = optional_number(block, "line_delay_sigma_s");
  block.finish();
  return quality;
}

TriadCalibration read_triad(YamlBlock block) {
  TriadCalibration triad;
  triad.bias = block.vector3("bias");
  triad.matrix = block.matrix("matrix", 3, 3);
  if (block.has("quality")) triad.quality = read_quality(block.block("quality"));
  block.finish();
  return triad;
}

ImuCalibration read_imu(YamlBlock block) {
  ImuCalibration imu;
  imu.rate_hz = block.number("rate_hz");
  YamlBlock noise = block.block("noise");
  imu.noise.gyroscope_noise_density = noise.number("gyroscope_noise_density");
  imu.noise.gyroscope_random_walk = noise.number("gyroscope_random_walk");
  imu.noise.accelerometer_noise_density = noise.number("accelerometer_noise_density");
  imu.noise.accelerometer_random_walk = noise.number("accelerometer_random_walk");
  imu.noise.gyroscope_bias_sigma = noise.number("gyroscope_bias_sigma");
  imu.noise.accelerometer_bias_sigma = noise.number("accelerometer_bias_sigma");
  if (noise.has("measured")) imu.noise_measured = noise.texts("measured");
  noise.finish();
  imu.gyroscope = read_triad(block.block("gyroscope"));
  imu.accelerometer = read_triad(block.block("accelerometer"));
  block.finish();
  return imu;
}

Pose3 read_pose(YamlBlock block) {
  Pose3 pose;
  pose.translation = block.vector3("translation");
  const std::vector<double> q = block.numbers("q_wxyz", 4);
  pose.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
  const double off = std::abs(pose.rotation.norm() - 1);
  if (off > 1e-2) block.fail("q_wxyz", "must have norm 1, not " + to_text(pose.rotation.norm()));
  // What a program wrote is kept to the last bit.
  if (off > kUnitTolerance) pose.rotation.normalize();
  block.finish();
  return pose;
}

std::int32_t read_pixels(YamlBlock& block, const char* key, double value) {
  if (value != std::floor(value) || value < 1 || value > 1e6) block.fail(key, "must be whole, positive numbers");
  return static_cast<std::int32_t>(value);
}

DistortionModel read_model(YamlBlock& block, const char* key) {
  const std::string name = block.text(key);
  for (const auto model : {DistortionModel::kNone, DistortionModel::kRadtan, DistortionModel::kEquidistant}) {
    if (name == name_of(model)) return model;
  }
  block.fail(key, "= '" + name + "' is not none, radtan or equidistant");
}

CameraCalibration read_camera(YamlBlock block) {
  CameraCalibration camera;
  camera.name = block.text("name");
  const std::vector<double> resolution = block.numbers("resolution", 2);
  camera.width_px = read_pixels(block, "resolution", resolution[0]);
  camera.height_px = read_pixels(block, "resolution", resolution[1]);
  camera.intrinsics_px = Eigen::Map<const Eigen::Vector4d>(block.numbers("intrinsics", 4).data());
  camera.distortion_model = read_model(block, "distortion_model");
  camera.distortion = Eigen::Map<const Eigen::Vector4d>(block.numbers("distortion_coeffs", 4).data());
  camera.T_body_camera = read_pose(block.block("T_body_camera"));
  camera.time_offset_s = block.number("time_offset_s");
  camera.rate_hz = block.number("rate_hz");
  if (block.has("intrinsics_quality")) {
    camera.intrinsics_quality = read_intrinsics_quality(block.block("intrinsics_quality"));
  }
  if (block.has("mounting_quality")) camera.mounting_quality = read_mounting_quality(block.block("mounting_quality"));
  block.finish();
  return camera;
}

GpsCalibration read_gps(YamlBlock block) {
  GpsCalibration gps;
  gps.antenna_in_body = block.vector3("antenna_in_body");
  if (block.has("time_offset_s")) gps.time_offset_s = block.number("time_offset_s");
  gps.time_offset_sigma_s = optional_number(block, "time_offset_sigma_s");
  block.finish();
  return gps;
}

ClockCalibration read_clock(YamlBlock block) {
  ClockCalibration clock;
  clock.stream = block.text("stream");
  clock.reference = block.text("reference");
  clock.skew_ppm = block.number("skew_ppm");
  clock.skew_sigma_ppm = optional_number(block, "skew_sigma_ppm");
  clock.offset_sigma_s = optional_number(block, "offset_sigma_s");
  clock.jitter_rms_s = optional_number(block, "jitter_rms_s");
  clock.jitter_p99_s = optional_number(block, "jitter_p99_s");
  block.finish();
  return clock;
}

// Numbers are handed over as text: the emitter would round them.
template <class Vector>
void emit_list(YAML::Emitter& out, const Vector& values) {
  out << YAML::Flow << YAML::BeginSeq;
  for (const double value : values) {
    std::string text;
    io::append_number(text, value);
    out << text;
  }
  out << YAML::EndSeq;
}

void emit_number(YAML::Emitter& out, const char* key, double value) {
  std::string text;
  io::append_number(text, value);
  out << YAML::Key << key << YAML::Value << text;
}

void emit_if_known(YAML::Emitter& out, const char* key, double value) {
  if (!std::isnan(value)) emit_number(out, key, value);
}

void emit_matrix(YAML::Emitter& out, const char* key, const Eigen::Matrix3d& matrix) {
  out << YAML::Key << key << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (int i = 0; i < 3; ++i) emit_list(out, Eigen::Vector3d(matrix.row(i)));
  out << YAML::EndSeq;
}

template <class Vector>
void emit_if_whole(YAML::Emitter& out, const char* key, const Vector& values) {
  if (values.hasNaN()) return;
  out << YAML::Key << key << YAML::Value;
  emit_list(out, values);
}

template <class Quality>
void begin_quality(YAML::Emitter& out, const char* key, const Quality& quality) {
  out << YAML::Key << key << YAML::Value << YAML::BeginMap;
  out << YAML::Key << "verdict" << YAML::Value << verdict_name(quality.verdict);
  out << YAML::Key << "method" << YAML::Value << YAML::DoubleQuoted << quality.method;
}

template <class Quality>
void end_quality(YAML::Emitter& out, const Quality& quality) {
  out << YAML::Key << "reasons" << YAML::Value;
  // A flow list keeps an empty one on its line; sentences get a line each.
  if (quality.reasons.empty()) out << YAML::Flow;
  out << YAML::BeginSeq;
  for (const std::string& reason : quality.reasons) out << YAML::DoubleQuoted << reason;
  out << YAML::EndSeq << YAML::EndMap;
}

void emit_quality(YAML::Emitter& out, const TriadQuality& quality) {
  begin_quality(out, "quality", quality);
  out << YAML::Key << "samples" << YAML::Value << std::to_string(quality.samples);
  emit_if_whole(out, "bias_sigma", quality.bias_sigma);
  if (!quality.matrix_sigma.hasNaN()) emit_matrix(out, "matrix_sigma", quality.matrix_sigma);
  emit_if_known(out, "residual_rms", quality.residual_rms);
  end_quality(out, quality);
}

void emit_quality(YAML::Emitter& out, const IntrinsicsQuality& quality) {
  begin_quality(out, "intrinsics_quality", quality);
  out << YAML::Key << "pictures" << YAML::Value << std::to_string(quality.pictures);
  emit_if_whole(out, "intrinsics_sigma", quality.intrinsics_sigma_px);
  emit_if_whole(out, "distortion_sigma", quality.distortion_sigma);
  emit_if_known(out, "reprojection_rms_px", quality.reprojection_rms_px);
  end_quality(out, quality);
}

void emit_quality(YAML::Emitter& out, const MountingQuality& quality) {
  begin_quality(out, "mounting_quality", quality);
  out << YAML::Key << "pictures" << YAML::Value << std::to_string(quality.pictures);
  emit_if_whole(out, "rotation_sigma", quality.rotation_sigma);
  emit_if_whole(out, "translation_sigma", quality.translation_sigma);
  emit_if_known(out, "time_offset_sigma_s", quality.time_offset_sigma_s);
  emit_if_known(out, "line_delay_s", quality.line_delay_s);
  emit_if_known(out, "line_delay_sigma_s", quality.line_delay_sigma_s);
  end_quality(out, quality);
}

void emit_triad(YAML::Emitter& out, const TriadCalibration& triad) {
  out << YAML::BeginMap << YAML::Key << "bias" << YAML::Value;
  emit_list(out, triad.bias);
  emit_matrix(out, "matrix", triad.matrix);
  if (triad.quality) emit_quality(out, *triad.quality);
  out << YAML::EndMap;
}

void emit_imu(YAML::Emitter& out, const ImuCalibration& imu) {
  out << YAML::Key << "imu" << YAML::Value << YAML::BeginMap;
  emit_number(out, "rate_hz", imu.rate_hz);
  out << YAML::Key << "noise" << YAML::Value << YAML::BeginMap;
  emit_number(out, "gyroscope_noise_density", imu.noise.gyroscope_noise_density);
  emit_number(out, "gyroscope_random_walk", imu.noise.gyroscope_random_walk);
  emit_number(out, "accelerometer_noise_density", imu.noise.accelerometer_noise_density);
  emit_number(out, "accelerometer_random_walk", imu.noise.accelerometer_random_walk);
  emit_number(out, "gyroscope_bias_sigma", imu.noise.gyroscope_bias_sigma);
  emit_number(out, "accelerometer_bias_sigma", imu.noise.accelerometer_bias_sigma);
  if (!imu.noise_measured.empty()) {
    out << YAML::Key << "measured" << YAML::Value << YAML::Flow << imu.noise_measured;
  }
  out << YAML::EndMap << YAML::Key << "gyroscope" << YAML::Value;
  emit_triad(out, imu.gyroscope);
  out << YAML::Key << "accelerometer" << YAML::Value;
  emit_triad(out, imu.accelerometer);
  out << YAML::EndMap;
}

void emit_gps(YAML::Emitter& out, const GpsCalibration& gps) {
  out << YAML::Key << "gps" << YAML::Value << YAML::BeginMap << YAML::Key << "antenna_in_body" << YAML::Value;
  emit_list(out, gps.antenna_in_body);
  emit_number(out, "time_offset_s", gps.time_offset_s);
  emit_if_known(out, "time_offset_sigma_s", gps.time_offset_sigma_s);
  out << YAML::EndMap;
}

void emit_clock(YAML::Emitter& out, const ClockCalibration& clock) {
  out << YAML::BeginMap;
  out << YAML::Key << "stream" << YAML::Value << YAML::DoubleQuoted << clock.stream;
  out << YAML::Key << "reference" << YAML::Value << YAML::DoubleQuoted << clock.reference;
  emit_number(out, "skew_ppm", clock.skew_ppm);
  emit_if_known(out, "skew_sigma_ppm", clock.skew_sigma_ppm);
  emit_if_known(out, "offset_sigma_s", clock.offset_sigma_s);
  emit_if_known(out, "jitter_rms_s", clock.jitter_rms_s);
  emit_if_known(out, "jitter_p99_s", clock.jitter_p99_s);
  out << YAML::EndMap;
}

void emit_camera(YAML::Emitter& out, const CameraCalibration& camera) {
  const Eigen::Quaterniond& q = camera.T_body_camera.rotation;
  require(std::abs(q.norm() - 1) <= kUnitTolerance, camera.name + ".T_body_camera: norm of the quaternion", q.norm(),
          "must be 1");
  require(!camera.name.empty(), "a camera must have a name");
  out << YAML::BeginMap;
  out << YAML::Key << "name" << YAML::Value << YAML::DoubleQuoted << camera.name;
  out << YAML::Key << "resolution" << YAML::Value << YAML::Flow
      << YAML::BeginSeq
      // As text: the emitter writes numbers in the global locale, 1280 as 1.280.
      << std::to_string(camera.width_px) << std::to_string(camera.height_px) << YAML::EndSeq;
  out << YAML::Key << "intrinsics" << YAML::Value;
  emit_list(out, camera.intrinsics_px);
  out << YAML::Key << "distortion_model" << YAML::Value << name_of(camera.distortion_model);
  out << YAML::Key << "distortion_coeffs" << YAML::Value;
  emit_list(out, camera.distortion);
  out << YAML::Key << "T_body_camera" << YAML::Value << YAML::BeginMap << YAML::Key << "translation" << YAML::Value;
  emit_list(out, camera.T_body_camera.translation);
  out << YAML::Key << "q_wxyz" << YAML::Value;
  emit_list(out, Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()));
  out << YAML::EndMap;
  emit_number(out, "time_offset_s", camera.time_offset_s);
  emit_number(out, "rate_hz", camera.rate_hz);
  if (camera.intrinsics_quality) emit_quality(out, *camera.intrinsics_quality);
  if (camera.mounting_quality) emit_quality(out, *camera.mounting_quality);
  out << YAML::EndMap;
}

}  // namespace

Rig read_rig(const std::filesystem::path& path) {
  YamlBlock file = YamlBlock::load(path, true);
  if (file.text("format") != kFormat) file.fail("format", std::string("must be ") + kFormat);
  Rig rig;
  if (file.has("imu")) rig.imu = read_imu(file.block("imu"));
  if (file.has("magnetometer")) rig.magnetometer = MagnetometerCalibration{read_triad(file.block("magnetometer"))};
  if (file.has("cameras")) {
    for (YamlBlock& block : file.blocks("cameras")) rig.cameras.push_back(read_camera(std::move(block)));
  }
  if (file.has("gps")) rig.gps = read_gps(file.block("gps"));
  if (file.has("clocks")) {
    for (YamlBlock& block : file.blocks("clocks")) rig.clocks.push_back(read_clock(std::move(block)));
  }
  file.finish();
  io::as_data_error(path, [&] { rig.check(); });
  return rig;
}

void write_rig(const std::filesystem::path& path, const Rig& rig) {
  rig.check();
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "format" << YAML::Value << kFormat;
  if (rig.imu) emit_imu(out, *rig.imu);
  if (rig.magnetometer) {
    out << YAML::Key << "magnetometer" << YAML::Value;
    emit_triad(out, rig.magnetometer->triad);
  }
  if (!rig.cameras.empty()) {
    out << YAML::Key << "cameras" << YAML::Value << YAML::BeginSeq;
    for (const CameraCalibration& camera : rig.cameras) emit_camera(out, camera);
    out << YAML::EndSeq;
  }
  if (rig.gps) emit_gps(out, *rig.gps);
  if (!rig.clocks.empty()) {
    out << YAML::Key << "clocks" << YAML::Value << YAML::BeginSeq;
    for (const ClockCalibration& clock : rig.clocks) emit_clock(out, clock);
    out << YAML::EndSeq;
  }
  out << YAML::EndMap;
  io::AtomicFile file(path);
  file.stream() << out.c_str() << "\n...\n";
  file.commit();
}

Rig update_rig(const std::filesystem::path& path, const std::function<void(Rig&)>& change) {
  // A link that leads nowhere is no missing file: reading says so.
  const bool absent = !std::filesystem::exists(io::status_of(path)) && !std::filesystem::is_symlink(path);
  Rig rig = absent ? Rig{} : read_rig(path);
  change(rig);
  write_rig(path, rig);
  return rig;
}

}  // namespace loc
