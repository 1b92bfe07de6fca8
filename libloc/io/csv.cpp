#include "libloc/io/csv.hpp"

#include <array>
#include <cmath>
#include <deque>

#include "libloc/core/check.hpp"
#include "libloc/io/table.hpp"

namespace loc {
namespace {

class CsvSource final : public MeasurementSource {
 public:
  CsvSource(const std::filesystem::path& path, const CsvOptions& options) : table_(path, options, "rows") {}

  std::optional<Measurement> next() override {
    while (waiting_.empty()) {
      const auto row = table_.next();
      if (!row) return std::nullopt;
      if (row->magnetometer) push(*row->magnetometer);
      if (row->gps) push(*row->gps);
      if (row->odometry) push(*row->odometry);
      if (row->reference) push(*row->reference);
      if (row->imu) push(*row->imu);
    }
    Measurement m = std::move(waiting_.front());
    waiting_.pop_front();
    return m;
  }

  NamedCounts counts() const override {
    NamedCounts counts;
    table_.add_counts(counts);
    return counts;
  }

 private:
  void push(Measurement m) {
    stamp_of(m).sequence = sequence_[m.index()]++;
    waiting_.push_back(std::move(m));
  }

  io::Table table_;
  std::deque<Measurement> waiting_;  // what is left of the row
  std::array<std::int64_t, kStreamKinds> sequence_{};
};

void append(std::string& line, bool present, const double* values, int size) {
  for (int i = 0; i < size; ++i) {
    line += ',';
    if (present) io::append_number(line, values[i]);
  }
}

}  // namespace

std::unique_ptr<MeasurementSource> open_csv(const std::filesystem::path& path, const CsvOptions& options) {
  return std::make_unique<CsvSource>(path, options);
}

CsvWriter::CsvWriter(const std::filesystem::path& path) : path_(path), file_(path, std::ios::binary | std::ios::trunc) {
  file_ << "time_ns,qw,qx,qy,qz,px_m,py_m,pz_m,vx_m_s,vy_m_s,vz_m_s,wx_rad_s,wy_rad_s,wz_rad_s,"
           "bgx_rad_s,bgy_rad_s,bgz_rad_s,bax_m_s2,bay_m_s2,baz_m_s2,"
           "sigma_theta_x_rad,sigma_theta_y_rad,sigma_theta_z_rad,sigma_px_m,sigma_py_m,sigma_pz_m,"
           "sigma_vx_m_s,sigma_vy_m_s,sigma_vz_m_s,sigma_bgx_rad_s,sigma_bgy_rad_s,sigma_bgz_rad_s,"
           "sigma_bax_m_s2,sigma_bay_m_s2,sigma_baz_m_s2,valid,status,sequence,scale,sigma_scale,"
           "origin_latitude_rad,origin_longitude_rad,origin_altitude_m\n";
  if (!file_) throw DataError(path_.string() + ": cannot be written");
}

void CsvWriter::write(const Estimate& e) {
  std::string line = std::to_string(e.time_ns);
  const Eigen::Vector4d wxyz(e.q_world_body.w(), e.q_world_body.x(), e.q_world_body.y(), e.q_world_body.z());
  const bool oriented = (e.valid & kValidOrientation) != 0;
  append(line, oriented, wxyz.data(), 4);
  append(line, (e.valid & kValidPosition) != 0, e.position.data(), 3);
  append(line, (e.valid & kValidVelocity) != 0, e.velocity.data(), 3);
  append(line, oriented, e.angular_velocity.data(), 3);
  append(line, (e.valid & kValidGyroscopeBias) != 0, e.gyroscope_bias.data(), 3);
  append(line, (e.valid & kValidAccelerometerBias) != 0, e.accelerometer_bias.data(), 3);
  const int dim = (e.valid & kValidCovariance) != 0 ? e.covariance_dim : 0;
  for (int i = 0; i < kMaxEstimateDim; ++i) {
    const double sigma = i < dim ? std::sqrt(e.covariance(i, i)) : 0;
    append(line, i < dim, &sigma, 1);
  }
  line += ',' + std::to_string(e.valid) + ',' + std::to_string(e.status) + ',' + std::to_string(e.sequence);
  const std::array<double, 2> scale{e.scale, e.scale_sigma};
  append(line, (e.valid & kValidScale) != 0, scale.data(), 2);
  const std::array<double, 3> origin{e.origin.latitude, e.origin.longitude, e.origin.altitude};
  append(line, std::isfinite(e.origin.latitude), origin.data(), 3);
  line += '\n';
  file_ << line;
  if (!file_) throw DataError(path_.string() + ": writing failed");
}

void CsvWriter::flush() {
  file_.flush();
  if (!file_) throw DataError(path_.string() + ": writing failed");
}

}  // namespace loc
