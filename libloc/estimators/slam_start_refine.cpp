// Step (3) of the start of SLAM: robust least squares of the pixels over velocity, direction of gravity, both biases,
// the poses' errors by the noise of the IMU, and the points, which are eliminated (Schur complement).
// Source: Nocedal, Wright, "Numerical optimization", 2006, section 10.3 (Levenberg, Marquardt); Huber, "Robust
// statistics", 1981; Triggs et al., "Bundle adjustment, a modern synthesis", 2000, section 6.1.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "libloc/estimators/slam_start_detail.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc::slam_start {
namespace {

constexpr int kIterations = 25;
constexpr int kPointIterations = 2;
constexpr double kFall = 1e-3;                // of the cost, a sum of squared deviations: less is convergence
constexpr int kMaxTries = 8;                  // of the damping, per iteration
constexpr double kHuber = 2.4477;             // radius of 95 % of two normal values
constexpr double kReject = 13.82;             // squared radius of 99.9 %
constexpr double kMedianOfTwo = 1.3863;       // median of the squared radius
constexpr double kInverseDistanceSigma = 10;  // of a point, prior [1/m]: nothing is nearer than a few centimetres
constexpr double kPoseFloor = 1e-6;           // deviation of the poses' errors when the IMU has no noise [rad, m]
constexpr double kBiasFloor = 1e-6;           // deviation of the prior of a bias that is known [m/s^2]
constexpr double kOutside = 1e4;              // squared radius that counts for a point without projection
constexpr int kRounds = 4;                    // of outliers
constexpr int kMinPointObservations = 3;

using MotionMatrix = Eigen::Matrix<double, kStartDim, kStartDim>;
using MotionVector = Eigen::Matrix<double, kStartDim, 1>;

double squared(double a) {
  return a * a;
}

// Gauss-Newton's equations with the points still in.
struct Equations {
  double cost = 0;
  Eigen::MatrixXd U;  // poses of frames 1, 2, ...: block diagonal
  Eigen::VectorXd b;
  Eigen::MatrixXd by_motion;  // of the poses
  struct OfPoint {
    double cost = 0;
    Eigen::Matrix3d V = Eigen::Matrix3d::Zero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    Eigen::Matrix<double, Eigen::Dynamic, 3> W;  // poses by point
  };
  std::vector<OfPoint> points;
};

// The same without the points.
struct Reduced {
  Eigen::LLT<Eigen::MatrixXd> factor;  // of motion, poses' errors
  Eigen::VectorXd rhs;
  Eigen::MatrixXd Y;  // W L^-T of all points
  std::vector<Eigen::LLT<Eigen::Matrix3d>> points;
};

Point moved(const Point& point, const Eigen::Vector3d& d) {
  Point out = point;
  out.direction = (point.direction + tangent(point.direction) * d.head<2>()).normalized();
  out.inverse_distance += d[2];
  return out;
}

class Refinement {
 public:
  explicit Refinement(Problem& problem) : problem_(problem), poses_(6 * (problem.frames() - 1)) {
    const double ba = std::max(problem.noise.accelerometer_bias_sigma, kBiasFloor);
    prior_.setZero();
    prior_.segment<3>(kStartGyroscopeBias).setConstant(1 / squared(problem.gyroscope_bias_sigma));
    prior_.segment<3>(kStartAccelerometerBias).setConstant(1 / squared(ba));
  }

  bool weigh_poses(const Unknowns& x) {
    Eigen::MatrixXd covariance = pose_covariance(problem_, x.gyroscope_bias, x.accelerometer_bias);
    covariance.diagonal().array() += squared(kPoseFloor);
    const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
    if (factor.info() != Eigen::Success) return false;
    pose_information_ = factor.solve(Eigen::MatrixXd::Identity(poses_, poses_));
    return true;
  }

