// The models of the start of SLAM: integrals of the IMU over the window, the covariance of the poses that its noise
// makes, poses and pixels with their derivatives.
#include <cmath>

#include "libloc/estimators/slam_start_detail.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc::slam_start {

double Problem::ray_sigma() const {
  double sum = 0;
  for (const double sigma : sigma_px) sum += sigma;
  const Eigen::Vector4d& f = camera->intrinsics_px();
  return sum / static_cast<double>(sigma_px.size()) / std::sqrt(f[0] * f[1]);
}

std::vector<FrameMotion> integrate(const Problem& problem, const Eigen::Vector3d& gyroscope_bias,
                                   const Eigen::Vector3d& accelerometer_bias) {
  std::vector<FrameMotion> out;
  out.reserve(problem.times_s.size());
  InertialState state;  // without v0 and gravity: they enter the position as v0 t + g t^2 / 2, exactly
  using Rows = Eigen::Matrix<double, 3, 6>;
  Rows theta = Rows::Zero();
  Rows p = Rows::Zero();
  Rows v = Rows::Zero();
  std::size_t at = 0;
  for (const std::size_t end : problem.step_end) {
    for (; at < end; ++at) {
      InertialStep step = problem.steps[at];
      step.angular_velocity -= gyroscope_bias;
      step.specific_force -= accelerometer_bias;
      const double dt = step.dt_s;
      const Eigen::Vector3d turn = dt * step.angular_velocity;
      const Eigen::Quaterniond half = so3::exp(0.5 * turn);
      const Eigen::Matrix3d middle = (state.q_world_body * half).toRotationMatrix();
      // Of the attitude in the middle of the step, then of the mean acceleration.
      Rows by = half.toRotationMatrix().transpose() * theta;
      by.leftCols<3>() -= 0.5 * dt * so3::right_jacobian(0.5 * turn);
      Rows acceleration = -middle * so3::hat(step.specific_force) * by;
      acceleration.rightCols<3>() -= middle;
      p += dt * v + 0.5 * dt * dt * acceleration;
      v += dt * acceleration;
      const InertialJacobian f = propagate(state, step, Eigen::Vector3d::Zero(), ImuIntegration::kMidpoint);
      theta = f.theta_theta * theta;
      theta.leftCols<3>() -= dt * so3::right_jacobian(turn);
    }
    FrameMotion frame;
    frame.rotation = state.q_world_body.toRotationMatrix();
    frame.shift = state.position;
    frame.by_biases << theta, p;
    out.push_back(frame);
  }
  return out;
}

Eigen::MatrixXd pose_covariance(const Problem& problem, const Eigen::Vector3d& gyroscope_bias,
                                const Eigen::Vector3d& accelerometer_bias) {
  using Matrix15 = Eigen::Matrix<double, kInertialDim, kInertialDim>;
  const auto squared = [](double a) { return a * a; };
  const Eigen::Index size = 6 * (problem.frames() - 1);
  Eigen::MatrixXd out(size, size);
  Eigen::MatrixXd cross(kInertialDim, size);  // of the state now with the poses so far
  Eigen::MatrixXd now = Eigen::MatrixXd::Zero(kInertialDim, kInertialDim);
  InertialState state;
  std::size_t at = problem.step_end.front();
  for (int frame = 1; frame < problem.frames(); ++frame) {
    // Noise and transition from frame to frame first: the poses so far are touched once a frame only.
    Eigen::MatrixXd added = Eigen::MatrixXd::Zero(kInertialDim, kInertialDim);
    Matrix15 transition = Matrix15::Identity();
    for (; at < problem.step_end[static_cast<std::size_t>(frame)]; ++at) {
      InertialStep step = problem.steps[at];
      step.angular_velocity -= gyroscope_bias;
      step.specific_force -= accelerometer_bias;
      InertialStepNoise noise;
      noise.theta = squared(problem.noise.gyroscope_noise_density) * step.dt_s;
      noise.velocity = squared(problem.noise.accelerometer_noise_density) * step.dt_s;
      noise.gyroscope_bias = squared(problem.noise.gyroscope_random_walk) * step.dt_s;
      noise.accelerometer_bias = squared(problem.noise.accelerometer_random_walk) * step.dt_s;
      const InertialJacobian f = propagate(state, step, Eigen::Vector3d::Zero(), ImuIntegration::kMidpoint);
      propagate_covariance(added, f, noise);
      transition = dense(f) * transition;
    }
    now = transition * now * transition.transpose() + added;
    const Eigen::Index done = 6 * (frame - 1);
    cross.leftCols(done) = (transition * cross.leftCols(done)).eval();
    // theta and p are the first six: this frame's pose joins the others.
    out.block(done, done, 6, 6) = now.topLeftCorner<6, 6>();
    out.block(done, 0, 6, done) = cross.topLeftCorner(6, done);
    out.block(0, done, done, 6) = cross.topLeftCorner(6, done).transpose();
    cross.middleCols<6>(done) = now.leftCols<6>();
  }
  return out;
}

