// SPDX-License-Identifier: Apache-2.0
// A second process of this program, for code that must not be able to crash the first one.
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
  /// Sends as many of `bytes` as there is room for and removes them. Returns false on an error.
  [[nodiscard]] bool send(std::string& bytes) const;
  /// Appends received bytes to `bytes`. Returns false at their end or on an error.
  [[nodiscard]] bool receive(std::string& bytes) const;

 private:
  Descriptor end_;
};

/// A second process that runs this program. It inherits no file, port or socket but its end of the channel.
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
  /// Waits up to `longest` for the process to end, then kills it. Returns its failure, for example "with status 1", or
  /// "".
  std::string end(Time longest);

 private:
  Channel channel_;
  pid_t number_ = -1;
};

/// Returns the child's end of the channel; the child must call this first. `name`: its name in process lists. `bytes`:
/// about how much more memory it can allocate.
[[nodiscard]] Channel become_child(const char* name, std::size_t bytes);

}  // namespace absenc::os
