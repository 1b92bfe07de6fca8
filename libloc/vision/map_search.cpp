#include "libloc/vision/map_search.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/geometry/absolute_pose.hpp"
#include "libloc/vision/corner_detector.hpp"

namespace loc {
namespace {

constexpr int kSide = 8;
constexpr int kSamples = kSide * kSide;
constexpr double kSpacing = 1.5;        // of samples [px of the picture at half its size]
constexpr double kLeastDeviation = 3;   // of the brightness over the samples: less is noise
constexpr int kMostCorners = 1000;      // of a picture
constexpr double kCornerSpacing = 5;    // [px]
constexpr double kLeastAlike = 0.75;    // correlation of a pair
constexpr double kSecondBest = 0.75;    // of 1 less correlation: the best to the second best
constexpr double kSamePlace = 8;        // a second best nearer than that is the same place [px]
constexpr std::size_t kMostPairs = 80;  // the clearest
constexpr std::size_t kFewestPairs = 8;
constexpr double kFitPx = 6;         // a corner is where it is to a pixel or two, the map is no better
constexpr double kAllFitPart = 0.4;  // of the pairs, for the pose by all of them
constexpr int kDraws = 15;           // of four pairs, in one picture
constexpr std::size_t kDrawnFrom = 24;

struct Pair {
  std::size_t map = 0;
  int corner = -1;
  double doubt = 1;  // 1 less correlation, best to second best
};

struct Variant {
  double scale;
  double angle;
};
constexpr Variant kVariants[] = {{1, 0.35}, {0.75, 0}, {1, -0.35}, {1.33, 0}};

// Samples around a place. @param step from samples to pixels
bool describe(const GrayView& half, const Eigen::Vector2d& middle_px, const Eigen::Matrix2d& step, float* out) {
  float sum = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const Eigen::Vector2d p = middle_px + step * Eigen::Vector2d(x - 0.5 * (kSide - 1), y - 0.5 * (kSide - 1));
      if (!(p.x() >= 0 && p.y() >= 0 && p.x() < half.width - 1 && p.y() < half.height - 1)) return false;
      const int ix = static_cast<int>(p.x());
      const int iy = static_cast<int>(p.y());
      const auto fx = static_cast<float>(p.x() - ix);
      const auto fy = static_cast<float>(p.y() - iy);
      const std::uint8_t* a = half.row(iy) + ix;
      const std::uint8_t* b = half.row(iy + 1) + ix;
      const float upper = static_cast<float>(a[0]) + fx * (static_cast<float>(a[1]) - static_cast<float>(a[0]));
      const float lower = static_cast<float>(b[0]) + fx * (static_cast<float>(b[1]) - static_cast<float>(b[0]));
      out[y * kSide + x] = upper + fy * (lower - upper);
      sum += out[y * kSide + x];
    }
  }
  Eigen::Map<Eigen::Matrix<float, kSamples, 1>> samples(out);
  samples.array() -= sum / kSamples;
  const float norm = samples.norm();
  if (!(norm > kLeastDeviation * kSide)) return false;
  samples /= norm;
  return true;
}

double angle_to(const SightedPoint& point, const Pose3& pose) {
  const Eigen::Vector3d seen = pose.rotation.conjugate() * (point.position - pose.translation);
  return std::atan2(point.direction.cross(seen).norm(), point.direction.dot(seen));
}

}  // namespace

struct MapSearch::Work {
  explicit Work(const Camera& given) : camera(given) {
    corner_options.most = kMostCorners;
    const double cell = std::sqrt(static_cast<double>(camera.width_px()) * camera.height_px() / kMostCorners);
    corner_options.columns = std::max(2, static_cast<int>(camera.width_px() / cell));
    corner_options.rows = std::max(2, static_cast<int>(camera.height_px() / cell));
    corner_options.min_separation_px = kCornerSpacing;
    corner_options.min_strength = 30;
  }