  // Equations of one point. @param e adds to those of the poses too, unless null
  Equations::OfPoint of_point(const Point& point, const Track& track, const std::vector<PoseModel>& poses,
                              Equations* e) const {
    Equations::OfPoint out;
    if (e != nullptr) out.W.setZero(poses_, 3);
    out.V(2, 2) = 1 / squared(kInverseDistanceSigma);
    out.g[2] = -point.inverse_distance / squared(kInverseDistanceSigma);
    out.cost = squared(point.inverse_distance / kInverseDistanceSigma);
    for (const Observation& o : track.observations) {
      if (!o.used) continue;
      const auto frame = static_cast<std::size_t>(o.frame);
      const auto model = pixel_model(problem_, poses[frame].rotation, poses[frame].position, point);
      if (!model) {
        out.cost += loss(kOutside);
        continue;
      }
      const double sigma = problem_.sigma_px[frame] * ratio_;
      const Eigen::Vector2d residual = o.pixel_px - model->pixel_px;
      const double radius = residual.squaredNorm() / squared(sigma);
      out.cost += loss(radius);
      const double weight = huber_weight(radius) / squared(sigma);
      const Eigen::Matrix<double, 3, 2> by_point = weight * model->by_point.transpose();
      out.V += by_point * model->by_point;
      out.g += by_point * residual;
      if (e == nullptr || o.frame == 0) continue;
      const Eigen::Index at = 6 * (o.frame - 1);
      const Eigen::Matrix<double, 6, 2> by_pose = weight * model->by_pose.transpose();
      e->U.block<6, 6>(at, at) += by_pose * model->by_pose;
      e->b.segment<6>(at) += by_pose * residual;
      out.W.middleRows<6>(at) += by_pose * model->by_point;
    }
    return out;
  }

  Equations linearise(const Unknowns& x, const std::vector<PoseModel>& poses) const {
    Equations e;
    e.cost = prior_cost(x);
    e.U.setZero(poses_, poses_);
    e.b.setZero(poses_);
    e.by_motion.resize(poses_, kStartDim);
    for (int i = 1; i < problem_.frames(); ++i) {
      e.by_motion.middleRows<6>(6 * (i - 1)) = poses[static_cast<std::size_t>(i)].by_motion;
    }
    e.points.resize(x.points.size());
    for (std::size_t t = 0; t < problem_.tracks.size(); ++t) {
      if (!x.points[t].used) continue;
      e.points[t] = of_point(x.points[t], problem_.tracks[t], poses, &e);
      e.cost += e.points[t].cost;
    }
    return e;
  }

  // Eliminates the points. @param damping relative, of all unknowns
  std::optional<Reduced> reduce(const Equations& e, const Unknowns& x, double damping) const {
    Reduced out;
    out.points.resize(e.points.size());
    out.Y.setZero(poses_, 3 * static_cast<Eigen::Index>(e.points.size()));
    Eigen::VectorXd b = e.b;
    for (std::size_t t = 0; t < e.points.size(); ++t) {
      if (!x.points[t].used) continue;
      Eigen::Matrix3d V = e.points[t].V;
      V.diagonal() *= 1 + damping;
      out.points[t].compute(V);
      if (out.points[t].info() != Eigen::Success) return std::nullopt;
      auto Y = out.Y.middleCols<3>(3 * static_cast<Eigen::Index>(t));
      Y = out.points[t].matrixL().solve(e.points[t].W.transpose()).transpose();
      b -= Y * out.points[t].matrixL().solve(e.points[t].g);
    }
    Eigen::MatrixXd H = e.U;
    H.selfadjointView<Eigen::Lower>().rankUpdate(out.Y, -1);
    H.triangularView<Eigen::StrictlyUpper>() = H.transpose();
    const Eigen::Index size = kStartDim + poses_;
    Eigen::MatrixXd full(size, size);
    const Eigen::MatrixXd HA = H * e.by_motion;
    full.topLeftCorner<kStartDim, kStartDim>() = e.by_motion.transpose() * HA;
    full.topLeftCorner<kStartDim, kStartDim>().diagonal() += prior_;
    full.bottomLeftCorner(poses_, kStartDim) = HA;
    // The poses' errors have a stiff prior of their own: damped with its diagonal, they would hardly move.
    full.bottomRightCorner(poses_, poses_) = H + pose_information_;
    full.diagonal().head<kStartDim>() *= 1 + damping;
    full.diagonal().tail(poses_) += damping * H.diagonal();
    out.rhs.resize(size);
    out.rhs.head<kStartDim>() = e.by_motion.transpose() * b;
    out.rhs.segment<3>(kStartGyroscopeBias) -= prior_.segment<3>(kStartGyroscopeBias).cwiseProduct(x.gyroscope_bias);
    out.rhs.segment<3>(kStartAccelerometerBias) -=
        prior_.segment<3>(kStartAccelerometerBias).cwiseProduct(x.accelerometer_bias);
    out.rhs.tail(poses_) = b - pose_information_ * x.noise;
    out.factor.compute(full);
    if (out.factor.info() != Eigen::Success) return std::nullopt;
    return out;
  }

