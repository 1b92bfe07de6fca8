// Start values for the start of SLAM, from nothing: which observations jump, the gyroscope's bias from the epipolar
// constraint, and velocity, gravity and points from equations that are linear in them.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "libloc/estimators/slam_start_detail.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc::slam_start {
namespace {

constexpr double kPairS = 0.2;  // between the frames of a pair of the epipolar constraint [s]
constexpr int kRotationIterations = 5;
constexpr int kEpipolarIterations = 12;
constexpr double kMaxBiasStep = 0.05;  // of one iteration [rad/s]
constexpr int kClosedFormIterations = 6;
constexpr double kCauchy = 3;          // weights fall off beyond so many robust deviations
constexpr double kMinDistance = 0.05;  // of a point from a camera, for weights [m]

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double cauchy(double residual, double scale) {
  const double r = residual / (kCauchy * scale);
  return 1 / (1 + r * r);
}

// The ray of each observation in the axes of start, if the body turned as these motions say.
using Rays = std::vector<std::vector<Eigen::Vector3d>>;
Rays rays_in_start(const Problem& problem, const std::vector<FrameMotion>& motion) {
  const Eigen::Matrix3d R_body_camera = problem.T_body_camera.rotation.toRotationMatrix();
  Rays out;
  out.reserve(problem.tracks.size());
  for (const Track& track : problem.tracks) {
    auto& rays = out.emplace_back();
    for (const Observation& o : track.observations) {
      rays.push_back(motion[static_cast<std::size_t>(o.frame)].rotation * (R_body_camera * o.ray));
    }
  }
  return out;
}

struct Pair {
  std::size_t first, second;  // frames
  struct Match {
    std::size_t track, first, second;  // which observations of it
  };
  std::vector<Match> matches;
};

constexpr std::size_t kMinMatches = 6;

std::vector<Pair> make_pairs(const Problem& problem) {
  std::vector<Pair> pairs;
  const auto frames = static_cast<std::size_t>(problem.frames());
  for (std::size_t i = 0, j = 0; i < frames; ++i) {
    while (j < frames && problem.times_s[j] - problem.times_s[i] < kPairS) ++j;
    if (j == frames) break;
    pairs.push_back({i, j, {}});
  }
  std::vector<std::ptrdiff_t> place(frames);
  for (std::size_t t = 0; t < problem.tracks.size(); ++t) {
    std::ranges::fill(place, -1);
    const auto& observations = problem.tracks[t].observations;
    for (std::size_t k = 0; k < observations.size(); ++k) {
      if (observations[k].used) place[static_cast<std::size_t>(observations[k].frame)] = static_cast<std::ptrdiff_t>(k);
    }
    for (Pair& pair : pairs) {
      if (place[pair.first] < 0 || place[pair.second] < 0) continue;
      pair.matches.push_back(
          {t, static_cast<std::size_t>(place[pair.first]), static_cast<std::size_t>(place[pair.second])});
    }
  }
  std::erase_if(pairs, [](const Pair& pair) { return pair.matches.size() < kMinMatches; });
  return pairs;
}

// Direction of motion t of a pair: t . (a x b) = 0 for the rays a, b of every match, robustly.
Eigen::Vector3d direction_of_motion(const std::vector<Eigen::Vector3d>& normals, double sigma) {
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  for (int iteration = 0; iteration < 4; ++iteration) {
    Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
    std::vector<double> residuals;
    residuals.reserve(normals.size());
    for (const Eigen::Vector3d& n : normals) residuals.push_back(std::abs(t.dot(n)));
    std::vector<double> sorted = residuals;
    const double scale = std::max(sigma, 1.4826 * median(sorted));
    for (std::size_t k = 0; k < normals.size(); ++k) {
      // At first large parallax counts less than by its square: an outlier's is the largest.
      const double weight = iteration == 0 ? 1 / (normals[k].norm() + 4 * sigma) : cauchy(residuals[k], scale);
      moment += weight * normals[k] * normals[k].transpose();
    }
    t = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(moment).eigenvectors().col(0);
  }
  return t;
}

// |x| = size of the minimum of x^T S x - 2 r^T x, S symmetric: x = (S + lambda I)^-1 r, and |x| falls with lambda.
std::optional<Eigen::Vector3d> minimum_on_sphere(const Eigen::Matrix3d& S, const Eigen::Vector3d& r, double size) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(S);
  const Eigen::Vector3d& values = eigen.eigenvalues();
  const Eigen::Vector3d along = eigen.eigenvectors().transpose() * r;
  const auto solution = [&](double lambda) { return Eigen::Vector3d(along.array() / (values.array() + lambda)); };
  double low = -values[0];                              // |x| is infinite here
  double high = -values[0] + r.norm() / size + 1e-300;  // |x| <= size here
  if (!(std::abs(along[0]) > 0) || !std::isfinite(high)) return std::nullopt;
  for (int i = 0; i < 200 && high - low > 1e-15 * std::abs(high); ++i) {
    const double middle = 0.5 * (low + high);
    (solution(middle).norm() > size ? low : high) = middle;
  }
  const Eigen::Vector3d x = eigen.eigenvectors() * solution(high);
  if (!x.allFinite() || !(x.norm() > 0)) return std::nullopt;
  return Eigen::Vector3d(x.normalized() * size);
}

}  // namespace

