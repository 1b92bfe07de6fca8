#include "libloc/io/eqvio.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "libloc/core/check.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/io/text_file.hpp"

namespace loc {
namespace {

namespace fs = std::filesystem;

enum Cell : std::size_t { kType, kTime, kFrame, kLandmark, kGx, kGy, kGz, kAx, kAy, kAz, kU, kV, kKey, kValue, kCells };
constexpr std::array<const char*, kCells> kNames = {"row_type", "t_abs",  "frame_idx", "landmark_id", "gx",
                                                    "gy",       "gz",     "ax",        "ay",          "az",
                                                    "u_norm",   "v_norm", "key",       "value"};
// Beyond the outermost feature: room for predictions.
constexpr double kMarginPx = 10;
// tan(87 degrees): farther out no undistorted picture has points.
constexpr double kLargestTangent = 19;

// Lines split into the cells that are used.
class Rows {
 public:
  explicit Rows(const fs::path& path) : lines_(path) {
    const auto heading = lines_.next();
    if (!heading) throw DataError(path.string() + ": no complete line");
    std::vector<std::string_view> names;
    io::split_cells(*heading, names);
    columns_ = names.size();
    for (std::size_t cell = 0; cell < kCells; ++cell) {
      const auto at = std::find(names.begin(), names.end(), kNames[cell]);
      if (at == names.end()) throw DataError(lines_.where() + ": no column " + kNames[cell]);
      if (std::find(at + 1, names.end(), kNames[cell]) != names.end()) {
        throw DataError(lines_.where() + ": two columns " + kNames[cell]);
      }
      at_[cell] = static_cast<std::size_t>(at - names.begin());
    }
  }

  // False at the end. Rows without any content are counted and passed over.
  bool next() {
    for (;;) {
      const auto line = lines_.next();
      if (!line) return false;
      io::split_cells(*line, cells_);
      if (std::all_of(cells_.begin(), cells_.end(), [](std::string_view cell) { return cell.empty(); })) {
        ++blank_;
        continue;
      }
      // A value of a meta row is free text.
      if (cells_.size() < columns_ || (cells_.size() > columns_ && cell(kType) != "meta")) {
        throw DataError(lines_.where() + ": " + std::to_string(cells_.size()) + " cells, the heading has " +
                        std::to_string(columns_));
      }
      return true;
    }
  }

  std::string_view cell(Cell which) const { return cells_[at_[which]]; }
  double number(Cell which) const {
    const auto value = io::parse_number(cell(which));
    if (!value) fail(which, "is not a number");
    return *value;
  }
  std::int64_t index(Cell which) const {
    const auto value = io::parse_integer(cell(which));
    if (!value || *value < 0) fail(which, "is not a whole number from 0 on");
    return *value;
  }
  TimeNs time() const {
    const auto value = io::parse_time(cell(kTime), 0);
    if (!value) fail(kTime, "is not a time in seconds");
    return *value;
  }
  [[noreturn]] void fail(Cell which, const std::string& why) const {
    throw DataError(lines_.where() + ": " + kNames[which] + " = '" + std::string(cell(which)) + "' " + why);
  }
  std::string where() const { return lines_.where(); }
  const fs::path& path() const { return lines_.path(); }
  std::int64_t blank() const { return blank_; }
  bool cut_tail() const { return lines_.cut_tail(); }

 private:
  io::LineReader lines_;
  std::size_t columns_ = 0;
  std::array<std::size_t, kCells> at_{};
  std::vector<std::string_view> cells_;
  std::int64_t blank_ = 0;
};

// The meta rows by their keys, with their lines.
class Meta {
 public:
  void add(const Rows& rows) {
    const std::string key(rows.cell(kKey));
    if (key.empty()) throw DataError(rows.where() + ": a meta row without a key");
    const auto [at, fresh] = entries_.try_emplace(key, Entry{std::string(rows.cell(kValue)), rows.where()});
    if (!fresh) throw DataError(rows.where() + ": " + key + " comes a second time; it is in " + at->second.where);
  }
  void require_text(const fs::path& path, const char* key, const std::string& text) const {
    const Entry& entry = get(path, key);
    if (entry.text != text) {
      throw DataError(entry.where + ": " + key + " = '" + entry.text + "', only '" + text + "' can be read");
    }
  }
  double number(const fs::path& path, const char* key) const {
    const Entry& entry = get(path, key);
    const auto value = io::parse_number(entry.text);
    if (!value || !std::isfinite(*value)) {
      throw DataError(entry.where + ": " + key + " = '" + entry.text + "' is not a finite number");
    }
    return *value;
  }

