#include "libloc/sensors/imu_noise.hpp"

#include <cmath>

#include "libloc/core/check.hpp"

namespace loc {

void ImuNoise::check() const {
  require_not_negative("gyroscope_noise_density", gyroscope_noise_density);
  require_not_negative("gyroscope_random_walk", gyroscope_random_walk);
  require_not_negative("accelerometer_noise_density", accelerometer_noise_density);
  require_not_negative("accelerometer_random_walk", accelerometer_random_walk);
  require_not_negative("gyroscope_bias_sigma", gyroscope_bias_sigma);
  require_not_negative("accelerometer_bias_sigma", accelerometer_bias_sigma);
}

DiscreteImuNoise discretise(const ImuNoise& noise, double dt_s) {
  noise.check();
  require_positive("dt_s", dt_s);
  const double root = std::sqrt(dt_s);
  return {noise.gyroscope_noise_density / root, noise.accelerometer_noise_density / root,
          noise.gyroscope_random_walk * root, noise.accelerometer_random_walk * root};
}

}  // namespace loc
