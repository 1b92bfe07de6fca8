#include "libloc/io/recording_writer.hpp"

#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <string>

#include "libloc/core/check.hpp"
#include "libloc/io/text_file.hpp"

namespace loc {
namespace {

namespace fs = std::filesystem;

// One data.csv, made with its first line.
class CsvFile {
 public:
  CsvFile(const fs::path& folder, const std::string& heading) : path_(folder / "data.csv") {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) throw DataError(folder.string() + ": cannot be made: " + error.message());
    file_.open(path_, std::ios::binary | std::ios::trunc);
    file_ << heading << '\n';
    check();
  }
  void begin(TimeNs time_ns) { line_ = std::to_string(time_ns); }
  // A triad is written whole or not at all, as readers want it.
  void add(const double* values, int size) {
    bool known = true;
    for (int i = 0; i < size; ++i) known = known && !std::isnan(values[i]);
    for (int i = 0; i < size; ++i) {
      line_ += ',';
      if (known) io::append_number(line_, values[i]);
    }
  }
  void add(const Eigen::Vector3d& v) { add(v.data(), 3); }
  void add(const Eigen::Quaterniond& q) {
    const std::array<double, 4> wxyz = {q.w(), q.x(), q.y(), q.z()};
    add(wxyz.data(), 4);
  }
  void add(double value) { add(&value, 1); }
  void add_sigma(const Eigen::Matrix3d& cov) { add(Eigen::Vector3d(cov.diagonal().cwiseSqrt())); }
  void add_text(const std::string& text) { line_ += ',' + text; }
  void end() {
    file_ << line_ << '\n';
    check();
  }
  void close() {
    file_.close();
    check();
  }

 private:
  void check() {
    if (!file_) throw DataError(path_.string() + ": cannot be written");
  }

