// SPDX-License-Identifier: Apache-2.0
// A complete toy unit with a selectable mistake, which the kit must find.
#pragma once

#include <array>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/make.hpp"
#include "absenc/sim/place.hpp"

namespace absenc::kit::toy {

enum class Mistake : std::uint8_t {
  none,
  weak_check,         // the toy has no mistake, but weak parity bits, which accept a quarter of the wrong words
  accepts_two_bytes,  // the host takes the first two bytes it receives for the reply
  ignores_checksum,   // the host ignores the checksum
  accepts_excess,     // the host accepts bytes that begin with a good reply, and leaves the excess for the next command
  reports_nothing,    // the host reports no field of a good reply
  has_no_request,     // `encode` fails for every command
  unread_vectors,     // no command sends the request of the vectors
  stale_reply,        // the virtual encoder returns the position of the previous request
  wrong_position,     // the virtual encoder's position is one count too high
  needs_more_storage,       // `host_storage` is smaller than the host needs
  overflows_storage,        // the host is constructed even if the storage is too small
  ignores_last_byte,        // `decode` ignores the last byte of a frame
  differs_among_many,       // the decoder of many frames refuses a good frame
  wrong_bit_positions,      // the stated bit positions of the position field cover only a part of its bits
  ignores_condition,        // the virtual encoder ignores its condition
  never_ends,               // the host waits for ever if no byte arrives
  accepts_all_arguments,    // `encode` accepts any arguments
  late_capture_timeout,     // captures wait longer for a reply than any host does
  zeroes_invalid_position,  // every position is invalid, and the zero command sets the zero nevertheless
};

inline constexpr std::uint8_t ask = 0x5A;
inline constexpr Time answer_limit = std::chrono::microseconds(200);
inline constexpr Time gap = std::chrono::microseconds(30);

constexpr std::uint16_t crc16(Bytes bytes) {
  std::uint16_t crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc = static_cast<std::uint16_t>(crc ^ byte << 8);
    for (unsigned i = 0; i < 8; ++i)
      crc = static_cast<std::uint16_t>((crc & 0x8000) != 0 ? crc << 1 ^ 0x1021 : crc << 1);
  }
  return crc;
}

constexpr std::uint16_t parities(unsigned position) {
  unsigned odd = 3;
  for (unsigned bit = 0; bit < 14; ++bit) odd ^= (position >> bit & 1) << bit % 2;
  return static_cast<std::uint16_t>(position | odd << 14);
}

inline constexpr std::array<FieldInfo, 1> fields{
    {{"singleturn", FieldInfo::Kind::number, "counts", "position", {}, Role::position}}};

template <Mistake mistake>
struct Toy {
  static constexpr bool weak = mistake == Mistake::weak_check;
  static constexpr std::size_t length = weak ? 2 : 4;
  static constexpr unsigned bits = weak ? 14 : 16;

  static constexpr std::array<std::uint8_t, length> encoded(unsigned position) {
    const unsigned word = weak ? parities(position) : position;
    std::array<std::uint8_t, length> bytes{static_cast<std::uint8_t>(word), static_cast<std::uint8_t>(word >> 8)};
    if constexpr (!weak) {
      const std::uint16_t crc = crc16(Bytes(bytes).first(2));
      bytes[2] = static_cast<std::uint8_t>(crc >> 8);
      bytes[3] = static_cast<std::uint8_t>(crc);
    }
    return bytes;
  }
  static Result<unsigned> position_of(Bytes reply) {
    if (reply.size() != length) return Error::wrong_length;
    const unsigned position = (reply[0] | unsigned{reply[1]} << 8) & low_mask(bits);
    const auto wanted = encoded(position);
    const std::size_t checked = mistake == Mistake::ignores_last_byte ? length - 1 : length;
    for (std::size_t i = 0; i < checked; ++i) {
      if (reply[i] != wanted[i]) return Error::bad_checksum;
    }
    return position;
  }
  static Reading reading_of(unsigned position) {
    return {.singleturn = position,
            .singleturn_bits = bits,
            .singleturn_valid_bits = mistake == Mistake::zeroes_invalid_position ? 0 : bits};
  }

  class Host final : public Conversation<std::uint8_t> {
   public:
    void feed(const Event<std::uint8_t>& event) override {
      using Kind = Event<std::uint8_t>::Kind;
      if (event.kind == Kind::sent) state_ = State::receiving;
      if (state_ != State::receiving) return;
      if (event.kind == Kind::received) {
        for (const std::uint8_t byte : event.items) {
          if (size_ < received_bytes_.size()) received_bytes_[size_++] = byte;
        }
        if (mistake == Mistake::accepts_two_bytes && size_ >= 2)
          take(received_bytes_[0] | unsigned{received_bytes_[1]} << 8);
        if (mistake == Mistake::accepts_excess && size_ >= length) conclude(length);
      }
      if (event.kind == Kind::silence && !(mistake == Mistake::never_ends && size_ == 0)) conclude(size_);
    }
    Step<std::uint8_t> next(Time) override {
      using Kind = Step<std::uint8_t>::Kind;
      static constexpr std::array request{ask};
      if (state_ == State::done) return {.kind = Kind::done};
      const bool ready = state_ == State::ready;
      if (ready) state_ = State::sending;
      return {.kind = ready ? Kind::transfer : Kind::wait, .out = request, .answer = answer_limit, .gap = gap};
    }
    [[nodiscard]] Error error() const override { return error_; }
    [[nodiscard]] const Reading* reading() const override {
      const bool good = state_ == State::done && error_ == Error::none;
      return good && mistake != Mistake::reports_nothing ? &reading_ : nullptr;
    }
    void report(FieldSink& sink) const override {
      if (reading() == nullptr) return;
      sink.put({&fields[0], static_cast<std::int64_t>(reading_.singleturn)});
    }
    [[nodiscard]] Exchange<std::uint8_t> exchange() const override { return {}; }

