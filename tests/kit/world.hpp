// SPDX-License-Identifier: Apache-2.0
// Simulates a unit's virtual encoder and host in virtual time.
#pragma once

#include <cstring>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "absenc/host/reply_guard.hpp"
#include "absenc/sim/faulty_node.hpp"
#include "absenc/sim/line.hpp"
#include "tests/kit/frames.hpp"
#include "tests/kit/player.hpp"

namespace absenc::kit {

/// A shaft whose position the test sets.
struct SettableShaft final : Shaft {
  [[nodiscard]] ShaftState at(Time) const override { return {.position = position}; }
  std::int64_t position = 0;
};

/// Result of one conversation between host and virtual encoder.
struct ConversationResult {
  bool made = false;   // whether the unit supports the command with these options
  bool ended = false;  // whether the conversation ended before its time limit
  Error error = Error::none;
  // Whether the conversation reported a reading before any byte was received, or together with an error.
  bool premature_reading = false;
  std::string detail{};
  std::string advice{};
  ReportedFields seen{};          // all reported fields, and the last reading
  std::uint64_t damaged{};        // number of faults that changed bytes during the conversation
  std::uint64_t faults{};         // number of faults of any kind during the conversation
  std::uint64_t request_count{};  // number of requests that the encoder answered during the conversation
  Wire sent{};                    // bytes that the host has sent in its last exchange; empty on CAN
  Wire received{};

  [[nodiscard]] bool good() const { return made && ended && error == Error::none; }
};

template <class Item>
class World {
 public:
  static constexpr bool is_can = std::is_same_v<Item, CanFrame>;
  using Faulty = std::conditional_t<is_can, sim::FaultyNode, sim::FaultyDevice>;
  using Line = sim::Line<Item>;

  World(const Unit& unit, const Options& options, std::uint64_t seed)
      : unit_(unit),
        options_(options),
        device_storage_(unit.device_storage),
        host_storage_(unit.host_storage),
        device_(unit.device(options, shaft_, device_storage_).template of<Item>()) {
    if (device_ == nullptr) return;
    device_->power_on(Time{}, Device<Item>::PowerOn::skip);
    faulty_ = std::make_unique<Faulty>(*device_, sim::FaultRates{}, seed);
    line_ = std::make_unique<Line>(unit.link, settings());
    line_->attach(sim::NodeRole::device, *faulty_);
  }

  /// Returns whether the unit has a virtual encoder for these options.
  [[nodiscard]] bool made() const { return device_ != nullptr; }
  [[nodiscard]] Device<Item>& device() { return *device_; }
  [[nodiscard]] Line& line() { return *line_; }
  [[nodiscard]] const Faulty& faulty() const { return *faulty_; }
  [[nodiscard]] const Options& options() const { return options_; }
  void set_rates(const sim::FaultRates& rates) { faulty_->set_rates(rates); }
  void pass(Time time) { line_->run_until(line_->now() + time); }
  /// Sets the position of the shaft. If the encoder sends unsolicited frames, waits until those with the old position
  /// have arrived.
  void move(std::int64_t position) {
    shaft_.position = position;
    const bool unsolicited = is_can || (unit_.streams != nullptr && unit_.streams(options_));
    if (unsolicited) pass(std::chrono::milliseconds(5));
  }
  [[nodiscard]] std::int64_t place() const { return shaft_.position; }

  /// Sets the host's options, and configures the host's port to suit these options.
  void set_options(const Options& options) {
    options_ = options;
    SetRate set(settings());
    attach(set);
    line_->run(node_, line_->now());
  }

