#include "libloc/estimators/slam_options.hpp"

#include <array>
#include <set>
#include <stdexcept>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr std::array kConsistencies = {"plain", "first-estimate", "invariant"};

void require_at_least(const char* name, int value, int least) {
  require(value >= least, name, value, "must be at least " + std::to_string(least));
}

void require_probability(const char* name, double value) {
  require(value > 0 && value < 1, name, value, "must be between 0 and 1");
}

}  // namespace

const char* slam_consistency_name(SlamConsistency consistency) {
  return kConsistencies.at(static_cast<std::size_t>(consistency));
}

SlamConsistency parse_slam_consistency(std::string_view name) {
  for (std::size_t i = 0; i < kConsistencies.size(); ++i) {
    if (name == kConsistencies[i]) return static_cast<SlamConsistency>(i);
  }
  throw std::invalid_argument("consistency '" + std::string(name) + "': must be plain, first-estimate or invariant");
}

void SlamMapOptions::check() const {
  require_at_least("map.max_features", max_features, 4);
  require(max_features <= 2000, "map.max_features", max_features, "must be at most 2000: memory grows with its square");
  require_at_least("map.max_measured", max_measured, 4);
  require_at_least("map.min_visible", min_visible, 1);
  require(min_visible <= max_features, "map.min_visible", min_visible, "must not be above map.max_features");
  require_at_least("map.max_added", max_added, 1);
  require_at_least("map.steer_after_frames", steer_after_frames, 0);
  require(cover_radius >= 0 && cover_radius <= 1, "map.cover_radius", cover_radius, "must be from 0 to 1");
  require_at_least("map.grid_columns", grid_columns, 1);
  require_at_least("map.grid_rows", grid_rows, 1);
  require(grid_columns <= 1000 && grid_rows <= 1000, "map.grid_columns and map.grid_rows must be at most 1000");
  require_not_negative("map.min_separation_px", min_separation_px);
  require_not_negative("map.border_px", border_px);
  require_positive("map.inverse_depth", inverse_depth);
  require_positive("map.sigma_inverse_depth", sigma_inverse_depth);
  require(2 * sigma_inverse_depth >= inverse_depth, "map.sigma_inverse_depth", sigma_inverse_depth,
          "must be at least half of map.inverse_depth: a point at infinity is within two deviations");
  require_not_negative("map.max_linearity_index", max_linearity_index);
  require_at_least("map.delete_after_tries", delete_after_tries, 2);
  require(delete_below_ratio >= 0 && delete_below_ratio <= 1, "map.delete_below_ratio", delete_below_ratio,
          "must be from 0 to 1");
}

double SlamAssociationOptions::gate(SlamMotion motion) const {
  if (gate_probability != 0) return gate_probability;
  return motion == SlamMotion::kInertial ? 0.95 : 0.999;
}

void SlamAssociationOptions::check() const {
  if (gate_probability != 0) require_probability("association.gate_probability", gate_probability);
  require_probability("association.ransac_probability", ransac_probability);
  require_at_least("association.max_hypotheses", max_hypotheses, 1);
}

void SlamOptions::check() const {
  camera.check();
  require_at_least("max_iterations", max_iterations, 1);
  require(camera_index >= 0, "camera_index", camera_index, "must not be negative");
  require(position.allFinite() && velocity.allFinite() && angular_velocity.allFinite(),
          "position, velocity and angular_velocity must be finite");
  require(!q_world_body || (q_world_body->coeffs().allFinite() && q_world_body->norm() > 1e-6),
          "q_world_body must be finite, and not zero");
  require_not_negative("sigma_position", sigma_position);
  require_not_negative("sigma_orientation", sigma_orientation);
  require_not_negative("sigma_velocity", sigma_velocity);
  require_not_negative("sigma_angular_velocity", sigma_angular_velocity);
  require_not_negative("acceleration_density", acceleration_density);
  require_not_negative("angular_acceleration_density", angular_acceleration_density);
  imu_noise.check();
  require(vibration_part >= 0 && vibration_part <= 1, "vibration_part", vibration_part, "must be from 0 to 1");
  require_positive("gravity", gravity);
  require_positive("sigma_px", sigma_px);
  require_positive("sigma_extrinsic_rotation", sigma_extrinsic_rotation);
  require_positive("sigma_extrinsic_position", sigma_extrinsic_position);
  require_positive("sigma_time_offset", sigma_time_offset);
  require(!estimate_time_offset || motion == SlamMotion::kInertial,
          "estimate_time_offset: without an IMU there is no other clock");
  require_positive("max_gap_s", max_gap_s);
  start.check();
  moving_start.check();
  require(moving_start_factor >= 1 && moving_start_factor <= 100, "moving_start_factor", moving_start_factor,
          "must be from 1 to 100");
  require_at_least("recover_after", recover_after, 1);
  stand_still.check();
  require_positive("zero_velocity_sigma", zero_velocity_sigma);
  require_positive("zero_rate_sigma_floor", zero_rate_sigma_floor);
  require_positive("still_picture_px", still_picture_px);
  require_positive("still_picture_s", still_picture_s);
  require_positive("max_imu_step_s", max_imu_step_s);
  require(max_imu_bridge_s >= max_imu_step_s, "max_imu_bridge_s", max_imu_bridge_s, "is below max_imu_step_s");
  require_positive("gap_acceleration_sigma", gap_acceleration_sigma);
  require_positive("gap_angular_velocity_sigma", gap_angular_velocity_sigma);
  require_positive("max_angular_velocity", max_angular_velocity);
  require_positive("max_specific_force", max_specific_force);
  require_positive("lost_after_s", lost_after_s);
  require(relocate_s >= 0, "relocate_s", relocate_s, "must not be negative");
  map.check();
  association.check();
  require(landmarks.size() <= static_cast<std::size_t>(map.max_features),
          "landmarks: more than map.max_features = " + std::to_string(map.max_features));
  std::set<std::int64_t> ids;
  for (const KnownLandmark& landmark : landmarks) {
    const std::string name = "landmarks[" + std::to_string(ids.size()) + "]";
    require(landmark.position.allFinite(), name + ".position must be finite");
    require_not_negative(name + ".sigma", landmark.sigma);
    require(ids.insert(landmark.id).second, name + ".id", static_cast<double>(landmark.id), "comes twice");
  }
}

SlamOptions slam_options_for_images(SlamOptions options) {
  options.sigma_px = 1;
  options.map.max_linearity_index = 0.03;
  options.second_order_noise = options.motion == SlamMotion::kConstantVelocity;
  options.relocate_s = 2;
  if (options.motion == SlamMotion::kConstantVelocity) {
    // Where nothing but the picture tells what moves.
    options.map.steer_after_frames = 20;
    options.map.cover_radius = 0.09;
  }
  return options;
}

}  // namespace loc