Eigen::Matrix<double, 3, 2> tangent(const Eigen::Vector3d& unit) {
  Eigen::Matrix<double, 3, 2> out;
  out.col(0) = unit.unitOrthogonal();
  out.col(1) = unit.cross(out.col(0));
  return out;
}

std::vector<PoseModel> pose_models(const Problem& problem, const Unknowns& x) {
  const std::vector<FrameMotion> motion = integrate(problem, x.gyroscope_bias, x.accelerometer_bias);
  std::vector<PoseModel> out;
  out.reserve(motion.size());
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const double t = problem.times_s[i];
    PoseModel pose;
    pose.rotation = motion[i].rotation;
    pose.position = motion[i].shift + t * x.velocity + 0.5 * t * t * problem.gravity * x.down;
    pose.by_motion.setZero();
    pose.by_motion.block<3, 3>(3, kStartVelocity) = t * Eigen::Matrix3d::Identity();
    pose.by_motion.block<3, 2>(3, kStartDown) = 0.5 * t * t * problem.gravity * tangent(x.down);
    pose.by_motion.middleCols<6>(kStartGyroscopeBias) = motion[i].by_biases;
    if (i > 0) {
      const Eigen::Vector<double, 6> noise = x.noise.segment<6>(6 * (static_cast<Eigen::Index>(i) - 1));
      const Eigen::Matrix3d turn = so3::exp(noise.head<3>()).toRotationMatrix();
      pose.rotation *= turn;
      pose.position += noise.tail<3>();
      pose.by_motion.topRows<3>() = (turn.transpose() * pose.by_motion.topRows<3>()).eval();
    }
    out.push_back(pose);
  }
  return out;
}

std::optional<PixelModel> pixel_model(const Problem& problem, const Eigen::Matrix3d& rotation,
                                      const Eigen::Vector3d& position, const Point& point) {
  const Eigen::Matrix3d R_camera_body = problem.T_body_camera.rotation.conjugate().toRotationMatrix();
  const Eigen::Vector3d& lever = problem.T_body_camera.translation;  // also the origin of the points
  const Eigen::Matrix3d R_body_start = rotation.transpose();
  // The point times its inverse distance: stays finite when that is zero.
  const Eigen::Vector3d in_body = R_body_start * (point.direction - point.inverse_distance * (position - lever));
  const auto projection =
      problem.camera->project_with_jacobians(R_camera_body * (in_body - point.inverse_distance * lever));
  if (!projection) return std::nullopt;
  const Eigen::Matrix<double, 2, 3> by_body = projection->d_point * R_camera_body;
  PixelModel out;
  out.pixel_px = projection->pixel_px;
  out.by_pose.leftCols<3>() = by_body * so3::hat(in_body);
  out.by_pose.rightCols<3>() = -point.inverse_distance * by_body * R_body_start;
  out.by_point.leftCols<2>() = by_body * R_body_start * tangent(point.direction);
  out.by_point.col(2) = -by_body * (R_body_start * (position - lever) + lever);
  return out;
}

}  // namespace loc::slam_start
