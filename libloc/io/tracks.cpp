#include "libloc/io/tracks.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "libloc/core/check.hpp"
#include "libloc/io/text_file.hpp"

namespace loc {
namespace {

constexpr double kLargestIndex = 9007199254740992.0;  // 2^53: every whole number up to here is a double

struct Row {
  std::int64_t frame = 0;
  std::int64_t feature = 0;
  std::int64_t dimension = 0;
  double value = 0;
  std::int64_t line = 0;

  bool same_feature(const Row& other) const { return frame == other.frame && feature == other.feature; }
};

bool before(const Row& a, const Row& b) {
  if (a.frame != b.frame) return a.frame < b.frame;
  if (a.feature != b.feature) return a.feature < b.feature;
  return a.dimension < b.dimension;
}

std::string name_of(const Row& row) {
  return "frame " + std::to_string(row.frame) + " feature " + std::to_string(row.feature) + " dimension " +
         std::to_string(row.dimension);
}

std::int64_t parse_index(std::string_view word, const char* name, const io::LineReader& lines) {
  const auto value = io::parse_number(word);
  if (!value || *value != std::floor(*value) || *value < 0 || *value > kLargestIndex) {
    throw DataError(lines.where() + ": " + name + " = '" + std::string(word) + "' is not a whole number from 0 on");
  }
  return static_cast<std::int64_t>(*value);
}

Row parse_row(std::string_view rest, const io::LineReader& lines, std::int64_t line) {
  const std::string_view frame = io::next_word(rest);
  const std::string_view feature = io::next_word(rest);
  const std::string_view dimension = io::next_word(rest);
  const std::string_view value = io::next_word(rest);
  if (value.empty() || !io::trim(rest).empty()) {
    throw DataError(lines.where() + ": other than 4 columns; a row is frame feature dimension value");
  }
  Row row;
  row.frame = parse_index(frame, "frame", lines);
  row.feature = parse_index(feature, "feature", lines);
  row.dimension = parse_index(dimension, "dimension", lines);
  if (row.dimension > 1) {
    throw DataError(lines.where() + ": dimension = '" + std::string(dimension) + "' must be 0 (u) or 1 (v)");
  }
  const auto number = io::parse_number(value);
  if (!number || !std::isfinite(*number)) {
    throw DataError(lines.where() + ": value = '" + std::string(value) + "' is not a finite number");
  }
  row.value = *number;
  row.line = line;
  return row;
}

// Every row of the sorted ones has its fellow, and only one.
void require_pairs(const std::vector<Row>& rows, const std::string& path) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    const auto where = [&](const Row& r) { return path + ":" + std::to_string(r.line); };
    if (i > 0 && rows[i - 1].same_feature(row) && rows[i - 1].dimension == row.dimension) {
      throw DataError(where(row) + ": " + name_of(row) + " comes a second time; it is in line " +
                      std::to_string(rows[i - 1].line) + " already");
    }
    const bool has_fellow =
        (i > 0 && rows[i - 1].same_feature(row)) || (i + 1 < rows.size() && rows[i + 1].same_feature(row));
    if (!has_fellow) {
      throw DataError(where(row) + ": " + name_of(row) + ": dimension " + std::to_string(1 - row.dimension) +
                      " is missing");
    }
  }
}

std::vector<TrackFrame> frames_of(const std::vector<Row>& rows) {
  std::vector<TrackFrame> frames;
  for (std::size_t i = 0; i + 1 < rows.size(); i += 2) {
    if (frames.empty() || frames.back().frame != rows[i].frame) frames.push_back({rows[i].frame, {}});
    frames.back().features.push_back({rows[i].feature, {rows[i].value, rows[i + 1].value}});
  }
  return frames;
}

}  // namespace

