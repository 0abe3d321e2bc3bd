// SPDX-License-Identifier: Apache-2.0
// Saves the memory of a virtual encoder to a file before the encoder's reply confirms a change.
#pragma once

#include "absenc/client/memory/memory_file.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc::client {

/// A machine in front of a virtual encoder. Every change that a reply confirms is in the file, even if this process is
/// killed. If saving fails, `next` throws Failure and the encoder sends no reply.
template <class Item>
class MemorySaver final : public Machine<Item> {
 public:
  /// Takes the machine on the line, which is `device` itself or a machine in front of it, and the file for the device's
  /// memory.
  MemorySaver(Machine<Item>& line, Device<Item>& device, MemoryFile& file)
      : line_(&line), device_(&device), file_(&file), saved_(device.memory_version()), finished_(saved_) {}

  void feed(const Event<Item>& event) override { line_->feed(event); }

  Step<Item> next(Time now) override {
    const Step<Item> step = line_->next(now);
    if (saved_ != device_->memory_version()) save(os::Durable::no);  // waiting for the disk would delay the reply
    return step;
  }

  /// Saves the memory if it changed since this function last saved it, and waits until it is on the disk. Throws
  /// Failure.
  void finish() {
    if (finished_ != device_->memory_version()) save(os::Durable::yes);
    finished_ = saved_;
  }

 private:
  void save(os::Durable durable) {
    file_->save(device_->memory(), durable);
    saved_ = device_->memory_version();
  }

  Machine<Item>* line_;
  Device<Item>* device_;
  MemoryFile* file_;
  std::uint32_t saved_;
  std::uint32_t finished_;
};

}  // namespace absenc::client
