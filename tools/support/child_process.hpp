// A program that is started and watched. It runs in a process group of its own, so that Ctrl-C at the terminal reaches
// only the one that watches, and it gets SIGTERM from the kernel when that one dies, however it dies.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "libloc/core/time.hpp"
#include "tools/support/file_descriptor.hpp"

namespace loc {

class ChildProcess {
 public:
  /// Starts it. Its stderr is ours.
  /// @param name for messages @param arguments the first is the program: a path, or a name that is looked for on PATH
  /// @param read_output its stdout goes to read_line() instead of to ours
  /// @throws std::runtime_error when it cannot be started (not found, not executable).
  ChildProcess(std::string name, const std::vector<std::string>& arguments, bool read_output = false);
  ChildProcess(ChildProcess&&) noexcept = default;
  ChildProcess& operator=(ChildProcess&&) noexcept = default;
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  /// Kills it if it still runs.
  ~ChildProcess();

  const std::string& name() const { return name_; }
  pid_t pid() const { return pid_; }
  /// Looks whether it runs; does not wait.
  bool running();
  /// Asks it to end with SIGTERM, kills it if that takes too long. @return false when it had to be killed.
  bool stop(TimeNs patience_ns);
  /// Waits for its end. @return false when it still runs after that time.
  bool wait(TimeNs patience_ns);
  /// The next line of its stdout; nullopt when there is none in time.
  std::optional<std::string> read_line(TimeNs patience_ns);

  /// Ended with exit code 0.
  bool succeeded() const { return ended_ && status_ == 0; }
  /// Ended by stop(), before it had installed a handler for SIGTERM.
  bool stopped_early() const;
  /// "exit code 1", "signal 9 (Killed)", "running"
  std::string describe() const;

 private:
  std::string name_;
  // The id of a moved-from child is not ours to signal.
  struct Pid {
    pid_t value = -1;
    Pid() = default;
    Pid(Pid&& other) noexcept : value(std::exchange(other.value, -1)) {}
    Pid& operator=(Pid&& other) noexcept {
      std::swap(value, other.value);
      return *this;
    }
    operator pid_t() const { return value; }
  } pid_;
  FileDescriptor output_;
  std::string unread_;
  bool ended_ = false;
  int status_ = 0;
};

/// The folder of the running program, where its siblings are.
std::string own_folder();

}  // namespace loc
