// SPDX-License-Identifier: Apache-2.0
// Logs every frame of a CAN port to a file that can-utils, Wireshark and others read.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absenc/link/port.hpp"
#include "absenc/os/line_file.hpp"

namespace absenc::client {

/// Returns the line of the log for a frame, such as "(1436509052.249713) vcan0 044#2A366C2B".
[[nodiscard]] std::string candump_line(Time since_1970, const std::string& interface, const CanFrame& frame);

class CanLog final : public Port<CanFrame> {
 public:
  /// Makes a port that logs the frames of `port` and passes them on. `owner` keeps `port` alive.
  CanLog(Port<CanFrame>& port, std::shared_ptr<void> owner, std::shared_ptr<os::LineFile> file, std::string interface);

  Time now() override { return port_->now(); }
  void begin(const Step<CanFrame>& step) override;
  Event<CanFrame> wait(const Step<CanFrame>& step) override;

 private:
  void write(const std::string& line);

  Port<CanFrame>* port_;
  std::shared_ptr<void> owner_;
  std::shared_ptr<os::LineFile> file_;
  std::string interface_;
  Time offset_;  // time of day minus the time of the port's clock
  std::vector<CanFrame> sending_;
};

}  // namespace absenc::client
