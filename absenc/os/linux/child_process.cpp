// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/child_process.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

namespace {

constexpr int channel_of_child = 3;
constexpr Time between_looks = std::chrono::milliseconds(5);

struct Ends {
  Ends() {
    std::array<int, 2> both{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, both.data()) < 0)
      throw system_failure("socketpair", errno);
    ours = Descriptor(both[0]);
    other = Descriptor(both[1]);
  }
  Descriptor ours, other;
};

/// The steps that posix_spawn performs in the child before the program begins.
struct SpawnSteps {
  explicit SpawnSteps(int channel) {
    ::posix_spawn_file_actions_init(&files);
    ::posix_spawnattr_init(&attributes);
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
      ::posix_spawn_file_actions_addopen(&files, stream, "/dev/null", O_RDWR, 0);
    }
    ::posix_spawn_file_actions_adddup2(&files, channel, channel_of_child);
    ::posix_spawn_file_actions_addclosefrom_np(&files, channel_of_child + 1);
    // The child blocks these signals: Ctrl-C in a terminal signals parent and child at once, but the parent still
    // needs the child.
    sigset_t blocked;
    ::sigemptyset(&blocked);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE}) ::sigaddset(&blocked, signal);
    ::posix_spawnattr_setsigmask(&attributes, &blocked);
    ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  }
  ~SpawnSteps() {
    ::posix_spawn_file_actions_destroy(&files);
    ::posix_spawnattr_destroy(&attributes);
  }
  SpawnSteps(const SpawnSteps&) = delete;
  SpawnSteps& operator=(const SpawnSteps&) = delete;

  posix_spawn_file_actions_t files{};
  posix_spawnattr_t attributes{};
};

std::string ending_of(int status) {
  if (WIFSIGNALED(status)) {
    return "by signal " + std::to_string(WTERMSIG(status)) + " (" + ::strsignal(WTERMSIG(status)) + ")";
  }
  return WEXITSTATUS(status) == 0 ? std::string() : "with status " + std::to_string(WEXITSTATUS(status));
}

void limit(__rlimit_resource what, rlim_t most) {
  const rlimit both{most, most};
  ::setrlimit(what, &both);
}

// Returns the size of data and stack in bytes (sixth number of statm, proc(5)).
std::size_t data_bytes() {
  std::ifstream file("/proc/self/statm");
  std::size_t pages = 0;
  for (int i = 0; i < 6; ++i) file >> pages;
  return pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace

bool Channel::send(std::string& bytes) const {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(end_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0) return errno == EAGAIN || errno == ENOBUFS;
    bytes.erase(0, static_cast<std::size_t>(sent));
  }
  return true;
}

bool Channel::receive(std::string& bytes) const {
  std::array<char, 65536> piece;  // the array is not initialised, because only received bytes are read from it
  for (;;) {
    const ssize_t size = ::recv(end_.get(), piece.data(), piece.size(), MSG_DONTWAIT);
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) return errno == EAGAIN;
    bytes.append(piece.data(), static_cast<std::size_t>(size));
    return size != 0;
  }
}

ChildProcess::ChildProcess(std::vector<std::string> arguments) : channel_(Descriptor()) {
  Ends ends;
  const SpawnSteps steps(ends.other.get());
  std::vector<char*> words;
  for (std::string& one : arguments) words.push_back(one.data());
  words.push_back(nullptr);
  // /proc/self/exe is the running program, even if a newer version was installed since.
  const int error = ::posix_spawn(&number_, "/proc/self/exe", &steps.files, &steps.attributes, words.data(), ::environ);
  if (error != 0) throw system_failure("starting this program again", error);
  channel_ = Channel(std::move(ends.ours));
}

ChildProcess::~ChildProcess() { end({}); }

std::string ChildProcess::end(Time longest) {
  if (number_ < 0) return {};
  const Time deadline = now() + longest;
  int status = 0;
  pid_t ended = 0;
  while ((ended = ::waitpid(number_, &status, WNOHANG)) == 0 && now() < deadline) {
    const timespec pause{0, static_cast<long>(between_looks.count())};
    ::nanosleep(&pause, nullptr);
  }
  if (ended == 0) {
    ::kill(number_, SIGKILL);
    while (::waitpid(number_, &status, 0) < 0 && errno == EINTR) {
    }
  }
  const bool by_itself = ended == number_;
  number_ = -1;
  return by_itself ? ending_of(status) : std::string();
}

Channel become_child(const char* name, std::size_t bytes) {
  // If the parent ended before prctl(2), the child notices by the closed channel.
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::prctl(PR_SET_NAME, name);
  ::fcntl(channel_of_child, F_SETFD, FD_CLOEXEC);
  limit(RLIMIT_CORE, 1);  // a core size of 0 would still start a program that collects core files; 1 does not (core(5))
  limit(RLIMIT_DATA, data_bytes() + bytes);
  return Channel(Descriptor(channel_of_child));
}

}  // namespace absenc::os