  /// Runs one conversation until it ends, or a stream has its first result, but at most for the time `limit`.
  ConversationResult run(const Command& command, Arguments arguments, Time limit = std::chrono::seconds(100)) {
    return run_in(host_storage_, command, arguments, limit);
  }
  ConversationResult run_in(std::span<std::byte> storage, const Command& command, Arguments arguments,
                            Time limit = std::chrono::seconds(100)) {
    ConversationResult result;
    Conversation<Item>* conversation = unit_.host(options_, command, arguments, storage).template of<Item>();
    if (conversation == nullptr) return result;
    result.made = true;
    result.premature_reading = conversation->reading() != nullptr;
    const std::uint64_t changed = changed_bytes();
    const std::uint64_t faults = all_faults();
    const std::uint64_t answered = device_->answer_count();
    const bool is_guarded = guarded(command);
    if (is_guarded) guard_.attach(*conversation, unit_, options_, !command.changes_encoder);
    on_emit_ = [&] {
      if (conversation->streams()) return false;
      if (conversation->error() == Error::none) conversation->report(result.seen);
      return true;
    };
    attach(is_guarded ? static_cast<Machine<Item>&>(guard_) : *conversation);
    result.ended = line_->run(node_, line_->now() + limit);
    if (is_guarded) guard_.conclude();
    on_emit_ = {};
    result.error = conversation->error();
    result.detail = conversation->detail();
    result.advice = conversation->advice();
    if (result.error == Error::none) conversation->report(result.seen);
    if (conversation->reading() != nullptr) {
      result.seen.reading = *conversation->reading();
      result.premature_reading = result.premature_reading || result.error != Error::none;
    }
    result.damaged = changed_bytes() - changed;
    result.faults = all_faults() - faults;
    result.request_count = device_->answer_count() - answered;
    if constexpr (!is_can) {
      const auto exchange = conversation->exchange();
      result.sent.assign(exchange.sent.begin(), exchange.sent.end());
      result.received.assign(exchange.received.begin(), exchange.received.end());
    }
    idle_.detach(*line_, node_);
    return result;
  }

  /// Runs a machine at the host's end for the time `limit`, or until `on_emit` returns false.
  void run(Machine<Item>& machine, Time limit, std::function<bool()> on_emit) {
    on_emit_ = std::move(on_emit);
    attach(machine);
    line_->run(node_, line_->now() + limit);
    on_emit_ = {};
    idle_.detach(*line_, node_);
  }

  /// Returns the number of faults that change bits.
  [[nodiscard]] std::uint64_t changed_bytes() const {
    using sim::FaultKind;
    std::uint64_t sum = 0;
    for (std::size_t kind = 0; kind < sim::fault_names.size(); ++kind) {
      const auto fault = static_cast<FaultKind>(kind);
      const bool keeps = fault == FaultKind::delay || fault == FaultKind::echo || fault == FaultKind::silence ||
                         fault == FaultKind::repeat;
      if (!keeps || host_clocks(unit_.link)) {
        sum += faulty_->counts()[kind];
      }
    }
    return sum;
  }

 private:
  [[nodiscard]] std::uint64_t all_faults() const {
    std::uint64_t sum = 0;
    for (const std::uint64_t count : faulty_->counts()) sum += count;
    return sum;
  }

  static constexpr std::size_t none = ~std::size_t{0};

  /// A machine at the host's end of the line that only sets the baud rate of the host's port.
  class SetRate final : public Machine<Item> {
   public:
    explicit SetRate(const LineSettings& line) : line_(line) {}
    void feed(const Event<Item>&) override {}
    Step<Item> next(Time) override {
      using Kind = typename Step<Item>::Kind;
      return {.kind = std::exchange(done_, true) ? Kind::done : Kind::configure, .rate = line_.rate};
    }

   private:
    LineSettings line_;
    bool done_ = false;
  };
  /// A machine that does nothing: it takes the host's end of the line between two conversations, because the storage
  /// of a conversation is used again.
  struct Idle final : Machine<Item> {
    void feed(const Event<Item>&) override {}
    Step<Item> next(Time) override { return {.kind = Step<Item>::Kind::done}; }
    void detach(Line& line, std::size_t node) { line.replace(node, *this); }
  };

  [[nodiscard]] LineSettings settings() const { return line_settings(unit_, options_).with_some_rate(); }
  // Returns whether the host uses a reply guard for the command, by the same rule as `host::Session`.
  [[nodiscard]] bool guarded(const Command& command) const {
    if (is_can) return command.verb == Verb::read || command.verb == Verb::read_part;
    return !host_clocks(unit_.link);
  }
  void attach(Machine<Item>& machine) {
    if (node_ == none) {
      node_ = line_->attach(sim::NodeRole::host, idle_, [this] { return !on_emit_ || on_emit_(); });
    }
    // On SPI the chip must stay deselected for a minimum time between two conversations.
    if (unit_.link == LinkKind::spi) pass(std::chrono::microseconds(20));
    line_->replace(node_, machine);
  }

  const Unit& unit_;
  Options options_;
  SettableShaft shaft_;
  std::vector<std::byte> device_storage_;
  std::vector<std::byte> host_storage_;
  Device<Item>* device_;
  std::unique_ptr<Faulty> faulty_;
  std::unique_ptr<Line> line_;
  host::ReplyGuard<Item> guard_;
  Idle idle_;
  std::function<bool()> on_emit_;
  std::size_t node_ = none;
};

}  // namespace absenc::kit
