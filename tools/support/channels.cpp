#include "tools/support/channels.hpp"

#include <CLI/CLI.hpp>

#include "tools/support/program.hpp"

namespace loc {
namespace {

constexpr std::size_t kMaxChannel = 63;

}  // namespace

void add_channel_option(CLI::App& app, std::vector<std::string>& assignments) {
  app.add_option(
      "--channel", assignments,
      "STREAM=NAME, may be given several times; streams: imu, magnetometer, image, gps, reference, odometry, "
      "features");
}

std::array<std::string, kStreamKinds> parse_channels(const std::vector<std::string>& assignments) {
  std::array<std::string, kStreamKinds> out;
  for (const std::string& assignment : assignments) {
    const auto equals = assignment.find('=');
    const std::string stream = assignment.substr(0, equals);
    const std::string channel = equals == std::string::npos ? "" : assignment.substr(equals + 1);
    if (channel.empty() || channel.size() > kMaxChannel) {
      throw UsageError("--channel '" + assignment + "': must be STREAM=NAME, the name 1 to 63 characters long");
    }
    bool known = false;
    for (std::size_t i = 0; i < kStreamKinds; ++i) {
      if (stream != stream_name(static_cast<StreamKind>(i))) continue;
      out[i] = channel;
      known = true;
    }
    if (!known) throw UsageError("--channel '" + assignment + "': there is no stream '" + stream + "'");
  }
  return out;
}

}  // namespace loc
