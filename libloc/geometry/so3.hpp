// Rotations. A rotation is a unit Eigen::Quaterniond (Hamilton); perturbations are on the right: R_true = R *
// Exp(theta), theta in the body's axes, radians. One boxplus and one boxminus serve filters, calibration, simulation
// and tests. Source: Sola, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics", 2018, equations
// 132-146.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace loc::so3 {

/// [v]x, so that hat(v) * w = v x w.
Eigen::Matrix3d hat(const Eigen::Vector3d& v);

/// Inverse of hat; reads the entries (2,1), (0,2), (1,0).
Eigen::Vector3d vee(const Eigen::Matrix3d& m);

/// Unit quaternion of the rotation vector theta [rad]; exact to rounding at any angle, zero included.
Eigen::Quaterniond exp(const Eigen::Vector3d& theta);

/// Rotation vector [rad] with norm in [0, pi]; q and -q give the same.
Eigen::Vector3d log(const Eigen::Quaterniond& q);

/// R_plus = R * Exp(theta), normalised.
Eigen::Quaterniond boxplus(const Eigen::Quaterniond& q, const Eigen::Vector3d& theta);

/// theta = Log(q0^-1 * q1), so that boxplus(q0, boxminus(q1, q0)) = q1.
Eigen::Vector3d boxminus(const Eigen::Quaterniond& q1, const Eigen::Quaterniond& q0);

/// Exp(theta + d) = Exp(theta) * Exp(right_jacobian(theta) * d) to first order in d.
Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& theta);

/// Inverse of right_jacobian. Defined for |theta| < 2 pi.
Eigen::Matrix3d right_jacobian_inverse(const Eigen::Vector3d& theta);

/// Exp(theta + d) = Exp(left_jacobian(theta) * d) * Exp(theta) to first order in d.
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& theta);

/// Angle of rotation between two attitudes [rad], in [0, pi].
double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b);

/// Rotation about z [rad] that is closest to q: the heading part of q = heading * inclination (Rz * R_in).
double heading(const Eigen::Quaterniond& q);

}  // namespace loc::so3
