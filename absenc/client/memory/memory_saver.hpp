// SPDX-License-Identifier: Apache-2.0
// Stands in front of a virtual encoder and saves its memory before anybody can know what it holds.
#pragma once

#include "absenc/client/memory/memory_file.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc::client {

/// Whatever becomes of this process, what its host was told is in the file. Throws Failure out of `next`, and with
/// that gives no reply, when it cannot be saved.
template <class Item>
class MemorySaver final : public Machine<Item> {
 public:
  /// `line` is the device, or what stands in front of it.
  MemorySaver(Machine<Item>& line, Device<Item>& device, MemoryFile& file)
      : line_(&line), device_(&device), file_(&file), saved_(device.memory_version()), finished_(saved_) {}

  void feed(const Event<Item>& event) override { line_->feed(event); }

  Step<Item> next(Time now) override {
    const Step<Item> step = line_->next(now);
    if (saved_ != device_->memory_version()) save(os::Durable::no);  // to wait for the disk would make the reply late
    return step;
  }

  /// Waits until the disk has it. Throws Failure.
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
