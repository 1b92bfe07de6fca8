// The front end: patches against pictures whose shift is known exactly, corners, and tracks against the true
// projections of a rendered room.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "libloc/vision/corner_detector.hpp"
#include "libloc/vision/feature_tracker.hpp"
#include "libloc/vision/patch.hpp"
#include "support/rendered_ride.hpp"

namespace loc {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using test::RoomCamera;

constexpr TimeNs kFrameNs = 50'000'000;

// Patches

struct Gray {
  int width = 160;
  int height = 120;
  std::vector<std::uint8_t> bytes =
      std::vector<std::uint8_t>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0);

  GrayView view() const { return {bytes.data(), width, height, width}; }
  template <class Function>
  static Gray of(Function&& value) {
    Gray out;
    for (int y = 0; y < out.height; ++y) {
      for (int x = 0; x < out.width; ++x) {
        out.bytes[static_cast<std::size_t>(y * out.width + x)] =
            static_cast<std::uint8_t>(std::clamp(std::lround(value(Vector2d(x, y))), 0L, 255L));
      }
    }
    return out;
  }
};

/// Smooth brightness, known everywhere: waves of 9 to 30 pixels.
double waves(const Vector2d& p) {
  struct Wave {
    Vector2d number;
    double phase;
  };
  static const std::vector<Wave> kWaves = [] {
    std::vector<Wave> out;
    Random random(7);
    for (int i = 0; i < 12; ++i) {
      const double angle = random.uniform(0, 2 * std::numbers::pi);
      const double number = 2 * std::numbers::pi / random.uniform(9, 30);
      out.push_back({{number * std::cos(angle), number * std::sin(angle)}, random.uniform(0, 2 * std::numbers::pi)});
    }
    return out;
  }();
  double out = 120;
  for (const Wave& wave : kWaves) out += 10 * std::sin(wave.number.dot(p) + wave.phase);
  return out;
}

Matrix2d turn(double angle, double scale) {
  return scale * Eigen::Rotation2Dd(angle).toRotationMatrix();
}

struct WarpCase {
  Matrix2d warp = Matrix2d::Identity();
  double gain = 1;
  double offset = 0;
};

TEST(Patch, IsPlacedToATwentiethOfAPixelInAPictureShiftedTurnedScaledAndBrightened) {
  const Vector2d from(80, 60);
  Matrix2d shear;
  shear << 1.15, 0.2, -0.1, 0.9;
  const std::vector<WarpCase> cases{{},
                                    {.gain = 1.4, .offset = -30},
                                    {.gain = 0.5, .offset = 40},
                                    {.warp = turn(0.4, 1)},
                                    {.warp = turn(0, 1.5)},
                                    {.warp = turn(-0.3, 0.75), .gain = 0.8},
                                    {.warp = shear, .gain = 1.2, .offset = -10}};
  const Gray then = Gray::of(waves);
  ImagePatch cut;
  ASSERT_TRUE(cut.cut(then.view(), from));
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const WarpCase& c = cases[i];
    const Matrix2d back = c.warp.inverse();
    WarpedPatch patch;
    ASSERT_TRUE(cut.warp(c.warp, patch)) << i;
    for (const Vector2d& to : {Vector2d(80, 60), Vector2d(85.5, 57.25), Vector2d(72.37, 66.81)}) {
      const Gray now = Gray::of([&](const Vector2d& q) { return c.gain * waves(from + back * (q - to)) + c.offset; });
      const PatchMatch match = align_patch(patch, now.view(), to + Vector2d(0.8, -0.7), 3);
      ASSERT_TRUE(match.found) << i;
      EXPECT_LT((match.pixel_px - to).norm(), 0.05) << i << " at " << to.transpose();
      EXPECT_GT(match.correlation, 0.98) << i;
      EXPECT_NEAR(match.gain, c.gain, 0.06 * c.gain) << i;
    }
  }
}

TEST(Patch, CutBetweenPixelsStaysBetweenThem) {
  const Gray picture = Gray::of(waves);
  for (const Vector2d& at : {Vector2d(70.25, 50.5), Vector2d(71.49, 49.51), Vector2d(69.9, 50.1)}) {
    ImagePatch cut;
    WarpedPatch patch;
    ASSERT_TRUE(cut.cut(picture.view(), at));
    ASSERT_TRUE(cut.warp(Matrix2d::Identity(), patch));
    const PatchMatch match = align_patch(patch, picture.view(), at + Vector2d(-0.6, 0.9), 3);
    ASSERT_TRUE(match.found);
    EXPECT_LT((match.pixel_px - at).norm(), 0.02);
  }
}

