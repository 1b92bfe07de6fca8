#include "libloc/sim/clothoid_path.hpp"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr int kMaxIterations = 100;
constexpr double kLargestChange = 0.5;  // [rad], of a course from its first value

double direction(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  return std::atan2(to.y() - from.y(), to.x() - from.x());
}

// Least squares over the free courses between the ends: x -> courses = first values + kLargestChange tanh(x), which
// keeps them in their bounds. The residuals are the jumps of curvature times the shorter of the two straight lines.
class CourseProblem {
 public:
  CourseProblem(const std::vector<Eigen::Vector2d>& points, const std::vector<std::optional<double>>& given)
      : points_(points), given_(given), guess_(points.size(), 0) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (given[i]) {
        guess_[i] = *given[i];
      } else if (i > 0 && i + 1 < points.size()) {
        const double before = direction(points[i - 1], points[i]);
        const double turn = wrap_angle(direction(points[i], points[i + 1]) - before);
        const double length = (points[i] - points[i - 1]).norm();
        const double share = length / (length + (points[i + 1] - points[i]).norm());
        // Not more than a right angle to either straight line, else hairpins would become balloons.
        const double most = 0.5 * std::numbers::pi;
        const double part = std::clamp(share * std::abs(turn), std::abs(turn) - most, most);
        guess_[i] = before + std::copysign(part, turn);
        free_.push_back(i);
      }
    }
  }

  int size() const { return static_cast<int>(free_.size()); }

  std::vector<double> courses(const Eigen::VectorXd& x) const {
    std::vector<double> out = guess_;
    for (int k = 0; k < size(); ++k) out[free_[k]] += kLargestChange * std::tanh(x[k]);
    const std::size_t n = points_.size();
    // Free ends: an arc has its courses symmetrically about the straight line.
    const double first = direction(points_[0], points_[1]);
    const double last = direction(points_[n - 2], points_[n - 1]);
    const bool both_free = n == 2 && !given_[0] && !given_[1];
    if (!given_[0]) out[0] = both_free ? first : first - wrap_angle(out[1] - first);
    if (!given_[n - 1]) out[n - 1] = both_free ? last : last - wrap_angle(out[n - 2] - last);
    return out;
  }

  void evaluate(const Eigen::VectorXd& x) {
    const std::size_t n = points_.size();
    const std::vector<double> course = courses(x);
    // How each course follows x: the variable, and the derivative.
    std::vector<std::pair<int, double>> follows(n, {-1, 0});
    for (int k = 0; k < size(); ++k) {
      const double t = std::tanh(x[k]);
      follows[free_[k]] = {k, kLargestChange * (1 - t * t)};
    }
    if (!given_[0]) follows[0] = {follows[1].first, -follows[1].second};
    if (!given_[n - 1]) follows[n - 1] = {follows[n - 2].first, -follows[n - 2].second};

    residual.setZero(size());
    std::vector<Eigen::Triplet<double>> entries;
    const auto add = [&](int row, std::size_t point, double value) {
      if (const auto [column, derivative] = follows[point]; column >= 0) {
        entries.emplace_back(row, column, value * derivative);
      }
    };
    ClothoidFit before = fit_clothoid(points_[0], course[0], points_[1], course[1]);
    std::size_t done = 0;
    for (int k = 0; k < size(); ++k) {
      const std::size_t i = free_[k];
      if (done + 1 != i) before = fit_clothoid(points_[i - 1], course[i - 1], points_[i], course[i]);
      const ClothoidFit after = fit_clothoid(points_[i], course[i], points_[i + 1], course[i + 1]);
      const double length = std::min((points_[i] - points_[i - 1]).norm(), (points_[i + 1] - points_[i]).norm());
      residual[k] = length * (after.clothoid.curvature - before.end_curvature);
      add(k, i - 1, -length * before.end_curvature_jacobian[0]);
      add(k, i, length * (after.start_curvature_jacobian[0] - before.end_curvature_jacobian[1]));
      add(k, i + 1, length * after.start_curvature_jacobian[1]);
      before = after;
      done = i;
    }
    jacobian.resize(size(), size());
    jacobian.setFromTriplets(entries.begin(), entries.end());
  }

  Eigen::VectorXd residual;
  Eigen::SparseMatrix<double> jacobian;

 private:
  const std::vector<Eigen::Vector2d>& points_;
  const std::vector<std::optional<double>>& given_;
  std::vector<double> guess_;
  std::vector<std::size_t> free_;  // between the ends
};

// Levenberg and Marquardt.
std::vector<double> estimate_courses(const std::vector<Eigen::Vector2d>& points,
                                     const std::vector<std::optional<double>>& given) {
  CourseProblem problem(points, given);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(problem.size());
  if (problem.size() == 0) return problem.courses(x);
  problem.evaluate(x);
  double damping = 1e-6;
  for (int iteration = 0; iteration < kMaxIterations && problem.residual.cwiseAbs().maxCoeff() > 1e-14; ++iteration) {
    const double cost = problem.residual.squaredNorm();
    const Eigen::VectorXd gradient = problem.jacobian.transpose() * problem.residual;
    Eigen::SparseMatrix<double> normal = problem.jacobian.transpose() * problem.jacobian;
    for (int k = 0; k < problem.size(); ++k) normal.coeffRef(k, k) += damping;
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(normal);
    const Eigen::VectorXd step = solver.solve(-gradient);
    problem.evaluate(x + step);
    if (problem.residual.squaredNorm() < cost) {
      x += step;
      damping = std::max(0.1 * damping, 1e-14);
      if (step.cwiseAbs().maxCoeff() < 1e-13) break;
    } else {
      if (step.cwiseAbs().maxCoeff() < 1e-13) break;
      problem.evaluate(x);
      damping *= 10;
    }
  }
  return problem.courses(x);
}

}  // namespace

ClothoidPath::ClothoidPath(const std::vector<Eigen::Vector2d>& points,
                           const std::vector<std::optional<double>>& courses) {
  require(!points.empty(), "a path needs at least one point");
  require(courses.size() == points.size(), "number of courses", static_cast<double>(courses.size()),
          "must be the number of points");
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::string name = "point " + std::to_string(i);
    require(points[i].allFinite(), name + " must be finite");
    require(i == 0 || points[i] != points[i - 1], name + " is the same as the one before");
    if (courses[i]) require_finite(name + ": course", *courses[i]);
  }
  require(points.size() > 1 || courses[0].has_value(), "a path of one point needs its course");
  if (points.size() == 1) {
    courses_ = {*courses[0]};
    return;
  }
  courses_ = estimate_courses(points, courses);
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    ClothoidFit fit;
    try {
      fit = fit_clothoid(points[i], courses_[i], points[i + 1], courses_[i + 1]);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("points " + std::to_string(i) + " to " + std::to_string(i + 1) + ": " + error.what());
    }
    pieces_.push_back(fit.clothoid);
    const double end = fit.clothoid.at(fit.clothoid.length).course;
    courses_[i + 1] += 2 * std::numbers::pi * std::round((end - courses_[i + 1]) / (2 * std::numbers::pi));
  }
}

}  // namespace loc
