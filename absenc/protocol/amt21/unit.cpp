// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/amt21/unit.hpp"

#include <array>
#include <optional>

#include "absenc/protocol/author/bits.hpp"
#include "absenc/protocol/author/scan.hpp"
#include "absenc/protocol/author/unit.hpp"

namespace absenc::amt21 {

namespace {

using namespace author;
using Dialog = DialogOf<Protocol>;

// ---- Procedures

struct PositionAndTurns : Looked<Protocol> {
  std::optional<std::int32_t> turns{};
};

template <Ask ask>
constexpr Request request(const Format& format, Arguments = {}) {
  return {ask, format.address};
}
constexpr Request request_to(std::size_t node) { return {Ask::position, static_cast<std::uint8_t>(4 * node)}; }
constexpr std::size_t addresses = 64;

// Reads position, turns and position again. The turns are valid only if the shaft did not pass zero between the two
// positions.
Procedure read_both(Dialog& dialog, PositionAndTurns& found) {
  const Format format = dialog.format();
  std::uint64_t before = co_await look(dialog, found, request<Ask::position>(format));
  for (int tries = 0; tries < 3; ++tries) {
    const Reply counted = co_await dialog.ask(request<Ask::turns>(format));
    const std::uint64_t now = co_await look(dialog, found, request<Ask::position>(format));
    const bool passed_zero = (now < before) != (wrapped_difference(now, before, format.singleturn_bits) < 0);
    before = now;
    if (passed_zero) continue;
    found.turns = counted.value;
    const Reading turns = Protocol::reading(format, request<Ask::turns>(format), counted);
    found.reading.multiturn = turns.multiturn;
    found.reading.multiturn_bits = turns.multiturn_bits;
    found.reading.multiturn_signed = turns.multiturn_signed;
    found.reading.multiturn_valid = true;
    co_return done;
  }
  co_return {Error::cross_check_failed, "the shaft passed zero between position and turns, three times"};
}

Procedure restart(Dialog& dialog, PositionAndTurns& found, Ask command_kind) {
  if (command_kind == Ask::zero) {
    co_await may_set_zero(dialog, found, request<Ask::position>(dialog.format()));
  } else {
    co_await look(dialog, found, request<Ask::position>(dialog.format()));
  }
  const std::uint64_t before = found.reading.singleturn;
  co_await dialog.ask({command_kind, dialog.format().address}).changes();
  co_await dialog.rest(restart_time + between_looks);
  const Result<Reply> answer = co_await dialog.attempt(request<Ask::position>(dialog.format()));
  if (!answer) co_return {answer.error(), "it was sent, but whether the encoder obeyed could not be read"};
  const std::uint64_t now = co_await look(dialog, found, request<Ask::position>(dialog.format()));
  const unsigned bits = dialog.format().singleturn_bits;
  if (command_kind == Ask::zero) note_zero(dialog, before, now, bits, standstill_millidegrees);
  if (command_kind == Ask::zero && !is_near(now, 0, bits)) {
    co_return {Error::cross_check_failed, "the position is still not zero",
               "hold the shaft still, then `absenc zero` again"};
  }
  co_return done;
}

// ---- The virtual encoder

class Encoder final : public BusDevice<Protocol, Encoder, 4> {  // 4 bytes of memory, which hold the encoder's zero
 public:
  using BusDevice::BusDevice;
  [[nodiscard]] bool is_mine(const Request& asked) const { return asked.address == format().address; }

  std::optional<Reply> answer(const Request& asked, Time at) {
    const unsigned bits = format().singleturn_bits;
    if (asked.ask == Ask::position) return Reply{static_cast<std::int32_t>(counts(at, bits, 0) & ((1 << bits) - 1))};
    if (asked.ask == Ask::turns) {
      return Reply{static_cast<std::int32_t>(wrapped_difference(turns(at) - lost_turns_, 0, turns_bits))};
    }
    if (asked.ask == Ask::zero) {
      if (!expect(format().multiturn_bits == 0, "zero sent to an encoder with turns", at)) return std::nullopt;
      store_zero(at, 0);
    }
    restart(at + restart_time);
    return std::nullopt;
  }
  void set_condition(std::size_t, std::int64_t value, Time) override { battery_ = value != 0; }

 private:
  void started(Time at) override {
    if (!battery_) lost_turns_ = turns(at);
  }
  [[nodiscard]] std::uint64_t turns(Time at) const { return static_cast<std::uint64_t>(counts(at, 0, 0)); }

