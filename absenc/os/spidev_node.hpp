// SPDX-License-Identifier: Apache-2.0
// A character device that this process serves (CUSE): programs that use spidev reach a Spidev.
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
  /// Creates /dev/`name`, which the destructor removes. `spidev` must outlive the node. Throws Failure, and as
  /// `wait_for` does.
  SpidevNode(const std::string& name, Spidev& spidev);
  SpidevNode(const SpidevNode&) = delete;
  SpidevNode& operator=(const SpidevNode&) = delete;
  ~SpidevNode();

  [[nodiscard]] const std::string& path() const { return path_; }

  /// Answers requests of programs until the time `end`. Throws Failure, and as `wait_for` does.
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
  std::optional<Pending> pending_;
  std::unique_ptr<fuse_session, CloseSession> session_;
};

}  // namespace absenc::os
