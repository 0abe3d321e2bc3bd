// SPDX-License-Identifier: Apache-2.0
// A second process of this program, for code that must not be able to crash the first process, and the connection to
// it.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "absenc/core/time.hpp"
#include "absenc/os/descriptor.hpp"

namespace absenc::os {

/// One end of a connection between two processes. `send` and `receive` do not block.
class Channel {
 public:
  explicit Channel(Descriptor end) : end_(std::move(end)) {}

  [[nodiscard]] int get() const { return end_.get(); }
  /// Sends as many of `bytes` as there is room for and removes them from `bytes`. Returns false if the other end is
  /// closed or on another error.
  [[nodiscard]] bool send(std::string& bytes) const;
  /// Appends the received bytes to `bytes`, at most 65536 per call. Returns false if the other end is closed and
  /// everything was received, or on another error.
  [[nodiscard]] bool receive(std::string& bytes) const;

 private:
  Descriptor end_;
};

/// A second process that runs this program. It inherits no file, port or socket except its end of the channel, and
/// blocks SIGINT, SIGTERM, SIGHUP, SIGQUIT and SIGPIPE. After `become_child` the kernel kills it when the thread that
/// created it ends.
class ChildProcess {
 public:
  /// Starts the process with `arguments` for its `main`. Throws Failure.
  explicit ChildProcess(std::vector<std::string> arguments);
  /// Kills the process if it still runs.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  [[nodiscard]] const Channel& channel() const { return channel_; }
  [[nodiscard]] pid_t number() const { return number_; }
  /// Waits up to `longest` for the process to end, then kills it if it still runs. Returns how it ended, "by signal 6
  /// (Aborted)" or "with status 1"; "" for status 0, if it was killed here, and for later calls.
  std::string end(Time longest);

 private:
  Channel channel_;
  pid_t number_ = -1;
};

/// Returns the child's end of the channel; the child must call this first. From then on the process ends with the
/// thread that created it, appears as `name` in process lists, writes no core file and can allocate about `bytes` more
/// memory at most.
[[nodiscard]] Channel become_child(const char* name, std::size_t bytes);

}  // namespace absenc::os
