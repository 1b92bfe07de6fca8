// AprilGrids: the library apriltag finds first tags, the grid is grown from them.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "libloc/core/check.hpp"
#include "libloc/vision/target_search.hpp"
#ifdef LOC_APRILTAG
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#endif

namespace loc {

bool finds_april_grids() {
#ifdef LOC_APRILTAG
  return true;
#else
  return false;
#endif
}

#ifdef LOC_APRILTAG
namespace vision {
namespace {

// Corners of a tag: lower left, lower right, upper right, upper left.
using Quad = std::array<cv::Point2f, 4>;

struct Seed {
  int number;  // in the family
  Quad quad;
};

constexpr int kMaxWrongCells = 3;    // of 36; two codes of the family differ by 11 at least
constexpr float kSmallestSide = 10;  // [px] of a tag: cells of 1.25 px cannot be read

float shortest_side(const Quad& quad) {
  double side = 1e9;
  for (std::size_t k = 0; k < 4; ++k) side = std::min(side, cv::norm(quad[k] - quad[(k + 1) % 4]));
  return static_cast<float>(side);
}

// A window that the edges of the tag's cells, an eighth of its side away, do not reach.
int window_of(const Quad& quad) {
  return std::clamp(static_cast<int>(0.08F * shortest_side(quad)), 2, 10);
}

// Takes the tag's own coordinates, (0, 0) lower left to (1, 1) upper right, to pixels.
cv::Matx33d plane_of(const Quad& quad) {
  const Quad unit{cv::Point2f(0, 0), cv::Point2f(1, 0), cv::Point2f(1, 1), cv::Point2f(0, 1)};
  return cv::getPerspectiveTransform(unit.data(), quad.data());
}

cv::Point2f apply(const cv::Matx33d& H, double x, double y) {
  const cv::Vec3d p = H * cv::Vec3d(x, y, 1);
  return {static_cast<float>(p[0] / p[2]), static_cast<float>(p[1] / p[2])};
}

// Seen from its front, convex, large enough and within the picture.
bool plausible(const cv::Mat& gray, const Quad& quad) {
  for (std::size_t k = 0; k < 4; ++k) {
    const cv::Point2f a = quad[(k + 1) % 4] - quad[k];
    const cv::Point2f b = quad[(k + 2) % 4] - quad[(k + 1) % 4];
    if (!(a.cross(b) < 0)) return false;  // in the picture y counts downwards
    if (!(quad[k].x > 0 && quad[k].x < static_cast<float>(gray.cols - 1))) return false;
    if (!(quad[k].y > 0 && quad[k].y < static_cast<float>(gray.rows - 1))) return false;
  }
  return shortest_side(quad) >= kSmallestSide;
}

}  // namespace

struct AprilGridSearch::Library {
  Library() : family(tag36h11_create()), detector(apriltag_detector_create()) {
    apriltag_detector_add_family_bits(detector, family, 1);
    detector->nthreads = 1;
    detector->quad_decimate = 1;
  }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;
  ~Library() {
    apriltag_detector_destroy(detector);
    tag36h11_destroy(family);
  }

  /// Tags whose outlines it finds; those of one number twice are all given.
  /// @param scale pixels of the searched picture for one of the original
  std::vector<Seed> tags(cv::Mat& searched, double scale, double thinner_px) const {
    image_u8_t view{.width = searched.cols,
                    .height = searched.rows,
                    .stride = static_cast<std::int32_t>(searched.step),
                    .buf = searched.data};
    zarray_t* detections = apriltag_detector_detect(detector, &view);
    std::vector<Seed> seeds;
    for (int i = 0; i < zarray_size(detections); ++i) {
      apriltag_detection_t* detection = nullptr;
      zarray_get(detections, i, static_cast<void*>(&detection));
      Seed seed{detection->id, {}};
      cv::Point2d middle(0, 0);
      for (const auto& p : detection->p) middle += cv::Point2d(p[0], p[1]) / 4;
      for (std::size_t k = 0; k < 4; ++k) {
        // Its pixels begin at their corners; what was taken off the black is put back.
        cv::Point2d p(detection->p[k][0], detection->p[k][1]);
        const cv::Point2d out = p - middle;
        p += out * (thinner_px * std::sqrt(2.0) / std::max(1.0, cv::norm(out)));
        seed.quad[k] = cv::Point2f(p / scale - cv::Point2d(0.5, 0.5));
      }
      seeds.push_back(seed);
    }
    apriltag_detections_destroy(detections);
    return seeds;
  }

