#include "core/isolated_call.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>

#include "core/error.h"

namespace touchstone {
namespace {

constexpr char kAnswer = 'A';
constexpr char kError = 'E';

bool write_all(int file, const std::string& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = write(file, bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    done += static_cast<std::size_t>(count);
  }
  return true;
}

[[noreturn]] void be_the_child(const std::function<std::string()>& work, int cpu_seconds, int answer) {
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  const rlimit cpu{static_cast<rlim_t>(cpu_seconds), static_cast<rlim_t>(cpu_seconds)};
  setrlimit(RLIMIT_CPU, &cpu);
  std::signal(SIGABRT, SIG_DFL);
  std::signal(SIGSEGV, SIG_DFL);
  if (const int nowhere = open("/dev/null", O_WRONLY); nowhere >= 0) dup2(nowhere, STDERR_FILENO);
  std::string bytes;
  try {
    bytes = kAnswer + work();
  } catch (const std::exception& error) {
    bytes = kError + std::string(error.what());
  } catch (...) {
    bytes = kError + std::string("an unknown exception");
  }
  // Neither destructors nor buffers of the parent's are run or flushed twice.
  _exit(write_all(answer, bytes) ? 0 : 1);
}

/// All that comes through the pipe until its other end is closed or the time is over; `in_time` says which.
std::string read_until(int file, std::chrono::steady_clock::time_point end, bool& in_time) {
  std::string bytes;
  std::array<char, 65536> part{};
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - std::chrono::steady_clock::now()).count();
    pollfd waiting{file, POLLIN, 0};
    const int ready = left > 0 ? poll(&waiting, 1, static_cast<int>(left)) : 0;
    if (ready < 0 && errno == EINTR) continue;
    in_time = ready != 0;
    if (!in_time) return bytes;
    const ssize_t count = read(file, part.data(), part.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return bytes;
    bytes.append(part.data(), static_cast<std::size_t>(count));
  }
}

}  // namespace

std::string isolated_call(const std::function<std::string()>& work, int cpu_seconds, int wall_seconds) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) fail("no pipe could be opened ({})", std::strerror(errno));
  const pid_t child = fork();
  if (child < 0) {
    const int reason = errno;
    close(ends[0]);
    close(ends[1]);
    fail("no process could be started ({})", std::strerror(reason));
  }
  if (child == 0) {
    close(ends[0]);
    be_the_child(work, cpu_seconds, ends[1]);
  }
  close(ends[1]);
  bool in_time = true;
  const std::string bytes =
      read_until(ends[0], std::chrono::steady_clock::now() + std::chrono::seconds(wall_seconds), in_time);
  if (!in_time) kill(child, SIGKILL);
  close(ends[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!in_time) fail("it gave no answer within {} s", wall_seconds);
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    if (signal == SIGXCPU || signal == SIGKILL) fail("it took more than {} s, or was killed", cpu_seconds);
    fail("it was ended by signal {}", signal);
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || bytes.empty()) fail("it ended without an answer");
  if (bytes[0] == kError) fail("{}", bytes.substr(1));
  return bytes.substr(1);
}

}  // namespace touchstone