  Camera camera;
  CornerOptions corner_options;
  std::vector<Corner> corners;
  Eigen::MatrixXf of_corners;
  Eigen::MatrixXf of_map;
  Eigen::MatrixXf alike;  // map x corners
  std::vector<int> corner_of;
  std::vector<std::size_t> map_of;
  std::vector<Pair> pairs;
  std::vector<SightedPoint> sighted;
  std::vector<SightedPoint> fitting;
  cv::Mat half_patch;

  void describe_corners(const GrayView& image, const GrayView& half);
  void describe_map(std::span<const MapPatch> map, const Variant& variant);
  void pair_up(std::size_t map_size);
  std::size_t fit(const Pose3& pose, double angle);
  std::optional<Pose3> pose(const Pose3& last, std::int64_t attempt);
};

void MapSearch::Work::describe_corners(const GrayView& image, const GrayView& half) {
  find_corners(image, {}, corner_options, corners);
  of_corners.resize(kSamples, kMostCorners);
  corner_of.clear();
  const Eigen::Matrix2d step = kSpacing * Eigen::Matrix2d::Identity();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    float* out = of_corners.col(static_cast<Eigen::Index>(corner_of.size())).data();
    if (describe(half, corners[i].pixel_px / 2, step, out)) corner_of.push_back(static_cast<int>(i));
  }
}

// Columns of those that could be described; map_of says which.
void MapSearch::Work::describe_map(std::span<const MapPatch> map, const Variant& variant) {
  of_map.resize(kSamples, static_cast<Eigen::Index>(map.size()));
  map_of.clear();
  const Eigen::Matrix2d step = kSpacing / variant.scale * Eigen::Rotation2Dd(-variant.angle).toRotationMatrix();
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (map[i].patch->empty()) continue;
    Eigen::Vector2d middle;
    const GrayView whole = map[i].patch->view(middle);
    // OpenCV has no view of what must not be changed.
    const cv::Mat pixels(whole.height, whole.width, CV_8UC1, const_cast<std::uint8_t*>(whole.data),
                         static_cast<std::size_t>(whole.stride));
    cv::pyrDown(pixels, half_patch);
    const GrayView half{half_patch.data, half_patch.cols, half_patch.rows, static_cast<int>(half_patch.step)};
    float* out = of_map.col(static_cast<Eigen::Index>(map_of.size())).data();
    if (describe(half, middle / 2, step, out)) map_of.push_back(i);
  }
}

// The corner that looks most like each, unless another one does nearly as much.
void MapSearch::Work::pair_up(std::size_t map_size) {
  const auto described = static_cast<Eigen::Index>(map_of.size());
  const auto seen = static_cast<Eigen::Index>(corner_of.size());
  alike.resize(static_cast<Eigen::Index>(map_size), kMostCorners);
  auto now = alike.topLeftCorner(described, seen);
  now.noalias() = of_map.leftCols(described).transpose() * of_corners.leftCols(seen);
  for (Eigen::Index i = 0; i < described; ++i) {
    Eigen::Index best = 0;
    const float most = now.row(i).maxCoeff(&best);
    if (!(most > kLeastAlike)) continue;
    const Eigen::Vector2d place = corners[static_cast<std::size_t>(corner_of[static_cast<std::size_t>(best)])].pixel_px;
    float second = -1;
    for (Eigen::Index k = 0; k < seen; ++k) {
      if (now(i, k) <= second) continue;
      const Eigen::Vector2d& other = corners[static_cast<std::size_t>(corner_of[static_cast<std::size_t>(k)])].pixel_px;
      if ((other - place).norm() > kSamePlace) second = now(i, k);
    }
    const double doubt = (1 - static_cast<double>(most)) / std::max(1e-6, 1 - static_cast<double>(second));
    if (!(doubt < kSecondBest)) continue;
    pairs.push_back({map_of[static_cast<std::size_t>(i)], corner_of[static_cast<std::size_t>(best)], doubt});
  }
}