TEST(Patch, SearchFindsTheRightPixelOfTheEllipseAndNoneOutside) {
  const Vector2d from(80, 60);
  const Gray then = Gray::of(waves);
  ImagePatch cut;
  WarpedPatch patch;
  ASSERT_TRUE(cut.cut(then.view(), from));
  ASSERT_TRUE(cut.warp(Matrix2d::Identity(), patch));
  const Gray now = Gray::of([&](const Vector2d& q) { return 1.3 * waves(q - Vector2d(9, -6)) - 20; });
  const Vector2d truth = from + Vector2d(9, -6);
  const auto along = [](double angle, double wide, double narrow) {
    const Matrix2d R = turn(angle, 1);
    return Matrix2d(R * Vector2d(wide * wide, narrow * narrow).asDiagonal() * R.transpose());
  };
  const double towards = std::atan2(-6, 9);
  const PatchMatch inside = search_patch(patch, now.view(), from, along(towards, 4, 0.5), 3, 30);
  ASSERT_TRUE(inside.found);
  EXPECT_EQ(inside.pixel_px, truth);
  EXPECT_GT(inside.correlation, 0.99);
  // Across it the same place is outside, though nearer than the ellipse is long.
  const PatchMatch across = search_patch(patch, now.view(), from, along(towards + std::numbers::pi / 2, 4, 0.5), 3, 30);
  EXPECT_TRUE(!across.found || across.correlation < 0.9);
  if (across.found) {
    EXPECT_GT((across.pixel_px - truth).norm(), 5);
  }
  // Cut off before it is reached.
  const PatchMatch small = search_patch(patch, now.view(), from, along(towards, 4, 0.5), 3, 5);
  EXPECT_LE((small.pixel_px - from).cwiseAbs().maxCoeff(), 5.5);
  EXPECT_LT(small.correlation, 0.9);
}

TEST(Patch, WithoutTextureOrAlongAnEdgeIsRefused) {
  const Gray flat = Gray::of([](const Vector2d&) { return 100.0; });
  const Gray faint = Gray::of([](const Vector2d& p) { return 100 + 0.04 * (waves(p) - 120); });
  // As a lens shows it: steps from pixel to pixel would be texture.
  const Gray edge = Gray::of([](const Vector2d& p) { return 120 + 80 * std::tanh((p.x() + 0.3 * p.y() - 98) / 2); });
  WarpedPatch patch;
  for (const Gray* picture : {&flat, &faint, &edge}) {
    ImagePatch cut;
    ASSERT_TRUE(cut.cut(picture->view(), {80, 60}));
    EXPECT_FALSE(cut.warp(Matrix2d::Identity(), patch));
  }
  // A textured patch is not found in a picture without texture, nor where the picture is too dark or too bright.
  const Gray then = Gray::of(waves);
  ImagePatch cut;
  ASSERT_TRUE(cut.cut(then.view(), {80, 60}));
  ASSERT_TRUE(cut.warp(Matrix2d::Identity(), patch));
  for (const double value : {0.0, 100.0, 255.0}) {
    const Gray one = Gray::of([&](const Vector2d&) { return value; });
    EXPECT_FALSE(search_patch(patch, one.view(), {80, 60}, 9 * Matrix2d::Identity(), 3, 30).found);
    EXPECT_FALSE(align_patch(patch, one.view(), {80, 60}, 3).found);
  }
  // Its negative is another pattern.
  const Gray negative = Gray::of([](const Vector2d& p) { return 240 - waves(p); });
  EXPECT_FALSE(align_patch(patch, negative.view(), {80, 60}, 3).found);
}