void mark_jumps(Problem& problem) {
  const Rays rays = rays_in_start(problem, integrate(problem, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()));
  std::vector<std::vector<double>> residuals(rays.size());
  std::vector<double> all;
  for (std::size_t t = 0; t < rays.size(); ++t) {
    const auto& ray = rays[t];
    const auto n = static_cast<std::ptrdiff_t>(ray.size());
    const auto time = [&](std::ptrdiff_t k) {
      const int frame = problem.tracks[t].observations[static_cast<std::size_t>(k)].frame;
      return problem.times_s[static_cast<std::size_t>(frame)];
    };
    for (std::ptrdiff_t k = 0; k < n; ++k) {
      // From both sides, from the two before, from the two after: one outlier nearby leaves one of them.
      constexpr std::array<std::array<std::ptrdiff_t, 2>, 3> kNeighbours = {{{-1, 1}, {-2, -1}, {1, 2}}};
      double least = std::numeric_limits<double>::infinity();
      for (const auto& [before, after] : kNeighbours) {
        const std::ptrdiff_t a = k + before;
        const std::ptrdiff_t b = k + after;
        if (a < 0 || b >= n || b < 0) continue;
        const double share = (time(k) - time(a)) / (time(b) - time(a));
        const Eigen::Vector3d& from = ray[static_cast<std::size_t>(a)];
        const Eigen::Vector3d expected = from + share * (ray[static_cast<std::size_t>(b)] - from);
        least = std::min(least, (ray[static_cast<std::size_t>(k)] - expected).norm());
      }
      residuals[t].push_back(least);
      if (std::isfinite(least)) all.push_back(least);
    }
  }
  if (all.empty()) return;
  const double limit = 8 * std::max(problem.ray_sigma(), median(all));
  for (std::size_t t = 0; t < rays.size(); ++t) {
    for (std::size_t k = 0; k < residuals[t].size(); ++k) {
      problem.tracks[t].observations[k].used = residuals[t][k] <= limit;
    }
  }
}

