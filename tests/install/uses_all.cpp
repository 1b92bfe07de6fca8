// A user's program with every library: makes a message, decodes it, fits an ellipsoid, writes and reads a rig.
#include <cstdio>
#include <filesystem>
#include <vector>

#include "libloc/calib/ellipsoid.hpp"
#include "libloc/core/random.hpp"
#include "libloc/io/rig_yaml.hpp"
#include "loc/imu_t.hpp"
#include "msgs/convert.hpp"
#include "msgs/decode.hpp"

int main() {
  loc::ImuMeasurement imu;
  imu.time_ns = 1'700'000'000'000'000'001;
  imu.angular_velocity = {0.1, 0.2, 0.3};
  imu.specific_force = {0, 0, 9.8};
  const loc::imu_t message = loc::to_message(imu);
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  if (message.encode(bytes.data(), 0, static_cast<int>(bytes.size())) != static_cast<int>(bytes.size())) return 1;
  loc::MeasurementDecoder decoder;
  const auto decoded = decoder.decode("LOC_IMU", bytes, loc::kNoTime);
  if (!decoded || loc::stamp_of(*decoded).time_ns != imu.time_ns) return 2;

  loc::Rig rig;
  rig.imu = loc::ImuCalibration{};
  rig.imu->gyroscope.bias = imu.angular_velocity;
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> readings(200, 3);
  loc::Random random(1);
  for (int i = 0; i < 200; ++i) readings.row(i) = Eigen::RowVector3d(1, 2, 3) + random.direction().transpose();
  const loc::EllipsoidFit fit = loc::fit_ellipsoid(readings);
  if ((fit.centre - Eigen::Vector3d(1, 2, 3)).norm() > 1e-6) return 4;
  rig.magnetometer = loc::MagnetometerCalibration{.triad = fit.triad()};
  const std::filesystem::path path = std::filesystem::temp_directory_path() / "libloc_uses_all_rig.yaml";
  loc::write_rig(path, rig);
  const loc::Rig back = loc::read_rig(path);
  std::filesystem::remove(path);
  if (!back.imu || back.imu->gyroscope.bias != rig.imu->gyroscope.bias) return 3;
  std::puts("libloc works from another project");
  return 0;
}
