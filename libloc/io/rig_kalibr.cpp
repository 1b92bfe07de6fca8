// The files of Kalibr and of EuRoC that hold parts of a rig; declared in rig_yaml.hpp.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "libloc/io/rig_yaml.hpp"
#include "libloc/io/text_file.hpp"
#include "libloc/io/yaml_block.hpp"

namespace loc {
namespace {

using io::YamlBlock;

constexpr double kIdentityTolerance = 1e-9;  // [rad], [m]

Pose3 pose_from(YamlBlock& block, const char* key, const Eigen::Matrix4d& m) {
  try {
    return Pose3::from_matrix(m);
  } catch (const std::invalid_argument& error) {
    block.fail(key, error.what());
  }
}

std::int32_t pixels(YamlBlock& block, double value) {
  if (value != std::floor(value) || value < 1 || value > 1e6) {
    block.fail("resolution", "must be whole, positive numbers");
  }
  return static_cast<std::int32_t>(value);
}

// Resolution, intrinsics and distortion, which Kalibr and EuRoC call the same but for two words.
void read_lens(YamlBlock& block, const char* coefficients, CameraCalibration& camera) {
  if (block.text("camera_model") != "pinhole") block.fail("camera_model", "must be pinhole");
  const std::vector<double> resolution = block.numbers("resolution", 2);
  camera.width_px = pixels(block, resolution[0]);
  camera.height_px = pixels(block, resolution[1]);
  camera.intrinsics_px = Eigen::Map<const Eigen::Vector4d>(block.numbers("intrinsics", 4).data());
  const std::string model = block.text("distortion_model");
  if (model == "none") {
    camera.distortion_model = DistortionModel::kNone;
    block.ignore(coefficients);
    return;
  }
  if (model == "radtan" || model == "radial-tangential") {
    camera.distortion_model = DistortionModel::kRadtan;
  } else if (model == "equidistant") {
    camera.distortion_model = DistortionModel::kEquidistant;
  } else {
    block.fail("distortion_model", "= '" + model + "' is not none, radtan (radial-tangential) or equidistant");
  }
  camera.distortion = Eigen::Map<const Eigen::Vector4d>(block.numbers(coefficients, 4).data());
}

void read_noise(YamlBlock& block, ImuNoise& noise) {
  noise.gyroscope_noise_density = block.number("gyroscope_noise_density");
  noise.gyroscope_random_walk = block.number("gyroscope_random_walk");
  noise.accelerometer_noise_density = block.number("accelerometer_noise_density");
  noise.accelerometer_random_walk = block.number("accelerometer_random_walk");
}

Pose3 read_euroc_pose(YamlBlock& block) {
  YamlBlock pose = block.block("T_BS");
  if (pose.number("cols") != 4 || pose.number("rows") != 4) block.fail("T_BS", "must be 4 by 4");
  const std::vector<double> data = pose.numbers("data", 16);
  return pose_from(block, "T_BS", Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(data.data()));
}

// Kalibr reads with PyYAML and insists on floats: 1e-05 would be a word there, 458 an integer.
std::string kalibr_number(double value) {
  std::string text;
  io::append_number(text, value);
  if (text.find('.') == std::string::npos) text.insert(std::min(text.find('e'), text.size()), ".0");
  return text;
}

template <class Values>
std::string kalibr_list(const Values& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + kalibr_number(value);
  return "[" + text + "]";
}

void write_number(std::ostream& out, const char* key, double value) {
  out << key << ": " << kalibr_number(value) << "\n";
}

// Those that T_cn_cnm1 links to camera i of n.
std::string neighbours(std::size_t i, std::size_t n) {
  std::string text;
  if (i > 0) text = std::to_string(i - 1);
  if (i + 1 < n) text += (text.empty() ? "" : ", ") + std::to_string(i + 1);
  return "[" + text + "]";
}

Rig checked(const std::filesystem::path& path, Rig rig) {
  io::as_data_error(path, [&] { rig.check(); });
  return rig;
}

}  // namespace

std::vector<CameraCalibration> read_kalibr_camchain(const std::filesystem::path& path) {
  YamlBlock file = YamlBlock::load(path, false);
  Rig rig;
  bool with_imu = false;
  for (int i = 0; file.has(("cam" + std::to_string(i)).c_str()); ++i) {
    CameraCalibration camera;
    camera.name = "cam" + std::to_string(i);
    YamlBlock block = file.block(camera.name.c_str());
    read_lens(block, "distortion_coeffs", camera);
    if (i == 0) with_imu = block.has("T_cam_imu");
    if (with_imu) {
      camera.T_body_camera = pose_from(block, "T_cam_imu", block.matrix("T_cam_imu", 4, 4)).inverse();
      camera.time_offset_s = block.number("timeshift_cam_imu");
    } else if (i > 0) {
      const Pose3 T_this_before = pose_from(block, "T_cn_cnm1", block.matrix("T_cn_cnm1", 4, 4));
      camera.T_body_camera = rig.cameras.back().T_body_camera * T_this_before.inverse();
    }
    rig.cameras.push_back(camera);
  }
  // A camera that the numbers do not lead to would be lost in silence.
  for (const std::string& key : file.keys()) {
    const bool camera =
        key.size() > 3 && key.starts_with("cam") && key.find_first_not_of("0123456789", 3) == std::string::npos;
    const bool read = std::ranges::any_of(rig.cameras, [&](const CameraCalibration& c) { return c.name == key; });
    if (camera && !read && !rig.cameras.empty()) {
      file.fail(key.c_str(), "is out of order: there is no cam" + std::to_string(rig.cameras.size()));
    }
  }
  if (rig.cameras.empty()) throw DataError(path.string() + ": no cam0: not a camchain of Kalibr");
  return checked(path, std::move(rig)).cameras;
}

ImuCalibration read_kalibr_imu(const std::filesystem::path& path) {
  YamlBlock file = YamlBlock::load(path, false);
  YamlBlock block = file.has("imu0") ? file.block("imu0") : file;
  // What a calibration of scales, axes and place found and this struct does not hold must not be lost in silence.
  if (block.has("model") && block.text("model") != "calibrated") {
    block.fail("model", "= '" + block.text("model") + "': only calibrated is read");
  }
  for (const char* key : {"accelerometers", "gyroscopes"}) {
    if (block.has(key)) block.fail(key, "is not read: only the model calibrated is");
  }
  if (block.has("T_i_b") && pose_from(block, "T_i_b", block.matrix("T_i_b", 4, 4)).log().norm() > kIdentityTolerance) {
    block.fail("T_i_b", "must be the identity: body is the IMU");
  }
  if (block.has("time_offset") && block.number("time_offset") != 0) {
    block.fail("time_offset", "must be 0: times are those of the IMU");
  }
  Rig rig;
  rig.imu.emplace();
  read_noise(block, rig.imu->noise);
  rig.imu->rate_hz = block.number("update_rate");
  return *checked(path, std::move(rig)).imu;
}

void write_kalibr_camchain(const std::filesystem::path& path, const Rig& rig) {
  rig.check();
  require(!rig.cameras.empty(), "the rig has no camera");
  io::AtomicFile file(path);
  std::ostream& out = file.stream();
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const CameraCalibration& camera = rig.cameras[i];
    const Pose3 T_camera_imu = camera.T_body_camera.inverse();
    const auto write_pose = [&](const char* key, const Pose3& pose) {
      const Eigen::Matrix4d m = pose.matrix();
      out << "  " << key << ":\n";
      for (int row = 0; row < 4; ++row) out << "  - " << kalibr_list(Eigen::Vector4d(m.row(row))) << "\n";
    };
    out << "cam" << i << ":\n";
    write_pose("T_cam_imu", T_camera_imu);
    if (i > 0) write_pose("T_cn_cnm1", T_camera_imu * rig.cameras[i - 1].T_body_camera);
    out << "  cam_overlaps: " << neighbours(i, rig.cameras.size()) << "\n";
    out << "  camera_model: pinhole\n";
    const bool none = camera.distortion_model == DistortionModel::kNone;
    out << "  distortion_coeffs: " << (none ? "[]" : kalibr_list(camera.distortion)) << "\n";
    out << "  distortion_model: "
        << (none                                                       ? "none"
            : camera.distortion_model == DistortionModel::kEquidistant ? "equidistant"
                                                                       : "radtan")
        << "\n";
    out << "  intrinsics: " << kalibr_list(camera.intrinsics_px) << "\n";
    out << "  resolution: [" << camera.width_px << ", " << camera.height_px << "]\n";
    out << "  rostopic: /cam" << i << "/image_raw\n";
    write_number(out, "  timeshift_cam_imu", camera.time_offset_s);
  }
  file.commit();
}