RotationOnly rotation_only(const Problem& problem) {
  const double sigma = problem.ray_sigma();
  const double prior = 1 / (problem.gyroscope_bias_sigma * problem.gyroscope_bias_sigma);
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  double parallax = 0;
  for (int iteration = 0; iteration < kRotationIterations; ++iteration) {
    const std::vector<FrameMotion> motion = integrate(problem, bias, Eigen::Vector3d::Zero());
    const Rays rays = rays_in_start(problem, motion);
    // Each ray against the first of its track; residual b - a = turn of the bias x (b - a), robustly.
    std::vector<double> largest;
    std::vector<double> all;
    for (std::size_t t = 0; t < rays.size(); ++t) {
      const auto& observations = problem.tracks[t].observations;
      const auto first = std::ranges::find_if(observations, &Observation::used);
      if (first == observations.end()) continue;
      const Eigen::Vector3d& a = rays[t][static_cast<std::size_t>(first - observations.begin())];
      std::vector<double> of_track;
      for (std::size_t k = 0; k < rays[t].size(); ++k) {
        if (observations[k].used) of_track.push_back((rays[t][k] - a).norm());
      }
      all.insert(all.end(), of_track.begin(), of_track.end());
      largest.push_back(*std::ranges::max_element(of_track));
    }
    if (all.empty()) return {bias, 0};
    parallax = median(largest) / sigma;
    const double scale = std::max(sigma, 1.2 * median(all));
    Eigen::Matrix3d H = prior * Eigen::Matrix3d::Identity();
    Eigen::Vector3d b = -prior * bias;
    for (std::size_t t = 0; t < rays.size(); ++t) {
      const auto& observations = problem.tracks[t].observations;
      const auto first = std::ranges::find_if(observations, &Observation::used);
      if (first == observations.end()) continue;
      const auto start = static_cast<std::size_t>(first->frame);
      const Eigen::Vector3d& a = rays[t][static_cast<std::size_t>(first - observations.begin())];
      const auto turn = [&](std::size_t frame) {
        return Eigen::Matrix3d(motion[frame].rotation * motion[frame].by_biases.topLeftCorner<3, 3>());
      };
      for (std::size_t k = 0; k < rays[t].size(); ++k) {
        if (!observations[k].used) continue;
        const Eigen::Vector3d& ray = rays[t][k];
        const Eigen::Vector3d residual = ray - a;
        const double weight = cauchy(residual.norm(), scale) / (scale * scale);
        const Eigen::Matrix3d by_bias =
            so3::hat(a) * turn(start) - so3::hat(ray) * turn(static_cast<std::size_t>(observations[k].frame));
        H += weight * by_bias.transpose() * by_bias;
        b -= weight * by_bias.transpose() * residual;
      }
    }
    bias += H.ldlt().solve(b);
  }
  return {bias, parallax};
}

