// SPDX-License-Identifier: Apache-2.0
// Measures the processor time per reading of `absenc monitor` with 1, 8 and 64 encoders.
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

constexpr int most_encoders = 64;
constexpr std::array<int, 3> counts{1, 8, most_encoders};

[[noreturn]] void fail(const std::string& what) {
  std::fprintf(stderr, "monitor_bench: %s: %s\n", what.c_str(), std::strerror(errno));
  std::exit(1);
}

/// A child process whose standard output or standard error this program reads.
struct Child {
  pid_t pid;
  FILE* output;
};

Child start(std::vector<std::string> arguments, int captured) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) fail("pipe");
  const pid_t pid = fork();
  if (pid < 0) fail("fork");
  if (pid == 0) {
    const int other = captured == STDOUT_FILENO ? STDERR_FILENO : STDOUT_FILENO;
    dup2(ends[1], captured);
    if (std::freopen("/dev/null", "w", other == STDOUT_FILENO ? stdout : stderr) == nullptr) _exit(126);
    close(ends[0]);
    close(ends[1]);
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    execv(pointers[0], pointers.data());
    _exit(127);
  }
  close(ends[1]);
  return {pid, fdopen(ends[0], "r")};
}

std::string line_of(FILE* file) {
  std::string line;
  for (int c = std::fgetc(file); c != EOF && c != '\n'; c = std::fgetc(file)) line += static_cast<char>(c);
  return line;
}

/// Returns the monitor's user and system time per reading, in microseconds.
double measure(const std::string& absenc, const fs::path& folder, int count, const char* seconds) {
  std::vector<std::string> arguments{absenc, "monitor", "--json", "--rate", "100", "--for", seconds};
  for (int i = 0; i < count; ++i) arguments.push_back("tformat:" + (folder / std::to_string(i)).string());
  const Child monitor = start(arguments, STDERR_FILENO);
  std::string last;
  for (std::string line = line_of(monitor.output); !line.empty(); line = line_of(monitor.output)) last = line;
  std::fclose(monitor.output);
  rusage usage{};
  int status = 0;
  if (wait4(monitor.pid, &status, 0, &usage) < 0 || status != 0) fail("the monitor failed: " + last);
  unsigned long readings = 0;
  if (std::sscanf(last.c_str(), "absenc: %lu readings", &readings) != 1 || readings == 0) fail(last);
  const auto microseconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) * 1e6 + static_cast<double>(time.tv_usec);
  };
  return (microseconds(usage.ru_utime) + microseconds(usage.ru_stime)) / static_cast<double>(readings);
}

}  // namespace

int main(int argument_count, char** arguments) {
  const char* const absenc = std::getenv("ABSENC");
  if (absenc == nullptr) fail("ABSENC must name the command");
  const bool quick = argument_count > 1 && std::strncmp(arguments[1], "--benchmark_min_time", 20) == 0;
  std::string name = fs::temp_directory_path() / "absenc-bench-XXXXXX";
  const fs::path folder = mkdtemp(name.data());
  std::vector<Child> encoders;
  for (int i = 0; i < most_encoders; ++i) {
    encoders.push_back(start({absenc, "emulate", "tformat", "--pty", folder / std::to_string(i)}, STDOUT_FILENO));
    if (line_of(encoders.back().output).rfind("ready: ", 0) != 0) fail("a virtual encoder did not start");
  }
  std::array<std::vector<double>, counts.size()> times;
  for (int round = 0; round < (quick ? 1 : 3); ++round) {
    for (std::size_t i = 0; i < counts.size(); ++i) {
      times[i].push_back(measure(absenc, folder, counts[i], quick ? "1" : "4"));
    }
  }
  for (std::size_t i = 0; i < counts.size(); ++i) {
    std::sort(times[i].begin(), times[i].end());
    const double median = times[i][times[i].size() / 2];
    std::printf("%2d encoders: %5.1f us of processor time a reading, %.2f times that of one encoder\n", counts[i],
                median, median / times[0][times[0].size() / 2]);
  }
  for (const Child& encoder : encoders) {
    kill(encoder.pid, SIGTERM);
    waitpid(encoder.pid, nullptr, 0);
    std::fclose(encoder.output);
  }
  fs::remove_all(folder);
}