 private:
  struct Entry {
    std::string text;
    std::string where;
  };
  const Entry& get(const fs::path& path, const char* key) const {
    const auto at = entries_.find(key);
    if (at == entries_.end()) {
      throw DataError(path.string() + ": no meta row " + key + " before the first row of another type");
    }
    return at->second;
  }
  std::map<std::string, Entry> entries_;
};

// T_body_camera and K; the size of the picture is not in there.
CameraCalibration camera_of(const Meta& meta, const fs::path& path) {
  CameraCalibration camera;
  camera.name = "cam0";
  const std::array<const char*, 4> names = {"camera_fx", "camera_fy", "camera_cx", "camera_cy"};
  for (std::size_t i = 0; i < 4; ++i) {
    camera.intrinsics_px[static_cast<Eigen::Index>(i)] = meta.number(path, names[i]);
  }
  camera.T_body_camera.translation = {meta.number(path, "T_ci_tx"), meta.number(path, "T_ci_ty"),
                                      meta.number(path, "T_ci_tz")};
  Eigen::Quaterniond q{meta.number(path, "T_ci_qw"), meta.number(path, "T_ci_qx"), meta.number(path, "T_ci_qy"),
                       meta.number(path, "T_ci_qz")};
  if (std::abs(q.norm() - 1) > 1e-2) {
    throw DataError(path.string() + ": T_ci_qw … T_ci_qz: norm " + to_text(q.norm(), 6) + ", must be 1");
  }
  camera.T_body_camera.rotation = q.normalized();
  for (Eigen::Index i = 0; i < 2; ++i) {
    if (!(camera.intrinsics_px[i] > 0)) {
      throw DataError(path.string() + ": " + names[static_cast<std::size_t>(i)] + " = " +
                      to_text(camera.intrinsics_px[i]) + " must be positive");
    }
  }
  return camera;
}

// A picture that holds every feature. Rows that cannot be read are left for next() to complain about.
void fit_picture(CameraCalibration& camera, const fs::path& path) {
  // At least from the corner to where the principal point is in the middle.
  Eigen::Vector2d low = Eigen::Vector2d::Zero();
  Eigen::Vector2d high = 2 * camera.intrinsics_px.tail<2>();
  Rows rows(path);
  try {
    while (rows.next()) {
      if (rows.cell(kType) != "vision_feature") continue;
      const Eigen::Vector2d m(rows.number(kU), rows.number(kV));
      if (!m.allFinite() || m.cwiseAbs().maxCoeff() > kLargestTangent) continue;
      const Eigen::Vector2d pixel = camera.intrinsics_px.head<2>().cwiseProduct(m) + camera.intrinsics_px.tail<2>();
      low = low.cwiseMin(pixel - Eigen::Vector2d::Constant(kMarginPx));
      high = high.cwiseMax(pixel + Eigen::Vector2d::Constant(kMarginPx));
    }
  } catch (const DataError&) {
    // next() comes to this row in its turn.
  }
  const Eigen::Vector2d shift = (-low).array().ceil();
  camera.intrinsics_px.tail<2>() += shift;
  const Eigen::Vector2d size = (high + shift).array().ceil() + 1;
  camera.width_px = static_cast<std::int32_t>(size.x());
  camera.height_px = static_cast<std::int32_t>(size.y());
}

class Source final : public EqvioSource {
 public:
  Source(const fs::path& path, const EqvioOptions& options) : rows_(path), sigma_px_(options.sigma_px) {
    if (!std::isnan(sigma_px_)) require_positive("EqvioOptions.sigma_px", sigma_px_);
    if (options.camera) options.camera->check();
    Meta meta;
    while ((at_row_ = rows_.next()) && rows_.cell(kType) == "meta") meta.add(rows_);
    meta.require_text(path, "format_version", "1");
    meta.require_text(path, "measurement_space", "normalized");
    if (options.camera) {
      rig_.cameras.push_back(*options.camera);
    } else {
      rig_.cameras.push_back(camera_of(meta, path));
      fit_picture(rig_.cameras.back(), path);
    }
    rig_.check();
    camera_.emplace(rig_.cameras.back());
  }

  std::optional<Measurement> next() override {
    for (; at_row_ || fetch(); at_row_ = false) {
      const std::string_view type = rows_.cell(kType);
      const bool feature = type == "vision_feature";
      if (!feature && type != "imu") {
        rows_.fail(kType, type == "meta" ? "comes after other rows" : "is not meta, imu or vision_feature");
      }
      const TimeNs time_ns = rows_.time();
      const bool same_frame = feature && frame_ && rows_.index(kFrame) == frame_->sequence;
      if (frame_ && !same_frame) return take_frame();  // this row comes again
      if (same_frame) {
        add_feature(time_ns);
      } else if (last_time_ns_ != kNoTime && time_ns < last_time_ns_) {
        ++rows_back_;
      } else if (feature) {
        begin_frame(time_ns);
      } else if (auto imu = read_imu(time_ns)) {
        at_row_ = false;
        return imu;
      }
    }
    if (frame_) return take_frame();
    return std::nullopt;
  }