  /// Cells of the tag in the picture that are not as those of this number; nullopt without contrast or outside.
  std::optional<int> wrong_cells(const cv::Mat& gray, const Quad& quad, int number, double min_contrast) const {
    const cv::Matx33d H = plane_of(quad);
    const double cell = 1.0 / family->width_at_border;
    // The black border inside, and the white around the tag without the squares at its corners.
    double black = 0;
    double white = 0;
    int blacks = 0;
    int whites = 0;
    for (int i = 2; i + 2 < family->width_at_border; ++i) {
      const double along = (i + 0.5) * cell;
      for (const bool far : {false, true}) {
        const double in = far ? 1 - cell / 2 : cell / 2;
        const double out = far ? 1 + cell : -cell;
        for (const cv::Point2f& p : {apply(H, along, in), apply(H, in, along)}) {
          const auto value = brightness(gray, p);
          if (!value) return std::nullopt;
          black += *value;
          ++blacks;
        }
        for (const cv::Point2f& p : {apply(H, along, out), apply(H, out, along)}) {
          const auto value = brightness(gray, p);
          if (!value) continue;  // the outermost white may be cut off by the picture's border
          white += *value;
          ++whites;
        }
      }
    }
    if (whites == 0 || white / whites - black / blacks < min_contrast) return std::nullopt;
    const double threshold = (white / whites + black / blacks) / 2;
    const std::uint64_t code = family->codes[number];
    int wrong = 0;
    for (std::uint32_t i = 0; i < family->nbits; ++i) {
      const double x = (family->bit_x[i] + 0.5) * cell;
      const double y = 1 - (family->bit_y[i] + 0.5) * cell;  // its rows count downwards
      const auto value = brightness(gray, apply(H, x, y));
      if (!value) return std::nullopt;
      const bool expected = (code >> (family->nbits - 1 - i) & 1U) != 0;
      if ((*value > threshold) != expected) ++wrong;
    }
    return wrong;
  }

  apriltag_family_t* family;
  apriltag_detector_t* detector;
};

namespace {

// A part of the grid that hangs together, while it grows.
class Growth {
 public:
  using Check = std::function<bool(const Quad&, int tag)>;
  struct Tag {
    Quad quad;
    std::array<bool, 4> good;
  };

  Growth(const cv::Mat& gray, const CalibrationTarget& target, const TargetDetectorOptions& options,
         const std::multimap<int, Quad>& seeds, Check check)
      : gray_(gray), target_(target), options_(options), seeds_(seeds), check_(std::move(check)) {}

  /// Begins with a tag that the library found. False when it is none of the grid.
  bool start(int tag, const Quad& seed) { return add(tag, seed, reach_of_seed(seed)); }

  void grow() {
    std::set<int> open;
    const auto open_around = [&](int tag) {
      for (const int next : neighbours(tag)) {
        if (!tags_.contains(next)) open.insert(next);
      }
    };
    for (const auto& [tag, unused] : tags_) open_around(tag);
    // A tag that failed is tried again once another neighbour of it is known, from which it is predicted better.
    while (!open.empty()) {
      const int tag = *open.begin();
      open.erase(open.begin());
      if (add_from_neighbours(tag)) open_around(tag);
    }
    leave_out_strays();
  }

  const std::map<int, Tag>& tags() const { return tags_; }

 private:
  std::vector<int> neighbours(int tag) const {
    std::vector<int> out;
    for (int row = tag / target_.columns - 1; row <= tag / target_.columns + 1; ++row) {
      for (int column = tag % target_.columns - 1; column <= tag % target_.columns + 1; ++column) {
        const int other = row * target_.columns + column;
        if (row >= 0 && row < target_.rows && column >= 0 && column < target_.columns && other != tag) {
          out.push_back(other);
        }
      }
    }
    return out;
  }

  // From the known tags around it, as if the lens did not distort there.
  Quad predicted(int tag) const {
    std::vector<cv::Point2d> board;
    std::vector<cv::Point2d> pixels;
    for (const int other : neighbours(tag)) {
      const auto known = tags_.find(other);
      if (known == tags_.end()) continue;
      for (int k = 0; k < 4; ++k) {
        const Eigen::Vector3d p = target_.corner(4 * other + k);
        board.emplace_back(p.x(), p.y());
        pixels.emplace_back(known->second.quad[static_cast<std::size_t>(k)]);
      }
    }
    const cv::Mat found = cv::findHomography(board, pixels, 0);
    Quad quad;
    if (found.empty()) return quad;
    const cv::Matx33d H = found;
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector3d p = target_.corner(4 * tag + k);
      quad[static_cast<std::size_t>(k)] = apply(H, p.x(), p.y());
    }
    return quad;
  }

  static float reach_of_seed(const Quad& quad) { return 0.05F * shortest_side(quad) + 1.5F; }

