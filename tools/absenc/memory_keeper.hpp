// SPDX-License-Identifier: Apache-2.0
// Stands in front of a virtual encoder and saves its memory while the line is quiet: at most once a second.
#pragma once

#include <chrono>
#include <exception>

#include "absenc/protocol/conversation.hpp"
#include "tools/absenc/memory_file.hpp"
#include "tools/absenc/output.hpp"

namespace absenc::tool {

template <class Item>
class MemoryKeeper final : public Machine<Item> {
 public:
  /// `line` is the device, or what stands in front of it.
  MemoryKeeper(Machine<Item>& line, Device<Item>& device, const MemoryFile& file)
      : line_(&line), device_(&device), file_(&file), saved_(device.memory_version()) {}

  void feed(const Event<Item>& event) override {
    if (event.kind == Event<Item>::Kind::timer && event.at < line_timer_) return;
    line_->feed(event);
  }

  Step<Item> next(Time now) override {
    Step<Item> step = line_->next(now);
    if (step.kind != Step<Item>::Kind::wait) return step;
    line_timer_ = step.at > now ? step.at : never;
    if (saved_ != device_->memory_version() && now >= save_at_) {
      save(os::Durable::no);  // waiting for the disk would make the next answer late
      save_at_ = now + std::chrono::seconds(1);
    }
    if (saved_ != device_->memory_version()) step.at = std::min(line_timer_, save_at_);
    return step;
  }

  /// What has changed since; false when it could not be saved.
  bool finish() { return saved_ == device_->memory_version() || save(os::Durable::yes); }

 private:
  bool save(os::Durable durable) {
    try {
      file_->save(device_->memory(), durable);
      saved_ = device_->memory_version();
      return true;
    } catch (const std::exception& error) {
      print_message(error.what());
      return false;
    }
  }

  Machine<Item>* line_;
  Device<Item>* device_;
  const MemoryFile* file_;
  std::uint32_t saved_;
  Time save_at_{};
  Time line_timer_ = never;
};

}  // namespace absenc::tool
