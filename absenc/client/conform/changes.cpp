// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/conform/changes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <exception>
#include <span>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/client/memory.hpp"
#include "absenc/client/settings.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/core/bits.hpp"
#include "absenc/os/error.hpp"

namespace absenc::client {

namespace {

// wait that is longer than an encoder is busy after the write of a byte, including the time of its reply
constexpr Time settling = std::chrono::milliseconds(50);
constexpr unsigned tries = 3;  // number of times that the test tries to restore a changed value of the encoder
// number of bytes of the memory on each side of the written byte that must stay unchanged
constexpr std::uint32_t beside = 4;
// two positions count as equal if they differ by at most this fraction of a turn, 1/512
constexpr unsigned position_tolerance = 512;

/// Thrown when a command fails or a value is missing or wrong, so that the clause is broken.
struct ClauseBroken {
  std::string evidence;
};

std::int64_t number_of(const Answer& answer, std::string_view field) {
  const Value& value = answer[field];
  if (const auto* number = std::get_if<std::int64_t>(&value)) return *number;
  if (const auto* counts = std::get_if<std::uint64_t>(&value)) return static_cast<std::int64_t>(*counts);
  throw ClauseBroken{fmt::format("{} was not told", field)};
}

// Returns the addresses next to that of the clause, on both sides, that are in the same area of the memory.
std::vector<std::uint32_t> addresses_beside(const Unit& unit, const Clause& clause) {
  std::vector<std::uint32_t> addresses;
  const auto area =
      std::ranges::find_if(unit.memory, [&](const MemoryArea& one) { return one.has(clause.page, clause.address); });
  if (area == unit.memory.end()) return addresses;
  const std::uint32_t first = clause.address - std::min(beside, clause.address - area->first);
  const std::uint32_t end = std::min(clause.address + beside + 1, area->first + area->count);
  for (std::uint32_t at = first; at < end; ++at) {
    if (at != clause.address) addresses.push_back(at);
  }
  return addresses;
}

// Adds to the evidence how exactly it compares positions.
std::string with_tolerance(std::string_view seen) {
  return fmt::format("{}; positions are compared to within 1/{} turn", seen, position_tolerance);
}

struct BusySink final : FieldSink {
  void put(const FieldValue& field) override {
    if (field.info->name == "busy") reply.busy = field.number != 0;
    if (field.info->role == Role::value) reply.value = field.number;
  }
  BusyReply reply;
};

}  // namespace

bool is_near(const Reading& reading, std::uint64_t wanted) {
  const std::uint64_t turn = std::uint64_t{1} << reading.singleturn_bits;
  const std::uint64_t away = (reading.singleturn - wanted) & (turn - 1);
  return std::min(away, turn - away) <= turn / position_tolerance;
}

void ChangeTester::test(const Clause& clause, ClauseResult& result) {
  try {
    test_one(clause, result);
  } catch (...) {
    put_back();
    throw;
  }
  put_back();
  if (interrupted_) throw os::Interrupted{};
}

void ChangeTester::test_one(const Clause& clause, ClauseResult& result) {
  try {
    switch (clause.demand) {
      case Demand::byte_written:
        return test_byte(clause, result);
      case Demand::byte_alone:
      case Demand::page_alone:
        return test_bytes_beside(clause, result);
      case Demand::byte_busy:
        return test_busy(clause, result);
      case Demand::page_closed:
        return test_closed(clause, result);
      case Demand::set:
        return test_setting(clause, result);
      case Demand::zeroed:
        return test_offset(clause, result);
      case Demand::mirrored:
        return test_direction(clause, result);
      case Demand::paced:
        return test_pace(clause, result);
      case Demand::zero:
        return test_zero(result);
      case Demand::reset:
        return test_reset(clause, result);
      case Demand::restarts:
        return test_restart(clause, result);
      default:
        return;
    }
  } catch (const ClauseBroken& refused) {
    conclude(result, false, refused.evidence);
  } catch (const os::Failure& failure) {
    if (failure.kind() != os::Failure::Kind::unsupported) throw;
    // the port does not support a step of the test, so the clause stays untested
    result.evidence = failure.what();
  }
}

// ---- Clauses about the memory

void ChangeTester::test_byte(const Clause& clause, ClauseResult& result) {
  // saves the setting that access to this memory byte changes, such as the selected bank
  if (!clause.setting.empty()) save_setting(clause);
  const std::int64_t written = save_byte(clause.page, clause.address) ^ 0xFF;
  const Saved& byte = saved_.back();
  byte.write(written);
  const std::int64_t now = byte.look();
  conclude(result, now == written,
           fmt::format("0x{:02X} was there, 0x{:02X} was written, 0x{:02X} is read", byte.value, written, now));
}

void ChangeTester::test_bytes_beside(const Clause& clause, ClauseResult& result) {
  if (!clause.setting.empty()) save_setting(clause);
  const std::size_t settings = saved_.size();
  MemoryImage compared;
  if (clause.demand == Demand::page_alone) {
    save_byte(static_cast<std::uint32_t>(clause.other), clause.address);
    compared[{static_cast<std::uint32_t>(clause.other), clause.address}] = 0;
  } else {
    for (const std::uint32_t at : addresses_beside(unit_, clause)) {
      save_byte(clause.page, at);
      compared[{clause.page, at}] = 0;
    }
  }
  const std::int64_t written = save_byte(clause.page, clause.address) ^ 0xFF;
  saved_.back().write(written);
  const auto others = std::span(saved_).subspan(settings).first(saved_.size() - settings - 1);
  const auto same =
      std::count_if(others.begin(), others.end(), [](const Saved& other) { return other.look() == other.value; });
  const std::int64_t now = saved_.back().look();
  std::string seen = fmt::format(
      "{} of {} others ({}) are as before, when 0x{:02X} was written to {} and 0x{:02X} is read", same, others.size(),
      addresses_in_words(unit_, compared), written, to_text(unit_, {clause.page, clause.address}), now);
  if (same != std::ssize(others)) return conclude(result, false, std::move(seen));
  // Unchanged neighbouring bytes prove nothing if the byte itself was not written.
  result.evidence = seen;
  if (now == written) conclude(result, true, std::move(seen));
}

// Sends single requests instead of commands, because a command would wait until the memory is no longer busy.
void ChangeTester::test_busy(const Clause& clause, ClauseResult& result) {
  const std::int64_t written = save_byte(clause.page, clause.address) ^ 0xFF;
  const Command& reader = *find_command(unit_, Verb::memory_read);
  const Command& writer = *find_command(unit_, Verb::memory_write);
  const SingleExchange wrote = send(
      writer,
      role_arguments(writer, {{Role::page, clause.page}, {Role::address, clause.address}, {Role::value, written}}));
  const auto where =
      role_arguments(reader, {{Role::page, clause.page}, {Role::address, clause.address}, {Role::count, 1}});
  const SingleExchange asked = send(reader, where);
  line_.wait_for(settling);
  const std::int64_t now = saved_.back().look();
  std::string seen = fmt::format("{}; later 0x{:02X} is read, 0x{:02X} was written",
                                 exchange_text(unit_.link, asked.request.frame(), asked.reply.frame()), now, written);
  const std::optional<BusyReply> accepted = busy_reply(wrote);
  const std::optional<BusyReply> reply = busy_reply(asked);
  result.evidence = "the byte could not be written: " + seen;
  if (!accepted || accepted->busy || now != written) return;
  // A memory that is ready again at once is no violation, because the document states no shortest busy time.
  result.evidence = "it was not busy any more: " + seen;
  if (reply && !reply->busy && reply->value == written) return;
  conclude(result, reply && reply->busy, std::move(seen));
}

// Saves byte 0 of page 0: `put_back` reads it at the end of the test, which selects page 0, as after power-on.
void ChangeTester::test_closed(const Clause& clause, ClauseResult& result) {
  save({.look = [this] { return read_byte(0, 0); }, .write = [](std::int64_t) {}});
  static_cast<void>(read_byte(clause.page, clause.address));
  const SingleExchange sent = line_.send(request_of_ask(unit_, line_.options(), clause.ask));
  const bool as_demanded = reply_error(unit_, line_.options(), clause.as, {sent.request, sent.reply}) == Error::none;
  const std::string seen = exchange_text(unit_.link, sent.request.frame(), sent.reply.frame());
  // reads the byte, which proves that the encoder still replies, and selects the page of the byte
  static_cast<void>(read_byte(clause.page, clause.address));
  conclude(result, as_demanded, seen);
}

// ---- Clauses about settings

void ChangeTester::test_setting(const Clause& clause, ClauseResult& result) {
  const std::int64_t before = save_setting(clause);
  const std::int64_t wanted = before == clause.value ? clause.other : clause.value;
  saved_.back().write(wanted);
  const std::int64_t now = saved_.back().look();
  conclude(result, now == wanted, fmt::format("it was {}, was set to {}, reads as {}", before, wanted, now));
}

void ChangeTester::test_offset(const Clause& clause, ClauseResult& result) {
  save_setting(clause);
  const Reading before = read();
  const Command& zero = *find_command(unit_, Verb::zero);
  static_cast<void>(run(zero, complete_arguments(zero, std::array{clause.value})));
  const Reading after = read();
  const std::string seen =
      with_tolerance(fmt::format("the position is {} after {}", after.singleturn, before.singleturn));
  if (!is_near(after, 0)) return conclude(result, false, seen);
  result.evidence = seen + ": it was 0 before";
  if (!is_near(before, 0)) conclude(result, true, seen);
}

// The encoder does not report the direction of counting, so the test compares the position before and after: it is
// unchanged, or mirrored if the direction has changed.
void ChangeTester::test_direction(const Clause& clause, ClauseResult& result) {
  const Reading before = read();
  const std::uint64_t turn = std::uint64_t{1} << before.singleturn_bits;
  const std::uint64_t mirror = (turn - before.singleturn) & (turn - 1);
  result.evidence = fmt::format("the position is {}, which mirrored is the same", before.singleturn);
  if (is_near(before, mirror)) return;
  const Command& setter = *require_setting(unit_, clause.setting).setter;
  const auto is_mirrored = [this, before, mirror] {
    const Reading now = read();
    if (is_near(now, mirror)) return std::int64_t{1};
    if (is_near(now, before.singleturn)) return std::int64_t{0};
    throw ClauseBroken{
        fmt::format("the position is {}, neither {} as before nor {}", now.singleturn, before.singleturn, mirror)};
  };
  const auto set = [this, &setter](std::int64_t value) {
    static_cast<void>(run(setter, complete_arguments(setter, std::array{value})));
  };
  // It is not known which of the setting's two values stands for which direction, so both may be tried.
  save({.look = is_mirrored,
        .write =
            [is_mirrored, set, values = std::array{clause.other, clause.value}](std::int64_t wanted) {
              for (const std::int64_t value : values) {
                set(value);
                if (is_mirrored() == wanted) return;
              }
            },
        .restore_command = fmt::format("absenc config set {} {} {}, or {}, until the position is {} again", name_,
                                       clause.setting, clause.other, clause.value, before.singleturn)});
  set(clause.value);
  const std::int64_t first = is_mirrored();
  set(clause.other);
  const std::int64_t second = is_mirrored();
  const auto words = [](std::int64_t mirrored) { return mirrored != 0 ? "mirrored" : "as before"; };
  conclude(result, first != second,
           with_tolerance(fmt::format("with {} the position is {}, with {} {}", clause.value, words(first),
                                      clause.other, words(second))));
}

void ChangeTester::test_pace(const Clause& clause, ClauseResult& result) {
  // time to listen, which is long enough for two frames at the lowest rate, one frame per second
  static constexpr Time heard_for = std::chrono::milliseconds(2200);
  const Command& start = *find_command(unit_, clause.command);
  const Command& stop = *find_command(unit_, clause.stop);
  const auto look = [this] { return line_.count_unsolicited(heard_for).per_second(); };
  const auto write = [this, &start, &stop](std::int64_t value) {
    if (value == 0) static_cast<void>(run(stop, complete_arguments(stop, {})));
    if (value != 0) static_cast<void>(run(start, complete_arguments(start, std::array{value})));
  };
  const std::int64_t before = save({.look = look, .write = write});
  saved_.back().restore_command = before == 0 ? fmt::format("absenc run {} {}", name_, clause.stop)
                                              : fmt::format("absenc run {} {} {}", name_, clause.command, before);
  const std::int64_t wanted = before == clause.value ? clause.value / 2 : clause.value;
  write(wanted);
  const std::int64_t now = look();
  write(0);
  const std::int64_t stopped = look();
  conclude(result, now == wanted && stopped == 0,
           fmt::format("{} a second came by themselves, {} when it was told {}, {} when it was told to stop", before,
                       now, wanted, stopped));
}

// ---- Clauses that erase values which cannot be restored

// Returns whether the test may erase `what`; if not, stores the reason in `result`.
bool ChangeTester::may_erase(std::string_view what, ClauseResult& result) const {
  if (what.empty() || resets_) return true;
  result.evidence = fmt::format("there is {}, which nothing could bring back: --resets gives it up", what);
  return false;
}

void ChangeTester::test_zero(ClauseResult& result) {
  const Command& zero = *find_command(unit_, Verb::zero);
  const Reading before = read();
  const bool differs = !is_near(before, 0);
  if (!may_erase(before.singleturn != 0 ? fmt::format("a position of {}", before.singleturn) : "", result)) return;
  static_cast<void>(run(zero, complete_arguments(zero, {})));
  const Reading after = read();
  const std::string seen =
      with_tolerance(fmt::format("the position is {} after {}", after.singleturn, before.singleturn));
  if (!is_near(after, 0)) return conclude(result, false, seen);
  result.evidence = seen + ": it was 0 before, a command that is ignored would not show";
  if (differs) conclude(result, true, seen);
}

void ChangeTester::test_reset(const Clause& clause, ClauseResult& result) {
  const bool turns = clause.verb == Verb::reset_multiturn;
  const auto demanded = static_cast<std::uint32_t>(clause.value);
  const Reading before = read();
  std::string lost;
  if (before.alarms != 0) lost = "an alarm";
  if (turns && before.multiturn != 0) lost = fmt::format("a count of {} turns", before.turns());
  if (!may_erase(lost, result)) return;
  const Command& command = *find_command(unit_, clause.verb);
  const CommandResult ran = line_.run(command, complete_arguments(command, {}));
  const Reading after = read();
  std::string seen = fmt::format("position {}, turns {}, alarms {:x} before; {}, {}, {:x} after", before.singleturn,
                                 before.turns(), before.alarms, after.singleturn, after.turns(), after.alarms);
  // The clear command also fails if other alarms remain, which it cannot clear.
  const bool obeyed = ran.error == Error::none || (ran.error == Error::cross_check_failed && after.alarms != 0);
  const bool cleared = (after.alarms & demanded) == 0 && (!turns || after.multiturn == 0);
  const bool nothing_else = is_near(after, before.singleturn) && (turns || after.multiturn == before.multiturn);
  seen = with_tolerance(seen);
  if (!obeyed) seen = fmt::format("{} {}; {}", text_of(ran.error).name, ran.detail, seen);
  if (!obeyed || !cleared || !nothing_else) return conclude(result, false, std::move(seen));
  const bool differs = turns ? before.multiturn != 0 : (before.alarms & demanded) != 0;
  result.evidence = fmt::format("{}: there was nothing to reset, a command that is ignored would not show", seen);
  if (differs) conclude(result, true, std::move(seen));
}

void ChangeTester::test_restart(const Clause& clause, ClauseResult& result) {
  const Reading before = read();
  const bool turns = before.multiturn_bits != 0 && before.multiturn != 0;
  if (!may_erase(turns ? fmt::format("a count of {} turns", before.turns()) : "", result)) return;
  static_cast<void>(send(*find_command(unit_, clause.command), {}));
  const CommandResult at_once = line_.run(*find_command(unit_, Verb::read), {});
  line_.wait_for(std::chrono::milliseconds(clause.value) + settling);
  const Reading after = read();
  const bool silent = !at_once.heard;
  conclude(result, silent && is_near(after, before.singleturn),
           with_tolerance(fmt::format("at once: {}; later position {}, {} before", silent ? "no answer" : "an answer",
                                      after.singleturn, before.singleturn)));
}

// ---- Saving and restoring values

std::int64_t ChangeTester::save(Saved one) {
  one.value = one.look();
  saved_.push_back(std::move(one));
  return saved_.back().value;
}

std::int64_t ChangeTester::save_byte(std::uint32_t page, std::uint32_t address) {
  const Command& setter = *find_command(unit_, Verb::memory_write);
  const auto write = [this, &setter, page, address](std::int64_t value) {
    const auto arguments = role_arguments(setter, {{Role::page, page}, {Role::address, address}, {Role::value, value}});
    static_cast<void>(run(setter, arguments));
  };
  const std::int64_t value = save({.look = [this, page, address] { return read_byte(page, address); }, .write = write});
  const bool paged = find_role(setter.arguments, Role::page) != nullptr;
  saved_.back().restore_command = fmt::format("absenc memory write {} 0x{:02X} 0x{:02X}{}", name_, address, value,
                                              paged ? fmt::format(" --page {}", page) : "");
  return value;
}

std::int64_t ChangeTester::save_setting(const Clause& clause) {
  const Setting setting = require_setting(unit_, clause.setting);
  const auto look = [this, setting, field = clause.field] {
    const CommandResult ran = run(*setting.getter, complete_arguments(*setting.getter, {}));
    const std::int64_t value = number_of(ran.answer, field);
    line_.note_setting(*setting.setter, value);
    return value;
  };
  const auto write = [this, setting](std::int64_t value) {
    static_cast<void>(run(*setting.setter, complete_arguments(*setting.setter, std::array{value})));
    line_.note_setting(*setting.setter, value);
  };
  const std::int64_t value = save({.look = look, .write = write});
  std::string restore_command = fmt::format("absenc config set {} {} {}", name_, clause.setting, value);
  if (!setting.setter->changes_option.empty()) {
    const std::int64_t wanted = value == clause.value ? clause.other : clause.value;
    restore_command += fmt::format(" --option {}={}", setting.setter->changes_option, wanted);
  }
  saved_.back().restore_command = std::move(restore_command);
  return value;
}

void ChangeTester::put_back() {
  while (!saved_.empty()) {
    const Saved one = std::move(saved_.back());
    saved_.pop_back();
    if (!put_back(one) && !one.restore_command.empty()) restore_commands_.push_back(one.restore_command);
  }
}

// Restores one value or returns false. An interrupt must wait until all values are restored.
bool ChangeTester::put_back(const Saved& one) {
  for (unsigned i = 0; i < tries; ++i) {
    try {
      line_.wait_for(settling);
      if (one.look() == one.value) return true;
      one.write(one.value);
      if (one.look() == one.value) return true;
    } catch (const os::Interrupted&) {
      interrupted_ = true;
    } catch (const os::Ended&) {
      interrupted_ = true;
    } catch (const ClauseBroken&) {  // the loop tries again: a command failed, or a value is not as expected
    } catch (const std::exception&) {
    }
  }
  return false;
}

// ---- Access to the line

CommandResult ChangeTester::run(const Command& command, Arguments arguments) const {
  CommandResult ran = line_.run(command, arguments);
  if (ran.error == Error::none) return ran;
  throw ClauseBroken{fmt::format("{}: {} {}", command.name, text_of(ran.error).name, ran.detail)};
}

// Returns the decoded reply of the memory; nothing if the reply is missing or bad.
std::optional<BusyReply> ChangeTester::busy_reply(const SingleExchange& sent) const {
  if (sent.reply.frame().empty()) return std::nullopt;
  BusySink sink;
  const Error error = unit_.decode(line_.options(), sent.request.frame(), sent.reply.frame(), sink);
  if (error == Error::busy) sink.reply.busy = true;
  return error == Error::none || error == Error::busy ? std::optional(sink.reply) : std::nullopt;
}

SingleExchange ChangeTester::send(const Command& command, Arguments arguments) const {
  std::vector<std::uint8_t> request(longest_request);
  const auto size = unit_.encode(line_.options(), command, arguments, request);
  if (!size) throw ClauseBroken{fmt::format("{}: {}", command.name, text_of(size.error()).name)};
  request.resize(*size);
  return line_.send(request);
}

Reading ChangeTester::read() const {
  const CommandResult ran = run(*find_command(unit_, Verb::read), {});
  if (!ran.reading) throw ClauseBroken{"no position was told"};
  return *ran.reading;
}

// Returns the byte or word of the memory at this address.
std::int64_t ChangeTester::read_byte(std::uint32_t page, std::uint32_t address) const {
  const Command& getter = *find_command(unit_, Verb::memory_read);
  const CommandResult ran =
      run(getter, role_arguments(getter, {{Role::page, page}, {Role::address, address}, {Role::count, 1}}));
  if (ran.value) return *ran.value;
  if (ran.data.size() < word_bytes(unit_)) throw ClauseBroken{"no byte was told"};
  return static_cast<std::int64_t>(load_little_endian(Bytes(ran.data).first(word_bytes(unit_))));
}

}  // namespace absenc::client
