// Pictures of a scene as a calibrated camera takes them, for testing image programs with known truth.
// Each pixel looks along its own ray of geometry/camera, so lens distortion is exact and the corners of textures stand
// where Camera::project() says (0.02 px rms with cv::cornerSubPix); what it sees of a texture is averaged over its area
// (Crow 1984, summed-area tables), so that nothing flickers in the distance. Faces are opaque, nearest first, seen from
// their front only; beyond them sky and ground. No shadows, no light, no rolling shutter; edges of faces are not
// smoothed. Pixels without a ray (outside the image circle of a fisheye) are black.
//
//   const SceneRenderer renderer(scene, rig.cameras[0], {});
//   ImageMeasurement image = renderer.render(T_world_camera);   // set time_ns, camera, sequence
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sim/scene.hpp"

namespace loc {

struct RendererOptions {
  PixelFormat format = PixelFormat::kGray;  ///< or kBgr, kRgb
  double texel_m = 0;                       ///< size of a texture's pixel; 0: a 1500th of its longer side
  double blur_px = 2;      ///< side of the square that a pixel averages over: 1 its own area, 2 as with a lens
  double gain = 1;         ///< of the exposure; the result is cut at 255
  double noise_sigma = 0;  ///< of each byte, in grey levels

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

class SceneRenderer {
 public:
  /// Takes about 4 bytes for each texel and channel. @throws std::invalid_argument as check() of scene, calibration and
  /// options; for a texture of more than 16 million texels.
  SceneRenderer(const Scene& scene, const CameraCalibration& calibration, const RendererOptions& options);
  SceneRenderer(SceneRenderer&&) noexcept;
  SceneRenderer& operator=(SceneRenderer&&) noexcept;
  ~SceneRenderer();

  /// @param random noise is drawn from it; may be null when noise_sigma is 0.
  /// @throws std::invalid_argument for noise without random numbers, or a pose that is not finite.
  ImageMeasurement render(const Pose3& T_world_camera, Random* random = nullptr) const;
  /// Motion blur: the mean of the pictures from several poses during the exposure.
  ImageMeasurement render(std::span<const Pose3> T_world_camera, Random* random = nullptr) const;

 private:
  struct Parts;
  std::unique_ptr<const Parts> parts_;
};

}  // namespace loc