  bool add_from_neighbours(int tag) {
    const Quad guess = predicted(tag);
    if (!plausible(gray_, guess)) return false;
    const float side = shortest_side(guess);
    // Where the library found it too, its outline is better than a prediction across a distorting lens.
    const auto [first, last] = seeds_.equal_range(tag);
    for (auto seed = first; seed != last; ++seed) {
      const cv::Point2f way = apply(plane_of(seed->second), 0.5, 0.5) - apply(plane_of(guess), 0.5, 0.5);
      if (cv::norm(way) < 0.5F * side && add(tag, seed->second, reach_of_seed(seed->second))) return true;
    }
    return add(tag, guess, 0.1F * side + 1);
  }

  // Corners that do not lie where those around them say: near a corner of the grid there are others of tags' cells.
  void leave_out_strays() {
    std::vector<std::pair<int, std::size_t>> strays;
    for (const auto& [tag, found] : tags_) {
      for (std::size_t k = 0; k < 4; ++k) {
        if (!found.good[k]) continue;
        const auto expected = expected_corner(tag, k);
        if (!expected || cv::norm(expected->pixel - cv::Point2d(found.quad[k])) >
                             expected->within_sides * shortest_side(found.quad) + 0.6) {
          strays.emplace_back(tag, k);
        }
      }
    }
    for (const auto& [tag, k] : strays) tags_.at(tag).good[k] = false;
  }

  struct Expected {
    cv::Point2d pixel;
    double within_sides;  // how far off it may be, in sides of the tag; the next saddle is an eighth away
  };
  // From the others on this tag and those around it: a polynomial of second order, or with few of them a homography.
  std::optional<Expected> expected_corner(int tag, std::size_t corner) const {
    std::vector<cv::Point2d> board;
    std::vector<cv::Point2d> pixels;
    const Eigen::Vector3d at = target_.corner(4 * tag + static_cast<int>(corner));
    std::vector<int> around = neighbours(tag);
    around.push_back(tag);
    for (const int other : around) {
      const auto known = tags_.find(other);
      if (known == tags_.end()) continue;
      for (std::size_t k = 0; k < 4; ++k) {
        if (!known->second.good[k] || (other == tag && k == corner)) continue;
        const Eigen::Vector3d p = (target_.corner(4 * other + static_cast<int>(k)) - at) / target_.size_m;
        board.emplace_back(p.x(), p.y());
        pixels.emplace_back(known->second.quad[k]);
      }
    }
    if (board.size() < 4) return std::nullopt;
    if (board.size() < kFewestForSmooth) {
      const cv::Mat found = cv::findHomography(board, pixels, 0);
      if (found.empty()) return std::nullopt;
      return Expected{cv::Point2d(apply(cv::Matx33d(found), 0, 0)), 0.07};
    }
    const auto place = smooth_place(board, pixels);
    if (!place) return std::nullopt;
    return Expected{*place, 0.04};
  }

  bool add(int tag, const Quad& rough, float max_way) {
    if (!plausible(gray_, rough)) return false;
    const float side = shortest_side(rough);
    std::vector<cv::Point2f> corners(rough.begin(), rough.end());
    // First wide enough to reach the corner from where it was thought to be, then narrow.
    const int reach = std::clamp(static_cast<int>(0.12F * side), 2, 12);
    refine_corners(gray_, corners, reach, max_way, options_.max_disagreement_px);
    for (std::size_t k = 0; k < 4; ++k) {
      if (cv::norm(corners[k] - rough[k]) > max_way) corners[k] = rough[k];
    }
    Tag added{rough, {}};
    // A blurred corner needs a larger window than a sharp one.
    const int narrow = window_of(rough);
    for (const int half_side : {narrow, narrow + 1}) {
      if (static_cast<float>(half_side) > std::max(2.0F, 0.11F * side)) break;
      std::vector<cv::Point2f> ends = corners;
      const std::vector<bool> good = refine_corners(gray_, ends, half_side, max_way, options_.max_disagreement_px);
      for (std::size_t k = 0; k < 4; ++k) {
        if (added.good[k] || !good[k] || cv::norm(ends[k] - rough[k]) > max_way) continue;
        added.good[k] = true;
        added.quad[k] = ends[k];
      }
    }
    // Predictions go on from it: one corner that was not found is made up for by the others, more are not.
    if (std::ranges::count(added.good, true) < 2 || !plausible(gray_, added.quad)) return false;
    if (!check_(added.quad, tag)) return false;
    tags_.emplace(tag, added);
    return true;
  }

