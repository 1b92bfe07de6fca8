// Where the camera is when nothing is known of it but the map: patches of features at known places are compared with
// the corners of all of the picture, and the pose is that which explains most of the pairs that look alike.
//   1. corners of the picture, and what is around them: 8 x 8 samples of the picture at half its size, less their mean,
//      of length 1; the same of the patches, as they are and once turned or scaled
//   2. pairs whose correlation is high, and clearly higher than that of the corner that comes second
//   3. the pose by all of them with weights that narrow down (absolute_pose.hpp); if too few fit, by four at a time
// What comes out is a guess to be confirmed by looking for the features where it says. Costs a few milliseconds.
// Source: M. Brown, R. Szeliski, S. Winder, "Multi-image matching using multi-scale oriented patches", CVPR 2005 (the
// samples); D. Lowe, "Distinctive image features from scale-invariant keypoints", IJCV 60, 2004 (the second best).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "libloc/geometry/camera.hpp"
#include "libloc/geometry/pose3.hpp"
#include "libloc/vision/patch.hpp"

namespace loc {

struct MapPatch {
  const ImagePatch* patch = nullptr;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< in world [m]
};

class MapSearch {
 public:
  explicit MapSearch(const Camera& camera);
  MapSearch(MapSearch&&) noexcept;
  MapSearch& operator=(MapSearch&&) noexcept;
  ~MapSearch();

  /// @param half the picture at half its size, smoothed @param last where the camera was last
  /// @param attempt counts the pictures in which is searched: patches are turned and scaled another way in each
  /// @returns T_world_camera, or nullopt when no pose explains enough pairs.
  std::optional<Pose3> find(const GrayView& image, const GrayView& half, std::span<const MapPatch> map,
                            const Pose3& last, std::int64_t attempt);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace loc
