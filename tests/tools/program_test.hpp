// For tests of the real programs: a folder of one's own, processes with their log lines in a file, generated
// recordings, and what stands in an LCM log.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "libloc/core/time.hpp"
#include "loc/estimate_t.hpp"
#include "tools/support/child_process.hpp"

namespace loc::test {

inline constexpr TimeNs kSecond = 1'000'000'000;
inline constexpr TimeNs kMs = 1'000'000;

class TemporaryFolder {
 public:
  TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder();
  std::string path(const std::string& name) const { return folder_ + "/" + name; }

 private:
  std::string folder_;
};

/// Starts a program of ours (loc-…) or of the system; what it writes to stderr goes to that file.
ChildProcess start(const std::string& program, const std::vector<std::string>& arguments,
                   const std::string& stderr_file, bool read_output = false);
/// Runs it to its end. @return its exit code, or 128 + the signal that ended it, -1 when it had to be killed.
int run(const std::string& program, const std::vector<std::string>& arguments, const std::string& stderr_file,
        TimeNs patience = 30 * kSecond);

/// A hub on a free port. url: where.
struct RunningHub {
  explicit RunningHub(const TemporaryFolder& folder, const std::vector<std::string>& arguments = {});
  ChildProcess process;
  std::string url;
};

std::string text_of(const std::string& file);
bool wait_until(const std::function<bool()>& condition, TimeNs patience);
/// Children of a process that are alive, by the name of their program.
pid_t child_of(pid_t parent, const std::string& program);
std::vector<pid_t> children_of(pid_t parent);
bool alive(pid_t process);

/// Rotation about changing axes, gravity, earth's field at a lower rate; as CSV.
void write_recording(const std::string& file, double imu_rate_hz, double seconds, int magnetometer_every = 4);

/// Estimates in a log, without the two times at which they were made.
std::vector<std::vector<std::uint8_t>> estimates_in(const std::string& log);
/// Log time of the last whole message of a channel [us]; 0: there is none.
std::int64_t last_time_us(const std::string& log, const std::string& channel);
/// value of "name=" in the last line that holds text; -1 when there is none
std::int64_t figure(const std::string& log_lines, const std::string& text, const std::string& name);

}  // namespace loc::test
