// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/e201/procedures.hpp"

#include <span>

#include "absenc/protocol/author/standstill.hpp"

namespace absenc::e201 {

using author::done;
using author::Outcome;
using author::Part;
using author::Procedure;

namespace {

constexpr unsigned supplied_above = 1000;  // voltage in mV above which the encoder counts as supplied

constexpr std::string_view check_firmware = "`absenc info` shows which firmware it has";
constexpr std::string_view check_clocks =
    "look at it with `absenc config get ... clock`, set it with `absenc config set ... clock`";
constexpr Outcome too_old{Error::unsupported, "reading by `4` needs firmware 1.16 of the interface", check_firmware};

bool is_too_old(const Reply& reply) {
  const std::optional<Version> version = find_version(reply.text);
  return version && !has_samples(*version);
}

}  // namespace

Procedure read(Dialog& dialog, InterfaceResults& found) {
  Result<Reply> reply = co_await dialog.attempt({letter::samples});
  const bool unusable = reply.error() == Error::timeout || reply.error() == Error::wrong_length;
  if (unusable && !dialog.is_noisy()) {
    const Result<Reply> version = co_await dialog.attempt({letter::version});
    if (version && is_too_old(*version)) co_return too_old;
    if (!version && reply.error() == Error::timeout) co_return {version.error()};
    reply = co_await dialog.attempt({letter::samples});
    if (version && reply.error() == Error::timeout) {
      co_return {Error::timeout, "the interface answers `v` but not `4`", check_firmware};
    }
  }
  if (!reply) co_return {reply.error()};
  found.samples = reply->samples;
  found.reading = Protocol::reading(dialog.format(), {letter::samples}, *reply);
  // The end of the request is taken as the time of the latch, because no document states this time.
  found.reading.latched = dialog.sent_at();
  found.reading.received = dialog.received_at();
  co_return done;
}

// The text of a reply does not show which command it answers, so silence must follow each.
Procedure read_info(Dialog& dialog, InterfaceResults& found) {
  static constexpr auto letters = std::array{letter::version, letter::serial, letter::supply, letter::clock};
  for (const std::uint8_t asked : letters) {
    const Result<Reply> reply = co_await dialog.attempt({asked}).until_silence();
    if (!reply && (asked == letter::version || dialog.is_noisy())) co_return {reply.error()};
    if (reply) found.take(asked, *reply);
    if (found.clock) found.take_clock(dialog.format(), *found.clock);
  }
  co_return done;
}

// ---- Settings: each is read back

namespace {

// Sets the clock number and reads it back. Error cross_check_failed: the number read back is another one.
Part<Error> switch_clock(Dialog& dialog, unsigned clock) {
  const Result<Reply> told = co_await dialog.attempt({letter::set_clock, clock}).changes();
  if (!told) co_return told.error();
  const Result<Reply> now = co_await dialog.attempt({letter::clock});
  if (!now) co_return now.error();
  co_return now->number == clock ? Error::none : Error::cross_check_failed;
}

}  // namespace

Procedure set_clock(Dialog& dialog, InterfaceResults& found, Arguments arguments) {
  const unsigned clock = clock_of(arguments[0]);
  const Error error = co_await switch_clock(dialog, clock);
  if (error == Error::cross_check_failed)
    co_return {error, "the interface has another setting than it was given", check_clocks};
  found.take_clock(dialog.format(), clock);
  co_return {error};
}

Procedure switch_supply(Dialog& dialog, InterfaceResults& found, bool on) {
  co_await dialog.ask({on ? letter::supply_on : letter::supply_off}).changes();
  const Reply reply = co_await dialog.ask({letter::supply}).after(supply_time);
  found.supply = reply.text;
  const std::optional<unsigned> voltage = find_milli(reply.text, 'V');
  if (voltage && (*voltage > supplied_above) != on) {
    co_return {Error::cross_check_failed, "the voltage that the interface shows contradicts it",
               "look at it with `absenc info`"};
  }
  co_return done;
}

namespace {

// Positions from `?` include the turns, so the difference does not wrap.
bool is_near(const Dialog& dialog, std::int64_t counts, std::int64_t other) {
  const unsigned bits = dialog.format().word.bits_of(Meaning::position);
  const auto to = static_cast<std::uint64_t>(counts);
  const auto from = static_cast<std::uint64_t>(other);
  return (counts > other ? to - from : from - to) <= static_cast<std::uint64_t>(author::counts_of_angle(bits));
}

}  // namespace

Procedure set_zero(Dialog& dialog, InterfaceResults& found) {
  // `4` is read too, because `?` reports no errors; firmware before 1.16 does not answer `4`.
  const Result<Reply> samples = co_await dialog.attempt({letter::samples});
  if (samples) {
    const Reading look = Protocol::reading(dialog.format(), {letter::samples}, *samples);
    const Outcome why_not = author::objection_to_zero(look, look);
    if (why_not.error != Error::none) co_return why_not;
  } else if (samples.error() != Error::timeout) {
    co_return {samples.error(), "the encoder sends no valid word, so nothing was changed"};
  }
  const Reply first = co_await dialog.ask({letter::decimal});
  const Reply second = co_await dialog.ask({letter::decimal}).after(author::between_looks);
  if (!is_near(dialog, second.number, first.number)) {
    co_return {Error::not_still, "nothing was changed"};
  }
  co_await dialog.ask({letter::zero}).changes();
  const Reply now = co_await dialog.ask({letter::decimal});
  if (!is_near(dialog, now.number, 0)) {
    if (is_near(dialog, now.number, second.number)) dialog.refused();
    co_return {Error::cross_check_failed, "the position is not zero afterwards",
               "hold the shaft still, then `absenc run ... set-zero` again"};
  }
  if (is_near(dialog, second.number, 0)) {
    dialog.unproven(
        "the position was zero before already, so it cannot show whether the zero was set: turn the shaft "
        "and try again");
  }
  found.counts = now.number;
  co_return done;
}

Procedure clear_zero(Dialog& dialog, InterfaceResults& found) {
  const Reply first = co_await dialog.ask({letter::decimal});
  const Reply second = co_await dialog.ask({letter::decimal}).after(author::between_looks);
  co_await dialog.ask({letter::clear_zero}).changes();
  const Reply now = co_await dialog.ask({letter::decimal}).or_say("it was sent, but the position could not be read");
  found.counts = now.number;
  // Only the position shows the interface's zero. While the shaft turns, it changes anyway.
  if (!is_near(dialog, second.number, first.number)) {
    dialog.unproven(
        "the shaft turns, so the position cannot show whether the zero was cleared: hold it still and look "
        "again");
  } else if (is_near(dialog, now.number, second.number)) {
    dialog.unproven("the position is the same as before: no zero was set, or the interface did not clear it");
  }
  co_return done;
}

// ---- clock-sweep

unsigned InterfaceResults::recommended() const {
  unsigned best = 0;
  unsigned longest = 0;
  for (unsigned first = 0; first < valid.size(); ++first) {
    unsigned end = first;
    while (end < valid.size() && valid[end] == frames) ++end;
    if (end - first <= longest) continue;
    longest = end - first;
    best = first + longest / 2 + 1;
  }
  return best;
}

namespace {

// Explains the last exchange at once, because more exchanges follow before the procedure ends.
Outcome failure(const Dialog& dialog, Error error) {
  const Explanation what = explain(dialog.format(), error, dialog.exchange().sent, dialog.reply());
  return {error, dialog.is_noisy() ? endless_noise.detail : what.detail,
          what.advice.empty() ? text_of(error).advice : what.advice};
}

Part<Outcome> try_clocks(Dialog& dialog, InterfaceResults& found) {
  Outcome bad = done;  // outcome of the last invalid frame, returned if no clock gave good frames only
  if (dialog.is_aborted()) co_return done;
  for (unsigned clock = 1; clock <= clocks_khz.size(); ++clock) {
    found.left = clock;
    const Error error = co_await switch_clock(dialog, clock);
    if (error == Error::cross_check_failed)
      co_return {error, "the interface has another clock than it was given", check_clocks};
    if (error != Error::none) co_return failure(dialog, error);
    for (unsigned read = 0; read < found.frames && !dialog.is_aborted(); ++read) {
      const Result<Reply> frame = co_await dialog.attempt({letter::samples});
      if (!frame) bad = failure(dialog, frame.error());
      if (!frame && dialog.is_noisy()) co_return bad;
      if (frame) ++found.valid[clock - 1];
    }
    if (dialog.is_aborted()) co_return done;
    ++found.measured;
    dialog.emit();
  }
  if (found.recommended() != 0) co_return done;
  bad.detail = "no MA clock gave good frames only";
  co_return bad;
}

}  // namespace

Procedure sweep_clocks(Dialog& dialog, InterfaceResults& found, Arguments arguments) {
  dialog.restores();
  found.frames = static_cast<unsigned>(arguments[0]);
  const Reply version = co_await dialog.ask({letter::version});
  if (is_too_old(version)) co_return too_old;
  const Reply clock = co_await dialog.ask({letter::clock}).or_say("the interface does not say which clock it has");
  found.previous = static_cast<unsigned>(clock.number);
  dialog.hold_line(true);  // no other conversation may read positions while a clock of the sweep is set
  const Outcome outcome = co_await try_clocks(dialog, found);
  found.left = found.previous;
  const Error error = co_await switch_clock(dialog, found.previous);
  if (error == Error::cross_check_failed) {
    co_return {error, "the clock that was set before could not be restored", check_clocks};
  }
  if (error != Error::none) {
    co_return {error, "it is not known whether the clock that was set before is restored", check_clocks};
  }
  found.restored = true;
  found.aborted = dialog.is_aborted();
  co_return outcome;
}

// ---- Explanations

namespace {

struct ErrorExplanation {
  Error error;
  Explanation explanation;
};

constexpr std::string_view check_biss =
    "check what is connected, or select a lower MA clock with `absenc config set ... clock`";
constexpr std::string_view check_clock =
    "select another MA clock with `absenc config set ... clock`; `absenc run ... clock-sweep` finds one";
constexpr std::string_view check_model = "check that it is an E201-9S";

constexpr auto of_samples = std::to_array<ErrorExplanation>({
    {Error::invalid_argument, {"the interface samples 64 bits, and the word does not fit", "give it fewer bits"}},
    {Error::line_stuck,
     {{}, "check that an encoder is connected and supplied: `absenc run ... supply-on` switches its supply on"}},
    {Error::truncated,
     {"the ACK is too long for the 64 samples",
      "select a lower MA clock with `absenc config set ... clock`; `absenc run ... clock-sweep` finds one"}},
    {Error::bad_checksum, {"the interface does not compensate the delay of the line", check_clock}},
    {Error::cross_check_failed, {"the bits behind the word are not what after_word says", "check the number of bits"}},
    {Error::wrong_length, {"the interface answers with 16 hexadecimal digits and CR", check_stream}},
});
constexpr auto of_lines = std::to_array<ErrorExplanation>({
    {Error::timeout, {"the interface is silent", check_model}},
    {Error::wrong_length, {"the interface answers with a line that ends with CR", check_stream}},
    {Error::bad_framing, {"this is no answer to that command", check_model}},
});

// Explains the error bad_framing of a position by naming the check of the samples that failed.
Explanation explain_framing(const Format& format, Bytes reply) {
  const Result<std::uint64_t> samples = decode_samples(reply);
  if (!samples) return {"the interface answers with hexadecimal digits", check_model};
  if (format.carries == Carries::ssi) return {"the line is not idle before the word", "check what is connected"};
  if (*samples >> 61 != 0b110) return {"the samples do not begin with 110", check_biss};
  if (*samples << 3 == 0) return {"no start bit follows the ACK", check_biss};
  return {"the CDS bit is 1", check_biss};
}

}  // namespace

Explanation explain(const Format& format, Error error, Bytes request, Bytes reply) {
  const bool samples = request.empty() || request[0] == letter::samples;
  if (samples && error == Error::bad_framing) return explain_framing(format, reply);
  if (samples && error == Error::bad_checksum && format.carries == Carries::ssi) {
    return {"the parity of the word is wrong", check_clock};
  }
  for (const ErrorExplanation& one :
       samples ? std::span<const ErrorExplanation>(of_samples) : std::span<const ErrorExplanation>(of_lines)) {
    if (one.error == error) return one.explanation;
  }
  return {};
}

}  // namespace absenc::e201