TracksFile read_tracks(const std::filesystem::path& path) {
  io::LineReader lines(path);
  std::vector<Row> rows;
  std::int64_t out_of_order = 0;
  std::int64_t latest_frame = 0;
  std::int64_t number = 0;
  while (const auto line = lines.next()) {
    ++number;
    const std::string_view text = io::trim(line->substr(0, line->find('#')));
    if (text.empty()) continue;
    rows.push_back(parse_row(text, lines, number));
    if (rows.back().frame < latest_frame) ++out_of_order;
    latest_frame = std::max(latest_frame, rows.back().frame);
  }
  std::optional<Row> last;
  if (lines.cut_tail() && !rows.empty()) last = rows.back();
  // Stable: of two rows of one name, the later one is the second.
  if (!std::ranges::is_sorted(rows, before)) std::ranges::stable_sort(rows, before);

  std::int64_t cut = 0;
  if (last) {
    const auto same = [&](const Row& row) { return row.same_feature(*last); };
    if (std::ranges::count_if(rows, same) == 1) {
      std::erase_if(rows, same);
      cut = 1;
    }
  }
  if (rows.empty()) throw DataError(path.string() + ": no complete row in it");
  require_pairs(rows, path.string());

  TracksFile file;
  file.frames = frames_of(rows);
  file.counts.push_back({"tracks.frames", std::ssize(file.frames)});
  file.counts.push_back({"tracks.read", std::ssize(rows) / 2});
  if (out_of_order > 0) file.counts.push_back({"tracks.out_of_order", out_of_order});
  if (lines.cut_tail()) file.counts.push_back({"tracks.skipped.no_line_end", 1});
  if (cut > 0) file.counts.push_back({"tracks.skipped.cut_feature", cut});
  return file;
}

void write_tracks(const std::filesystem::path& path, std::span<const TrackFrame> frames) {
  std::int64_t last = -1;
  std::vector<std::int64_t> ids;
  for (const TrackFrame& frame : frames) {
    const std::string name = "frame " + std::to_string(frame.frame);
    require(frame.frame > last, name + ": frames must ascend, from 0 on");
    last = frame.frame;
    ids.clear();
    for (const FeatureObservation& feature : frame.features) {
      require(feature.id >= 0, name + ": feature " + std::to_string(feature.id) + ": must not be negative");
      require(feature.pixel_px.allFinite(), name + ": feature " + std::to_string(feature.id) + ": must be finite");
      ids.push_back(feature.id);
    }
    std::ranges::sort(ids);
    const auto twice = std::ranges::adjacent_find(ids);
    require(twice == ids.end(), name + ": a feature comes twice");
  }
  io::AtomicFile file(path);
  file.stream() << "# frame feature dimension (0: u, 1: v) value [px]\n";
  std::string text;
  for (const TrackFrame& frame : frames) {
    text.clear();
    for (const FeatureObservation& feature : frame.features) {
      const std::string row = std::to_string(frame.frame) + ' ' + std::to_string(feature.id);
      for (const int dimension : {0, 1}) {
        text += row;
        text += dimension == 0 ? " 0 " : " 1 ";
        io::append_number(text, feature.pixel_px[dimension]);
        text += '\n';
      }
    }
    file.stream() << text;
  }
  file.commit();
}

void TracksClock::check() const {
  require_positive("rate_hz", rate_hz);
  require(start_time_ns != kNoTime, "start_time_ns: must be a time");
  require_not_negative("sigma_px", sigma_px);
  require(camera >= 0, "camera", camera, "must not be negative");
}

std::vector<FeaturesMeasurement> to_measurements(std::span<const TrackFrame> frames, const TracksClock& clock) {
  clock.check();
  std::vector<FeaturesMeasurement> out;
  out.reserve(frames.size());
  for (const TrackFrame& frame : frames) {
    FeaturesMeasurement& m = out.emplace_back();
    const TimeNs since_start = from_seconds(static_cast<double>(frame.frame) / clock.rate_hz);
    const bool possible = !__builtin_add_overflow(clock.start_time_ns, since_start, &m.time_ns);
    require(possible, "frame", static_cast<double>(frame.frame), "its time is out of range");
    m.sequence = frame.frame;
    m.camera = clock.camera;
    m.sigma_px = clock.sigma_px;
    m.features = frame.features;
  }
  return out;
}

std::vector<TrackFrame> to_track_frames(std::span<const FeaturesMeasurement> measurements) {
  std::vector<TrackFrame> out;
  const bool numbered = !measurements.empty() && measurements.front().sequence >= 0;
  std::int64_t last = -1;
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    const FeaturesMeasurement& m = measurements[i];
    const std::string name = "measurements[" + std::to_string(i) + "]";
    require((m.sequence >= 0) == numbered, name + ": some have a sequence and some not");
    require(m.camera == measurements.front().camera, name + ": must be of the same camera as the first");
    const std::int64_t frame = numbered ? m.sequence : static_cast<std::int64_t>(i);
    require(frame > last, name + ".sequence", static_cast<double>(m.sequence), "must ascend");
    last = frame;
    if (m.features.empty()) continue;
    out.push_back({frame, m.features});
    std::ranges::sort(out.back().features, {}, &FeatureObservation::id);
  }
  return out;
}

}  // namespace loc