  bool battery_ = true;
  // Number of turns of the shaft at the last start without a battery, which set the reported turns to 0.
  std::uint64_t lost_turns_ = 0;
};

// ---- Options and fields

struct Values {
  std::uint8_t encoder_address = 0;
  std::string_view command{};
  std::optional<std::int32_t> singleturn{};
  std::optional<std::int32_t> multiturn{};
  std::optional<bool> clash{};
};

constexpr std::array<std::string_view, 5> rate_names{"2000000", "115200", "38400", "19200", "9600"};

constexpr auto options = OptionsOf{
    option<&Format::singleturn_bits>("singleturn_bits", "bits of the position", 12, 14, 2),
    option<&Format::multiturn_bits>("multiturn_bits", "bits of the turns; 0: none", 0, 14, 14),
    with_role<Role::encoder>(option<&Format::address>("address", "of the encoder on its line", 0, 252, 4)),
    with_role<Role::rate>(option<&Format::rate>("rate", "baud", rate_names)),
    option<&Format::drops_low_bits>("drop_low_bits", "read an encoder of 14 bits as one of 12"),
};
constexpr auto models = std::array{
    ModelText{"AMT21xB", "14 bits, 2 Mbit/s", 4000, "singleturn_bits=14 multiturn_bits=0 rate=2000000"},
    ModelText{"AMT21xD", "14 bits and turns, 2 Mbit/s", 4000, "singleturn_bits=14 multiturn_bits=14 rate=2000000"},
    ModelText{"AMT21xA", "12 bits, 2 Mbit/s", 8000, "singleturn_bits=12 multiturn_bits=0 rate=2000000"},
    ModelText{"AMT21xC", "12 bits and turns, 2 Mbit/s", 8000, "singleturn_bits=12 multiturn_bits=14 rate=2000000"},
    ModelText{"AMT21xF", "14 bits, rate to be set", 4000, "singleturn_bits=14 multiturn_bits=0 rate=115200"},
    ModelText{"AMT21xH", "14 bits and turns, rate to be set", 4000, "singleturn_bits=14 multiturn_bits=14 rate=115200"},
    ModelText{"AMT21xE", "12 bits, rate to be set", 8000, "singleturn_bits=12 multiturn_bits=0 rate=115200"},
    ModelText{"AMT21xG", "12 bits and turns, rate to be set", 8000, "singleturn_bits=12 multiturn_bits=14 rate=115200"},
};
constexpr auto fields = fields_of<Values>(
    field<&Values::encoder_address>("encoder_address", "", "address of the request", Role::encoder),
    field<&Values::command>("command", "", "command of the request", Role::exchange),
    field<&Values::singleturn>("singleturn", "counts", "position within the turn", Role::position),
    field<&Values::multiturn>("multiturn", "revolutions", "turns", Role::turns),
    field<&Values::clash>("clash", "", "the reply was damaged: two encoders of one address, or a bad line",
                          Role::clash));

// ---- Reported fields

constexpr Values values_of_request(const Format&, const Request& asked) {
  constexpr std::array<std::string_view, 2> answered{"position", "turns"};
  return {.encoder_address = asked.address,
          .command = asked.is_answered()      ? answered[static_cast<std::size_t>(asked.ask)]
                     : asked.ask == Ask::zero ? "zero"
                                              : "reset"};
}
constexpr Values values_of_reply(const Format& format, const Request& asked, const Reply& reply) {
  Values all = values_of_request(format, asked);
  (asked.ask == Ask::turns ? all.multiturn : all.singleturn) = reply.value;
  return all;
}
constexpr Values values_of_found(const Format& format, const PositionAndTurns& found) {
  Values all = values_of_reply(format, found.request, found.reply);
  all.multiturn = found.turns;
  return all;
}
void put_nodes(FieldSink& sink, const Format&, const Nodes<addresses>& nodes) {
  for (std::size_t i = 0; i < addresses; ++i) {
    if (nodes.there[i]) fields.put(sink, {.encoder_address = request_to(i).address, .clash = nodes.clash[i]});
  }
}
BitRanges bits_of_field(const Options& values, Frame, Frame, const FieldInfo& field) {
  const unsigned singleturn = options.format(values).singleturn_bits;
  if (&field == fields.of<&Values::singleturn>()) return bits_of(0, 14 - singleturn, singleturn);
  return bits_of(0, 0, &field == fields.of<&Values::multiturn>() ? turns_bits : 0);
}

constexpr Report<Protocol> report{
    .put_request = put_values<fields, values_of_request>,
    .put_reply = put_values<fields, values_of_reply>,
};
constexpr Finding<Format, PositionAndTurns> found{.put = put_values<fields, values_of_found>};
constexpr Finding<Format, Nodes<addresses>> nodes{.put = put_nodes};

// ---- Commands

constexpr std::string_view no_turns(const Format& format) {
  return format.multiturn_bits == 0 ? "this encoder has no turns (multiturn_bits=14 says that it has)" : "";
}
constexpr std::string_view no_zero(const Format& format) {
  return format.multiturn_bits != 0 ? "an encoder with turns cannot be zeroed: it takes its reset only" : "";
}
constexpr bool has_turns(const Format& format) { return format.multiturn_bits != 0; }
constexpr Command read{"position", Verb::read, 0, "position, and turns where it has them"};
constexpr auto commands = std::array{
    reading<report, request<Ask::position>>(read).or_when(
        has_turns, command<report, found, read_both, request<Ask::position>>(read)),
    reading<report, request<Ask::turns>>({"turns", Verb::read_part, 0, "turns"}).unless(no_turns),
    command<report, found, restart, request<Ask::zero>, Ask::zero>(
        {"zero", Verb::zero, 0, "make this the zero of the turn: it restarts, 200 ms", {}, true, false})
        .unless(no_zero),
    command<report, found, restart, request<Ask::reset>, Ask::reset>(
        {"reset", Verb::run, 0, "restart it, 200 ms", {}, true, false}),
    command<report, nodes, scan<Protocol, addresses, request_to>, request<Ask::position>>(
        {"scan", Verb::scan, 0, "ask each of the 64 addresses", {}, false, false}),
};

// ---- Vectors

constexpr std::string_view document = "CUI Devices AMT21, 2019-11-21";
constexpr std::string_view d14 = "singleturn_bits=14 multiturn_bits=14";
constexpr auto vectors = std::array{
    VectorText{"amt21-1", "a position", document, "", "54", "ab61",
               "encoder_address=84 command=position singleturn=8619"},
    VectorText{"amt21-2", "one turn", document, d14, "55", "0180", "encoder_address=84 command=turns multiturn=1"},
    VectorText{"amt21-3", "two turns back", "derived", d14, "55", "fe7f",
               "encoder_address=84 command=turns multiturn=-2"},
    VectorText{"amt21-4", "12 bits", "derived", "singleturn_bits=12", "54", "0480",
               "encoder_address=84 command=position singleturn=1"},
    VectorText{"amt21-5", "14 bits read as 12", "derived", "singleturn_bits=12", "54", "e679", "out_of_range"},
    VectorText{"amt21-6", "K1 is wrong", "derived", "", "54", "3412", "bad_checksum"},
    VectorText{"amt21-7", "nothing is there", "derived", "", "54", "ffff", "bad_checksum"},
    VectorText{"amt21-8", "one byte", "derived", "", "54", "34", "wrong_length"},
    VectorText{"amt21-9", "zero", document, "", "565e", "", "encoder_address=84 command=zero"},
    VectorText{"amt21-10", "a reset has no reply", document, "", "5675", "3492", "wrong_length"},
};

// ---- Declaration

constexpr Result<Request> guess_request(const Format& format, Bytes) { return request<Ask::position>(format); }
constexpr auto conditions = std::array{Condition{"battery", "", "keeps the turns while the power is off", 0, 1, 1}};

constexpr auto known_as = std::array<std::string_view, 3>{"CUI", "Same Sky", "AMT21"};

constexpr Declaration<Protocol, Encoder> declaration{
    .id = "amt21",
    .name = "CUI AMT21 (RS-485)",
    .document = document,
    .known_as = known_as,
    .link = LinkKind::half_duplex,
    .options = options.infos,
    .format = format_of<options>,
    .models = models,
    .fields = fields.infos,
    .commands = commands,
    .vectors = vectors,
    .frames_size = 1500,
    .report = report,
    .guess_request = guess_request,
    .bits = bits_of_field,
    .conditions = conditions,
    .timing = {.turnaround = turn_around[0],
               // Time after which the host reports that a reply is missing, at the slowest of the baud rates.
               .turnaround_limit = Protocol::host_times({.rate = rates.size() - 1}).answer_limit},
};

}  // namespace

constinit const Unit unit = Descriptor<declaration>::make();

}  // namespace absenc::amt21
