#include "tools/support/child_process.hpp"

#include <fcntl.h>
#include <sys/poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "tools/support/program.hpp"

namespace loc {
namespace {

constexpr TimeNs kLook = 5'000'000;

std::array<FileDescriptor, 2> make_pipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw std::system_error(errno, std::generic_category(), "pipe");
  return {FileDescriptor(ends[0]), FileDescriptor(ends[1])};
}

// Between fork and exec only async-signal-safe calls are allowed. @return errno of what failed.
int become(char* const* arguments, int output, pid_t parent) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != parent) return ESRCH;  // it died before the line above
  ::signal(SIGINT, SIG_DFL);
  ::signal(SIGTERM, SIG_DFL);
  ::signal(SIGPIPE, SIG_DFL);
  if (output >= 0 && ::dup2(output, STDOUT_FILENO) < 0) return errno;
  ::execvp(arguments[0], arguments);
  return errno;
}

}  // namespace

ChildProcess::ChildProcess(std::string name, const std::vector<std::string>& arguments, bool read_output)
    : name_(std::move(name)) {
  std::vector<char*> raw;
  raw.reserve(arguments.size() + 1);
  // execvp() does not write through it.
  for (const std::string& argument : arguments) raw.push_back(const_cast<char*>(argument.c_str()));
  raw.push_back(nullptr);
  auto failure = make_pipe();
  auto output = make_pipe();
  const pid_t parent = ::getpid();
  pid_.value = ::fork();
  if (pid_ < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (pid_ == 0) {
    const int error = become(raw.data(), read_output ? output[1].get() : -1, parent);
    (void)!::write(failure[1].get(), &error, sizeof error);
    ::_exit(127);
  }
  ::setpgid(pid_, pid_);
  failure[1].close();
  int error = 0;
  // The pipe closes when the program has taken over.
  if (::read(failure[0].get(), &error, sizeof error) == static_cast<ssize_t>(sizeof error)) {
    ::waitpid(pid_, nullptr, 0);
    pid_.value = -1;
    throw std::runtime_error("cannot start " + arguments.at(0) + ": " + std::generic_category().message(error));
  }
  if (read_output) output_ = std::move(output[0]);
}

ChildProcess::~ChildProcess() {
  if (pid_ > 0 && running()) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
}

bool ChildProcess::running() {
  if (pid_ <= 0 || ended_) return false;
  int status = 0;
  if (::waitpid(pid_, &status, WNOHANG) == pid_) {
    ended_ = true;
    status_ = status;
  }
  return !ended_;
}

bool ChildProcess::wait(TimeNs patience_ns) {
  const TimeNs give_up = steady_now() + patience_ns;
  while (running()) {
    if (steady_now() > give_up) return false;
    // Not sleep_for(): after a stop signal it would not sleep any more.
    ::poll(nullptr, 0, static_cast<int>(kLook / 1'000'000));
  }
  return true;
}

bool ChildProcess::stop(TimeNs patience_ns) {
  if (!running()) return true;
  ::kill(pid_, SIGTERM);
  if (wait(patience_ns)) return true;
  ::kill(pid_, SIGKILL);
  wait(patience_ns);
  return false;
}

std::optional<std::string> ChildProcess::read_line(TimeNs patience_ns) {
  const TimeNs give_up = steady_now() + patience_ns;
  for (;;) {
    if (const auto end = unread_.find('\n'); end != std::string::npos) {
      std::string line = unread_.substr(0, end);
      unread_.erase(0, end + 1);
      return line;
    }
    const TimeNs left = give_up - steady_now();
    pollfd event{output_.get(), POLLIN, 0};
    if (left <= 0) return std::nullopt;
    const int ready = ::poll(&event, 1, static_cast<int>(left / 1'000'000) + 1);
    if (ready < 0 && errno == EINTR) continue;
    if (ready != 1) return std::nullopt;
    std::array<char, 512> part{};
    const ssize_t size = ::read(output_.get(), part.data(), part.size());
    if (size <= 0) return std::nullopt;
    unread_.append(part.data(), static_cast<std::size_t>(size));
  }
}

bool ChildProcess::stopped_early() const {
  return ended_ && WIFSIGNALED(status_) && WTERMSIG(status_) == SIGTERM;
}

std::string ChildProcess::describe() const {
  if (!ended_) return "running";
  if (WIFSIGNALED(status_)) {
    return "signal " + std::to_string(WTERMSIG(status_)) + " (" + ::strsignal(WTERMSIG(status_)) + ")";
  }
  return "exit code " + std::to_string(WEXITSTATUS(status_));
}

std::string own_folder() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

}  // namespace loc
