#include "libloc/io/broad.hpp"

#include <matio.h>

#include <array>
#include <cmath>
#include <cstring>
#include <deque>
#include <fstream>
#include <string>

#include "libloc/core/check.hpp"
#include "libloc/io/text_file.hpp"

namespace loc {
namespace {

constexpr double kMicrotesla = 1e-6;

struct CloseMat {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

// matio fills what a cut file lacks with zeros and says nothing, so the lengths of the elements are added up first.
void check_whole(const std::filesystem::path& path) {
  constexpr std::uint64_t kHeaderBytes = 128;
  if (!std::filesystem::exists(io::status_of(path))) throw DataError(path.string() + ": no such file");
  const std::uint64_t size = io::size_of(path);
  std::ifstream file(path, std::ios::binary);
  if (!file) throw DataError(path.string() + ": cannot be read");
  std::array<unsigned char, kHeaderBytes> header{};
  file.read(reinterpret_cast<char*>(header.data()), kHeaderBytes);
  if (!file || header[124] != 0 || header[125] != 1 || header[126] != 'I' || header[127] != 'M') {
    throw DataError(path.string() + ": not a MATLAB v5 file (little endian)");
  }
  std::uint64_t at = kHeaderBytes;
  while (at < size) {
    std::array<unsigned char, 8> tag{};
    file.seekg(static_cast<std::streamoff>(at));
    file.read(reinterpret_cast<char*>(tag.data()), tag.size());
    std::uint64_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) length |= static_cast<std::uint64_t>(tag[4 + i]) << (8 * i);
    if (!file || at + 8 + length > size) {
      throw DataError(path.string() + ": the element at byte " + std::to_string(at) + " is cut");
    }
    at += 8 + length;
  }
}

class MatFile {
 public:
  explicit MatFile(const std::filesystem::path& path) : path_(path) {
    check_whole(path);
    file_.reset(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
    if (!file_) throw DataError(path.string() + ": not a MATLAB file");
  }

  // rows < 0: any number.
  Eigen::MatrixXd matrix(const char* name, Eigen::Index rows, Eigen::Index columns) {
    const Variable variable = read(name, rows, columns);
    if (variable->class_type != MAT_C_DOUBLE || variable->data_type != MAT_T_DOUBLE || variable->isComplex != 0) {
      fail(name, "is not of real doubles");
    }
    const auto n = static_cast<Eigen::Index>(variable->dims[0]);
    return Eigen::Map<const Eigen::MatrixXd>(static_cast<const double*>(variable->data), n, columns);
  }

  Eigen::Array<bool, Eigen::Dynamic, 1> flags(const char* name, Eigen::Index rows) {
    const Variable variable = read(name, rows, 1);
    if (variable->class_type != MAT_C_UINT8 || variable->data_type != MAT_T_UINT8) fail(name, "is not logical");
    const auto* const data = static_cast<const std::uint8_t*>(variable->data);
    Eigen::Array<bool, Eigen::Dynamic, 1> result(rows);
    for (Eigen::Index i = 0; i < rows; ++i) result(i) = data[i] != 0;
    return result;
  }

 private:
  [[noreturn]] void fail(const char* name, const std::string& what) const {
    throw DataError(path_.string() + ": variable '" + name + "' " + what);
  }

  Variable read(const char* name, Eigen::Index rows, Eigen::Index columns) {
    // Size before content: a corrupt size must not be allocated.
    const Variable info(Mat_VarReadInfo(file_.get(), name));
    if (!info) fail(name, "is missing or cannot be read");
    if (info->rank != 2 || info->dims == nullptr || static_cast<Eigen::Index>(info->dims[1]) != columns ||
        (rows >= 0 && static_cast<Eigen::Index>(info->dims[0]) != rows) || info->dims[0] > kMostRows) {
      fail(name, "has the wrong size");
    }
    Variable variable(Mat_VarRead(file_.get(), name));
    if (!variable || variable->data == nullptr ||
        variable->nbytes != variable->dims[0] * variable->dims[1] * static_cast<std::size_t>(variable->data_size)) {
      fail(name, "cannot be read");
    }
    return variable;
  }

  static constexpr std::size_t kMostRows = 100'000'000;
  std::filesystem::path path_;
  std::unique_ptr<mat_t, CloseMat> file_;
};

class BroadSource final : public MeasurementSource {
 public:
  BroadSource(const std::filesystem::path& path, const BroadOptions& options)
      : trial_(read_broad_trial(path)), options_(options) {}

