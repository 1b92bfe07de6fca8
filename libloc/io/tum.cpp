#include "libloc/io/tum.hpp"

#include <array>
#include <cmath>
#include <string>

#include "libloc/core/check.hpp"
#include "libloc/io/text_file.hpp"

namespace loc {
namespace {

std::pair<TimeNs, Pose3> parse_pose(std::string_view line, const std::string& where) {
  static constexpr std::array<const char*, 7> kNames{"tx", "ty", "tz", "qx", "qy", "qz", "qw"};
  std::string_view rest = line;
  const std::string_view time = io::next_word(rest);
  const auto time_ns = io::parse_time(time, 0);
  if (!time_ns) throw DataError(where + ": '" + std::string(time) + "' is not a time in seconds");
  std::array<double, 7> values{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::string_view word = io::next_word(rest);
    if (word.empty()) throw DataError(where + ": " + kNames[i] + " is missing; a pose has 8 columns");
    const auto value = io::parse_number(word);
    if (!value || !std::isfinite(*value)) {
      throw DataError(where + ": " + kNames[i] + " = '" + std::string(word) + "' is not a finite number");
    }
    values[i] = *value;
  }
  if (!io::trim(rest).empty()) throw DataError(where + ": more than 8 columns");
  const Eigen::Quaterniond q(values[6], values[3], values[4], values[5]);
  if (!(std::abs(q.norm() - 1) <= 1e-2)) {
    throw DataError(where + ": quaternion with norm " + to_text(q.norm()) + ": must be 1");
  }
  return {*time_ns, Pose3{q.normalized(), {values[0], values[1], values[2]}}};
}

}  // namespace

TumFile read_tum(const std::filesystem::path& path) {
  io::LineReader lines(path);
  TumFile file;
  std::int64_t not_increasing = 0;
  while (const auto line = lines.next()) {
    const std::string_view text = io::trim(*line);
    if (text.empty() || text.starts_with('#')) continue;
    const auto [time_ns, pose] = parse_pose(text, lines.where());
    if (!file.trajectory.empty() && time_ns <= file.trajectory.times_ns.back()) {
      ++not_increasing;
      continue;
    }
    file.trajectory.push_back(time_ns, pose);
  }
  if (file.trajectory.empty()) throw DataError(path.string() + ": no complete pose in it");
  file.counts.push_back({"tum.read", static_cast<std::int64_t>(file.trajectory.size())});
  if (not_increasing > 0) file.counts.push_back({"tum.skipped.time_not_increasing", not_increasing});
  if (lines.cut_tail()) file.counts.push_back({"tum.skipped.no_line_end", 1});
  return file;
}

void write_tum(const std::filesystem::path& path, const Trajectory& trajectory, std::string_view frame) {
  trajectory.check(path.string());
  io::AtomicFile file(path);
  file.stream() << "# timestamp [s] tx ty tz [m] qx qy qz qw, " << frame << " to world\n";
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const Eigen::Vector3d& t = trajectory.poses[i].translation;
    const Eigen::Quaterniond& q = trajectory.poses[i].rotation;
    std::string line = format_seconds(trajectory.times_ns[i]);
    for (const double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
      line += ' ';
      io::append_number(line, value);
    }
    file.stream() << line << '\n';
  }
  file.commit();
}

}  // namespace loc
