#include "program_test.hpp"

#include <gtest/gtest.h>
#include <sys/poll.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "libloc/io/lcm_log.hpp"
#include "msgs/convert.hpp"
#include "msgs/decode.hpp"
#include "tools/support/program.hpp"

namespace loc::test {
namespace fs = std::filesystem;

TemporaryFolder::TemporaryFolder() {
  std::string name = (fs::temp_directory_path() / "loc-test-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp failed");
  folder_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

ChildProcess start(const std::string& program, const std::vector<std::string>& arguments,
                   const std::string& stderr_file, bool read_output) {
  const bool ours = program.rfind("loc-", 0) == 0;
  std::vector<std::string> all = {"sh", "-c", R"(exec "$@" 2>>"$0")", stderr_file,
                                  ours ? std::string(LOC_PROGRAM_DIR) + "/" + program : program};
  all.insert(all.end(), arguments.begin(), arguments.end());
  return {program, all, read_output};
}

int run(const std::string& program, const std::vector<std::string>& arguments, const std::string& stderr_file,
        TimeNs patience) {
  ChildProcess process = start(program, arguments, stderr_file, true);
  if (!process.wait(patience)) return -1;
  const std::string how = process.describe();
  const int number = std::stoi(how.substr(how.find_first_of("0123456789")));
  return how.rfind("signal", 0) == 0 ? 128 + number : number;
}

RunningHub::RunningHub(const TemporaryFolder& folder, const std::vector<std::string>& arguments)
    : process([&] {
        std::vector<std::string> all = {"--port", "0"};
        all.insert(all.end(), arguments.begin(), arguments.end());
        return start("loc-hub", all, folder.path("hub.err"), true);
      }()),
      url(process.read_line(10 * kSecond).value_or("")) {
  EXPECT_FALSE(url.empty()) << text_of(folder.path("hub.err"));
}

std::string text_of(const std::string& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

bool wait_until(const std::function<bool()>& condition, TimeNs patience) {
  const TimeNs give_up = steady_now() + patience;
  while (!condition()) {
    if (steady_now() > give_up) return false;
    ::poll(nullptr, 0, 5);
  }
  return true;
}

namespace {

/// "pid (name) state parent …"
bool read_stat(pid_t process, std::string& name, char& state, pid_t& parent) {
  const std::string text = text_of("/proc/" + std::to_string(process) + "/stat");
  const auto open = text.find('(');
  const auto close = text.rfind(')');
  if (open == std::string::npos || close == std::string::npos) return false;
  name = text.substr(open + 1, close - open - 1);
  std::istringstream rest(text.substr(close + 1));
  return static_cast<bool>(rest >> state >> parent);
}

}  // namespace

bool alive(pid_t process) {
  std::string name;
  char state = 0;
  pid_t parent = 0;
  return read_stat(process, name, state, parent) && state != 'Z' && state != 'X';
}

std::vector<pid_t> children_of(pid_t wanted) {
  std::vector<pid_t> out;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string number = entry.path().filename();
    if (number.find_first_not_of("0123456789") != std::string::npos) continue;
    std::string name;
    char state = 0;
    pid_t parent = 0;
    const pid_t process = std::stoi(number);
    if (read_stat(process, name, state, parent) && parent == wanted && state != 'Z') out.push_back(process);
  }
  return out;
}

pid_t child_of(pid_t wanted, const std::string& program) {
  for (const pid_t process : children_of(wanted)) {
    std::string name;
    char state = 0;
    pid_t parent = 0;
    // The kernel keeps 15 characters of a name.
    if (read_stat(process, name, state, parent) && name == program.substr(0, 15)) return process;
  }
  return -1;
}

void write_recording(const std::string& file, double imu_rate_hz, double seconds, int magnetometer_every) {
  std::FILE* out = std::fopen(file.c_str(), "w");
  ASSERT_NE(out, nullptr);
  std::fputs("time_ns,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2,mx_uT,my_uT,mz_uT\n", out);
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  const auto count = static_cast<int>(imu_rate_hz * seconds);
  const double dt = 1 / imu_rate_hz;
  for (int i = 0; i < count; ++i) {
    const double t = i * dt;
    const Eigen::Vector3d rate(0.5 * std::sin(t), 0.4 * std::cos(1.3 * t), 0.3 * std::sin(0.7 * t));
    const Eigen::Vector3d force = q.conjugate() * Eigen::Vector3d(0, 0, 9.80665);
    const Eigen::Vector3d field = q.conjugate() * Eigen::Vector3d(0, 20, -44);
    std::fprintf(out, "%lld,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g", static_cast<long long>(std::llround(t * 1e9)) + 1,
                 rate.x(), rate.y(), rate.z(), force.x(), force.y(), force.z());
    if (i % magnetometer_every == 0) {
      std::fprintf(out, ",%.17g,%.17g,%.17g\n", field.x(), field.y(), field.z());
    } else {
      std::fputs(",,,\n", out);
    }
    q = (q * Eigen::Quaterniond(Eigen::AngleAxisd(rate.norm() * dt, rate.normalized()))).normalized();
  }
  ASSERT_EQ(std::fclose(out), 0);
}

std::vector<std::vector<std::uint8_t>> estimates_in(const std::string& log) {
  std::vector<std::vector<std::uint8_t>> out;
  LcmLogReader reader(log);
  while (const LcmLogEvent* event = reader.next()) {
    if (event->channel != kEstimateChannel) continue;
    auto estimate = decode_message<estimate_t>(event->data);
    estimate.host_time_ns = 0;
    estimate.publish_time_ns = 0;
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(estimate.getEncodedSize()));
    estimate.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    out.push_back(std::move(bytes));
  }
  return out;
}

std::int64_t last_time_us(const std::string& log, const std::string& channel) {
  std::int64_t last = 0;
  LcmLogReader reader(log);
  while (const LcmLogEvent* event = reader.next()) {
    if (event->channel == channel) last = event->log_time_us;
  }
  return last;
}

std::int64_t figure(const std::string& log_lines, const std::string& text, const std::string& name) {
  const auto line = log_lines.rfind(text);
  const auto at = line == std::string::npos ? line : log_lines.find(" " + name + "=", line);
  return at == std::string::npos ? -1 : std::stoll(log_lines.substr(at + name.size() + 2));
}

}  // namespace loc::test