  const cv::Mat& gray_;
  const CalibrationTarget& target_;
  const TargetDetectorOptions& options_;
  const std::multimap<int, Quad>& seeds_;
  Check check_;
  std::map<int, Tag> tags_;
};

}  // namespace

AprilGridSearch::AprilGridSearch(const CalibrationTarget& target, const TargetDetectorOptions& options)
    : target_(target), options_(options), library_(std::make_unique<Library>()) {}

AprilGridSearch::~AprilGridSearch() = default;

TargetDetection AprilGridSearch::find(const cv::Mat& gray) const {
  const int tag_count = target_.columns * target_.rows;
  const auto needed = static_cast<std::size_t>(std::min(options_.min_tags, tag_count));
  const auto check = [&](const Quad& quad, int tag) {
    const auto wrong = library_->wrong_cells(gray, quad, target_.first_tag + tag, options_.min_contrast);
    return wrong && *wrong <= kMaxWrongCells;
  };

  // From quick to slow, until one shows a part of the grid. Black is made thinner, so that the corners of tags and
  // squares part; half a pixel of it in a picture of twice the size, where the tags are small.
  struct Step {
    double scale;
    bool thinner;
  };
  std::vector<Step> steps;
  const double side = std::max(gray.cols, gray.rows);
  for (double scale = 1; side * scale > 2000; scale /= 2) steps.insert(steps.begin(), {scale / 2, true});
  if (side <= 2000) steps.push_back({0.5, true});
  steps.push_back({1, true});
  if (options_.thorough) {
    steps.push_back({1, false});
    if (side <= 2000) steps.push_back({2, true});
  }

  TargetDetection out;
  std::map<int, Growth::Tag> best;
  std::set<int> foreign;
  bool seen = false;
  for (const Step& step : steps) {
    cv::Mat searched;
    if (step.scale < 1) cv::resize(gray, searched, {}, step.scale, step.scale, cv::INTER_AREA);
    if (step.scale > 1) cv::resize(gray, searched, {}, step.scale, step.scale, cv::INTER_LINEAR);
    if (step.scale == 1) searched = gray.clone();  // the library takes bytes that it might change
    if (searched.cols < 16 || searched.rows < 16) continue;
    if (step.thinner) cv::dilate(searched, searched, cv::Mat());
    std::multimap<int, Quad> seeds;
    for (const Seed& seed : library_->tags(searched, step.scale, step.thinner ? 1 : 0)) {
      seen = true;
      const int tag = seed.number - target_.first_tag;
      if (tag >= 0 && tag < tag_count) {
        seeds.emplace(tag, seed.quad);
      } else {
        foreign.insert(seed.number);
      }
    }
    std::vector<std::map<int, Growth::Tag>> parts;
    for (const auto& [tag, quad] : seeds) {
      const cv::Point2f middle = apply(plane_of(quad), 0.5, 0.5);
      const float near = 0.5F * shortest_side(quad);
      const bool known = std::ranges::any_of(parts, [&, number = tag](const auto& part) {
        const auto other = part.find(number);
        return other != part.end() && cv::norm(apply(plane_of(other->second.quad), 0.5, 0.5) - middle) < near;
      });
      if (known) continue;
      Growth growth(gray, target_, options_, seeds, check);
      if (!growth.start(tag, quad)) continue;
      growth.grow();
      parts.push_back(growth.tags());
    }
    for (auto& part : parts) {
      if (part.size() > best.size()) best = std::move(part);
    }
    if (best.size() >= needed) break;
  }
  out.foreign_tags = static_cast<int>(foreign.size());
  if (best.size() < needed) {
    out.reason = !best.empty() ? "only " + std::to_string(best.size()) + " tag of the grid"
                 : !foreign.empty()
                     ? "tags, but none of the grid's: number " + std::to_string(*foreign.begin()) + " and others"
                 : seen ? "tags of the grid, but not sharp enough or not in a grid"
                        : "no tag of the family 36h11";
    return out;
  }
  for (const auto& [tag, found] : best) {
    for (std::size_t k = 0; k < 4; ++k) {
      if (!found.good[k]) {
        ++out.corners_left_out;
        continue;
      }
      const cv::Point2f& p = found.quad[k];
      out.view.corners.push_back({static_cast<std::int32_t>(4 * static_cast<std::size_t>(tag) + k), {p.x, p.y}});
    }
  }
  return out;
}

}  // namespace vision

#else
namespace vision {

struct AprilGridSearch::Library {};

AprilGridSearch::AprilGridSearch(const CalibrationTarget& target, const TargetDetectorOptions& options)
    : target_(target), options_(options) {
  require(false,
          "target: this build cannot find AprilGrids, for want of the library apriltag (Debian: libapriltag-dev)");
}
AprilGridSearch::~AprilGridSearch() = default;
TargetDetection AprilGridSearch::find(const cv::Mat& /*gray*/) const {
  return {};
}

}  // namespace vision
#endif
}  // namespace loc