void write_kalibr_imu(const std::filesystem::path& path, const Rig& rig) {
  rig.check();
  require(rig.imu.has_value(), "the rig has no IMU");
  io::AtomicFile file(path);
  std::ostream& out = file.stream();
  write_number(out, "accelerometer_noise_density", rig.imu->noise.accelerometer_noise_density);
  write_number(out, "accelerometer_random_walk", rig.imu->noise.accelerometer_random_walk);
  write_number(out, "gyroscope_noise_density", rig.imu->noise.gyroscope_noise_density);
  write_number(out, "gyroscope_random_walk", rig.imu->noise.gyroscope_random_walk);
  out << "rostopic: /imu0\n";
  write_number(out, "update_rate", rig.imu->rate_hz);
  file.commit();
}

CameraCalibration read_euroc_camera(const std::filesystem::path& path) {
  YamlBlock file = YamlBlock::load(path, false);
  if (file.text("sensor_type") != "camera") file.fail("sensor_type", "must be camera");
  CameraCalibration camera;
  const std::string folder = path.parent_path().filename().string();
  camera.name = folder.empty() ? "cam0" : folder;
  read_lens(file, "distortion_coefficients", camera);
  camera.T_body_camera = read_euroc_pose(file);
  camera.rate_hz = file.number("rate_hz");
  Rig rig;
  rig.cameras.push_back(camera);
  return checked(path, std::move(rig)).cameras[0];
}

