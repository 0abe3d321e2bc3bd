// SPDX-License-Identifier: Apache-2.0
// The engine of a clocked line with a protocol.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <new>

#include "absenc/protocol/author/clocked_engine.hpp"
#include "absenc/protocol/author/command.hpp"

namespace absenc::author {

/// What the document says of frames of clocked bits:
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

/// A position with typed replies; a subclass says what becomes of the bits.
template <Clocked P>
class ClockedHostOf : public ClockedEngine {
 public:
  /// Format of the encoder: the values of its options.
  using Format = typename P::Format;
  /// A reply of the protocol.
  using Reply = typename P::Reply;

  /// Returns the format of the encoder.
  [[nodiscard]] const Format& format() const { return format_; }
  /// The last good reply.
  [[nodiscard]] const Reply& last() const { return last_; }
  /// Returns the empty request of clocked links.
  [[nodiscard]] static constexpr NoRequest request() { return {}; }
  /// Returns the position, or null if there is none.
  [[nodiscard]] const Reading* reading() const override {
    return error() == Error::none && reading_.singleturn_bits != 0 ? &reading_ : nullptr;
  }
  /// The last that was good, whatever came after it.
  [[nodiscard]] const Reading& position() const { return reading_; }
  /// See HostOf.
  [[nodiscard]] static constexpr bool is_alone() { return false; }

 protected:
  /// Begins with a transfer at once.
  explicit ClockedHostOf(const Format& format) : ClockedHostOf(format, later) { ask(); }
  /// Nothing is clocked before the subclass does.
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
  /// This is the last good reply, whose position was taken at the first edge of the clock.
  void keep(const Reply& reply) {
    last_ = reply;
    keep();
  }
  /// Ends it, with no error by the last good reply.
  void conclude(Error error) {
    if (error == Error::none) keep();
    finish(error);
  }

 private:
  void keep() {
    new (&reading_) Reading(P::reading(format_, last_));  // made there, not copied
    reading_.latched = begun_at();
    reading_.received = received_at();
  }

  Format format_;
  Reply last_{};
  Reading reading_{};
  std::array<std::uint8_t, (P::most_clocks + 7) / 8> storage_;
};

/// A position, clocked out once.
template <Clocked P>
class ReadClocked : public ClockedHostOf<P> {
 public:
  /// Reads from an encoder of this format.
  explicit ReadClocked(const typename P::Format& format) : ClockedHostOf<P>(format) {}

 private:
  void clocked(BitView bits) final { this->conclude(this->take(bits)); }
};

/// What Reader, made of the format, reads.
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

/// The bits of a clocked frame; all of its bytes when it does not say how many count.
[[nodiscard]] constexpr BitView to_bits(const Frame& frame) {
  return {frame.bytes, frame.bits != 0 ? frame.bits : frame.bytes.size() * 8};
}

}  // namespace absenc::author