  // Unknowns after Gauss-Newton's step.
  Unknowns step(const Equations& e, const Reduced& reduced, const Unknowns& x) const {
    const Eigen::VectorXd z = reduced.factor.solve(reduced.rhs);
    const Eigen::VectorXd pose = e.by_motion * z.head<kStartDim>() + z.tail(poses_);
    Unknowns out = x;
    out.velocity += z.segment<3>(kStartVelocity);
    out.down = (x.down + tangent(x.down) * z.segment<2>(kStartDown)).normalized();
    out.gyroscope_bias += z.segment<3>(kStartGyroscopeBias);
    out.accelerometer_bias += z.segment<3>(kStartAccelerometerBias);
    out.noise += z.tail(poses_);
    for (std::size_t t = 0; t < x.points.size(); ++t) {
      if (!x.points[t].used) continue;
      const auto& factor = reduced.points[t];
      const auto Y = reduced.Y.middleCols<3>(3 * static_cast<Eigen::Index>(t));
      const Eigen::Vector3d right = factor.matrixL().solve(e.points[t].g) - Y.transpose() * pose;
      out.points[t] = moved(x.points[t], factor.matrixU().solve(right));
    }
    return out;
  }

  // Each point by itself to its least cost, poses given. Velocity and inverse distances enter as products: without this
  // the way to another scale is a narrow bent valley.
  // @returns the cost of all
  double settle_points(Unknowns& x, const std::vector<PoseModel>& poses) const {
    double cost = prior_cost(x);
    for (std::size_t t = 0; t < x.points.size(); ++t) {
      if (!x.points[t].used) continue;
      Equations::OfPoint now = of_point(x.points[t], problem_.tracks[t], poses, nullptr);
      for (int i = 0; i < kPointIterations; ++i) {
        const Point next = moved(x.points[t], now.V.llt().solve(now.g));
        Equations::OfPoint after = of_point(next, problem_.tracks[t], poses, nullptr);
        if (!(after.cost < now.cost)) break;
        x.points[t] = next;
        now = std::move(after);
      }
      cost += now.cost;
    }
    return cost;
  }

  // @returns whether it converged; x is at the least cost.
  bool descend(Unknowns& x, int& iterations) const {
    double damping = 1e-4;
    std::vector<PoseModel> poses = pose_models(problem_, x);
    for (int i = 0; i < kIterations; ++i) {
      ++iterations;
      const Equations e = linearise(x, poses);
      bool better = false;
      for (int tries = 0; tries < kMaxTries && !better; ++tries) {
        if (const auto reduced = reduce(e, x, damping)) {
          Unknowns next = step(e, *reduced, x);
          std::vector<PoseModel> next_poses = pose_models(problem_, next);
          const double after = settle_points(next, next_poses);
          if (after <= e.cost) {
            better = true;
            x = std::move(next);
            poses = std::move(next_poses);
            damping = std::max(damping * 0.1, 1e-12);
            if (e.cost - after <= kFall * (1 + 1e-3 * e.cost)) return true;
            continue;
          }
        }
        damping *= 10;
      }
      // No step however short falls: that is the minimum, to rounding.
      if (!better) return true;
    }
    return false;
  }

  double ratio() const { return ratio_; }
  void set_ratio(double ratio) { ratio_ = ratio; }
  void set_robust(bool robust) { robust_ = robust; }

 private:
  double prior_cost(const Unknowns& x) const {
    double sum = x.noise.dot(pose_information_ * x.noise);
    sum += prior_.segment<3>(kStartGyroscopeBias).dot(x.gyroscope_bias.cwiseAbs2());
    sum += prior_.segment<3>(kStartAccelerometerBias).dot(x.accelerometer_bias.cwiseAbs2());
    return sum;
  }
  double loss(double radius) const {
    if (!robust_ || radius <= squared(kHuber)) return radius;
    return 2 * kHuber * std::sqrt(radius) - squared(kHuber);
  }
  double huber_weight(double radius) const {
    if (!robust_ || radius <= squared(kHuber)) return 1;
    return kHuber / std::sqrt(radius);
  }

