// SPDX-License-Identifier: Apache-2.0
// A port in front of a port: Ctrl-C does not break off a conversation that first has to leave the encoder as it was.
#pragma once

#include <functional>
#include <utility>

#include "absenc/link/port.hpp"
#include "absenc/os/error.hpp"

namespace absenc::client {

template <class Item>
class AbortingPort final : public Port<Item> {
 public:
  /// `abort` asks the conversation to end early and returns whether it ends by itself.
  AbortingPort(Port<Item>& port, std::function<bool()> abort) : port_(&port), abort_(std::move(abort)) {}

  Time now() override { return port_->now(); }
  void begin(const Step<Item>& step) override { port_->begin(step); }
  Event<Item> wait(const Step<Item>& step) override {
    for (;;) {
      try {
        return port_->wait(step);
      } catch (const os::Interrupted&) {
        if (!abort_()) throw;
        aborted_ = true;
      }
    }
  }

  /// Whether that has happened since it was last asked.
  [[nodiscard]] bool take_aborted() { return std::exchange(aborted_, false); }

 private:
  Port<Item>* port_;
  std::function<bool()> abort_;
  bool aborted_ = false;
};

}  // namespace absenc::client