  std::optional<Measurement> next() override {
    while (waiting_.empty()) {
      if (row_ == trial_.angular_velocity.rows()) return std::nullopt;
      push_row(row_++);
    }
    Measurement m = std::move(waiting_.front());
    waiting_.pop_front();
    ++read_[m.index()];
    return m;
  }

  NamedCounts counts() const override {
    NamedCounts counts;
    for (std::size_t i = 0; i < kStreamKinds; ++i) {
      const std::string name = stream_name(static_cast<StreamKind>(i));
      if (read_[i] > 0) counts.push_back({name + ".read", read_[i]});
      if (not_finite_[i] > 0) counts.push_back({name + ".not_finite", not_finite_[i]});
    }
    if (repeated_ > 0) counts.push_back({"magnetometer.skipped.repeated", repeated_});
    return counts;
  }

 private:
  template <class M>
  void push(M m, Eigen::Index row, bool finite) {
    m.time_ns = options_.start_ns + trial_.time_ns[static_cast<std::size_t>(row)];
    Measurement measurement = std::move(m);
    if (!finite) ++not_finite_[measurement.index()];
    stamp_of(measurement).sequence = sequence_[measurement.index()]++;
    waiting_.push_back(std::move(measurement));
  }

  void push_row(Eigen::Index k) {
    MagnetometerMeasurement field;
    field.magnetic_field = trial_.magnetic_field.row(k);
    if (options_.drop_repeated_field && k > 0 && trial_.magnetic_field.row(k) == trial_.magnetic_field.row(k - 1)) {
      ++repeated_;
    } else {
      push(field, k, field.magnetic_field.allFinite());
    }
    if (options_.read_reference) {
      ReferenceMeasurement reference;
      const auto q = trial_.q_world_body_wxyz.row(k);
      reference.q_world_body = Eigen::Quaterniond(q(0), q(1), q(2), q(3));
      reference.position = trial_.position.row(k);
      reference.velocity.setConstant(std::numeric_limits<double>::quiet_NaN());
      reference.score = trial_.score(k);
      push(reference, k, q.allFinite() && reference.position.allFinite());
    }
    ImuMeasurement imu;
    imu.angular_velocity = trial_.angular_velocity.row(k);
    imu.specific_force = trial_.specific_force.row(k);
    push(imu, k, imu.angular_velocity.allFinite() && imu.specific_force.allFinite());
  }

  BroadTrial trial_;
  BroadOptions options_;
  Eigen::Index row_ = 0;
  std::deque<Measurement> waiting_;
  std::array<std::int64_t, kStreamKinds> sequence_{};
  std::array<std::int64_t, kStreamKinds> read_{};
  std::array<std::int64_t, kStreamKinds> not_finite_{};
  std::int64_t repeated_ = 0;
};

}  // namespace

BroadTrial read_broad_trial(const std::filesystem::path& path) {
  MatFile file(path);
  BroadTrial trial;
  trial.rate_hz = file.matrix("sampling_rate", 1, 1)(0, 0);
  if (!(std::isfinite(trial.rate_hz) && trial.rate_hz > 0)) {
    throw DataError(path.string() + ": sampling_rate = " + to_text(trial.rate_hz) + ": must be positive");
  }
  trial.angular_velocity = file.matrix("imu_gyr", -1, 3);
  const Eigen::Index n = trial.angular_velocity.rows();
  if (n == 0) throw DataError(path.string() + ": no sample in it");
  trial.specific_force = file.matrix("imu_acc", n, 3);
  trial.magnetic_field = file.matrix("imu_mag", n, 3) * kMicrotesla;
  trial.q_world_body_wxyz = file.matrix("opt_quat", n, 4);
  trial.position = file.matrix("opt_pos", n, 3);
  trial.score = file.flags("movement", n);
  trial.time_ns.reserve(static_cast<std::size_t>(n));
  for (Eigen::Index k = 0; k < n; ++k) trial.time_ns.push_back(from_seconds(static_cast<double>(k) / trial.rate_hz));
  return trial;
}

std::unique_ptr<MeasurementSource> open_broad(const std::filesystem::path& path, const BroadOptions& options) {
  return std::make_unique<BroadSource>(path, options);
}

}  // namespace loc
