// SPDX-License-Identifier: Apache-2.0
// Test helper: random conversations of a unit's host and virtual encoder in virtual time.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absenc/capture/signal.hpp"
#include "absenc/core/bit_view.hpp"
#include "absenc/protocol/unit.hpp"
#include "absenc/sim/bench_test.hpp"
#include "absenc/sim/faults.hpp"
#include "absenc/sim/line.hpp"
#include "absenc/sim/random.hpp"
#include "absenc/sim/waveform.hpp"

namespace absenc::capture::testing {

inline Options options_of(const Unit& unit, const std::vector<OptionText>& settings = {}) {
  Options options;
  if (resolve_options(unit, {}, settings, options).kind != OptionError::Kind::none) std::abort();
  return options;
}

/// Returns the line settings of `unit`, with a default rate if the unit's document states none.
inline LineSettings line_of(const Unit& unit) { return unit.line.with_some_rate(); }

/// Bytes that the host or the encoder sent as one message. Begin and end are in ticks.
struct Transmission {
  sim::NodeRole by;
  std::vector<std::uint8_t> bytes;
  Tick begin;
  Tick end;
};

struct TalkRecord {
  std::vector<Character> characters;
  std::vector<Transmission> transmissions;
  std::vector<Burst> bursts;
  bool collided = false;
};

/// Runs conversations between host and virtual encoder. Ticks are nanoseconds.
class Talker {
 public:
  Talker(const Unit& unit, const Options& options, const sim::FaultRates& rates, std::uint64_t seed)
      : unit_(unit),
        options_(options),
        random_(seed),
        device_storage_(unit.device_storage),
        host_storage_(unit.host_storage),
        device_(unit.device(options, shaft_, device_storage_).bytes),
        faulty_(*device_, rates, seed),
        line_(unit.link, line_of(unit)) {
    device_->power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    line_.attach(sim::NodeRole::device, faulty_);
    line_.observe([this](std::size_t sender, Time start, Time end, std::uint8_t byte) {
      if (waveform_ != nullptr) waveform_->byte(line_.role(sender), start, end, byte);
      record(line_.role(sender), static_cast<Tick>(start.count()), static_cast<Tick>(end.count()), byte);
    });
    line_.observe_transfers([this](const auto& transfer) {
      if (waveform_ != nullptr) waveform_->transfer(transfer);
      record(transfer);
    });
    for (const Command& command : unit.commands) {
      if (!command.changes_encoder && command.repeatable) commands_.push_back(&command);
    }
  }