TEST(Patch, AtTheBorderAndForNumbersThatAreNoneIsRefused) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kHuge = 1e300;
  const Gray picture = Gray::of(waves);
  ImagePatch cut;
  for (const Vector2d& at :
       {Vector2d(3, 60), Vector2d(80, 8.4), Vector2d(157, 60), Vector2d(80, 119), Vector2d(-50, -50),
        Vector2d(kNan, 60), Vector2d(80, kNan), Vector2d(kHuge, 60), Vector2d(80, -kHuge)}) {
    EXPECT_FALSE(cut.cut(picture.view(), at)) << at.transpose();
    EXPECT_TRUE(cut.empty());
  }
  WarpedPatch patch;
  EXPECT_FALSE(cut.warp(Matrix2d::Identity(), patch));  // empty
  ASSERT_TRUE(cut.cut(picture.view(), {9, 60}));
  ASSERT_TRUE(cut.warp(Matrix2d::Identity(), patch));
  EXPECT_FALSE(cut.warp(turn(0.5, 1), patch));  // its corners were not cut
  ASSERT_TRUE(cut.cut(picture.view(), {80, 60}));
  EXPECT_TRUE(cut.warp(turn(0.5, 1), patch));
  EXPECT_FALSE(cut.warp(turn(0, 0.2), patch));  // reaches far beyond
  EXPECT_FALSE(cut.warp(Matrix2d::Zero(), patch));
  EXPECT_FALSE(cut.warp(Matrix2d::Constant(kNan), patch));
  ASSERT_TRUE(cut.warp(Matrix2d::Identity(), patch));
  for (const Vector2d& at :
       {Vector2d(kNan, 60), Vector2d(80, kHuge), Vector2d(-kHuge, 60), Vector2d(-40, 60), Vector2d(80, 400)}) {
    EXPECT_FALSE(align_patch(patch, picture.view(), at, 3).found) << at.transpose();
    EXPECT_FALSE(search_patch(patch, picture.view(), at, 4 * Matrix2d::Identity(), 3, 30).found) << at.transpose();
  }
  EXPECT_FALSE(search_patch(patch, picture.view(), {80, 60}, Matrix2d::Constant(kNan), 3, 30).found);
  // Part of the ellipse is outside: the rest is searched.
  const PatchMatch part = search_patch(patch, picture.view(), {2, 60}, 100 * Matrix2d::Identity(), 3, 30);
  ASSERT_TRUE(part.found);
  EXPECT_GE(part.pixel_px.x(), kPatchHalf);
}

// Corners

TEST(Corners, AreSpreadStrongestFirstAndKeepTheirDistance) {
  RoomCamera room(test::radtan_camera());
  const ImageMeasurement image = room.at(test::swaying(0), 0);
  const GrayView view{image.data->data(), image.width_px, image.height_px, image.row_stride_bytes};
  CornerOptions options;
  std::vector<Corner> corners;
  const std::vector<Vector2d> taken{{376, 240}, {100, 100}};
  find_corners(view, taken, options, corners);
  ASSERT_GT(corners.size(), 60U);
  ASSERT_LE(corners.size(), 100U);
  std::map<std::pair<int, int>, int> cells;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vector2d& p = corners[i].pixel_px;
    EXPECT_GE(corners[i].strength, options.min_strength);
    EXPECT_DOUBLE_EQ(corners[i].strength, corner_strength(view, static_cast<int>(p.x()), static_cast<int>(p.y())));
    if (i > 0) {
      EXPECT_LE(corners[i].strength, corners[i - 1].strength);
    }
    EXPECT_TRUE(p.x() >= options.border_px && p.x() <= 751 - options.border_px) << p.transpose();
    EXPECT_TRUE(p.y() >= options.border_px && p.y() <= 479 - options.border_px) << p.transpose();
    for (std::size_t j = 0; j < i; ++j) EXPECT_GE((p - corners[j].pixel_px).norm(), options.min_separation_px);
    for (const Vector2d& other : taken) EXPECT_GE((p - other).norm(), options.min_separation_px);
    const double column = p.x() / 752 * options.columns;
    const double row = p.y() / 480 * options.rows;
    // Which cell a pixel belongs to that its border goes through is of no importance.
    const bool between = std::abs(column - std::round(column)) < 0.03 || std::abs(row - std::round(row)) < 0.03;
    if (!between) ++cells[{static_cast<int>(column), static_cast<int>(row)}];
  }
  for (const auto& [cell, count] : cells) EXPECT_EQ(count, 1);
  EXPECT_FALSE(cells.contains({7, 4}));  // the cell of a place that was taken
  const double strongest = corners[0].strength;
  // Places beside the corners, in other cells where a border runs between.
  std::vector<Vector2d> beside;
  beside.reserve(corners.size());
  for (const Corner& c : corners) beside.emplace_back(c.pixel_px + Vector2d(11, 0));
  std::vector<Corner> others;
  find_corners(view, beside, options, others);
  for (const Corner& c : others) {
    for (const Vector2d& other : beside) EXPECT_GE((c.pixel_px - other).norm(), options.min_separation_px);
  }
  options.min_strength = strongest / 2;
  find_corners(view, taken, options, others);
  EXPECT_LT(others.size(), corners.size());
  for (const Corner& c : others) EXPECT_GE(c.strength, strongest / 2);
  options.min_strength = CornerOptions{}.min_strength;
  options.most = 10;
  find_corners(view, taken, options, corners);
  ASSERT_EQ(corners.size(), 10U);
  EXPECT_EQ(corners[0].strength, strongest);
}

