// SPDX-License-Identifier: Apache-2.0
// Combines the engine of a clocked line with a protocol.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <new>

#include "absenc/protocol/author/clocked_engine.hpp"
#include "absenc/protocol/author/command.hpp"

namespace absenc::author {

/// The functions that a protocol of clocked bits must have:
///
///   struct Protocol {
///     using Format, Reply;
///     using Request = NoRequest;
///     static constexpr unsigned most_clocks;                 // of one transfer
///     static ClockedHostTimes host_times(const Format&);
///     static unsigned clocks(const Format&);                 // of one reading; more than `most_clocks` are refused
///     static Result<Reply> decode(const Format&, BitView);
///     static Reading reading(const Format&, const Reply&);
///   };
template <class P>
concept Clocked = requires {
  P::most_clocks;
};

struct Later {};
inline constexpr Later later{};  ///< Makes a host that begins its transfer later.

/// A conversation with typed replies; a subclass handles the bits.
template <Clocked P>
class ClockedHostOf : public ClockedEngine {
 public:
  /// Format of the encoder: the values of its options.
  using Format = typename P::Format;
  /// A reply of the protocol.
  using Reply = typename P::Reply;

  /// Returns the format of the encoder.
  [[nodiscard]] const Format& format() const { return format_; }
  /// Returns the last valid reply.
  [[nodiscard]] const Reply& last() const { return last_; }
  /// Returns the empty request of clocked links.
  [[nodiscard]] static constexpr NoRequest request() { return {}; }
  /// Returns the position, or null if there is none.
  [[nodiscard]] const Reading* reading() const override {
    return error() == Error::none && reading_.singleturn_bits != 0 ? &reading_ : nullptr;
  }
  /// Returns the position of the last valid reply, even if invalid ones followed.
  [[nodiscard]] const Reading& position() const { return reading_; }
  /// Returns false, as HostOf does.
  [[nodiscard]] static constexpr bool is_alone() { return false; }

 protected:
  /// Begins with a transfer at once.
  explicit ClockedHostOf(const Format& format) : ClockedHostOf(format, later) { ask(); }
  /// Clocks nothing until the subclass does.
  ClockedHostOf(const Format& format, Later) : ClockedEngine(P::host_times(format), storage_), format_(format) {}
  ~ClockedHostOf() = default;

  /// Begins a transfer.
  void ask() { clock(P::clocks(format_)); }
  /// Takes the bits of a transfer; returns the first error.
  [[nodiscard]] Error take(BitView bits) {
    const Result<Reply> reply = P::decode(format_, bits);
    if (reply) last_ = *reply;
    return reply.error();
  }
  /// Stores a valid reply, whose position was latched at the first edge of the clock.
  void keep(const Reply& reply) {
    last_ = reply;
    keep();
  }
  /// Ends the conversation. Without an error the last valid reply is its result.
  void conclude(Error error) {
    if (error == Error::none) keep();
    finish(error);
  }

 private:
  void keep() {
    new (&reading_) Reading(P::reading(format_, last_));  // constructed in place, not copied
    reading_.latched = begun_at();
    reading_.received = received_at();
  }

  Format format_;
  Reply last_{};
  Reading reading_{};
  std::array<std::uint8_t, (P::most_clocks + 7) / 8> storage_;
};

/// Reads one position with one transfer.
template <Clocked P>
class ReadClocked : public ClockedHostOf<P> {
 public:
  /// Reads from an encoder of this format.
  explicit ReadClocked(const typename P::Format& format) : ClockedHostOf<P>(format) {}

 private:
  void clocked(BitView bits) final { this->conclude(this->take(bits)); }
};

/// Declares a command that Reader carries out, constructed from the format.
template <const auto& unit_report, class Reader = ReadClocked<ReportedProtocol<unit_report>>>
[[nodiscard]] constexpr CommandOf<ReportedProtocol<unit_report>> clocked_reading(const Command& info) {
  using Format = typename ReportedProtocol<unit_report>::Format;
  using Made = Reported<unit_report, Reader>;
  return {.info = info,
          .request = nullptr,
          .make = [](const Format& format, Arguments,
                     std::span<std::byte> storage) { return make_host<Made>(storage, format); },
          .size = sizeof(Made)};
}

/// Returns the bits of a clocked frame; all bits of its bytes if `bits` is 0.
[[nodiscard]] constexpr BitView to_bits(const Frame& frame) {
  return {frame.bytes, frame.bits != 0 ? frame.bits : frame.bytes.size() * 8};
}

}  // namespace absenc::author
