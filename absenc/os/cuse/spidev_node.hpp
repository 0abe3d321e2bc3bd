// SPDX-License-Identifier: Apache-2.0
// A character device of this computer that is served by this process (CUSE): any program that speaks spidev finds a
// Spidev behind it. A library of its own, which is linked by the command only and not installed: nobody who uses
// absenc-os then gets libfuse.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "absenc/os/spidev.hpp"

struct fuse_session;

namespace absenc::os {

class SpidevNode {
 public:
  /// Makes /dev/`name`; it is gone with the object. `spidev` must outlive it. Throws Failure: `not_found` (the kernel's
  /// module is not there), `no_permission`, `in_use` (the name), `unsupported` (what is no name), `system`.
  SpidevNode(const std::string& name, Spidev& spidev);
  SpidevNode(const SpidevNode&) = delete;
  SpidevNode& operator=(const SpidevNode&) = delete;
  ~SpidevNode();

  [[nodiscard]] const std::string& path() const { return path_; }

  /// Answers whoever opens it, one message at a time and each when it is over, until `end`. Throws as `wait_for`
  /// (os/signals.hpp), and Failure when the kernel takes the device away.
  void serve(Time end = never);

 private:
  friend struct SpidevNodeCalls;

  struct CloseSession {
    void operator()(fuse_session* session) const;
  };
  enum class Asked : std::uint8_t { control, read, write };
  struct Pending {
    void* request;
    SpidevReply reply;
    Asked asked;
  };

  void process_one();
  void answer();

  Spidev* spidev_;
  std::string path_;
  bool made_ = false;
  std::optional<Pending> pending_;  // to be answered when it is over
  std::unique_ptr<fuse_session, CloseSession> session_;
};

}  // namespace absenc::os