TEST(Corners, AreNotInFlatPicturesNorAlongEdges) {
  std::vector<Corner> corners(3);
  const CornerOptions options{.columns = 4, .rows = 2};
  find_corners(Gray{}.view(), {}, options, corners);
  EXPECT_TRUE(corners.empty());
  find_corners(Gray::of([](const Vector2d& p) { return p.x() < 80 ? 40.0 : 200.0; }).view(), {}, options, corners);
  EXPECT_TRUE(corners.empty());
  // One square, turned, as a lens shows it: its four corners, in four cells.
  const Matrix2d R = turn(0.2, 1);
  const auto inside = [](double u) { return 0.5 + 0.5 * std::tanh(u); };
  const auto square = [&](const Vector2d& p) {
    const Vector2d in = R.transpose() * (p - Vector2d(80, 60));
    return 40 + 160 * inside(19.6 - std::abs(in.x())) * inside(14.6 - std::abs(in.y()));
  };
  find_corners(Gray::of(square).view(), {}, options, corners);
  ASSERT_EQ(corners.size(), 4U);
  std::set<std::pair<bool, bool>> which;
  for (const Corner& c : corners) {
    const Vector2d in = R.transpose() * (c.pixel_px - Vector2d(80, 60));
    EXPECT_NEAR(std::abs(in.x()), 19.6, 2.5);
    EXPECT_NEAR(std::abs(in.y()), 14.6, 2.5);
    which.insert({in.x() > 0, in.y() > 0});
  }
  EXPECT_EQ(which.size(), 4U);
}

// Tracks

struct Ride {
  int pictures = 30;
  double frame_s = 0.05;
  std::function<Pose3(double)> pose = test::swaying;
  std::function<std::optional<ImageMeasurement>(int, ImageMeasurement)> change = [](int, ImageMeasurement image) {
    return image;
  };
};

struct RideResult {
  double rms_px = 0;  ///< of the tracks against the projection of the point where they began
  double worst_px = 0;
  double alive = 0;  ///< share of the tracks of the first picture that are in view at the end and still there
  double kept = 1;   ///< least share from one picture to the next, of those that stay in view
  std::int64_t seen = 0;
};

RideResult ride(FeatureTracker& tracker, RoomCamera& room, const Ride& ride) {
  RideResult out;
  struct Began {
    Eigen::Vector3d point;
    int picture;
  };
  std::map<std::int64_t, Began> began;
  std::set<std::int64_t> before;
  double squares = 0;
  std::int64_t count = 0;
  const auto in_view = [&](std::int64_t id, const Pose3& pose) {
    const auto truth = room.camera().project(pose.inverse() * began.at(id).point);
    return truth && room.camera().in_image(*truth, 15);
  };
  for (int i = 0; i < ride.pictures; ++i) {
    const Pose3 pose = ride.pose(i * ride.frame_s);
    const auto image = ride.change(i, room.at(pose, i * kFrameNs));
    if (!image) continue;
    const FeaturesMeasurement& features = tracker.track(*image);
    EXPECT_EQ(features.time_ns, image->time_ns);
    std::set<std::int64_t> now;
    for (const FeatureObservation& feature : features.features) {
      EXPECT_TRUE(now.insert(feature.id).second) << "twice in one picture: " << feature.id;
      const auto ray = room.camera().unproject(feature.pixel_px);
      if (!began.contains(feature.id)) began[feature.id] = {test::on_wall(pose, *ray), i};
      if (began[feature.id].picture == i) continue;
      const auto truth = room.camera().project(pose.inverse() * began[feature.id].point);
      if (!truth) continue;
      const double error = (feature.pixel_px - *truth).norm();
      squares += error * error;
      out.worst_px = std::max(out.worst_px, error);
      ++count;
    }
    double stay = 0;
    double kept = 0;
    for (const std::int64_t id : before) {
      if (!in_view(id, pose)) continue;
      ++stay;
      kept += now.contains(id) ? 1 : 0;
    }
    if (stay > 0) out.kept = std::min(out.kept, kept / stay);
    before = now;
  }
  double first = 0;
  const Pose3 last = ride.pose((ride.pictures - 1) * ride.frame_s);
  for (const auto& [id, one] : began) {
    if (one.picture != 0 || !in_view(id, last)) continue;
    ++first;
    out.alive += before.contains(id) ? 1 : 0;
  }
  out.alive /= std::max(first, 1.0);
  out.rms_px = std::sqrt(squares / static_cast<double>(std::max<std::int64_t>(count, 1)));
  out.seen = count;
  return out;
}

