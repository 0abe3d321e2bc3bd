// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/amt21/unit.hpp"

#include <array>
#include <optional>

#include "absenc/protocol/amt21/frame.hpp"
#include "absenc/protocol/author/standstill.hpp"
#include "absenc/protocol/author/unit.hpp"

namespace absenc::amt21 {

namespace {

using namespace author;
using Line = LineOf<Protocol>;

// ---- Procedures

struct Found {
  Reading reading{};
  Request request{};
  std::int32_t turns = 0;
};

Part<std::uint32_t> look(Line& line, Found& found) {
  const Request request{Ask::position, line.format().address};
  const Reply reply = co_await line.ask(request);
  found.reading = Protocol::reading(line.format(), request, reply);
  found.reading.latched = line.sent_at();
  found.reading.received = line.received_at();
  co_return static_cast<std::uint32_t>(reply.value);
}

// Position and turns are asked for one after the other: between two positions on the same side of zero the turns hold.
Procedure read_both(Line& line, Found& found) {
  const unsigned bits = line.format().singleturn_bits;
  std::uint32_t before = co_await look(line, found);
  for (int tries = 0; tries < 3; ++tries) {
    const Reply turns = co_await line.ask({Ask::turns, line.format().address});
    const std::uint32_t now = co_await look(line, found);
    const bool passed_zero = (now < before) != (wrapped_difference(now, before, bits) < 0);
    before = now;
    if (passed_zero) continue;
    found.turns = turns.value;
    found.reading.multiturn = static_cast<std::uint64_t>(turns.value) & 0x3FFF;
    found.reading.multiturn_bits = 14;
    found.reading.multiturn_valid = true;
    co_return done;
  }
  co_return {Error::cross_check_failed, "the shaft passed zero between position and turns, three times"};
}

Procedure restart(Line& line, Found& found, Ask act) {
  const unsigned bits = line.format().singleturn_bits;
  const std::uint32_t first = co_await look(line, found);
  co_await line.rest(between_looks);
  const std::uint32_t second = co_await look(line, found);
  if (act == Ask::zero && !is_near(second, first, bits)) {
    co_return {Error::invalid_argument, "the shaft is turning: zero needs it standing still; nothing was sent"};
  }
  co_await line.ask({act, line.format().address});
  co_await line.rest(restart_time + between_looks);
  const Result<Reply> answer = co_await line.attempt({Ask::position, line.format().address});
  if (!answer) co_return {answer.error(), "it was sent, but whether the encoder obeyed could not be read"};
  const std::uint32_t now = co_await look(line, found);
  if (act == Ask::zero && !is_near(now, 0, bits)) {
    co_return {Error::cross_check_failed, "the position is still not zero"};
  }
  co_return done;
}

struct Nodes {
  std::array<bool, 64> there{};
  std::array<bool, 64> clash{};  // what came is damaged every time: two of one address, or a bad line
};

// Two answers, because one of noise is good in four.
Procedure scan(Line& line, Nodes& nodes) {
  bool any = false;
  for (unsigned i = 0; i < nodes.there.size(); ++i) {
    const Request request{Ask::position, static_cast<std::uint8_t>(4 * i)};
    const Result<Reply> first = co_await line.attempt(request);
    if (!first && first.error() == Error::timeout) continue;
    const Result<Reply> second = co_await line.attempt(request);
    nodes.there[i] = any = true;
    nodes.clash[i] = !first && !second;
  }
  if (!any) co_return {Error::timeout, "no address was answered at this rate"};
  co_return done;
}

// ---- The virtual encoder

constexpr std::int64_t counts_of(const Format& format, std::int64_t position) {
  return position >> (32 - format.singleturn_bits);
}

class Encoder final : public BusDevice<Protocol, Encoder, 2> {  // memory: the place of the zero, of 14 bits
 public:
  Encoder(const Format& format, const Shaft& shaft) : BusDevice(format, shaft) {}

  [[nodiscard]] bool is_mine(const Request& request) const { return request.address == format().address; }