  Problem& problem_;
  Eigen::Index poses_;
  MotionVector prior_;  // information of the priors, 0 where there is none
  Eigen::MatrixXd pose_information_;
  double ratio_ = 1;
  bool robust_ = true;
};

// What the observations that are used say: how many, residuals, parallax.
struct Census {
  int observations = 0;
  int outliers = 0;
  int features = 0;
  std::vector<double> radii;  // squared, in deviations as stated
  double squares_px = 0;
  double bounded_cost = 0;  // of all observations
};

// Marks observations beyond the bound as outliers (and others as good again), points with too few as unused.
Census examine(Problem& problem, Unknowns& x, double ratio, bool mark) {
  Census census;
  const std::vector<PoseModel> poses = pose_models(problem, x);
  for (std::size_t t = 0; t < problem.tracks.size(); ++t) {
    Track& track = problem.tracks[t];
    const int total = static_cast<int>(track.observations.size());
    int good = 0;
    std::vector<double> radii;
    double squares = 0;
    if (!x.points[t].used) {
      census.bounded_cost += kReject * total;
    } else {
      for (Observation& o : track.observations) {
        const auto frame = static_cast<std::size_t>(o.frame);
        const auto model = pixel_model(problem, poses[frame].rotation, poses[frame].position, x.points[t]);
        const double square = model ? (o.pixel_px - model->pixel_px).squaredNorm() : kOutside;
        const double radius = square / squared(problem.sigma_px[frame]);
        census.bounded_cost += std::min(radius, kReject);
        if (mark) o.used = model && radius <= kReject * squared(ratio);
        if (!o.used) continue;
        ++good;
        radii.push_back(radius);
        squares += square;
      }
    }
    if (good < kMinPointObservations) {
      x.points[t].used = false;
      census.outliers += total;
      continue;
    }
    ++census.features;
    census.observations += good;
    census.outliers += total - good;
    census.squares_px += squares;
    census.radii.insert(census.radii.end(), radii.begin(), radii.end());
  }
  return census;
}

// Robust deviation of the residuals over the stated one. Fitting makes residuals smaller than the noise.
double residual_ratio(Census& census) {
  const auto middle = census.radii.begin() + static_cast<std::ptrdiff_t>(census.radii.size() / 2);
  std::nth_element(census.radii.begin(), middle, census.radii.end());
  const double all = 2.0 * census.observations;
  const double left = all - 3.0 * census.features - kStartDim;
  return std::sqrt(*middle / kMedianOfTwo * all / std::max(left, 0.1 * all));
}

// Largest angle between the ray of a point from a frame and that from its first frame, in deviations; median.
double median_parallax(const Problem& problem, const Unknowns& x) {
  const std::vector<PoseModel> poses = pose_models(problem, x);
  const Eigen::Vector3d& lever = problem.T_body_camera.translation;
  std::vector<double> all;
  for (std::size_t t = 0; t < problem.tracks.size(); ++t) {
    if (!x.points[t].used) continue;
    std::optional<Eigen::Vector3d> first;
    double largest = 0;
    for (const Observation& o : problem.tracks[t].observations) {
      if (!o.used) continue;
      const PoseModel& pose = poses[static_cast<std::size_t>(o.frame)];
      const Eigen::Vector3d moved = pose.position + pose.rotation * lever - lever;
      const Eigen::Vector3d ray = (x.points[t].direction - x.points[t].inverse_distance * moved).normalized();
      if (!first) first = ray;
      largest = std::max(largest, first->cross(ray).norm());
    }
    all.push_back(largest / problem.ray_sigma());
  }
  if (all.empty()) return 0;
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  std::nth_element(all.begin(), middle, all.end());
  return *middle;
}

bool judge(const Problem& problem, const Refinement& refinement, Refined& out) {
  const Equations e = refinement.linearise(out.x, pose_models(problem, out.x));
  const auto reduced = refinement.reduce(e, out.x, 0);
  if (!reduced) return false;
  const Eigen::Index size = reduced->rhs.size();
  const Eigen::MatrixXd C = reduced->factor.solve(Eigen::MatrixXd::Identity(size, size));
  out.covariance = C.topLeftCorner<kStartDim, kStartDim>();

  const MotionMatrix information = out.covariance.ldlt().solve(MotionMatrix::Identity());
  const MotionVector scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const MotionMatrix scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const MotionVector eigenvalues =
      Eigen::SelfAdjointEigenSolver<MotionMatrix>(scaled, Eigen::EigenvaluesOnly).eigenvalues();
  out.condition = eigenvalues[kStartDim - 1] / std::max(eigenvalues[0], 1e-300);

  // Inverse distance of a point = own noise + what the poses hand on.
  const Eigen::Index poses = size - kStartDim;
  const auto hand_on = [&](std::size_t t, double& own) {
    const auto& factor = reduced->points[t];
    const Eigen::Vector3d row = factor.matrixL().solve(Eigen::Vector3d::UnitZ().eval());
    own = row.squaredNorm();
    const Eigen::VectorXd by_pose = reduced->Y.middleCols<3>(3 * static_cast<Eigen::Index>(t)) * row;
    Eigen::VectorXd all(size);
    all.head<kStartDim>() = e.by_motion.transpose() * by_pose;
    all.tail(poses) = by_pose;
    return all;
  };
  double sum = 0;
  double own_sum = 0;
  int behind = 0;
  Eigen::VectorXd all = Eigen::VectorXd::Zero(size);
  out.inverse_distance_sigma.assign(out.x.points.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t t = 0; t < out.x.points.size(); ++t) {
    if (!out.x.points[t].used) continue;
    double own = 0;
    const Eigen::VectorXd of_point = hand_on(t, own);
    const double sigma = std::sqrt(own + of_point.dot(C * of_point));
    out.inverse_distance_sigma[t] = sigma;
    if (out.x.points[t].inverse_distance < -3 * sigma) ++behind;
    sum += out.x.points[t].inverse_distance;
    own_sum += own;
    all += of_point;
  }
  out.scale_sigma = std::sqrt(own_sum + all.dot(C * all)) / std::max(sum, 1e-12);
  out.behind = static_cast<double>(behind) / std::max(out.features, 1);
  out.parallax = median_parallax(problem, out.x);
  return out.covariance.allFinite() && std::isfinite(out.scale_sigma) && std::isfinite(out.condition);
}

}  // namespace

