// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <utility>

#include "absenc/client/doctor/damage.hpp"
#include "absenc/client/doctor/judges.hpp"
#include "absenc/client/doctor/words.hpp"
#include "absenc/client/reading.hpp"
#include "absenc/client/share.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/os/serial_ports.hpp"

namespace absenc::client {

namespace {

// delay after the allowed time from which on a reply is called slow
constexpr Time slow = std::chrono::milliseconds(8);

FindingKind kind_of(const Refusal& refusal) {
  using Kind = os::Failure::Kind;
  if (refusal.bus == os::Failure::Bus::off) return FindingKind::can_bus_off;
  if (refusal.bus == os::Failure::Bus::not_acknowledged) return FindingKind::can_not_acknowledged;
  switch (refusal.kind) {
    case Kind::not_found:
      return FindingKind::port_missing;
    case Kind::no_permission:
      return FindingKind::port_forbidden;
    case Kind::in_use:
      return FindingKind::port_in_use;
    case Kind::unsupported:
      return FindingKind::port_unsuitable;
    case Kind::bad_rate:
      return FindingKind::port_rate;
    case Kind::lost:
      return FindingKind::port_lost;
    case Kind::system:
      break;
  }
  return FindingKind::port_failed;
}

// Returns advice on how to free a port, depending on the program that has opened it.
std::string_view action_for(os::Failure::Holder holder) {
  using Holder = os::Failure::Holder;
  switch (holder) {
    case Holder::server:
      return "look at what the server reads, on its page or by its API, or let it examine the encoder";
    case Holder::absenc:
      return "wait until that command is over, or end it";
    case Holder::modem_manager:
      return "let ModemManager go of it: `sudo systemctl stop ModemManager`";
    case Holder::unknown:
    case Holder::program:
      break;
  }
  return "end that program, or use another port";
}

std::size_t count(const std::vector<Attempted>& readings, bool (*is)(const Attempted&)) {
  return static_cast<std::size_t>(std::count_if(readings.begin(), readings.end(), is));
}

bool was_heard(const Attempted& one) { return one.heard; }

bool all_are(const std::vector<std::uint8_t>& bytes, std::uint8_t value) {
  return std::all_of(bytes.begin(), bytes.end(), [value](std::uint8_t byte) { return byte == value; });
}

std::string hex(const std::vector<std::uint8_t>& bytes, std::size_t most) {
  return to_hex(Bytes(bytes).first(std::min(bytes.size(), most)));
}

// Returns the evidence of an inverted line; "" if there is none.
std::string inversion(const Case& one) {
  const Observations& seen = one.seen;
  if (seen.damage && seen.damage->breaks > 0) {
    return fmt::format("the UART counted {} breaks, in which it was low for more than a character",
                       seen.damage->breaks);
  }
  if (!seen.unsolicited.empty() && all_are(seen.unsolicited, 0)) {
    return fmt::format("{} unsolicited bytes arrived, all of them 00", seen.unsolicited.size());
  }
  std::size_t zeros = 0;
  for (const Attempted& attempt : seen.readings) {
    const auto& reply = attempt.exchange.reply.bytes;
    // A cut frame of a few zeros is no evidence of an inverted line: it may be the beginning of a good frame.
    constexpr std::size_t many = 8;
    if (!reply.empty() && all_are(reply, 0) && (reply.size() >= many || !is_cut(one, attempt))) ++zeros;
  }
  const std::size_t heard = count(seen.readings, was_heard);
  if (heard > 0 && zeros == heard) return fmt::format("{} replies came, all of them nothing but 00", zeros);
  return {};
}

void judge_silence(const Case& one, std::vector<Finding>& findings) {
  const Observations& seen = one.seen;
  if (seen.readings.empty() || count(seen.readings, was_heard) != 0 || seen.never_silent) return;
  if (seen.late > 0 || (seen.line_errors > 0 && one.unit.link == LinkKind::can) || !seen.trials.empty() ||
      os::is_modem_driver(seen.facts.driver))
    return;
  const bool unswitched = one.unit.link == LinkKind::half_duplex && os::is_bare_uart(seen.facts.driver) &&
                          !seen.facts.kernel_direction.value_or(false);
  if (unswitched) {
    findings.push_back(finding(FindingKind::direction_unswitched, {seen.port, seen.facts.driver}));
  } else {
    findings.push_back(
        finding(FindingKind::no_answer, {fmt::format("{}", seen.readings.size()),
                                         seen.unsolicited.empty() ? "" : ", though something was heard before"}));
  }
}

void judge_lateness(const Case& one, std::vector<Finding>& findings) {
  const Observations& seen = one.seen;
  const std::size_t tried = seen.readings.size();
  // On CAN, a frame after an unanswered request may be unsolicited.
  if (seen.late == 0 || one.unit.link == LinkKind::can) return;
  // A few late replies may be due to a delay of this computer.
  const bool nothing_else = one.good == 0 && count(seen.readings, was_heard) * 10 < tried;
  const bool often = seen.late * 10 >= tried || nothing_else;
  if (!often && (seen.late < 2 || may_be_the_computer(seen, seen.late))) return;
  Time limit{};
  for (const Attempted& attempt : seen.readings) limit = std::max(limit, attempt.limit);
  const bool is_ours = seen.computer_late > Time{} && seen.lateness - limit <= seen.computer_late;
  const bool is_one_of_few = seen.late < 2 && !nothing_else;
  // Reports nothing if the replies were late by no more than the delay of this computer.
  if ((!often || is_one_of_few) && is_ours) return;
  const auto allowance = std::chrono::ceil<std::chrono::milliseconds>(seen.lateness * 3 / 2).count();
  findings.push_back(finding(often ? FindingKind::reply_late : FindingKind::sometimes_late,
                             {fmt::format("{}", std::min<std::uint64_t>(seen.late, tried)), fmt::format("{}", tried),
                              to_text(seen.lateness), fmt::format("{}", allowance)}));
}

void judge_slowness(const Case& one, std::vector<Finding>& findings) {
  std::vector<Time> excess;
  Time allowed{};
  for (const Attempted& attempt : one.seen.readings) {
    if (attempt.error != Error::none || attempt.allowed == Time{} || attempt.exchange.request.frame().empty()) continue;
    excess.push_back(attempt.after - attempt.allowed);
    allowed = attempt.allowed;
  }
  if (excess.size() < 10) return;
  std::sort(excess.begin(), excess.end());
  const Time fastest = excess[excess.size() / 10];
  if (fastest > slow) findings.push_back(finding(FindingKind::reply_slow, {to_text(fastest), to_text(allowed)}));
}

}  // namespace

std::string shown(const Attempted& one) {
  constexpr std::size_t most = 16;
  if (one.exchange.reply.can) return to_wire_text(LinkKind::can, one.exchange.reply.frame());
  return hex(one.exchange.reply.bytes, most);
}

void judge_port(const Case& one, std::vector<Finding>& findings) {
  const Observations& seen = one.seen;
  if (os::is_modem_driver(seen.facts.driver)) {
    findings.push_back(finding(FindingKind::port_is_modem, {seen.port, seen.facts.driver}));
  }
  if (seen.refusal) {
    findings.push_back(
        finding(kind_of(*seen.refusal), {seen.refusal->sentence, std::string(action_for(seen.refusal->holder))}));
  }
  if (const auto timer = seen.facts.latency_timer; timer && *timer > 1) {
    const std::string terminal = std::filesystem::path(seen.port).filename().string();
    findings.push_back(finding(FindingKind::latency_timer,
                               {terminal, fmt::format("{}", *timer), os::way_to_shorter_latency(terminal)}));
  }
}

namespace {

// Returns the time from the edge at which the encoder changes a bit to that at which it is sampled, in half periods of
// the clock (FtdiPort); 0 if a longer way only shifts the bits, because the host finds their start bit (BiSS).
unsigned sampled_after_halves(const Unit& unit) {
  if (unit.link == LinkKind::clocked_bidirectional) return 2;
  return unit.line.idle_clocks > 0 ? 1 : 0;
}

// The lowest clock rate that fails shows how long the data needs to follow the clock through cable and encoder.
void judge_clocks(const Case& one, std::vector<Finding>& findings) {
  const std::vector<ClockTrial>& clocks = one.seen.clocks;
  const auto is_bad = [](const ClockTrial& trial) { return trial.good < trial.tried; };
  const auto set = std::ranges::find_if(clocks, [](const ClockTrial& trial) { return trial.is_set; });
  if (set == clocks.end() || is_bad(*set)) return;
  const auto failed = std::find_if(set, clocks.end(), is_bad);
  auto slowest = set;
  while (slowest != clocks.begin() && !is_bad(*std::prev(slowest))) --slowest;
  const ClockTrial& fastest = *std::prev(failed);
  const unsigned halves = sampled_after_halves(one.unit);
  const auto way_ns = [halves](const ClockTrial& trial) { return halves * 500'000'000u / trial.rate; };
  std::string but;
  const auto add = [&but](const ClockTrial& trial) {
    but +=
        fmt::format("{} {} of {} at {} Hz", but.empty() ? ", but only" : " and", trial.good, trial.tried, trial.rate);
  };
  if (slowest != clocks.begin()) add(*std::prev(slowest));
  std::string cause = "no faster clock that was tried is too fast for encoder and cable";
  std::string action = "keep the clock";
  if (failed != clocks.end()) {
    add(*failed);
    cause = halves == 0 ? fmt::format("encoder, transceivers or cable are too slow for {} Hz", failed->rate)
                        : fmt::format(
                              "from the edge of the clock to the data the way takes {} to {} ns: transceivers, "
                              "cable, encoder",
                              way_ns(*failed), way_ns(fastest));
    action = fmt::format("set speed={} or less", fastest.rate);
  }
  findings.push_back(finding(FindingKind::clock_range,
                             {fmt::format("{}", slowest->rate), fmt::format("{}", fastest.rate), but, cause, action}));
}

}  // namespace

void judge_line(const Case& one, std::vector<Finding>& findings) {
  const Observations& seen = one.seen;
  if (seen.line_errors > 0 && one.unit.link == LinkKind::can) {
    findings.push_back(finding(
        FindingKind::can_errors,
        {fmt::format("{}", seen.line_errors), fmt::format("{}", seen.readings.size()), fmt::format("{}", one.good)}));
  }
  for (const Trial& trial : seen.trials) {
    const std::string as_said = good_as_said(trial.good_as_said, trial.tried_as_said);
    findings.push_back(finding(trial.finding_kind, {trial.said, trial.setting, fmt::format("{}", trial.good),
                                                    fmt::format("{}", trial.tried), as_said, trial.command}));
  }
  const bool characters = one.unit.link == LinkKind::half_duplex || one.unit.link == LinkKind::full_duplex;
  if (characters && one.good == 0 && seen.trials.empty()) {
    std::vector<std::uint8_t> bytes = seen.unsolicited;
    for (const Attempted& attempt : seen.readings) bytes.insert(bytes.end(), attempt.raw.begin(), attempt.raw.end());
    if (std::optional<Finding> text = text_of_others(one, bytes)) {
      findings.push_back(std::move(*text));
      return;
    }
  }
  const bool in_doubt = one.good == 0 && seen.trials.empty() && characters;
  const std::string inverted = in_doubt ? inversion(one) : "";
  if (!inverted.empty()) {
    findings.push_back(finding(FindingKind::line_inverted, {inverted}));
  } else if (seen.never_silent || seen.sends_unasked) {
    Finding found = finding(FindingKind::never_silent,
                            {fmt::format("{}", seen.unsolicited.size()), to_text(seen.listened),
                             hex(seen.unsolicited, 8), seen.never_silent ? "without a pause" : "repeatedly"});
    // The readings may be good nevertheless, or frames that nobody requested pass for replies.
    const bool good_nevertheless = one.good * 100 > seen.readings.size() * 99;
    if (!seen.never_silent || good_nevertheless) found.severity = Severity::warning;
    findings.push_back(std::move(found));
  }
  if (findings.empty() || findings.back().finding_kind != FindingKind::line_inverted) judge_silence(one, findings);
  judge_lateness(one, findings);
  judge_slowness(one, findings);
  judge_rest(one, findings);
  judge_clocks(one, findings);
}

namespace {

void judge_counter(const Case& one, std::vector<Finding>& findings) {
  constexpr std::size_t enough = 8;
  std::set<std::int64_t> values;
  std::size_t count = 0;
  const FieldInfo* field = nullptr;
  for (const Attempted& attempt : one.seen.readings) {
    if (attempt.error != Error::none || !attempt.counter) continue;
    values.insert(*attempt.counter);
    field = attempt.counter_field;
    ++count;
  }
  if (count < enough || values.size() != 1) return;
  findings.push_back(finding(FindingKind::counter_stands,
                             {std::string(field->name), fmt::format("{}", *values.begin()), fmt::format("{}", count)}));
}

// Returns the names of the alarms in `mask`, which holds the alarms of both channels.
std::set<std::string_view> alarm_names(const Unit& unit, std::uint32_t mask) {
  std::set<std::string_view> names;
  for (const Flags& flags : alarms_of(unit, {.alarms = mask})) {
    for (const std::string_view name : flag_names(*flags.field, flags.bits)) names.insert(name);
  }
  return names;
}

std::string echo_text(const Observations& seen) {
  using host::EchoMode;
  if (seen.echo_said == EchoMode::off) return "echo=off";
  if (seen.echo_said == EchoMode::on) return "echo=on";
  return seen.echo == EchoMode::on ? "echo seen" : seen.echo == EchoMode::off ? "no echo" : "echo not known";
}

Measured measured_of(const Unit& unit, const Observations& seen, std::size_t good) {
  Measured measured;
  if (seen.readings.empty()) return measured;
  const bool characters = unit.link == LinkKind::half_duplex || unit.link == LinkKind::full_duplex;
  if (characters && good > 0) measured.echo = echo_text(seen);
  measured.latency = seen.latency;
  if (!seen.latency && seen.facts.latency_timer)
    measured.latency = std::chrono::milliseconds(*seen.facts.latency_timer);
  measured.time = seen.readings.back().began - seen.readings.front().began;
  if (measured.time > Time{}) {
    measured.rate = static_cast<double>(good) / std::chrono::duration<double>(measured.time).count();
  }
  measured.failures = Share{seen.readings.size() - good, seen.readings.size()}.high();
  measured.computer_late = seen.computer_late;
  measured.turned = !seen.turned.empty();
  for (const Attempted& one : seen.readings) {
    if (one.error != Error::none || one.after <= Time{}) continue;
    measured.quickest = measured.slowest == Time{} ? one.after : std::min(measured.quickest, one.after);
    measured.slowest = std::max(measured.slowest, one.after);
  }
  return measured;
}

Reported reported_by(const Unit& unit, const Observations& seen) {
  Reported reported;
  const std::size_t all = alarm_names(unit, ~0u).size();
  std::uint32_t ever = 0;
  for (const Attempted& attempt : seen.readings) {
    if (!attempt.reading) continue;
    const std::uint32_t mask = attempt.reading->alarms_reported;
    ever |= mask;
    if (all != 0 && alarm_names(unit, mask).size() == all) ++reported.alarms;
    // A reply without any alarm or status cannot report an invalid position, so it does not report a valid one either.
    const bool reports_validity = (mask | attempt.reading->status_reported) != 0;
    if (reports_validity && attempt.reading->singleturn_validity() == Validity::valid) ++reported.valid;
  }
  for (const std::string_view name : alarm_names(unit, ~ever)) {
    reported.missing += fmt::format("{}{}", reported.missing.empty() ? "" : ", ", name);
  }
  return reported;
}

// Adds a finding if nothing else was found in so few readings that they show nothing.
void judge_count(const Case& one, Examination& result) {
  constexpr std::size_t enough = 10;
  if (one.good >= enough || !result.complete || result.first() != nullptr) return;
  const std::vector<Attempted>& readings = one.seen.readings;
  const Time time = readings.empty() ? Time{} : readings.back().began + readings.back().after - readings.front().began;
  result.findings.push_back(finding(FindingKind::few_readings,
                                    {fmt::format("{} reading{}", one.good, one.good == 1 ? "" : "s"), to_text(time)}));
}

}  // namespace

Examination judge(const Unit& unit, const Options& options, const Observations& seen) {
  Examination result{.tried = seen.readings.size(), .complete = seen.complete};
  result.good = count(seen.readings, [](const Attempted& one) { return one.error == Error::none; });
  result.measured = measured_of(unit, seen, result.good);
  const Case one{unit, options, seen, result.good};
  judge_port(one, result.findings);
  judge_line(one, result.findings);
  // Frames are judged only without a fault of the port or of the line, because such a fault already explains bad
  // frames.
  const bool explained = std::any_of(result.findings.begin(), result.findings.end(), [](const Finding& found) {
    return found.severity == Severity::fault && found.finding_kind != FindingKind::can_errors;
  });
  // A damaged frame passes a checksum of 8 bits once in 256 times.
  if (result.good * 20 < result.tried || result.good == 0) {
    if (!explained) judge_bad_frames(one, result.findings);
  } else {
    if (std::optional<Finding> start = judge_start(one)) {
      result.findings.push_back(std::move(*start));
    } else if (!explained) {
      judge_mixed_frames(one, result.findings);
    }
    judge_state(one, result.findings);
    judge_counter(one, result.findings);
    result.reported = reported_by(unit, seen);
    judge_position(one, seen.readings, false, result);
    if (result.measured.turned) judge_position(one, seen.turned, true, result);
  }
  const std::size_t failed = result.tried - result.good;
  if (failed * 20 > result.tried && result.first() == nullptr) {
    // If no judge explains the failures, reports them without a specific cause.
    const std::size_t silent = result.tried - count(seen.readings, was_heard);
    const std::string all = fmt::format("{}", result.tried);
    if (silent * 2 < failed) {
      const std::string last = shown(seen.readings.back());
      result.findings.push_back(finding(FindingKind::always_damaged, {all, "none was taken for a reply", last}));
    } else {
      const bool is_nobody = silent == result.tried;
      result.findings.push_back(is_nobody ? finding(FindingKind::no_answer, {all, ""})
                                          : some_silence(seen, failed, result.tried));
    }
  }
  if (!result.measured.turned) result.not_looked_at.emplace_back("a turning shaft (--turn)");
  judge_count(one, result);
  for (Finding& found : result.findings) suit(found, seen.place);
  std::stable_sort(result.findings.begin(), result.findings.end(), [](const Finding& before, const Finding& after) {
    return before.finding_kind < after.finding_kind;
  });
  return result;
}

}  // namespace absenc::client