  std::optional<Reply> answer(const Request& request, Time at) {
    if (request.ask == Ask::zero && format().multiturn_bits != 0) {
      violate("zero sent to an encoder with turns", at);
      return std::nullopt;
    }
    if (request.ask == Ask::zero) {
      const std::int64_t place = counts_of({.singleturn_bits = 14}, shaft(at).position);
      store(0, static_cast<std::uint8_t>(place & 0xFF));
      store(1, static_cast<std::uint8_t>(place >> 8 & 0x3F));
    }
    if (request.ask == Ask::zero || request.ask == Ask::reset) {
      restart(at + restart_time);
      return std::nullopt;
    }
    const std::int64_t counts = counts_of(format(), shaft(at).position - zero());
    if (request.ask == Ask::turns) {
      return Reply{static_cast<std::int32_t>(((counts >> format().singleturn_bits) - turns_at_start_ + 8192) & 16383) -
                   8192};
    }
    return Reply{static_cast<std::int32_t>(counts & ((1 << format().singleturn_bits) - 1))};
  }

 private:
  [[nodiscard]] std::int64_t zero() const { return (std::int64_t{stored(1)} << 8 | stored(0)) << 18; }
  // Its turns are counted by a battery that this one has; without one they would begin at 0.
  std::int64_t turns_at_start_ = 0;
};

// ---- What is declared

struct Values {
  std::uint8_t encoder_address = 0;
  std::string_view command{};
  std::optional<std::int32_t> singleturn{};
  std::optional<std::int32_t> multiturn{};
  std::optional<bool> clash{};
};

constexpr std::array<std::string_view, 5> rate_names{"2000000", "115200", "38400", "19200", "9600"};

struct Definition {
  using Protocol = amt21::Protocol;
  using Encoder = amt21::Encoder;
  static constexpr std::string_view id = "amt21", name = "CUI AMT21 (RS-485)",
                                    document = "CUI Devices AMT21, 2019-11-21";
  static constexpr LinkKind link = LinkKind::half_duplex;
  static constexpr std::size_t frames_size = 1500;

  static constexpr OptionsOf options{
      option<&Format::singleturn_bits>("singleturn_bits", "bits of the position", 12, 14, 2),
      option<&Format::multiturn_bits>("multiturn_bits", "bits of the turns; 0: none", 0, 14, 14),
      option<&Format::address>("address", "of the encoder on its line", 0, 252, 4),
      option<&Format::rate>("rate", "baud", rate_names),
      option<&Format::drops_low_bits>("drop_low_bits", "read an encoder of 14 bits as one of 12"),
  };
  static constexpr std::array models{
      ModelText{"AMT21xB", "14 bits, 2 Mbit/s", 8000, "singleturn_bits=14 multiturn_bits=0 rate=2000000"},
      ModelText{"AMT21xD", "14 bits and turns, 2 Mbit/s", 8000, "singleturn_bits=14 multiturn_bits=14 rate=2000000"},
      ModelText{"AMT21xA", "12 bits, 2 Mbit/s", 8000, "singleturn_bits=12 multiturn_bits=0 rate=2000000"},
      ModelText{"AMT21xC", "12 bits and turns, 2 Mbit/s", 8000, "singleturn_bits=12 multiturn_bits=14 rate=2000000"},
  };
  using enum FieldInfo::Kind;
  static constexpr auto fields = fields_of<Values>(
      field<&Values::encoder_address>({"encoder_address", number, "", "whose request this is"}),
      field<&Values::command>({"command", text, "", "what was asked"}),
      field<&Values::singleturn>({"singleturn", number, "counts", "position within the turn", {}, Shows::position}),
      field<&Values::multiturn>({"multiturn", number, "revolutions", "turns", {}, Shows::turns}),
      field<&Values::clash>(
          {"clash", boolean, "", "what came was damaged: two encoders of one address, or a bad line"}));