Eigen::Vector3d epipolar_gyroscope_bias(const Problem& problem) {
  const std::vector<Pair> pairs = make_pairs(problem);
  const double sigma = problem.ray_sigma();
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  const double prior = 1 / (problem.gyroscope_bias_sigma * problem.gyroscope_bias_sigma);
  for (int iteration = 0; iteration < kEpipolarIterations; ++iteration) {
    const std::vector<FrameMotion> motion = integrate(problem, bias, Eigen::Vector3d::Zero());
    const Rays rays = rays_in_start(problem, motion);
    Eigen::Matrix3d information = prior * Eigen::Matrix3d::Identity();
    Eigen::Vector3d pull = -prior * bias;
    for (const Pair& pair : pairs) {
      std::vector<Eigen::Vector3d> normals;
      for (const Pair::Match& m : pair.matches) {
        normals.push_back(rays[m.track][m.first].cross(rays[m.track][m.second]));
      }
      const Eigen::Vector3d t = direction_of_motion(normals, sigma);
      std::vector<double> residuals;
      std::vector<double> deviations;
      for (std::size_t k = 0; k < normals.size(); ++k) {
        const Pair::Match& m = pair.matches[k];
        // Of noise of the two rays; a point on the line of motion tells nothing, and has a residual of higher order.
        const double lever =
            std::hypot(t.cross(rays[m.track][m.first]).norm(), t.cross(rays[m.track][m.second]).norm());
        deviations.push_back(sigma * std::max(lever, 0.1));
        residuals.push_back(std::abs(t.dot(normals[k])) / deviations.back());
      }
      std::vector<double> sorted = residuals;
      const double scale = std::max(1.0, 1.4826 * median(sorted));
      // Unknown are the bias and t, two angles; t is eliminated.
      const Eigen::Matrix<double, 3, 2> across = tangent(t);
      Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
      Eigen::Matrix<double, 3, 2> W = Eigen::Matrix<double, 3, 2>::Zero();
      Eigen::Matrix2d V = 1e-9 * Eigen::Matrix2d::Identity();
      Eigen::Vector3d b = Eigen::Vector3d::Zero();
      Eigen::Vector2d g = Eigen::Vector2d::Zero();
      for (std::size_t k = 0; k < normals.size(); ++k) {
        const Pair::Match& m = pair.matches[k];
        const Eigen::Vector3d& first = rays[m.track][m.first];
        const Eigen::Vector3d& second = rays[m.track][m.second];
        const double weight = cauchy(residuals[k], scale) / (deviations[k] * deviations[k] * scale * scale);
        // A turn theta of the body at a frame, in its axes, moves the ray r by (R theta) x r.
        const auto turn = [&](std::size_t frame) {
          return Eigen::Matrix3d(motion[frame].rotation * motion[frame].by_biases.topLeftCorner<3, 3>());
        };
        const Eigen::RowVector3d by_bias = second.cross(t).cross(first).transpose() * -1 * turn(pair.first) +
                                           second.cross(t.cross(first)).transpose() * turn(pair.second);
        const Eigen::RowVector2d by_t = normals[k].transpose() * across;
        const double residual = t.dot(normals[k]);
        H += weight * by_bias.transpose() * by_bias;
        W += weight * by_bias.transpose() * by_t;
        V += weight * by_t.transpose() * by_t;
        b -= weight * residual * by_bias.transpose();
        g -= weight * residual * by_t.transpose();
      }
      const Eigen::LDLT<Eigen::Matrix2d> eliminate(V);
      information += H - W * eliminate.solve(W.transpose());
      pull += b - W * eliminate.solve(g);
    }
    Eigen::Vector3d step = information.ldlt().solve(pull);
    const double size = step.norm();
    if (size > kMaxBiasStep) step *= kMaxBiasStep / size;
    bias += step;
    if (size < 1e-6) break;
  }
  return bias;
}

