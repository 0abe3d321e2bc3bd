// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/port/can_log.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>

#include "absenc/client/error.hpp"
#include "absenc/os/error.hpp"

namespace absenc::client {

std::string candump_line(Time since_1970, const std::string& interface, const CanFrame& frame) {
  const auto microseconds = std::chrono::duration_cast<std::chrono::microseconds>(since_1970).count();
  const std::string data =
      frame.remote ? fmt::format("R{}", frame.size) : fmt::format("{:02X}", fmt::join(frame.bytes(), ""));
  return fmt::format("({}.{:06}) {} {:0{}X}#{}\n", microseconds / 1'000'000, microseconds % 1'000'000, interface,
                     frame.id, frame.extended ? 8 : 3, data);
}

CanLog::CanLog(Port<CanFrame>& port, std::shared_ptr<void> owner, std::shared_ptr<os::LineFile> file,
               std::string interface)
    : port_(&port), owner_(std::move(owner)), file_(std::move(file)), interface_(std::move(interface)) {
  const auto day = std::chrono::system_clock::now().time_since_epoch();
  offset_ = std::chrono::duration_cast<Time>(day) - port.now();
}

void CanLog::begin(const Step<CanFrame>& step) {
  if (step.kind == Step<CanFrame>::Kind::transfer) sending_.assign(step.out.begin(), step.out.end());
  port_->begin(step);
}

// A log file that cannot be written is a Failure: callers take os::Failure for the loss of the port, and wait until the
// port is back.
void CanLog::write(const std::string& line) {
  try {
    file_->append(line);
  } catch (const os::Failure& failure) {
    throw Failure(failure.what());
  }
}

Event<CanFrame> CanLog::wait(const Step<CanFrame>& step) {
  const Event<CanFrame> event = port_->wait(step);
  const bool sent = event.kind == Event<CanFrame>::Kind::sent;
  const std::span<const CanFrame> frames = sent ? std::span<const CanFrame>(sending_) : event.items;
  for (const CanFrame& frame : frames) write(candump_line(event.at + offset_, interface_, frame));
  if (sent) sending_.clear();
  return event;
}

}  // namespace absenc::client
