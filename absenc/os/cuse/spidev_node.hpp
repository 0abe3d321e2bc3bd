// SPDX-License-Identifier: Apache-2.0
// A character device that this process serves (CUSE): any program that uses spidev reaches a Spidev. It is a library of
// its own and not installed, so that users of absenc-os do not need libfuse.
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
  /// Creates /dev/`name`, which is removed with the object. `spidev` must outlive it. Throws Failure: `not_found` (the
  /// kernel module is not loaded), `no_permission`, `in_use` (the name), `unsupported` (the name is invalid), `lost`,
  /// `system`; throws Interrupted and Ended as `wait_for` does.
  SpidevNode(const std::string& name, Spidev& spidev);
  SpidevNode(const SpidevNode&) = delete;
  SpidevNode& operator=(const SpidevNode&) = delete;
  ~SpidevNode();

  [[nodiscard]] const std::string& path() const { return path_; }

  /// Answers requests of programs until `end`, one SPI message at a time; the reply is sent when its message has ended.
  /// Throws as `wait_for` does (os/signals.hpp), and Failure if the kernel removes the device.
  void serve(Time end = never);

 private:
  friend struct SpidevNodeCalls;

  struct CloseSession {
    void operator()(fuse_session* session) const;
  };
  enum class Operation : std::uint8_t { control, read, write };
  struct Pending {
    void* request;
    SpidevReply reply;
    Operation operation;
  };

  void process_one();
  void answer();

  Spidev* spidev_;
  std::string path_;
  bool made_ = false;
  std::optional<Pending> pending_;  // request of a program that is answered when its SPI message is over
  std::unique_ptr<fuse_session, CloseSession> session_;
};

}  // namespace absenc::os
