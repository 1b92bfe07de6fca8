#include "libloc/estimators/map_anchor_start.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

using Vector7 = Eigen::Matrix<double, kAnchorDim, 1>;
using Matrix7 = Eigen::Matrix<double, kAnchorDim, kAnchorDim>;
using Jacobian = Eigen::Matrix<double, 3, kAnchorDim>;

constexpr std::size_t kFewest = 3;
constexpr int kSteps = 8;
constexpr double kHuber = 3;         // deviations of one fix
constexpr double kFixedTurn = 1e-5;  // deviation of a tilt that is not to be found [rad]
constexpr double kAnyLogScale = 5;   // deviation of a scale of which nothing is known
constexpr double kAnyHeight = 1e4;   // [m]
constexpr double kAnyHeading = 10;   // [rad]
constexpr double kSmallestStep = 1e-9;
constexpr double kLargestTurn = 0.5;  // in one step [rad]

double square(double x) {
  return x * x;
}

// x + i y, and what an error of it weighs.
struct Flat {
  std::complex<double> in_map;
  std::complex<double> in_world;
  double weight;
};

std::complex<double> flat(const Eigen::Vector3d& v) {
  return {v.x(), v.y()};
}

double weight_of(const Eigen::Matrix3d& cov) {
  return 2 / (cov(0, 0) + cov(1, 1));
}

class Problem {
 public:
  Problem(std::span<const AnchorPair> pairs, const AnchorPrior& prior) : pairs_(pairs), prior_(prior) { weigh(0, 0); }

  // What the map drifts until now counts for the errors of the fixes; the way is in units of the map.
  // @param scale metres a unit
  void weigh(double way_now, double scale) {
    position_information_.clear();
    position_information_.reserve(pairs_.size());
    centre_.setZero();
    place_.setZero();
    double sum = 0;
    for (const AnchorPair& pair : pairs_) {
      Eigen::Matrix3d cov = pair.fix.position_cov;
      cov.diagonal().array() += square(prior_.position_walk) * scale * std::max(0.0, way_now - pair.way);
      Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
      if (pair.fix.has_height) {
        information = cov.inverse();
      } else {
        information.topLeftCorner<2, 2>() = cov.topLeftCorner<2, 2>().inverse();
      }
      position_information_.push_back(information);
      const double weight = weight_of(cov);
      centre_ += weight * pair.position;
      place_ += weight * pair.fix.position;
      sum += weight;
    }
    centre_ /= sum;
    place_ /= sum;
  }

  // A turn about the vertical, and the scale where it is not known. @returns false when there is no extent
  bool start(Eigen::Quaterniond& q, double& scale) const {
    std::complex<double> cross = 0;
    double spread = 0;
    const auto add = [&](const Flat& f) {
      cross += f.weight * std::conj(f.in_map) * f.in_world;
      spread += f.weight * std::norm(f.in_map);
    };
    for (const AnchorPair& pair : pairs_) {
      add({flat(pair.position - centre_), flat(pair.fix.position - place_), weight_of(pair.fix.position_cov)});
      if (pair.fix.velocity.allFinite()) {
        add({flat(pair.velocity), flat(pair.fix.velocity), weight_of(pair.fix.velocity_cov)});
      }
    }
    if (prior_.heading && prior_.scale_known) {
      cross += std::polar(1 / square(prior_.heading_sigma), *prior_.heading);
    } else if (!(spread > 0) || !(std::abs(cross) > 0)) {
      return false;
    }
    q = Eigen::AngleAxisd(std::arg(cross), Eigen::Vector3d::UnitZ());
    scale = prior_.scale_known ? 1 : std::abs(cross) / spread;
    return scale > 0;
  }

