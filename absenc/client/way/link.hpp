// SPDX-License-Identifier: Apache-2.0
// Opens the way to an encoder and owns it; a port in front of a port remembers the last exchange as it was on the wire.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absenc/client/way/address.hpp"
#include "absenc/link/port.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::client {

struct Link {
  std::unique_ptr<VirtualDevice> device;  // sim; outlives the port
  std::shared_ptr<void> owner;
  Port<std::uint8_t>* bytes = nullptr;  // exactly one is set
  Port<CanFrame>* frames = nullptr;
  Time latency{};                  // of the way to the line
  std::string place;               // "/dev/ttyUSB0 at 2500000 baud"
  std::vector<std::string> notes;  // what could be better about it
};

/// Throws os::Failure, UsageError.
[[nodiscard]] Link open_link(const EncoderAddress& uri);

/// Keeps the last request and everything that came back, echo and noise included, and lets a conversation that first
/// has to leave the encoder as it was do so when Ctrl-C comes.
template <class Item>
class WatchedPort final : public Port<Item> {
 public:
  /// The port to use from now on.
  void attach(Port<Item>& port) {
    port_ = &port;
    rate_ = 0;
  }
  /// Before a conversation: one that was broken off may have left the port at another rate than that of its encoder.
  void return_to(std::uint32_t rate) {
    if (rate_ != 0 && rate_ != rate) begin({.kind = Step<Item>::Kind::configure, .rate = rate});
  }

  Time now() override { return port_->now(); }

  void begin(const Step<Item>& step) override {
    if (step.kind == Step<Item>::Kind::transfer) {
      sent.assign(step.out.begin(), step.out.end());
      received.clear();
      clocks = step.bits;
      answer = step.answer;
      items_sent += step.out.size();
      first_received_at = Time{};
    } else if (step.kind == Step<Item>::Kind::pulse) {
      sent.clear();
      received.clear();
    }
    port_->begin(step);
    if (step.kind == Step<Item>::Kind::configure) rate_ = step.rate;
  }

  Event<Item> wait(const Step<Item>& step) override {
    if (over && over()) throw os::Ended{};
    const os::EndQuestion question(over);
    const Event<Item> event = wait_or_abort(step);
    if (event.kind == Event<Item>::Kind::sent) sent_at = event.at;
    if (event.kind == Event<Item>::Kind::line_error) ++line_errors;
    if (event.kind == Event<Item>::Kind::received) {
      if (received.empty()) first_received_at = event.at;
      received_at = event.at;
      items_received += event.items.size();
      if (received.size() < most_kept) received.insert(received.end(), event.items.begin(), event.items.end());
    }
    return event;
  }

  /// Whether the conversation was asked to end early since this was asked last.
  [[nodiscard]] bool take_aborted() { return std::exchange(aborted_, false); }

  std::function<bool()> over;   // ends all waiting
  std::function<bool()> abort;  // asks the conversation to end early; returns whether it ends by itself
  std::vector<Item> sent;
  std::vector<Item> received;
  std::size_t clocks = 0;  // of a clocked link, which sends nothing else
  Time answer{};           // how long the protocol waits for an answer
  Time sent_at{};          // end of sending
  Time first_received_at{};
  Time received_at{};  // last of `received`
  std::uint64_t items_sent = 0;
  std::uint64_t items_received = 0;
  std::uint64_t line_errors = 0;

 private:
  Event<Item> wait_or_abort(const Step<Item>& step) {
    for (;;) {
      try {
        return port_->wait(step);
      } catch (const os::Interrupted&) {
        if (!abort()) throw;
        aborted_ = true;
      }
    }
  }

  static constexpr std::size_t most_kept = 1024;
  Port<Item>* port_ = nullptr;
  std::uint32_t rate_ = 0;  // to which a conversation brought the port; 0: none did
  bool aborted_ = false;
};

}  // namespace absenc::client
