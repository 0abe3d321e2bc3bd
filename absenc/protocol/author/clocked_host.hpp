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

/// The members that a protocol of clocked bits must have; `Request` only if a unit is declared for the protocol:
///
///   struct Protocol {
///     using Format, Reply;
///     using Request = NoRequest;
///     static constexpr unsigned most_clocks;                 // of one transfer
///     static ClockedHostTimes host_times(const Format&);
///     static unsigned clocks(const Format&);                 // of one reading; error invalid_argument if it
///                                                            // takes more bytes than `most_clocks` bits
///     static Result<Reply> decode(const Format&, BitView);
///     static Reading reading(const Format&, const Reply&);
///   };
template <class P>
concept Clocked = requires {
  P::most_clocks;
};

struct Later {};
/// Argument of the constructor of ClockedHostOf that selects a host without a first transfer: its subclass begins the
/// first one.
inline constexpr Later later{};

/// A conversation on a clocked line with decoded replies; a subclass handles the bits.
template <Clocked P>
class ClockedHostOf : public ClockedEngine {
 public:
  /// Format of the encoder: the values of its options.
  using Format = typename P::Format;
  /// C++ type of the protocol's replies.
  using Reply = typename P::Reply;

  /// Returns the format of the encoder.
  [[nodiscard]] const Format& format() const { return format_; }
  /// Returns the last valid reply; an empty one if there was none.
  [[nodiscard]] const Reply& last() const { return last_; }
  /// Returns an empty request, because hosts of clocked links send none.
  [[nodiscard]] static constexpr NoRequest request() { return {}; }
  /// Returns the position that is the result; null after an error or if there is none.
  [[nodiscard]] const Reading* reading() const override {
    return error() == Error::none && reading_.singleturn_bits != 0 ? &reading_ : nullptr;
  }
  /// Returns the position that `keep` or `conclude` stored last, even if invalid replies followed.
  [[nodiscard]] const Reading& position() const { return reading_; }
  /// Returns false: the unit's explanation of the last reply is always added to the texts of an error.
  [[nodiscard]] static constexpr bool is_alone() { return false; }

 protected:
  /// Constructs a host whose first transfer is one reading.
  explicit ClockedHostOf(const Format& format) : ClockedHostOf(format, later) { ask(); }
  /// Constructs a host that begins no transfer until its subclass begins one.
  ClockedHostOf(const Format& format, Later) : ClockedEngine(P::host_times(format), storage_), format_(format) {}
  ~ClockedHostOf() = default;

  /// Sets that a transfer of one reading follows.
  void ask() { clock(P::clocks(format_)); }
  /// Decodes the bits of a transfer, and stores a valid reply. Returns the error of decoding.
  [[nodiscard]] Error take(BitView bits) {
    const Result<Reply> reply = P::decode(format_, bits);
    if (reply) last_ = *reply;
    return reply.error();
  }
  /// Stores a valid reply and its position, with `begun_at` as the time of its latch.
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
    // The reading is constructed in place, because a copy costs time.
    new (&reading_) Reading(P::reading(format_, last_));
    reading_.latched = begun_at();
    reading_.received = received_at();
  }

  Format format_;
  Reply last_{};
  Reading reading_{};
  std::array<std::uint8_t, (P::most_clocks + 7) / 8> storage_;
};

/// Conversation that reads one position with one transfer.
template <Clocked P>
class ReadClocked : public ClockedHostOf<P> {
 public:
  /// Constructs a conversation that reads an encoder of this format.
  explicit ReadClocked(const typename P::Format& format) : ClockedHostOf<P>(format) {}

 private:
  void clocked(BitView bits) final { this->conclude(this->take(bits)); }
};

/// Returns the declaration of a command on a clocked line that `Reader` executes.
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

/// Returns the bits of a frame of a clocked link; if `frame.bits` is 0, all bits of its bytes.
[[nodiscard]] constexpr BitView to_bits(const Frame& frame) {
  return {frame.bytes, frame.bits != 0 ? frame.bits : frame.bytes.size() * 8};
}

}  // namespace absenc::author