std::optional<Refined> refine(Problem problem, const Eigen::Vector3d& gyroscope_bias, const ClosedForm& start) {
  Refined out;
  Unknowns& x = out.x;
  x.velocity = start.velocity;
  x.down = start.gravity.normalized();
  x.gyroscope_bias = gyroscope_bias;
  x.accelerometer_bias.setZero();
  x.noise = Eigen::VectorXd::Zero(6 * (problem.frames() - 1));
  const Eigen::Vector3d& origin = problem.T_body_camera.translation;
  for (const auto& place : start.points) {
    Point& point = x.points.emplace_back();
    point.used = place && (*place - origin).norm() > 1e-3;
    point.direction = point.used ? Eigen::Vector3d((*place - origin).normalized()) : Eigen::Vector3d::UnitZ();
    point.inverse_distance = point.used ? 1 / (*place - origin).norm() : 0;
  }

  Refinement refinement(problem);
  if (!refinement.weigh_poses(x)) return std::nullopt;
  Census census = examine(problem, x, 1, false);
  if (census.features == 0) return std::nullopt;
  refinement.descend(x, out.iterations);
  // Then without what does not fit, and with the deviation that the rest shows; those that fit now come back.
  for (int round = 0; round < kRounds; ++round) {
    census = examine(problem, x, 1, false);
    if (census.features == 0) return std::nullopt;
    const double ratio = std::max(1.0, residual_ratio(census));
    const int before = census.observations;
    census = examine(problem, x, ratio, true);
    if (census.features == 0) return std::nullopt;
    const bool settled =
        round > 0 && census.observations == before && std::abs(ratio - refinement.ratio()) < 0.01 * ratio;
    refinement.set_ratio(ratio);
    refinement.set_robust(false);
    if (settled) break;
    out.converged = refinement.descend(x, out.iterations);
  }
  census = examine(problem, x, refinement.ratio(), false);
  if (census.features == 0) return std::nullopt;
  out.cost = census.bounded_cost;
  out.sigma_ratio = refinement.ratio();
  out.observations = census.observations;
  out.outliers = census.outliers;
  out.features = census.features;
  out.residual_px_rms = std::sqrt(census.squares_px / (2.0 * census.observations));
  if (!judge(problem, refinement, out)) return std::nullopt;
  out.tracks = std::move(problem.tracks);
  return out;
}

}  // namespace loc::slam_start