std::int64_t count_of(const NamedCounts& counts, const std::string& name) {
  for (const NamedCount& count : counts) {
    if (count.name == name) return count.value;
  }
  ADD_FAILURE() << "no count " << name;
  return -1;
}

TEST(FeatureTracker, StaysOnThePointThatItBeganWith) {
  RoomCamera room(test::small_camera(), 2);
  FeatureTracker tracker(room.calibration());
  const RideResult result = ride(tracker, room, {});
  EXPECT_LT(result.rms_px, 0.3);
  EXPECT_GT(result.alive, 0.85);
  EXPECT_GT(result.seen, 30 * 40);
}

TEST(FeatureTracker, SurvivesStepsOfTheExposure) {
  for (const double gain : {1.5, 0.6}) {
    RoomCamera room(test::small_camera());
    FeatureTracker tracker(room.calibration());
    const RideResult result = ride(tracker, room, {.pictures = 14, .change = [&](int i, const ImageMeasurement& image) {
                                                     return std::optional(test::brightened(image, i >= 7 ? gain : 1));
                                                   }});
    EXPECT_LT(result.rms_px, 0.3) << gain;
    EXPECT_GT(result.kept, 0.8) << gain;
    EXPECT_EQ(count_of(tracker.counts(), "pictures.exposure_steps"), 1) << gain;
  }
}

TEST(FeatureTracker, SurvivesDroppedPictures) {
  RoomCamera room(test::small_camera());
  FeatureTracker tracker(room.calibration());
  const RideResult result = ride(tracker, room, {.pictures = 16, .change = [](int i, ImageMeasurement image) {
                                                   return i >= 5 && i < 10 ? std::nullopt : std::optional(image);
                                                 }});
  EXPECT_LT(result.rms_px, 0.3);
  EXPECT_GT(result.kept, 0.8);
}

// A hand before the lens: dark, and noise all over. The picture before it keeps its own exposure.
TEST(FeatureTracker, SurvivesACoveredLens) {
  RoomCamera room(test::small_camera());
  FeatureTracker tracker(room.calibration());
  Random random(3);
  const RideResult result =
      ride(tracker, room, {.pictures = 14, .change = [&](int i, const ImageMeasurement& image) {
                             return std::optional(i != 7 ? image : test::changed(image, [&](double, int, int) {
                               return 5 + 2 * random.normal();
                             }));
                           }});
  EXPECT_EQ(count_of(tracker.counts(), "pictures.blind"), 1);
  EXPECT_LT(result.rms_px, 0.3);
  EXPECT_GT(result.alive, 0.8);
}

TEST(FeatureTracker, FollowsPureRotation) {
  RoomCamera room(test::small_camera());
  FeatureTracker tracker(room.calibration());
  const auto turning = [](double t) {
    return Pose3{so3::exp(Eigen::Vector3d(0, 0, 0.6 * t)) * test::along_x(), {-1.5, 0, 1.4}};
  };
  const RideResult result = ride(tracker, room, {.pictures = 12, .pose = turning});
  EXPECT_LT(result.rms_px, 0.3);
  EXPECT_GT(result.kept, 0.8);
}

