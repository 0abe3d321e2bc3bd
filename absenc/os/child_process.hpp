// SPDX-License-Identifier: Apache-2.0
// A second process of this program, for code that must not be able to end the first one, and the connection to it.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "absenc/core/time.hpp"
#include "absenc/os/descriptor.hpp"

namespace absenc::os {

/// One end of a connection between two processes. Neither call waits.
class Channel {
 public:
  explicit Channel(Descriptor end) : end_(std::move(end)) {}

  [[nodiscard]] int get() const { return end_.get(); }
  /// Sends as much of `bytes` as there is room for and removes that from it. False: the other end is closed.
  [[nodiscard]] bool send(std::string& bytes) const;
  /// Appends what has arrived, at most 64 kB. False: the other end is closed, and everything was received.
  [[nodiscard]] bool receive(std::string& bytes) const;

 private:
  Descriptor end_;
};

/// This program, run again. It inherits no file, port or socket but its end of the channel, and no terminal's signals.
/// The thread that makes it keeps it: the kernel kills it when that thread ends.
class ChildProcess {
 public:
  /// `arguments`: those of its `main`. Throws Failure.
  explicit ChildProcess(std::vector<std::string> arguments);
  /// Kills it, if it still runs.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  [[nodiscard]] const Channel& channel() const { return channel_; }
  [[nodiscard]] pid_t number() const { return number_; }
  /// Gives it this long to end by itself, then kills it. Returns how it ended by itself, "by signal 6 (Aborted)" or
  /// "with status 1"; "": with status 0, or it was killed here.
  std::string end(Time longest);

 private:
  Channel channel_;
  pid_t number_ = -1;
};

/// The child calls this first and gets its end of the channel. From then on the process ends with its parent, has
/// `name` in lists of processes, leaves no core file and takes at most `bytes` of memory more than it has now.
[[nodiscard]] Channel become_child(const char* name, std::size_t bytes);

}  // namespace absenc::os