   private:
    enum class State : std::uint8_t { ready, sending, receiving, done };

    void take(unsigned position) {
      reading_ = reading_of(position);
      error_ = Error::none;
      state_ = State::done;
    }
    void conclude(std::size_t size) {
      state_ = State::done;
      error_ = Error::timeout;
      if (size == 0) return;
      if (mistake == Mistake::ignores_checksum && size >= 2)
        return take(received_bytes_[0] | unsigned{received_bytes_[1]} << 8);
      const Result<unsigned> position = position_of(Bytes(received_bytes_).first(size));
      if (position) return take(*position);
      error_ = position.error();
    }

    State state_ = State::ready;
    Error error_ = Error::none;
    Reading reading_{};
    std::array<std::uint8_t, 16> received_bytes_{};
    std::size_t size_ = 0;
  };

  class Encoder final : public Device<std::uint8_t> {
   public:
    explicit Encoder(const Shaft& shaft) : shaft_(shaft) {}
    void feed(const Event<std::uint8_t>& event) override {
      using Kind = Event<std::uint8_t>::Kind;
      if (event.kind == Kind::received && event.items[0] == ask) {
        const auto now = static_cast<unsigned>(sim::counts_at(shaft_.at(event.at).position, bits));
        sent_position_ = mistake == Mistake::stale_reply ? previous_position_
                                                         : now + offset_ + (mistake == Mistake::wrong_position ? 1 : 0);
        previous_position_ = now;
        reply_at_ = event.at + std::chrono::microseconds(3);
        reply_due_ = true;
        ++answer_count_;
      }
    }
    Step<std::uint8_t> next(Time) override {
      if (!reply_due_) return {};
      reply_due_ = false;
      reply_ = encoded(static_cast<unsigned>(sent_position_ & low_mask(bits)));
      return {.kind = Step<std::uint8_t>::Kind::transfer, .out = reply_, .at = reply_at_};
    }
    void power_on(Time, PowerOn) override {}
    void power_off(Time) override {}
    void raise_alarms(std::uint32_t) override {}
    void lower_alarms(std::uint32_t) override {}
    void set_condition(std::size_t, std::int64_t value, Time) override {
      if (mistake != Mistake::ignores_condition) offset_ = static_cast<unsigned>(value);
    }
    [[nodiscard]] MutableBytes memory() override { return {}; }
    [[nodiscard]] std::uint32_t memory_version() const override { return 0; }
    [[nodiscard]] std::span<const Violation> violations() const override { return {}; }
    [[nodiscard]] std::uint32_t violation_count() const override { return 0; }
    [[nodiscard]] std::uint64_t answer_count() const override { return answer_count_; }

   private:
    const Shaft& shaft_;
    unsigned sent_position_ = 0;
    unsigned offset_ = 0;  // value of the toy's condition, in counts; the toy adds it to the position
    unsigned previous_position_ = 0;
    Time reply_at_{};
    bool reply_due_ = false;
    std::uint64_t answer_count_ = 0;
    std::array<std::uint8_t, length> reply_{};
  };

  static Error decode(const Options&, Frame request, Frame reply, FieldSink& sink) {
    if (reply.empty()) {
      if (request.bytes.size() != 1 || request.bytes[0] != ask) return Error::unexpected_reply;
      static constexpr FieldInfo command{"command", FieldInfo::Kind::number, "", "what is asked"};
      sink.put({&command, ask});
      return Error::none;
    }
    const Result<unsigned> position = position_of(reply.bytes);
    if (!position) return position.error();
    sink.put({&fields[0], static_cast<std::int64_t>(*position)});
    sink.put_reading(reading_of(*position));
    return Error::none;
  }
  struct Refusing final : FrameDecoder {
    Error decode(Frame, Frame, FieldSink&) const override { return Error::bad_checksum; }
  };
  static FrameDecoder* decoder(const Options&, std::span<std::byte> storage) { return new (storage.data()) Refusing; }
  static bool takes(Arguments arguments) { return arguments.empty() || mistake == Mistake::accepts_all_arguments; }
  static Result<std::size_t> encode(const Options&, const Command&, Arguments arguments, MutableBytes request) {
    if (mistake == Mistake::has_no_request || !takes(arguments)) return Error::invalid_argument;
    if (request.empty()) return Error::buffer_too_small;
    request[0] = ask;
    return std::size_t{1};
  }
  static FrameEnd frame_end(const Options&, Direction direction, Bytes bytes) {
    const std::size_t size = direction == Direction::request ? 1 : length;
    return {bytes.size() < size ? FrameEnd::Kind::incomplete : FrameEnd::Kind::complete, size};
  }
  static BitRanges places(const Options&, Frame, Frame, const FieldInfo& field) {
    BitRanges ranges;
    if (&field == &fields[0]) ranges.push_back({0, mistake == Mistake::wrong_bit_positions ? bits - 4 : bits});
    return ranges;
  }
  static Any<Conversation> host(const Options&, const Command&, Arguments arguments, std::span<std::byte> storage) {
    if (!takes(arguments)) return {};
    if (mistake == Mistake::overflows_storage) return {.bytes = new (storage.data()) Host};
    return make_host<Host>(storage);
  }
  static Any<Device> device(const Options&, const Shaft& shaft, std::span<std::byte> storage) {
    if (storage.size() < sizeof(Encoder)) return {};
    return {.bytes = new (storage.data()) Encoder(shaft)};
  }
  static Resolution resolution(const Options&) { return {bits, 0}; }