ImuCalibration read_euroc_imu(const std::filesystem::path& path) {
  YamlBlock file = YamlBlock::load(path, false);
  if (file.text("sensor_type") != "imu") file.fail("sensor_type", "must be imu");
  const Pose3 T_body_imu = read_euroc_pose(file);
  if (T_body_imu.log().norm() > kIdentityTolerance) file.fail("T_BS", "must be the identity: body is the IMU");
  Rig rig;
  rig.imu.emplace();
  read_noise(file, rig.imu->noise);
  rig.imu->rate_hz = file.number("rate_hz");
  return *checked(path, std::move(rig)).imu;
}

Rig read_any_rig(const std::filesystem::path& path) {
  YamlBlock file = YamlBlock::load(path, false);
  if (file.has("format")) return read_rig(path);
  Rig rig;
  if (file.has("cam0")) {
    rig.cameras = read_kalibr_camchain(path);
  } else if (file.has("sensor_type") && file.text("sensor_type") == "camera") {
    rig.cameras.push_back(read_euroc_camera(path));
  } else if (file.has("sensor_type")) {
    rig.imu = read_euroc_imu(path);
  } else if (file.has("imu0") || file.has("gyroscope_noise_density")) {
    rig.imu = read_kalibr_imu(path);
  } else {
    throw DataError(path.string() +
                    ": neither a rig.yaml of libloc, nor a camchain or imu file of Kalibr, nor a "
                    "sensor.yaml of EuRoC");
  }
  return rig;
}

}  // namespace loc