std::size_t MapSearch::Work::fit(const Pose3& pose, double angle) {
  fitting.clear();
  for (const SightedPoint& point : sighted) {
    if (angle_to(point, pose) < angle) fitting.push_back(point);
  }
  return fitting.size();
}

std::optional<Pose3> MapSearch::Work::pose(const Pose3& last, std::int64_t attempt) {
  if (sighted.size() < kFewestPairs) return std::nullopt;
  const double angle = kFitPx / camera.intrinsics_px().head<2>().minCoeff();
  AbsolutePoseOptions narrowing;
  narrowing.last_width = angle / 2;
  narrowing.min_fitting = kAllFitPart;
  auto found = absolute_pose(sighted, last, narrowing);
  if (found && fit(*found, angle) >= kFewestPairs) return found;
  // By four at a time: of the clearest pairs some are right.
  Random random(static_cast<std::uint64_t>(attempt));
  const std::size_t from = std::min(kDrawnFrom, sighted.size());
  narrowing.min_fitting = 1;
  narrowing.max_rounds = 30;
  std::size_t most = kFewestPairs - 1;
  std::optional<Pose3> best;
  for (int draw = 0; draw < kDraws; ++draw) {
    SightedPoint four[4];
    std::size_t which[4];
    for (std::size_t k = 0; k < 4; ++k) {
      do {
        which[k] = std::min(from - 1, static_cast<std::size_t>(random.uniform(0, static_cast<double>(from))));
      } while (std::find(which, which + k, which[k]) != which + k);
      four[k] = sighted[which[k]];
    }
    const auto one = absolute_pose(four, last, narrowing);
    if (!one) continue;
    const std::size_t agree = fit(*one, angle);
    if (agree <= most) continue;
    most = agree;
    best = one;
  }
  if (!best) return std::nullopt;
  fit(*best, angle);
  narrowing.min_fitting = 0.5;
  narrowing.first_width = 2 * angle;
  return absolute_pose(fitting, *best, narrowing);
}

MapSearch::MapSearch(const Camera& camera) : work_(std::make_unique<Work>(camera)) {}
MapSearch::MapSearch(MapSearch&&) noexcept = default;
MapSearch& MapSearch::operator=(MapSearch&&) noexcept = default;
MapSearch::~MapSearch() = default;

std::optional<Pose3> MapSearch::find(const GrayView& image, const GrayView& half, std::span<const MapPatch> map,
                                     const Pose3& last, std::int64_t attempt) {
  Work& w = *work_;
  if (map.size() < kFewestPairs) return std::nullopt;
  w.describe_corners(image, half);
  if (w.corner_of.size() < kFewestPairs) return std::nullopt;
  w.pairs.clear();
  w.describe_map(map, {1, 0});
  w.pair_up(map.size());
  w.describe_map(map, kVariants[static_cast<std::size_t>(attempt) % std::size(kVariants)]);
  w.pair_up(map.size());
  // The clearest pair of each feature.
  std::sort(w.pairs.begin(), w.pairs.end(),
            [](const Pair& a, const Pair& b) { return a.map != b.map ? a.map < b.map : a.doubt < b.doubt; });
  w.pairs.erase(
      std::unique(w.pairs.begin(), w.pairs.end(), [](const Pair& a, const Pair& b) { return a.map == b.map; }),
      w.pairs.end());
  std::sort(w.pairs.begin(), w.pairs.end(), [](const Pair& a, const Pair& b) { return a.doubt < b.doubt; });
  if (w.pairs.size() > kMostPairs) w.pairs.resize(kMostPairs);
  w.sighted.clear();
  for (const Pair& pair : w.pairs) {
    const auto ray = w.camera.unproject(w.corners[static_cast<std::size_t>(pair.corner)].pixel_px);
    if (ray) w.sighted.push_back({map[pair.map].position, *ray});
  }
  return w.pose(last, attempt);
}

}  // namespace loc
