#include "libloc/estimators/slam_frame.hpp"

#include "libloc/core/check.hpp"
#include "libloc/filter/imu_propagation.hpp"

namespace loc {

OdometryMeasurement odometry_of(const SlamFrame& frame) {
  constexpr std::uint32_t kNeeded = kValidOrientation | kValidPosition | kValidCovariance;
  const Estimate& estimate = frame.estimate;
  require((estimate.valid & kNeeded) == kNeeded, "odometry_of: the frame's estimate has no pose, or no covariance");
  OdometryMeasurement out;
  static_cast<Stamp&>(out) = frame;
  out.position = estimate.position;
  out.rotation = estimate.q_world_body;
  out.position_cov = estimate.covariance.block<3, 3>(kPosition, kPosition);
  out.orientation_cov = estimate.covariance.block<3, 3>(kTheta, kTheta);
  return out;
}

}  // namespace loc
