// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/e201/procedures.hpp"

#include "absenc/protocol/author/standstill.hpp"
#include "absenc/protocol/e201/explain.hpp"

namespace absenc::e201 {

using author::done;
using author::Outcome;
using author::Part;
using author::Procedure;

namespace {

constexpr unsigned supplied_above = 1000;  // mV

constexpr std::string_view check_firmware = "`info` shows which firmware it has";
constexpr std::string_view check_clocks = "read it and set it with clock and set-clock";
constexpr Outcome too_old{Error::unsupported, "reading by `4` needs firmware 1.16 of the interface", check_firmware};

bool is_too_old(const Reply& reply) {
  const std::optional<Version> version = find_version(reply.text);
  return version && !has_samples(*version);
}

}  // namespace

Procedure read(Line& line, Samples& found) {
  Result<Reply> reply = co_await line.attempt({letter::samples});
  const bool unusable = reply.error() == Error::timeout || reply.error() == Error::wrong_length;
  if (unusable && !line.is_noisy()) {
    const Result<Reply> version = co_await line.attempt({letter::version});
    if (version && is_too_old(*version)) co_return too_old;
    if (!version && reply.error() == Error::timeout) co_return {version.error()};
    reply = co_await line.attempt({letter::samples});
    if (version && reply.error() == Error::timeout) {
      co_return {Error::timeout, "the interface answers `v` but not `4`", check_firmware};
    }
  }
  if (!reply) co_return {reply.error()};
  found.samples = reply->samples;
  found.reading = Protocol::reading(line.format(), {letter::samples}, *reply);
  found.reading.latched = line.sent_at();  // clocking begins when the command is there
  found.reading.received = line.received_at();
  co_return done;
}

Procedure inform(Line& line, Info& found) {
  for (std::size_t i = 0; i < info_letters.size(); ++i) {
    const Result<Reply> reply = co_await line.attempt({info_letters[i]});
    if (!reply && (i == 0 || line.is_noisy())) co_return {reply.error()};
    if (reply) found.replies[i] = *reply;
  }
  co_return done;
}

// ---- What is set is read back

namespace {

// `none`, why that could not be done or read back, or cross_check_failed: it is another one.
Part<Error> switch_clock(Line& line, unsigned clock) {
  const Result<Reply> told = co_await line.attempt({letter::set_clock, clock});
  if (!told) co_return told.error();
  const Result<Reply> now = co_await line.attempt({letter::clock});
  if (!now) co_return now.error();
  co_return now->number == clock ? Error::none : Error::cross_check_failed;
}

}  // namespace

Procedure set_clock(Line& line, ReadBack& found, Arguments arguments) {
  const unsigned clock = clock_of(arguments[0]);
  const Error error = co_await switch_clock(line, clock);
  if (error == Error::cross_check_failed) co_return {error, "the interface has another setting than it was given"};
  found = {{letter::clock}, {.number = clock}};
  co_return {error};
}

Procedure switch_supply(Line& line, ReadBack& found, bool on) {
  co_await line.ask({on ? letter::supply_on : letter::supply_off});
  const Reply reply = co_await line.ask({letter::supply}).after(supply_time);
  found = {{letter::supply}, reply};
  const std::optional<unsigned> voltage = find_milli(reply.text, 'V');
  if (voltage && (*voltage > supplied_above) != on) {
    co_return {Error::cross_check_failed, "the voltage that the interface shows contradicts it",
               "look at it with `info`"};
  }
  co_return done;
}

namespace {

// `?` counts turns too, so nothing is wrapped.
bool is_near(const Line& line, std::int64_t counts, std::int64_t other) {
  const unsigned bits = line.format().word.bits_of(Meaning::position);
  const auto to = static_cast<std::uint64_t>(counts);
  const auto from = static_cast<std::uint64_t>(other);
  return (counts > other ? to - from : from - to) <= static_cast<std::uint64_t>(author::counts_of_angle(bits));
}

}  // namespace

Procedure set_zero(Line& line, ReadBack& found) {
  const Reply first = co_await line.ask({letter::decimal});
  const Reply second = co_await line.ask({letter::decimal}).after(author::between_looks);
  if (!is_near(line, second.number, first.number)) {
    co_return {Error::invalid_argument, "the encoder moves: it must stand still"};
  }
  co_await line.ask({letter::zero});
  const Reply now = co_await line.ask({letter::decimal});
  if (!is_near(line, now.number, 0)) {
    co_return {Error::cross_check_failed, "the position is not zero afterwards"};
  }
  found = {{letter::decimal}, now};
  co_return done;
}

// ---- clock-sweep

unsigned Sweep::recommended() const {
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

// The last exchange in words, for when others have followed.
Outcome failure(const Line& line, Error error) {
  const Explanation what = explain(line.format(), error, line.exchange().sent, line.reply());
  return {error, line.is_noisy() ? endless_noise.found : what.found,
          what.advice.empty() ? text_of(error).advice : what.advice};
}

// Ends early when the sweep is aborted, or cannot go on.
Part<Outcome> try_clocks(Line& line, Sweep& sweep) {
  Outcome bad = done;  // the last frame that was
  if (line.is_aborted()) co_return done;
  for (unsigned clock = 1; clock <= clocks_khz.size(); ++clock) {
    sweep.left = clock;
    const Error error = co_await switch_clock(line, clock);
    if (error == Error::cross_check_failed) co_return {error, "the interface has another clock than it was given"};
    if (error != Error::none) co_return failure(line, error);
    for (unsigned read = 0; read < sweep.frames && !line.is_aborted(); ++read) {
      const Result<Reply> frame = co_await line.attempt({letter::samples});
      if (!frame) bad = failure(line, frame.error());
      if (!frame && line.is_noisy()) co_return bad;
      if (frame) ++sweep.valid[clock - 1];
    }
    if (line.is_aborted()) co_return done;
    ++sweep.measured;
    line.emit();
  }
  if (sweep.recommended() != 0) co_return done;
  bad.detail = "no MA clock gave good frames only";
  co_return bad;
}

}  // namespace

Procedure sweep_clocks(Line& line, Sweep& sweep, Arguments arguments) {
  line.restores();
  sweep.frames = static_cast<unsigned>(arguments[0]);
  const Reply version = co_await line.ask({letter::version});
  if (is_too_old(version)) co_return too_old;
  const Reply clock = co_await line.ask({letter::clock}).or_say("the interface does not say which clock it has");
  sweep.previous = static_cast<unsigned>(clock.number);
  const Outcome outcome = co_await try_clocks(line, sweep);
  sweep.left = sweep.previous;
  const Error error = co_await switch_clock(line, sweep.previous);
  if (error == Error::cross_check_failed) {
    co_return {error, "the clock that was set before could not be restored", check_clocks};
  }
  if (error != Error::none) {
    co_return {error, "it is not known whether the clock that was set before is restored", check_clocks};
  }
  sweep.restored = true;
  sweep.aborted = line.is_aborted();
  co_return outcome;
}

}  // namespace absenc::e201
