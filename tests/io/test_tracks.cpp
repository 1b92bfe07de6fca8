#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "libloc/core/check.hpp"
#include "libloc/core/random.hpp"
#include "libloc/io/points.hpp"
#include "libloc/io/tracks.hpp"
#include "tests/support/temp_folder.hpp"

namespace loc {
namespace {

using test::TempFolder;

std::int64_t count_of(const NamedCounts& counts, const std::string& name) {
  const auto found = std::ranges::find(counts, name, &NamedCount::name);
  return found == counts.end() ? 0 : found->value;
}

TracksFile tracks_of(const std::string& text) {
  const TempFolder folder;
  return read_tracks(folder.write("tracks.txt", text));
}

/// What read_tracks says of a file, without the folder.
std::string error_of(const std::string& text) {
  try {
    tracks_of(text);
  } catch (const DataError& e) {
    const std::string message = e.what();
    return message.substr(message.find("tracks.txt"));
  }
  return "";
}

TEST(Tracks, ReadsRowsInAnyOrderWithCommentsBlankLinesAndCarriageReturns) {
  const TracksFile file = tracks_of(
      "\xEF\xBB\xBF# made by hand\r\n"
      "3 7 0 10.5\r\n"
      "\r\n"
      "  3\t7 1   -2.25e1  # below the image\r\n"
      "0 8 1 4\n"
      "0.0 8.000000000000000000e+00 0 +3\n"
      "3 1 0 1e2\n"
      "3 1 1 0.1\n");
  ASSERT_EQ(file.frames.size(), 2U);
  EXPECT_EQ(file.frames[0].frame, 0);
  ASSERT_EQ(file.frames[0].features.size(), 1U);
  EXPECT_EQ(file.frames[0].features[0].id, 8);
  EXPECT_EQ(file.frames[0].features[0].pixel_px, Eigen::Vector2d(3, 4));
  EXPECT_EQ(file.frames[1].frame, 3);
  ASSERT_EQ(file.frames[1].features.size(), 2U);
  EXPECT_EQ(file.frames[1].features[0].id, 1);
  EXPECT_EQ(file.frames[1].features[0].pixel_px, Eigen::Vector2d(100, 0.1));
  EXPECT_EQ(file.frames[1].features[1].pixel_px, Eigen::Vector2d(10.5, -22.5));
  EXPECT_EQ(count_of(file.counts, "tracks.frames"), 2);
  EXPECT_EQ(count_of(file.counts, "tracks.read"), 3);
  EXPECT_EQ(count_of(file.counts, "tracks.out_of_order"), 2);
}

TEST(Tracks, NumbersComeBackExactly) {
  Random random(1);
  std::vector<TrackFrame> frames;
  for (std::int64_t i = 0; i < 50; ++i) {
    TrackFrame& frame = frames.emplace_back();
    frame.frame = 3 * i;
    for (std::int64_t k = 0; k < 20; ++k) {
      const double scale = std::pow(10, random.uniform(-300, 300));
      frame.features.push_back({k * k * 1'000'000'007, {random.normal() * scale, random.uniform(-0.5, 751.5)}});
    }
  }
  frames[0].features[0].pixel_px = {-0.0, std::numeric_limits<double>::denorm_min()};
  frames[0].features.back().id = std::int64_t{1} << 53;
  const TempFolder folder;
  const auto path = folder.path() / "tracks.txt";
  write_tracks(path, frames);
  const TracksFile file = read_tracks(path);
  ASSERT_EQ(file.frames.size(), frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(file.frames[i].frame, frames[i].frame);
    ASSERT_EQ(file.frames[i].features.size(), 20U);
    for (std::size_t k = 0; k < 20; ++k) {
      EXPECT_EQ(file.frames[i].features[k].id, frames[i].features[k].id);
      EXPECT_EQ(file.frames[i].features[k].pixel_px, frames[i].features[k].pixel_px);
    }
  }
  EXPECT_TRUE(std::signbit(file.frames[0].features[0].pixel_px.x()));
  EXPECT_EQ(count_of(file.counts, "tracks.out_of_order"), 0);
}

TEST(Tracks, BadRowsAreNamedByFileLineAndValue) {
  const std::string good = "0 0 0 1\n0 0 1 2\n";
  const auto after_good = [&](const std::string& row) { return error_of(good + row + "\n"); };
  EXPECT_EQ(error_of(good), "");
  EXPECT_EQ(after_good("1 0 0"), "tracks.txt:3: other than 4 columns; a row is frame feature dimension value");
  EXPECT_EQ(after_good("1 0 0 1 2"), "tracks.txt:3: other than 4 columns; a row is frame feature dimension value");
  EXPECT_EQ(after_good("1,0,0,1"), "tracks.txt:3: other than 4 columns; a row is frame feature dimension value");
  EXPECT_EQ(after_good("-1 0 0 1"), "tracks.txt:3: frame = '-1' is not a whole number from 0 on");
  EXPECT_EQ(after_good("1.5 0 0 1"), "tracks.txt:3: frame = '1.5' is not a whole number from 0 on");
  EXPECT_EQ(after_good("nan 0 0 1"), "tracks.txt:3: frame = 'nan' is not a whole number from 0 on");
  EXPECT_EQ(after_good("1 inf 0 1"), "tracks.txt:3: feature = 'inf' is not a whole number from 0 on");
  EXPECT_EQ(after_good("1 1e17 0 1"), "tracks.txt:3: feature = '1e17' is not a whole number from 0 on");
  EXPECT_EQ(after_good("1 0x1 0 1"), "tracks.txt:3: feature = '0x1' is not a whole number from 0 on");
  EXPECT_EQ(after_good("1 0 2 1"), "tracks.txt:3: dimension = '2' must be 0 (u) or 1 (v)");
  EXPECT_EQ(after_good("1 0 u 1"), "tracks.txt:3: dimension = 'u' is not a whole number from 0 on");
  EXPECT_EQ(after_good("1 0 0 one"), "tracks.txt:3: value = 'one' is not a finite number");
  EXPECT_EQ(after_good("1 0 0 nan"), "tracks.txt:3: value = 'nan' is not a finite number");
  EXPECT_EQ(after_good("1 0 0 -inf"), "tracks.txt:3: value = '-inf' is not a finite number");
  EXPECT_EQ(after_good("1 0 0 1e999"), "tracks.txt:3: value = '1e999' is not a finite number");
  EXPECT_EQ(after_good("1 4 1 1"), "tracks.txt:3: frame 1 feature 4 dimension 1: dimension 0 is missing");
  EXPECT_EQ(after_good("1 4 0 1"), "tracks.txt:3: frame 1 feature 4 dimension 0: dimension 1 is missing");
  EXPECT_EQ(after_good("0 0 1 2"),
            "tracks.txt:3: frame 0 feature 0 dimension 1 comes a second time; it is in line 2 already");
  EXPECT_EQ(error_of("0 0 0 1\n# x\n0 0 0 1\n"),
            "tracks.txt:3: frame 0 feature 0 dimension 0 comes a second time; it is in line 1 already");
  EXPECT_EQ(error_of("# nothing\n"), "tracks.txt: no complete row in it");
  EXPECT_EQ(error_of(""), "tracks.txt: the file is empty");
  EXPECT_THROW(read_tracks("/nonexistent/tracks.txt"), DataError);
}

TEST(Tracks, ACutFileLosesItsLastFeatureAndSaysSo) {
  // Within v of feature 5: what is left of the row would be another number.
  TracksFile file = tracks_of("0 4 0 1\n0 4 1 2\n0 5 0 3\n0 5 1 4");
  ASSERT_EQ(file.frames.size(), 1U);
  EXPECT_EQ(file.frames[0].features.size(), 1U);
  EXPECT_EQ(count_of(file.counts, "tracks.skipped.no_line_end"), 1);
  EXPECT_EQ(count_of(file.counts, "tracks.skipped.cut_feature"), 1);
  // Within u: the feature before is whole.
  file = tracks_of("0 4 0 1\n0 4 1 2\n0 5 0 3");
  EXPECT_EQ(file.frames[0].features.size(), 1U);
  EXPECT_EQ(count_of(file.counts, "tracks.skipped.no_line_end"), 1);
  EXPECT_EQ(count_of(file.counts, "tracks.skipped.cut_feature"), 0);
  // A row that lacks its fellow earlier in the file is an error all the same.
  EXPECT_NE(error_of("0 4 0 1\n0 5 0 3\n0 5 1 4\n0 6"), "");
  EXPECT_EQ(error_of("0 4 0 1"), "tracks.txt: no complete row in it");
}

TEST(Tracks, WhatCannotBeWrittenIsRefused) {
  const TempFolder folder;
  const auto path = folder.path() / "tracks.txt";
  const double nan = std::nan("");
  const auto refuses = [&](const std::vector<TrackFrame>& frames) {
    EXPECT_THROW(write_tracks(path, frames), std::invalid_argument);
    EXPECT_FALSE(std::filesystem::exists(path));
  };
  refuses({{-1, {{0, {1, 2}}}}});
  refuses({{0, {{0, {1, 2}}}}, {0, {{0, {1, 2}}}}});
  refuses({{0, {{-1, {1, 2}}}}});
  refuses({{0, {{3, {1, 2}}, {4, {1, 2}}, {3, {1, 2}}}}});
  refuses({{0, {{3, {1, nan}}}}});
  EXPECT_THROW(write_tracks("/nonexistent/tracks.txt", std::vector<TrackFrame>{}), DataError);
}

TEST(Tracks, BecomeMeasurementsAndComeBack) {
  const std::vector<TrackFrame> frames{{2, {{1, {5, 6}}, {9, {7, 8}}}}, {5, {{9, {1, 2}}}}};
  const TracksClock clock{.rate_hz = 30, .start_time_ns = 1'000'000'000'000, .sigma_px = 0.5, .camera = 1};
  const auto measurements = to_measurements(frames, clock);
  ASSERT_EQ(measurements.size(), 2U);
  EXPECT_EQ(measurements[0].time_ns, 1'000'066'666'667);
  EXPECT_EQ(measurements[0].sequence, 2);
  EXPECT_EQ(measurements[0].camera, 1);
  EXPECT_EQ(measurements[0].sigma_px, 0.5);
  const auto back = to_track_frames(measurements);
  ASSERT_EQ(back.size(), 2U);
  EXPECT_EQ(back[1].frame, 5);
  EXPECT_EQ(back[0].features[1].pixel_px, Eigen::Vector2d(7, 8));

  auto other = measurements;
  for (FeaturesMeasurement& m : other) m.sequence = -1;
  std::ranges::reverse(other[0].features);
  const auto counted = to_track_frames(other);
  EXPECT_EQ(counted[1].frame, 1);
  EXPECT_EQ(counted[0].features[0].id, 1);
  other[1].sequence = 7;
  EXPECT_THROW(to_track_frames(other), std::invalid_argument);
  other = measurements;
  other[1].sequence = 2;
  EXPECT_THROW(to_track_frames(other), std::invalid_argument);
  other = measurements;
  other[1].camera = 0;
  EXPECT_THROW(to_track_frames(other), std::invalid_argument);
  EXPECT_THROW(to_measurements(frames, {.rate_hz = 0}), std::invalid_argument);
  EXPECT_THROW(to_measurements(std::vector<TrackFrame>{{std::int64_t{1} << 53, {}}}, {}), std::invalid_argument);
}

TEST(Points, AreReadFromBlanksAndCommas) {
  const TempFolder folder;
  const PointsFile file = read_points(folder.write("points.csv", "x, y,z\n# corner\n1,2 ,3\r\n4 5\t6 # door\n\n7,8,9"));
  ASSERT_EQ(file.points.size(), 2U);
  EXPECT_EQ(file.points[0], Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(file.points[1], Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(count_of(file.counts, "points.read"), 2);
  EXPECT_EQ(count_of(file.counts, "points.skipped.no_line_end"), 1);
  const std::vector<Eigen::Vector3d> points{{0.1, -1e-300, 1.0 / 3}, {5, 6, 7}};
  write_points(folder.path() / "out.txt", points);
  EXPECT_EQ(read_points(folder.path() / "out.txt").points, points);
}

TEST(Points, BadOnesAreNamedByFileLineAndValue) {
  const TempFolder folder;
  const auto error = [&](const std::string& text) -> std::string {
    try {
      read_points(folder.write("points.txt", text));
    } catch (const DataError& e) {
      const std::string message = e.what();
      return message.substr(message.find("points.txt"));
    }
    return "";
  };
  EXPECT_EQ(error("1 2 3\n1 2\n"), "points.txt:2: 2 columns; a point has x y z");
  EXPECT_EQ(error("1 2 3 4\n"), "points.txt:1: 4 columns; a point has x y z");
  EXPECT_EQ(error("1,,3\n"), "points.txt:1: y = '' is not a finite number");
  EXPECT_EQ(error("1 2 nan\n"), "points.txt:1: z = 'nan' is not a finite number");
  EXPECT_EQ(error("1 2 3\nx y z\n"), "points.txt:2: x = 'x' is not a finite number");
  EXPECT_EQ(error("x y z\n"), "points.txt: no complete point in it");
  EXPECT_THROW(write_points(folder.path() / "out.txt", {{1, 2, std::nan("")}}), std::invalid_argument);
}

}  // namespace
}  // namespace loc