std::optional<ClosedForm> closed_form(const Problem& problem, const Eigen::Vector3d& gyroscope_bias) {
  using Row6 = Eigen::Matrix<double, 3, 6>;
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  const std::vector<FrameMotion> motion = integrate(problem, gyroscope_bias, Eigen::Vector3d::Zero());
  const Rays rays = rays_in_start(problem, motion);
  const double sigma = problem.ray_sigma();
  // Camera at frame i: t v0 + t^2 / 2 g + known.
  std::vector<Eigen::Vector3d> known;
  known.reserve(motion.size());
  for (const FrameMotion& frame : motion) {
    known.emplace_back(frame.shift + frame.rotation * problem.T_body_camera.translation);
  }
  // Weights of the observations; at first all distances count as equal.
  std::vector<std::vector<double>> weights;
  for (const auto& track : rays) weights.emplace_back(track.size(), 1.0);

  ClosedForm out;
  for (int iteration = 0; iteration < kClosedFormIterations; ++iteration) {
    struct Eliminated {
      bool good = false;
      Row6 by_y;
      Eigen::Vector3d constant;
    };
    std::vector<Eliminated> points(rays.size());
    Matrix6 S = Matrix6::Zero();
    Vector6 r = Vector6::Zero();
    for (std::size_t track = 0; track < rays.size(); ++track) {
      Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
      Row6 B = Row6::Zero();
      Eigen::Vector3d a = Eigen::Vector3d::Zero();
      Matrix6 C = Matrix6::Zero();
      Vector6 c = Vector6::Zero();
      for (std::size_t k = 0; k < rays[track].size(); ++k) {
        const Observation& o = problem.tracks[track].observations[k];
        if (!o.used) continue;
        const Eigen::Vector3d& u = rays[track][k];
        const auto frame = static_cast<std::size_t>(o.frame);
        const double t = problem.times_s[frame];
        const Eigen::Matrix3d P = weights[track][k] * (Eigen::Matrix3d::Identity() - u * u.transpose());
        const Eigen::Vector3d Pk = P * known[frame];
        const Eigen::Vector2d power(t, 0.5 * t * t);
        A += P;
        a += Pk;
        for (int i = 0; i < 2; ++i) {
          B.middleCols<3>(3 * i) += power[i] * P;
          c.segment<3>(3 * i) += power[i] * Pk;
          for (int j = 0; j < 2; ++j) C.block<3, 3>(3 * i, 3 * j) += power[i] * power[j] * P;
        }
      }
      // X = A^-1 (B y + a). A is singular when all rays are parallel; noise makes it less so.
      const Eigen::LDLT<Eigen::Matrix3d> eliminate(A);
      if (eliminate.info() != Eigen::Success || !(eliminate.vectorD().minCoeff() > 1e-12 * A.trace())) continue;
      Eliminated& e = points[track];
      e.good = true;
      e.by_y = eliminate.solve(B);
      e.constant = eliminate.solve(a);
      S += C - B.transpose() * e.by_y;
      r -= c - B.transpose() * e.constant;
    }
    // v0 first, then g on its sphere.
    const Eigen::LDLT<Eigen::Matrix3d> velocity(S.topLeftCorner<3, 3>());
    if (velocity.info() != Eigen::Success || !velocity.isPositive()) return std::nullopt;
    const Eigen::Matrix3d S_vg = S.topRightCorner<3, 3>();
    const auto g = minimum_on_sphere(S.bottomRightCorner<3, 3>() - S_vg.transpose() * velocity.solve(S_vg),
                                     r.tail<3>() - S_vg.transpose() * velocity.solve(r.head<3>()), problem.gravity);
    if (!g) return std::nullopt;
    out.gravity = *g;
    out.velocity = velocity.solve(r.head<3>() - S_vg * *g);
    if (!out.velocity.allFinite()) return std::nullopt;
    Vector6 y;
    y << out.velocity, out.gravity;

    // Angles instead of distances, and fewer of them from outliers.
    out.points.assign(rays.size(), std::nullopt);
    std::vector<double> angles;
    for (std::size_t track = 0; track < rays.size(); ++track) {
      if (!points[track].good) continue;
      const Eigen::Vector3d X = points[track].by_y * y + points[track].constant;
      if (!X.allFinite()) continue;
      out.points[track] = X;
      for (std::size_t k = 0; k < rays[track].size(); ++k) {
        const Observation& o = problem.tracks[track].observations[k];
        const auto frame = static_cast<std::size_t>(o.frame);
        const double t = problem.times_s[frame];
        const Eigen::Vector3d to = X - (t * out.velocity + 0.5 * t * t * out.gravity + known[frame]);
        const double distance = std::max(to.norm(), kMinDistance);
        // Behind the camera as wrong as a right angle.
        const double angle = to.dot(rays[track][k]) > 0 ? rays[track][k].cross(to).norm() / distance : 1.0;
        weights[track][k] = angle;
        if (o.used) angles.push_back(angle);
      }
    }
    if (angles.empty()) return std::nullopt;
    const double scale = std::max(sigma, 1.2 * median(angles));
    for (std::size_t track = 0; track < rays.size(); ++track) {
      if (!out.points[track]) continue;
      for (std::size_t k = 0; k < rays[track].size(); ++k) {
        const auto frame = static_cast<std::size_t>(problem.tracks[track].observations[k].frame);
        const double t = problem.times_s[frame];
        const Eigen::Vector3d to = *out.points[track] - (t * out.velocity + 0.5 * t * t * out.gravity + known[frame]);
        const double distance = std::max(to.norm(), kMinDistance);
        weights[track][k] = cauchy(weights[track][k], scale) / (distance * distance);
      }
    }
  }
  return out;
}

}  // namespace loc::slam_start
