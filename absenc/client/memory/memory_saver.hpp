// SPDX-License-Identifier: Apache-2.0
// Saves the memory of a virtual encoder to a file before the encoder's reply confirms a change.
#pragma once

#include "absenc/client/memory/memory_file.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc::client {

/// A machine that saves a changed memory before the encoder's reply. `next` throws Failure.
template <class Item>
class MemorySaver final : public Machine<Item> {
 public:
  /// Takes the virtual encoder `device`, and the machine that is on its line: `device` itself or one that contains it.
  MemorySaver(Machine<Item>& line, Device<Item>& device, MemoryFile& file)
      : line_(&line), device_(&device), file_(&file), saved_(device.memory_version()), finished_(saved_) {}

  void feed(const Event<Item>& event) override { line_->feed(event); }

  Step<Item> next(Time now) override {
    const Step<Item> step = line_->next(now);
    // Saves without waiting until the file is on the disk, which would delay the reply.
    if (saved_ != device_->memory_version()) save(os::Durable::no);
    return step;
  }

  /// Waits until the memory is on the disk. Throws Failure.
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
