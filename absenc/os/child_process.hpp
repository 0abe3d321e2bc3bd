// SPDX-License-Identifier: Apache-2.0
// A second process of this program, for code that must not be able to crash the first one.
#pragma once

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
  /// Sends as many of `bytes` as the channel has room for, and removes the sent ones from `bytes`. Returns false on
  /// an error.
  [[nodiscard]] bool send(std::string& bytes) const;
  /// Appends received bytes to `bytes`. Returns false if the other process has closed the channel, or on an error.
  [[nodiscard]] bool receive(std::string& bytes) const;

 private:
  Descriptor end_;
};

/// A second process that runs this program. Of the parent's open files it inherits only its end of the channel.
class ChildProcess {
 public:
  /// Starts the process; its `main` gets `arguments`. Throws Failure.
  explicit ChildProcess(std::vector<std::string> arguments);
  /// Kills the process if it still runs.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  [[nodiscard]] const Channel& channel() const { return channel_; }
  /// Waits up to `longest` for the process to end, then kills it. Returns how the process failed, for example "with
  /// status 1"; "" if it succeeded.
  std::string end(Time longest);

 private:
  Channel channel_;
  int number_ = -1;  // number of the process; Windows: of a descriptor of it
};

/// Returns the child's end of the channel; the child must call this first. `name`: name of the child in process
/// lists. `bytes`: about how much more memory the child can allocate.
[[nodiscard]] Channel become_child(const char* name, std::size_t bytes);

}  // namespace absenc::os
