// SPDX-License-Identifier: Apache-2.0
// Counts the requests that a virtual encoder receives.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "absenc/client/emulate.hpp"
#include "absenc/client/port/address.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/link/step.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

template <class Item>
class RequestWatch final : public Machine<Item> {
 public:
  /// Takes the virtual encoder and its address; both must outlive the object.
  RequestWatch(Machine<Item>& device, const EncoderAddress& address)
      : device_(device),
        unit_(*address.unit),
        options_(address.options),
        character_(address.line.with_some_rate().byte_time()) {}

  void feed(const Event<Item>& event) override {
    look(event);
    device_.feed(event);
  }
  Step<Item> next(Time now) override {
    const Step<Item> step = device_.next(now);
    if (step.kind == Step<Item>::Kind::transfer) sending_ = true;
    return step;
  }
  [[nodiscard]] const RequestCounts& counts() const { return counts_; }

 private:
  using Kind = typename Event<Item>::Kind;
  static constexpr int most_in_reply = 24;  // assumed greatest length of a half-duplex reply, in characters

  void look(const Event<Item>& event) {
    if (unit_.link == LinkKind::clocked) {
      counts_.good += event.kind == Kind::selected ? 1 : 0;
      return;
    }
    if (event.kind == Kind::sent) sending_ = waits_ = false;
    if (event.kind == Kind::line_error) note_bad({});
    if constexpr (std::is_same_v<Item, CanFrame>) {
      if (event.kind == Kind::received) look_at_frames(event.items);
    } else {
      if (event.kind == Kind::silence) end_run();
      if (event.kind != Kind::received) return;
      if (unit_.link == LinkKind::spi) {
        look_at_transfer(event.items);
      } else {
        look_at_bytes(event.items, event.at, event.late);
      }
    }
  }

  // Frames that decoding reports as unexpected_reply belong to other devices on the bus.
  void look_at_frames(std::span<const CanFrame> frames) {
    for (const CanFrame& frame : frames) {
      const Error error = error_of({.can = &frame});
      if (error == Error::none) note_good();
      if (error != Error::none && error != Error::unexpected_reply) note_bad(to_wire_text(unit_.link, {.can = &frame}));
    }
  }

  // Counts an SPI transfer as good if it begins with a valid request, else as bad.
  void look_at_transfer(Bytes bytes) {
    const FrameEnd end = unit_.frame_end(options_, Direction::request, bytes);
    const bool good = end.kind == FrameEnd::Kind::complete && error_of({.bytes = bytes.first(end.size)}) == Error::none;
    if (good) return note_good();
    note_bad(to_hex(bytes));
  }

  // Ignores bytes after a collision, or after bytes that begin no request, until the next pause.
  void look_at_bytes(Bytes bytes, Time at, Time late) {
    const Time pause = at - character_ * static_cast<std::int64_t>(bytes.size()) - heard_at_;
    heard_at_ = at;
    // The port may report bytes late. If a reply fits into this delay, the host may have waited for the reply although
    // the bytes seem to follow without a pause.
    const bool may_have_waited = late > unit_.timing.turnaround + most_in_reply * character_;
    if (pause > 2 * character_ || may_have_waited) skipping_ = waits_ = false;
    if (sending_ && unit_.link == LinkKind::half_duplex) skipping_ = true;
    if (skipping_) return pending_.clear();
    pending_.insert(pending_.end(), bytes.begin(), bytes.end());
    while (take_one()) {
    }
  }

  // Takes one request from the pending bytes; returns false if there is no complete one.
  bool take_one() {
    if (pending_.empty()) return false;
    const FrameEnd end = unit_.frame_end(options_, Direction::request, pending_);
    if (end.kind == FrameEnd::Kind::incomplete) return false;
    if (end.kind == FrameEnd::Kind::no_frame) {
      end_run();
      skipping_ = true;
      return false;
    }
    const auto size = static_cast<std::ptrdiff_t>(std::min(end.size, pending_.size()));
    const Bytes request = Bytes(pending_).first(static_cast<std::size_t>(size));
    if (waits_) {
      note_bad(to_hex(request) + " right behind the request before, whose reply it does not wait for");
    } else if (error_of({.bytes = request}) == Error::none) {
      note_good();
      const bool is_answered = unit_.is_answered == nullptr || unit_.is_answered(options_, {.bytes = request});
      waits_ = unit_.link == LinkKind::half_duplex && is_answered;
    } else {
      note_bad(to_hex(request));
    }
    pending_.erase(pending_.begin(), pending_.begin() + size);
    return true;
  }

  void end_run() {
    if (!pending_.empty()) note_bad(to_hex(pending_));
    pending_.clear();
  }

  [[nodiscard]] Error error_of(const Frame& request) const { return unit_.check(options_, request, {}); }

  // Counts a good request. At the first one, earlier bad requests are counted separately: opening a port may produce a
  // few.
  void note_good() {
    if (++counts_.good > 1) return;
    counts_.before += counts_.bad;
    counts_.bad = 0;
    counts_.first_bad.clear();
  }
  void note_bad(std::string text) {
    if (++counts_.bad == 1) counts_.first_bad = std::move(text);
  }

  Machine<Item>& device_;
  const Unit& unit_;
  const Options& options_;
  Time character_;
  bool sending_ = false;
  Time heard_at_{};
  bool waits_ = false;  // whether the encoder has not replied yet, so that the host must wait
  // whether received bytes are ignored until the next pause
  bool skipping_ = false;
  std::vector<std::uint8_t> pending_{};
  RequestCounts counts_{};
};

}  // namespace absenc::client