  static constexpr Request position(const Format& format) { return {Ask::position, format.address}; }
  static constexpr Request turns(const Format& format) { return {Ask::turns, format.address}; }
  template <Ask act>
  static constexpr Request act_on(const Format& format, Arguments) {
    return {act, format.address};
  }
  static constexpr std::string_view no_turns(const Format& format) {
    return format.multiturn_bits == 0 ? "this encoder has no turns (multiturn_bits=14 says that it has)" : "";
  }
  static constexpr std::string_view no_zero(const Format& format) {
    return format.multiturn_bits != 0 ? "an encoder with turns cannot be zeroed: it takes its reset only" : "";
  }
  static constexpr bool has_turns(const Format& format) { return format.multiturn_bits != 0; }
  static constexpr Command read{"position", Verb::read, 0, "position, and turns where it has them"};
  static constexpr std::array commands{
      reading<Definition, Protocol, position>(read).or_when(
          has_turns, command<Definition, Protocol, Found, read_both, act_on<Ask::position>>(read)),
      reading<Definition, Protocol, turns>({"turns", Verb::read_part, 0, "turns"}).unless(no_turns),
      command<Definition, Protocol, Found, restart, act_on<Ask::zero>, Ask::zero>(
          {"zero", Verb::zero, 0, "make this the zero of the turn: it restarts, 200 ms", {}, true, false})
          .unless(no_zero),
      command<Definition, Protocol, Found, restart, act_on<Ask::reset>, Ask::reset>(
          {"reset", Verb::run, 0, "restart it, 200 ms", {}, true, false}),
      command<Definition, Protocol, Nodes, scan, act_on<Ask::position>>(
          {"scan", Verb::scan, 0, "ask each of the 64 addresses"}),
  };
  static constexpr std::string_view source = document;
  static constexpr std::string_view d14 = "singleturn_bits=14 multiturn_bits=14";
  static constexpr std::array vectors{
      VectorText{"amt21-1", "a position", source, "", "54", "ab61",
                 "encoder_address=84 command=position singleturn=8619"},
      VectorText{"amt21-2", "one turn", source, d14, "55", "0180", "encoder_address=84 command=turns multiturn=1"},
      VectorText{"amt21-3", "two turns back", "derived", d14, "55", "fe7f",
                 "encoder_address=84 command=turns multiturn=-2"},
      VectorText{"amt21-4", "12 bits", "derived", "singleturn_bits=12", "54", "0480",
                 "encoder_address=84 command=position singleturn=1"},
      VectorText{"amt21-5", "14 bits read as 12", "derived", "singleturn_bits=12", "54", "e679", "out_of_range"},
      VectorText{"amt21-6", "K1 is wrong", "derived", "", "54", "3412", "bad_checksum"},
      VectorText{"amt21-7", "nothing is there", "derived", "", "54", "ffff", "bad_checksum"},
      VectorText{"amt21-8", "one byte", "derived", "", "54", "34", "wrong_length"},
      VectorText{"amt21-9", "zero", source, "", "565e", "", "encoder_address=84 command=zero"},
      VectorText{"amt21-10", "a reset has no reply", source, "", "5675", "3492", "wrong_length"},
  };

  static constexpr LineSettings line(const Format& format) { return format.line(); }
  static constexpr Resolution resolution(const Format& format) {
    return {format.singleturn_bits, format.multiturn_bits};
  }
  static constexpr std::size_t reply_size(const Format&, Bytes) { return 2; }
  static constexpr Request guess_request(const Format& format, Bytes) { return position(format); }
  static constexpr Values values(const Request& request) {
    return {.encoder_address = request.address, .command = ask_names[static_cast<std::size_t>(request.ask)]};
  }
  static constexpr void put(FieldSink& sink, const Format&, const Request& request) {
    fields.put(sink, values(request));
  }
  static constexpr void put(FieldSink& sink, const Format&, const Request& request, const Reply& reply) {
    Values all = values(request);
    (request.ask == Ask::turns ? all.multiturn : all.singleturn) = reply.value;
    fields.put(sink, all);
  }
  static void put(FieldSink& sink, const Format& format, const Found& found) {
    Values all = values(position(format));
    all.singleturn = static_cast<std::int32_t>(found.reading.singleturn);
    if (found.reading.multiturn_valid) all.multiturn = found.turns;
    fields.put(sink, all);
  }
  static void put(FieldSink& sink, const Format&, const Nodes& nodes) {
    for (unsigned i = 0; i < nodes.there.size(); ++i) {
      if (nodes.there[i])
        fields.put(sink, {.encoder_address = static_cast<std::uint8_t>(4 * i), .clash = nodes.clash[i]});
    }
  }
};

}  // namespace

constinit const Unit unit = UnitOf<Definition>::make();

}  // namespace absenc::amt21