  static constexpr std::array<Model, 1> models{{{"toy", "", 0, {}}}};
  static constexpr std::array<Command, 2> commands{
      {{"position", Verb::read, 0, "position"}, {"zero", Verb::zero, 0, "zero", {}, true, false}}};
  static constexpr std::array<Condition, 1> conditions{{{"eccentricity", "counts", "beside its shaft", 0, 100, 0}}};
  static constexpr std::array<Expected, 1> expected{{{"singleturn", weak ? 8619 : 0x1234}}};
  static constexpr std::array<std::uint8_t, 1> request_bytes{mistake == Mistake::unread_vectors ? std::uint8_t{0x5B}
                                                                                                : ask};
  static constexpr std::array<std::uint8_t, length> reply_bytes = encoded(weak ? 8619 : 0x1234);
  static_assert(!weak || (reply_bytes[0] == 0xAB && reply_bytes[1] == 0x61));
  static constexpr std::array<Vector, 1> vectors{{{"toy-1", "", "", "", request_bytes, reply_bytes, expected}}};
};

template <Mistake mistake>
inline constexpr Unit unit = [] {
  using Made = Toy<mistake>;
  Unit made{};
  made.id = "toy";
  made.link = LinkKind::half_duplex;
  made.line = {.rate = 1'000'000};
  made.timing = {.turnaround_limit = mistake == Mistake::late_capture_timeout ? 10 * answer_limit : answer_limit};
  made.models = Made::models;
  made.fields = fields;
  made.commands = std::span(Made::commands).first(mistake == Mistake::zeroes_invalid_position ? 2 : 1);
  made.conditions = Made::conditions;
  made.vectors = Made::vectors;
  made.host_storage = sizeof(typename Made::Host) - (mistake == Mistake::needs_more_storage ? 8 : 0);
  made.device_storage = sizeof(typename Made::Encoder);
  made.decode = Made::decode;
  if (mistake == Mistake::differs_among_many) {
    made.decoder = Made::decoder;
    made.decoder_storage = sizeof(typename Made::Refusing);
  }
  made.encode = Made::encode;
  made.frame_end = Made::frame_end;
  made.host = Made::host;
  made.bits = Made::places;
  made.device = Made::device;
  made.resolution = Made::resolution;
  return made;
}();

/// A descriptor without functions; the role `forgotten` is missing from what it declares.
template <Role forgotten>
struct Declared {
  static constexpr Role unless_forgotten(Role role) { return role == forgotten ? Role::other : role; }
  using enum FieldInfo::Kind;
  static constexpr std::array<FieldInfo, 4> fields{
      {{"singleturn", number, "counts", "position", {}, unless_forgotten(Role::position)},
       {"encoder", number, "", "who answers", {}, unless_forgotten(Role::encoder)},
       {"clash", boolean, "", "two of them do", {}, unless_forgotten(Role::clash)},
       {"value", number, "", "a byte", {}, unless_forgotten(Role::value)}}};
  static constexpr std::array<Option, 1> options{
      {{.name = "encoder", .meaning = "", .default_value = 0, .maximum = 7, .role = unless_forgotten(Role::encoder)}}};
  static constexpr std::array<Argument, 2> arguments{
      {{"address", "of a byte", 0, 255, 0, true, unless_forgotten(Role::address)},
       {"value", "of a byte", 0, 255, 0, true, unless_forgotten(Role::value)}}};
  static constexpr std::array<Command, 4> commands{
      {{"position", Verb::read, 0, "position"},
       {"scan", Verb::scan, 1, "who answers"},
       {"memory-read", Verb::memory_read, 2, "a byte", std::span(arguments).first(1)},
       {"memory-write", Verb::memory_write, 3, "a byte", arguments, true}}};
  static constexpr Unit unit = [] {
    Unit made{};
    made.id = "toy";
    made.fields = fields;
    made.options = options;
    made.commands = commands;
    return made;
  }();
};

}  // namespace absenc::kit::toy
