// Tells from the innovations of SLAM whether the camera's intrinsics can be right.
// From: frames of the SLAM filter: measured and predicted pixels of features, attitude of the camera. Units: pixels,
// radians.
// A feature was at pixel u0 in the frame before; turning the camera by R moves it to u1 = h(R h^-1(u0)), through the
// lens h and back. With wrong intrinsics b this step is wrong by X db, X = d u1 / d b, the same way in every frame:
// innovations, which are white and know nothing of X when all is right, are regressed on X. b is the logarithm of the
// focal length, the principal point [px] and k1 (equidistant: the first of the series as well).
//   db = (sum X^T W X)^-1 sum X^T W r
// The filter's state has taken up part of the error, which is why db is not what the intrinsics are wrong by: it is a
// sign of doubt, not a calibration. With an IMU, which knows the turn by itself, it is some two times the error while
// the camera turns much, and far less while it mostly moves sideways; a camera alone takes most of a wrong focal length
// for another motion and another depth. Nothing is said while the camera does not turn.
// Its deviation comes from the differences between parts of the window (jackknife), because innovations of features
// that are tracked with an error which grows are not white. Source of that: B. Efron, "The Jackknife, the Bootstrap and
// Other Resampling Plans", 1982. Source of the idea that wrong models show in innovations: R. Mehra, J. Peschon, "An
// innovations approach to fault detection and diagnosis in dynamic systems", Automatica 7, 1971.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "libloc/core/time.hpp"
#include "libloc/estimators/slam_frame.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/sensors/rig.hpp"

namespace loc {

struct ResidualWatchOptions {
  double least_turn_px = 1;     ///< frames in which features turn by less (root mean square) tell nothing
  double longest_step_s = 0.3;  ///< between frames
  int batch_frames = 30;        ///< that tell something: one part of the window
  int least_batches = 6;        ///< before anything is said
  int least_in_a_row = 3;       ///< judgements, one after each batch, of which the same is said
  double least_sigmas = 2.5;    ///< of a doubt: so far from zero, and …
  double least_focal = 0.08;    ///< … that large: of the logarithm of the focal length
  double least_centre_px = 18;  ///< of a coordinate of the principal point
  double least_k1 = 0.08;       ///< of the first coefficient of the distortion
  /// Not for a camera alone: what its motion model lags behind looks the same.
  bool judge_centre = true;

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// What the last window says.
struct ResidualWatchVerdict {
  Eigen::Vector4d db = Eigen::Vector4d::Constant(kUnknown);     ///< ln f, cx [px], cy [px], k1
  Eigen::Vector4d sigma = Eigen::Vector4d::Constant(kUnknown);  ///< its deviations
  bool doubtful = false;
};

class ResidualWatch {
 public:
  /// @throws std::invalid_argument as both check().
  explicit ResidualWatch(const CameraCalibration& camera, const ResidualWatchOptions& options = {});

  /// A frame after its update; features without prediction are passed over.
  void see(const SlamFrame& frame);
  /// The next frame is not the successor of the last one (new start, other world). What was learnt stays.
  void break_off() { last_time_ns_ = kNoTime; }

  bool doubtful() const { return verdict_.doubtful; }
  /// NaN before the window has enough in it.
  const ResidualWatchVerdict& verdict() const { return verdict_; }

 private:
  static constexpr int kWindow = 15;  // batches
  struct Sums {
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
  };

  bool add(const SlamFrame& frame, Sums& sums) const;
  static Eigen::Vector4d solve(const Sums& sums);
  void judge();

  ResidualWatchOptions options_;
  Camera camera_;
  std::array<Sums, kWindow> batches_;
  std::int64_t batches_done_ = 0;
  Sums open_;
  int open_frames_ = 0;
  TimeNs last_time_ns_ = kNoTime;
  Eigen::Quaterniond last_attitude_ = Eigen::Quaterniond::Identity();
  std::vector<std::pair<std::int64_t, Eigen::Vector2d>> last_;  // identity, pixel; ascending
  ResidualWatchVerdict verdict_;
  int in_a_row_ = 0;
};

}  // namespace loc
