// Two cameras with the lenses that libloc knows, and poses from which they look at a target.
#pragma once

#include "libloc/geometry/so3.hpp"
#include "libloc/sensors/rig.hpp"

namespace loc::test {

inline CameraCalibration radtan_camera() {
  CameraCalibration c;
  c.name = "cam0";
  c.width_px = 752;
  c.height_px = 480;
  c.intrinsics_px = {458.654, 457.296, 367.215, 248.375};
  c.distortion_model = DistortionModel::kRadtan;
  c.distortion = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  return c;
}

inline CameraCalibration fisheye_camera() {
  CameraCalibration c = radtan_camera();
  c.intrinsics_px = {260, 260, 370.931, 236.897};
  c.distortion_model = DistortionModel::kEquidistant;
  c.distortion = {0.0034823894, 0.0007150348, -0.0020532361, 0.00020293673};
  return c;
}

/// T_world_camera in front of a target (x right, y up, z towards the camera) whose image is upright at turned = 0.
inline Pose3 in_front(const Eigen::Vector3d& middle, double distance, const Eigen::Vector3d& turned) {
  const Eigen::Quaterniond upside(0, 1, 0, 0);  // x stays, y and z turn
  const Pose3 straight{upside, middle + Eigen::Vector3d(0, 0, distance)};
  return Pose3{so3::exp(turned), middle} * Pose3{Eigen::Quaterniond::Identity(), -middle} * straight;
}

}  // namespace loc::test