  /// Runs one random command and returns what host and encoder sent.
  TalkRecord talk() {
    record_ = {};
    shaft_.put(static_cast<std::int64_t>(random_.below(60'000)), static_cast<std::int64_t>(random_.below(4096)));
    const Command& command = *commands_[random_.below(commands_.size())];
    std::vector<std::int64_t> arguments;
    for (const Argument& argument : command.arguments) {
      const std::int64_t minimum = argument.minimum;
      arguments.push_back(argument.required ? minimum + static_cast<std::int64_t>(random_.below(4))
                                            : argument.default_value);
    }
    streams_ = command.verb == Verb::read;
    Conversation<std::uint8_t>* conversation = unit_.host(options_, command, arguments, host_storage_).bytes;
    if (conversation != nullptr) {
      if (host_) {
        line_.replace(*host_, *conversation);
      } else {
        // If the encoder streams, the host stops a `read` command after its first result.
        host_ = line_.attach(sim::NodeRole::host, *conversation, [this] { return !streams_; });
      }
      line_.run(*host_, line_.now() + std::chrono::seconds(30));
    }
    const bool may_come_late = unit_.link == LinkKind::half_duplex || unit_.link == LinkKind::full_duplex;
    const Time pause = may_come_late ? unit_.timing.turnaround_limit : Time{};
    line_.run_until(line_.now() + pause + std::chrono::milliseconds(1));
    return std::move(record_);
  }

  /// Draws in `waveform` all bytes (on clocked links: bits) that host and encoder send from now on. `waveform` must
  /// outlive this object.
  void draw(sim::Waveform& waveform) { waveform_ = &waveform; }

  [[nodiscard]] Tick now() const { return static_cast<Tick>(line_.now().count()); }
  [[nodiscard]] sim::Random& random() { return random_; }
  [[nodiscard]] const sim::FaultyDevice& faulty() const { return faulty_; }

 private:
  void record(sim::NodeRole by, Tick begin, Tick end, std::uint8_t byte) {
    const bool is_other_wire = unit_.link == LinkKind::full_duplex && by == sim::NodeRole::device;
    record_.characters.push_back(
        {.begin = begin, .end = end, .value = byte, .channel = static_cast<std::uint8_t>(is_other_wire ? 1 : 0)});
    const auto last = std::find_if(record_.transmissions.rbegin(), record_.transmissions.rend(),
                                   [&](const Transmission& one) { return one.by == by; });
    if (unit_.link == LinkKind::half_duplex) {
      for (const Transmission& one : record_.transmissions)
        record_.collided = record_.collided || (one.by != by && one.end > begin);
    }
    // If a request is sent in several frames, the host pauses between these frames.
    const Tick pause = by == sim::NodeRole::host ? static_cast<Tick>(unit_.timing.frame_pause.count()) : 0;
    const bool is_newest = last == record_.transmissions.rbegin();
    const bool goes_on =
        last != record_.transmissions.rend() && (last->end == begin || (is_newest && begin - last->end <= pause));
    if (goes_on) {
      last->bytes.push_back(byte);
      last->end = end;
    } else {
      record_.transmissions.push_back({by, {byte}, begin, end});
    }
  }

  // A burst on a bidirectional link begins with a sample of the idle line; its last bit follows the last clock.
  void record_both_ways(const sim::Line<std::uint8_t>::Transfer& transfer) {
    if (transfer.goes_on_from == never) {
      Burst burst{};
      burst.begin = static_cast<Tick>(transfer.start.count());
      burst.has_last = burst.last = true;
      record_.bursts.push_back(burst);
    }
    Burst& burst = record_.bursts.back();
    burst.end = static_cast<Tick>(transfer.end.count());
    for (std::size_t i = 0; i < transfer.bits; ++i) {
      if (burst.bits % 8 == 0) burst.in.push_back(0);
      if (burst.last) burst.in.back() = static_cast<std::uint8_t>(burst.in.back() | 0x80u >> burst.bits % 8);
      ++burst.bits;
      burst.last = i < transfer.out_bits ? BitView{transfer.out, transfer.out_bits}[i]
                                         : BitView{transfer.in, transfer.bits}[i - transfer.out_bits];
    }
  }

  void record(const sim::Line<std::uint8_t>::Transfer& transfer) {
    if (unit_.link == LinkKind::clocked_bidirectional) return record_both_ways(transfer);
    std::size_t idle = unit_.link == LinkKind::clocked ? unit_.line.idle_clocks : 0;
    const bool held_low = transfer.held_low != never;
    if (held_low) {  // the rise of the clock line before the word samples one bit of the idle line
      ++idle;
      if (!record_.bursts.empty()) record_.bursts.back().low_after = true;
    }
    Burst burst{.begin = static_cast<Tick>(transfer.start.count()),
                .end = static_cast<Tick>(transfer.end.count()),
                .bits = transfer.bits + idle,
                .in = std::vector<std::uint8_t>((transfer.bits + idle + 7) / 8),
                .out = {},
                .low_before = held_low};
    if (unit_.link == LinkKind::spi) burst.out.assign(transfer.out.begin(), transfer.out.end());
    for (std::size_t i = 0; i < burst.bits; ++i) {
      const bool bit = i < idle || (transfer.in[(i - idle) / 8] >> (7 - (i - idle) % 8) & 1) != 0;
      if (bit) burst.in[i / 8] = static_cast<std::uint8_t>(burst.in[i / 8] | 0x80u >> i % 8);
    }
    record_.bursts.push_back(std::move(burst));
  }

  const Unit& unit_;
  Options options_;
  bool streams_ = false;
  sim::Random random_;
  sim::testing::TestShaft<12> shaft_;
  std::vector<std::byte> device_storage_;
  std::vector<std::byte> host_storage_;
  Device<std::uint8_t>* device_;
  sim::FaultyDevice faulty_;
  sim::Line<std::uint8_t> line_;
  sim::Waveform* waveform_ = nullptr;
  std::optional<std::size_t> host_;
  std::vector<const Command*> commands_;
  TalkRecord record_;
};

}  // namespace absenc::capture::testing