  // Normal equations about a state, the residuals weighted by Huber. @returns the sum of weighted squares
  void build(const Eigen::Vector3d& t, const Eigen::Quaterniond& q, double scale, const Eigen::Quaterniond& q0,
             Matrix7& information, Vector7& gradient) const {
    information.setZero();
    gradient.setZero();
    const auto add = [&](const Eigen::Vector3d& r, const Jacobian& J, const Eigen::Matrix3d& weight) {
      const double size = std::sqrt(std::max(0.0, r.dot(weight * r)));
      const double huber = size > kHuber ? kHuber / size : 1;
      information += huber * J.transpose() * weight * J;
      gradient += huber * J.transpose() * weight * r;
    };
    Jacobian J;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const AnchorPair& pair = pairs_[i];
      const Eigen::Vector3d way = scale * (q * (pair.position - centre_));
      const Eigen::Vector3d lever = q * pair.lever;
      J << Eigen::Matrix3d::Identity(), -so3::hat(way + lever), way;
      add(pair.fix.position - t - way - lever, J, position_information_[i]);
      if (!pair.fix.velocity.allFinite()) continue;
      const Eigen::Vector3d velocity = scale * (q * pair.velocity);
      const Eigen::Vector3d by_turning = q * pair.lever_velocity;
      J << Eigen::Matrix3d::Zero(), -so3::hat(velocity + by_turning), velocity;
      add(pair.fix.velocity - velocity - by_turning, J, pair.fix.velocity_cov.inverse());
    }
    // Priors: the map stands upright, and its scale and heading are what is known of them.
    const Eigen::Vector3d turned = so3::log(q * q0.inverse());
    const auto prior = [&](int at, double off, double sigma) {
      information(at, at) += 1 / square(sigma);
      gradient[at] -= off / square(sigma);
    };
    prior(kAnchorPosition + 2, t.z() - place_.z(), kAnyHeight);  // where no fix has one
    const double tilt = std::max(prior_.tilt_sigma, kFixedTurn);
    prior(kAnchorTurn, turned.x(), tilt);
    prior(kAnchorTurn + 1, turned.y(), tilt);
    if (prior_.heading) {
      prior(kAnchorTurn + 2, std::remainder(so3::heading(q) - *prior_.heading, 2 * std::numbers::pi),
            prior_.heading_sigma);
    } else {
      prior(kAnchorTurn + 2, 0, kAnyHeading);
    }
    prior(kAnchorScale, prior_.scale_known ? std::log(scale) : 0,
          prior_.scale_known ? prior_.scale_sigma : kAnyLogScale);
  }

  const Eigen::Vector3d& centre() const { return centre_; }
  const Eigen::Vector3d& place() const { return place_; }

 private:
  std::span<const AnchorPair> pairs_;
  const AnchorPrior& prior_;
  std::vector<Eigen::Matrix3d> position_information_;
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d place_ = Eigen::Vector3d::Zero();
};

}  // namespace

std::optional<AnchorStart> find_anchor(std::span<const AnchorPair> pairs, const AnchorPrior& prior,
                                       const Eigen::Vector3d& position, double way_now) {
  if (pairs.size() < kFewest) return std::nullopt;
  Problem problem(pairs, prior);
  AnchorStart found;
  AnchorState& state = found.state;
  if (!problem.start(state.q_world_map, state.scale)) return std::nullopt;
  problem.weigh(way_now, state.scale);
  const Eigen::Quaterniond upright = state.q_world_map;
  Eigen::Vector3d t = problem.place();
  Matrix7 information;
  Vector7 gradient;
  for (int step = 0; step < kSteps; ++step) {
    problem.build(t, state.q_world_map, state.scale, upright, information, gradient);
    const Vector7 dx = information.ldlt().solve(gradient);
    if (!dx.allFinite()) return std::nullopt;
    const Eigen::Vector3d turn = dx.segment<3>(kAnchorTurn);
    t += dx.head<3>();
    state.q_world_map = (so3::exp(turn * std::min(1.0, kLargestTurn / turn.norm())) * state.q_world_map).normalized();
    state.scale *= std::exp(std::clamp(dx[kAnchorScale], -1.0, 1.0));
    if (dx.norm() < kSmallestStep) break;
  }
  problem.build(t, state.q_world_map, state.scale, upright, information, gradient);
  // From the place of the centre to where the body is now.
  const Eigen::Vector3d way = state.scale * (state.q_world_map * (position - problem.centre()));
  Matrix7 to_now = Matrix7::Identity();
  to_now.block<3, 3>(kAnchorPosition, kAnchorTurn) = -so3::hat(way);
  to_now.block<3, 1>(kAnchorPosition, kAnchorScale) = way;
  state.position = t + way;
  const Matrix7 inverse = information.ldlt().solve(Matrix7::Identity());
  const Matrix7 covariance = to_now * inverse * to_now.transpose();
  if (!covariance.allFinite() || covariance.diagonal().minCoeff() <= 0) return std::nullopt;
  found.covariance = 0.5 * (covariance + covariance.transpose());
  return found;
}

}  // namespace loc