  NamedCounts counts() const override {
    NamedCounts counts = {{"imu.read", imu_read_}, {"features.read", frames_read_}, {"features.points", points_}};
    const auto add = [&](const char* name, std::int64_t value) {
      if (value > 0) counts.push_back({name, value});
    };
    add("imu.not_finite", not_finite_);
    add("imu.skipped.time_not_increasing", imu_repeated_);
    add("features.skipped.time_not_increasing", frames_repeated_);
    add("features.skipped.not_projected", not_projected_);
    add("rows.skipped.time_not_increasing", rows_back_);
    add("rows.skipped.blank", rows_.blank());
    add("rows.skipped.no_line_end", rows_.cut_tail() ? 1 : 0);
    return counts;
  }

  const Rig& rig() const override { return rig_; }

 private:
  bool fetch() { return at_row_ = rows_.next(); }

  std::optional<Measurement> read_imu(TimeNs time_ns) {
    ImuMeasurement imu;
    imu.time_ns = time_ns;
    imu.angular_velocity = {rows_.number(kGx), rows_.number(kGy), rows_.number(kGz)};
    imu.specific_force = {rows_.number(kAx), rows_.number(kAy), rows_.number(kAz)};
    last_time_ns_ = time_ns;
    if (time_ns == last_imu_ns_) {
      ++imu_repeated_;
      return std::nullopt;
    }
    last_imu_ns_ = time_ns;
    if (!imu.angular_velocity.allFinite() || !imu.specific_force.allFinite()) ++not_finite_;
    imu.sequence = imu_read_++;
    return imu;
  }

  void begin_frame(TimeNs time_ns) {
    const std::int64_t number = rows_.index(kFrame);
    if (number <= last_frame_) rows_.fail(kFrame, "comes after frame " + std::to_string(last_frame_));
    frame_.emplace();
    frame_->time_ns = time_ns;
    frame_->sequence = number;
    frame_->sigma_px = sigma_px_;
    last_frame_ = number;
    last_time_ns_ = time_ns;
    add_feature(time_ns);
  }

  void add_feature(TimeNs time_ns) {
    if (time_ns != frame_->time_ns) {
      rows_.fail(kTime, "differs within frame " + std::to_string(frame_->sequence) + ", which began at " +
                            format_seconds(frame_->time_ns));
    }
    FeatureObservation feature;
    feature.id = rows_.index(kLandmark);
    const Eigen::Vector3d point(rows_.number(kU), rows_.number(kV), 1);
    for (const auto& [cell, value] : {std::pair(kU, point.x()), std::pair(kV, point.y())}) {
      if (!std::isfinite(value)) rows_.fail(cell, "must be finite");
      if (std::abs(value) > kLargestTangent) rows_.fail(cell, "is farther out than 87 degrees");
    }
    if (std::find(ids_.begin(), ids_.end(), feature.id) != ids_.end()) {
      rows_.fail(kLandmark, "comes a second time in frame " + std::to_string(frame_->sequence));
    }
    ids_.push_back(feature.id);
    const auto pixel = camera_->project(point);
    if (!pixel) {
      ++not_projected_;
      return;
    }
    feature.pixel_px = *pixel;
    frame_->features.push_back(feature);
  }

  std::optional<Measurement> take_frame() {
    FeaturesMeasurement frame = std::move(*frame_);
    frame_.reset();
    ids_.clear();
    if (frame.time_ns == last_frame_ns_) {
      ++frames_repeated_;
      return next();
    }
    last_frame_ns_ = frame.time_ns;
    ++frames_read_;
    points_ += static_cast<std::int64_t>(frame.features.size());
    return frame;
  }

  Rows rows_;
  double sigma_px_;
  Rig rig_;
  std::optional<Camera> camera_;
  bool at_row_ = false;                       // rows_ stands on a row that is still to be used
  std::optional<FeaturesMeasurement> frame_;  // being read
  std::vector<std::int64_t> ids_;             // in it
  TimeNs last_time_ns_ = kNoTime;
  TimeNs last_imu_ns_ = kNoTime;
  TimeNs last_frame_ns_ = kNoTime;
  std::int64_t last_frame_ = -1;
  std::int64_t imu_read_ = 0;
  std::int64_t frames_read_ = 0;
  std::int64_t points_ = 0;
  std::int64_t not_finite_ = 0;
  std::int64_t imu_repeated_ = 0;
  std::int64_t frames_repeated_ = 0;
  std::int64_t not_projected_ = 0;
  std::int64_t rows_back_ = 0;
};

}  // namespace

std::unique_ptr<EqvioSource> open_eqvio(const fs::path& path, const EqvioOptions& options) {
  return std::make_unique<Source>(path, options);
}

bool is_eqvio(const fs::path& path) {
  try {
    io::LineReader lines(path);
    const auto heading = lines.next();
    return heading && heading->starts_with("row_type,t_abs,");
  } catch (const DataError&) {
    return false;
  }
}

}  // namespace loc