TEST(FeatureTracker, PicturesWithoutAnythingGiveNoTracks) {
  RoomCamera room(test::small_camera());
  const ImageMeasurement image = room.at(test::swaying(0), 0);
  FeatureTracker tracker(room.calibration());
  ASSERT_GT(tracker.track(image).features.size(), 40U);
  const std::int64_t first_lot = count_of(tracker.counts(), "tracks.new");
  Random random(5);
  for (const double value : {0.0, 255.0, 0.0}) {
    const ImageMeasurement flat = test::changed(image, [&](double, int, int) { return value; });
    EXPECT_TRUE(tracker.track(flat).features.empty()) << value;
    EXPECT_TRUE(tracker.last().empty());
  }
  // They count as pictures that did not come: all tracks go on.
  EXPECT_EQ(count_of(tracker.counts(), "pictures.blind"), 3);
  EXPECT_EQ(count_of(tracker.counts(), "tracks.lost"), 0);
  EXPECT_GE(static_cast<std::int64_t>(tracker.track(image).features.size()), first_lot);
  EXPECT_LE(count_of(tracker.counts(), "tracks.lost"), 1);
  // Noise has corners, but none of them is there in the next picture.
  std::int64_t old = 0;
  for (int i = 0; i < 4; ++i) {
    const ImageMeasurement noise = test::changed(image, [&](double, int, int) { return random.uniform(0, 255); });
    tracker.track(noise);
    for (const TrackedFeature& one : tracker.last()) old += one.age > 0 ? 1 : 0;
  }
  EXPECT_LE(old, 2);
  EXPECT_GE(count_of(tracker.counts(), "tracks.lost"), first_lot);
  // And the room is taken up again, with identities that are all new.
  for (const FeatureObservation& feature : tracker.track(image).features) EXPECT_GE(feature.id, first_lot);
}

TEST(FeatureTracker, IdentitiesAreNeverUsedTwiceAlsoAfterReset) {
  RoomCamera room(test::small_camera());
  FeatureTracker tracker(room.calibration(), {.max_tracks = 40});
  std::set<std::int64_t> ids;
  for (int round = 0; round < 3; ++round) {
    for (const FeatureObservation& feature : tracker.track(room.at(test::swaying(0.05 * round), 0)).features) {
      EXPECT_TRUE(ids.insert(feature.id).second) << feature.id;
    }
    EXPECT_EQ(tracker.last().size(), ids.size() - tracker.last().front().id);
    tracker.reset();
  }
  EXPECT_GT(ids.size(), 60U);
}

// The same errors come again and again: n pictures of a camera that stands still are not n measurements.
TEST(FeatureTracker, StandingPicturesSayLessAndLess) {
  RoomCamera room(test::small_camera());
  FeatureTracker tracker(room.calibration(), {.sigma_px = 0.5});
  ImageMeasurement image = room.at(test::swaying(0), 0);
  const auto sigma_after = [&](int pictures) {
    double sigma = 0;
    for (int i = 0; i < pictures; ++i) {
      image.time_ns += kFrameNs;
      sigma = tracker.track(image).sigma_px;
    }
    return sigma;
  };
  const auto a_second = static_cast<int>(from_seconds(1) / kFrameNs);
  EXPECT_EQ(sigma_after(a_second - 2), 0.5) << "not yet a second";
  EXPECT_NEAR(sigma_after(2 + 99), 0.5 * std::sqrt(100.0), 0.06);
  image.data = room.at(test::swaying(0.2), 0).data;
  EXPECT_EQ(sigma_after(1), 0.5) << "it moves";
}

TEST(FeatureTracker, PicturesThatAreNotTheCamerasAreRefusedAndChangeNothing) {
  RoomCamera room(test::small_camera());
  FeatureTracker tracker(room.calibration());
  const ImageMeasurement good = room.at(test::swaying(0), 0);
  const std::size_t tracks = tracker.track(good).features.size();
  const auto message = [&](const ImageMeasurement& image) -> std::string {
    try {
      tracker.track(image);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  ImageMeasurement bad = RoomCamera(test::radtan_camera()).at(test::swaying(0), 0);
  EXPECT_EQ(message(bad), "image: 752 x 480 pixels, the camera has 376 x 240");
  bad = good;
  bad.format = PixelFormat::kMjpeg;
  EXPECT_NE(message(bad).find("JPEG"), std::string::npos);
  bad = good;
  bad.format = PixelFormat::kBgr;  // a third of the bytes that it needs
  EXPECT_NE(message(bad).find("image.row_stride_bytes"), std::string::npos);
  bad = good;
  bad.data = nullptr;
  EXPECT_NE(message(bad).find("image.data"), std::string::npos);
  bad = good;
  bad.format = static_cast<PixelFormat>(77);
  EXPECT_NE(message(bad).find("image"), std::string::npos);
  std::size_t same = 0;
  tracker.track(good);
  for (const TrackedFeature& one : tracker.last()) same += one.age == 1 ? 1 : 0;
  EXPECT_GE(same + 1, tracks);
  EXPECT_THROW(FeatureTracker(CameraCalibration{}), std::invalid_argument);
  EXPECT_THROW(FeatureTracker(room.calibration(), {.klt_window_px = 20}), std::invalid_argument);
}

}  // namespace
}  // namespace loc