  fs::path path_;
  std::ofstream file_;
  std::string line_;
};

struct Place {
  const char* folder;
  const char* heading;
};

// Of the streams that have a file; in the order of StreamKind. Units in EuRoC's own way of writing.
const Place* place_of(StreamKind kind) {
  static const Place imu = {
      "imu0",
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m "
      "s^-2],a_RS_S_z [m s^-2]"};
  static const Place magnetometer = {"mag0", "#timestamp [ns],mx [T],my [T],mz [T]"};
  static const Place gps = {"gps0",
                            "#timestamp [ns],latitude [rad],longitude [rad],altitude [m],ve [m s^-1],vn [m s^-1],vu [m "
                            "s^-1],sigma_e [m],sigma_n [m],sigma_u [m],sigma_ve [m s^-1],sigma_vn [m s^-1],sigma_vu [m "
                            "s^-1],fix,satellites"};
  static const Place reference = {
      "state_groundtruth_estimate0",
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z [],v_RS_R_x [m "
      "s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],b_w_RS_S_x [rad s^-1],b_w_RS_S_y [rad s^-1],b_w_RS_S_z [rad "
      "s^-1],b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],b_a_RS_S_z [m s^-2]"};
  static const Place odometry = {"odometry0",
                                 "#timestamp [ns],odo_start [ns],odo_px [unit],odo_py [unit],odo_pz "
                                 "[unit],odo_qw,odo_qx,odo_qy,odo_qz,odo_sigma_px "
                                 "[unit],odo_sigma_py [unit],odo_sigma_pz [unit],odo_sigma_theta_x "
                                 "[rad],odo_sigma_theta_y [rad],odo_sigma_theta_z "
                                 "[rad]"};
  switch (kind) {
    case StreamKind::kImu:
      return &imu;
    case StreamKind::kMagnetometer:
      return &magnetometer;
    case StreamKind::kGps:
      return &gps;
    case StreamKind::kReference:
      return &reference;
    case StreamKind::kOdometry:
      return &odometry;
    case StreamKind::kImage:
    case StreamKind::kFeatures:
      return nullptr;
  }
  return nullptr;
}

std::string numbers(std::initializer_list<double> values) {
  std::string out = "[";
  for (const double v : values) out += (out.size() > 1 ? ", " : "") + to_text(v);
  return out + "]";
}

std::string pose_yaml(const Pose3& pose) {
  const Eigen::Matrix4d m = pose.matrix();
  std::string data;
  for (int i = 0; i < 16; ++i) data += (i == 0 ? "" : ", ") + to_text(m(i / 4, i % 4));
  return "T_BS:\n  cols: 4\n  rows: 4\n  data: [" + data + "]\n";
}

void write_text(const fs::path& path, const std::string& text) {
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file << text;
  file.close();
  if (error || !file) throw DataError(path.string() + ": cannot be written");
}

void write_imu_yaml(const fs::path& path, const ImuCalibration& imu) {
  const ImuNoise& n = imu.noise;
  write_text(path, "sensor_type: imu\n" + pose_yaml({}) + "rate_hz: " + to_text(imu.rate_hz) +
                       "\ngyroscope_noise_density: " + to_text(n.gyroscope_noise_density) +
                       "\ngyroscope_random_walk: " + to_text(n.gyroscope_random_walk) +
                       "\naccelerometer_noise_density: " + to_text(n.accelerometer_noise_density) +
                       "\naccelerometer_random_walk: " + to_text(n.accelerometer_random_walk) + "\n");
}

void write_camera_yaml(const fs::path& path, const CameraCalibration& c) {
  // EuRoC has no fisheye and no camera without distortion; Kalibr's names stand for them.
  const char* model = c.distortion_model == DistortionModel::kRadtan        ? "radial-tangential"
                      : c.distortion_model == DistortionModel::kEquidistant ? "equidistant"
                                                                            : "none";
  const Eigen::Vector4d& k = c.intrinsics_px;
  const Eigen::Vector4d& d = c.distortion;
  write_text(path, "sensor_type: camera\n" + pose_yaml(c.T_body_camera) + "rate_hz: " + to_text(c.rate_hz) +
                       "\nresolution: [" + std::to_string(c.width_px) + ", " + std::to_string(c.height_px) +
                       "]\ncamera_model: pinhole\nintrinsics: " + numbers({k[0], k[1], k[2], k[3]}) +
                       "\ndistortion_model: " + model +
                       "\ndistortion_coefficients: " + numbers({d[0], d[1], d[2], d[3]}) + "\n");
}

class EurocWriter final : public RecordingWriter {
 public:
  EurocWriter(const fs::path& folder, const Rig& rig) : unfinished_(folder) {
    const fs::path mav = unfinished_.path() / "mav0";
    std::error_code error;
    fs::create_directories(mav, error);
    if (error) throw DataError(mav.string() + ": cannot be made: " + error.message());
    if (rig.imu) write_imu_yaml(mav / "imu0" / "sensor.yaml", *rig.imu);
    for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
      write_camera_yaml(mav / ("cam" + std::to_string(i)) / "sensor.yaml", rig.cameras[i]);
    }
  }

  void write(const Measurement& measurement) override {
    if (const auto* reference = std::get_if<ReferenceMeasurement>(&measurement)) {
      write(*reference, {});
      return;
    }
    if (CsvFile* file = begin(kind_of(measurement), stamp_of(measurement).time_ns)) {
      std::visit([&](const auto& m) { add(*file, m); }, measurement);
      file->end();
    }
  }

  void write(const ReferenceMeasurement& reference, const ReferenceBiases& biases) override {
    CsvFile& file = *begin(StreamKind::kReference, reference.time_ns);
    file.add(reference.position);
    file.add(reference.q_world_body);
    file.add(reference.velocity);
    file.add(biases.gyroscope);
    file.add(biases.accelerometer);
    file.end();
  }

  void finish() override {
    for (auto& [kind, file] : files_) file.close();
    unfinished_.keep();
  }

  NamedCounts counts() const override {
    NamedCounts out;
    for (const auto& [kind, count] : counts_) {
      out.push_back({std::string(stream_name(kind)) + (place_of(kind) != nullptr ? ".written" : ".no_room"), count});
    }
    return out;
  }

  fs::path unfinished() const override { return unfinished_.path(); }

 private:
  // The file of a stream with the time of the row in it; nullptr where there is no room.
  CsvFile* begin(StreamKind kind, TimeNs time_ns) {
    ++counts_[kind];
    const Place* place = place_of(kind);
    if (place == nullptr) return nullptr;
    auto found = files_.find(kind);
    if (found == files_.end()) {
      found = files_.try_emplace(kind, unfinished_.path() / "mav0" / place->folder, place->heading).first;
    }
    found->second.begin(time_ns);
    return &found->second;
  }

  static void add(CsvFile& file, const ImuMeasurement& m) {
    file.add(m.angular_velocity);
    file.add(m.specific_force);
  }
  static void add(CsvFile& file, const MagnetometerMeasurement& m) { file.add(m.magnetic_field); }
  static void add(CsvFile& file, const GpsMeasurement& m) {
    const std::array<double, 2> place = {m.latitude, m.longitude};
    file.add(place.data(), 2);
    file.add(m.altitude);
    file.add(m.velocity_enu);
    file.add_sigma(m.position_cov);
    file.add_sigma(m.velocity_cov);
    file.add_text(std::to_string(static_cast<int>(m.fix)));
    file.add_text(m.satellites < 0 ? "" : std::to_string(m.satellites));
  }
  static void add(CsvFile& file, const OdometryMeasurement& m) {
    file.add_text(m.start_time_ns == kNoTime ? "" : std::to_string(m.start_time_ns));
    file.add(m.position);
    file.add(m.rotation);
    file.add_sigma(m.position_cov);
    file.add_sigma(m.orientation_cov);
  }
  // These are not reached: they have no file, or one that write() above fills.
  static void add(CsvFile& /*file*/, const ImageMeasurement& /*m*/) {}
  static void add(CsvFile& /*file*/, const FeaturesMeasurement& /*m*/) {}
  static void add(CsvFile& /*file*/, const ReferenceMeasurement& /*m*/) {}

  Unfinished unfinished_;
  std::map<StreamKind, CsvFile> files_;
  std::map<StreamKind, std::int64_t> counts_;
};

}  // namespace

Unfinished::Unfinished(fs::path target) : target_(std::move(target)) {
  // "recording/" is a folder named recording.
  if (!target_.has_filename()) target_ = target_.parent_path();
  path_ = target_;
  path_ += ".incomplete";
  const auto there = io::status_of(target_);
  std::error_code error;
  if (fs::exists(there) && !(fs::is_directory(there) && fs::is_empty(target_, error))) {
    throw DataError(target_.string() + ": is there already; remove it or choose another name");
  }
  if (fs::exists(io::status_of(path_))) {
    throw DataError(path_.string() + ": is there already, of a run that was cut off or still goes on; remove it");
  }
}

Unfinished::~Unfinished() {
  if (kept_) return;
  std::error_code error;  // what cannot be removed keeps its telling name
  fs::remove_all(path_, error);
}

void Unfinished::keep() {
  std::error_code error;
  if (fs::is_directory(io::status_of(target_))) fs::remove(target_, error);  // an empty one
  fs::rename(path_, target_, error);
  if (error) throw DataError(target_.string() + ": cannot be made of " + path_.string() + ": " + error.message());
  kept_ = true;
}

std::unique_ptr<RecordingWriter> create_euroc(const fs::path& folder, const Rig& rig) {
  rig.check();
  return std::make_unique<EurocWriter>(folder, rig);
}

}  // namespace loc
