// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/conform/readings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <utility>

#include "absenc/client/conform/evidence.hpp"
#include "absenc/client/error.hpp"

namespace absenc::client {

namespace {

std::string error_text(const Attempted& one) {
  const std::string_view name = error_texts[static_cast<std::size_t>(one.error)].name;
  return one.detail.empty() ? std::string(name) : fmt::format("{} {}", name, one.detail);
}

std::size_t distinct_counters(const Readings& readings) {
  std::set<std::int64_t> values;
  for (const Attempted& one : readings.all) {
    if (one.error == Error::none && one.counter) values.insert(*one.counter);
  }
  return values.size();
}

// Counts how many mixtures of two good replies the decoder rejects with one of `errors`.
std::size_t detected_mixtures(const Unit& unit, const Options& options, const Readings& readings, Errors errors) {
  const Attempted* const one = readings.first_good();
  std::size_t noticed = 0;
  for (const Attempted& other : readings.all) {
    const std::size_t bits = one->exchange.reply.bits;
    if (noticed != 0 || other.error != Error::none || other.exchange.reply.bits != bits) continue;
    capture::ObservedExchange mixed = other.exchange;
    for (std::size_t bit = 0; bit < bits; ++bit) {
      const auto mask = static_cast<std::uint8_t>(0x80U >> bit % 8);
      std::uint8_t& byte = mixed.reply.bytes[bit / 8];
      byte = static_cast<std::uint8_t>((byte & ~mask) | (one->exchange.reply.bytes[bit / 8] & mask));
      noticed += (errors & any_of(unit.check(options, mixed.request.frame(), mixed.reply.frame()))) != 0 ? 1 : 0;
    }
  }
  return noticed;
}

// Returns how many replies are no evidence of the reply to their own request; "" if there are none.
std::string doubt_text(const Readings& readings) {
  if (readings.in_doubt == 0) return {};
  return fmt::format("; {} replies came after a request without reply, and may be its late reply", readings.in_doubt);
}

}  // namespace

bool is_flat(const capture::ObservedFrame& reply) {
  const Frame frame = reply.frame();
  const std::size_t bits = frame.bits;
  for (std::size_t i = 1; i < bits; ++i) {
    if ((frame.bytes[i / 8] >> (7 - i % 8) & 1) != (frame.bytes[0] >> 7 & 1)) return false;
  }
  return bits != 0;
}

const Attempted* Readings::first_good() const {
  const auto found = std::find_if(all.begin(), all.end(), [](const Attempted& one) {
    return one.error == Error::none && !is_flat(one.exchange.reply);
  });
  return found == all.end() ? nullptr : &*found;
}

void judge_answered(const Readings& readings, ClauseResult& result) {
  result.evidence = "with these options nothing is asked";
  if (readings.requests == 0) return;
  const std::uint64_t good = readings.good - readings.good_in_doubt;
  std::string seen =
      fmt::format("{} of {} requests answered, {} of them well", readings.answered, readings.requests, good);
  if (readings.late != 0) seen += fmt::format(", {} late", readings.late);
  seen += doubt_text(readings);
  if (readings.answered != readings.requests) return conclude(result, false, std::move(seen));
  result.evidence = seen + ": what else came may be anything";
  if (good != 0) conclude(result, true, std::move(seen));
}

void judge_streamed(const Readings& readings, ClauseResult& result) {
  result.evidence = "with these options the encoder is asked";
  if (readings.requests != 0 || readings.all.empty()) return;
  std::string seen = fmt::format("{} good frames came by themselves", readings.good);
  const auto stopped = std::find_if(readings.all.begin(), readings.all.end(),
                                    [](const Attempted& one) { return one.error == Error::timeout; });
  const bool comes = readings.good != 0 && stopped == readings.all.end();
  const Attempted& worst = stopped != readings.all.end() ? *stopped : readings.all.front();
  if (!comes) seen += fmt::format("; {}", error_text(worst));
  conclude(result, comes, std::move(seen));
}

void judge_time(const Unit& unit, const Options& options, const Readings& readings, ClauseResult& result) {
  // the reply that is certainly late, or else the one that may be, whose time exceeds its limit most
  const Attempted* worst = nullptr;
  std::size_t timed = 0;
  const auto latest = [](const Attempted& one) { return one.answered_after + one.sent_late; };
  const auto excess = [&](const Attempted& one) {
    return std::pair(one.is_late(), (one.is_late() ? one.answered_after : latest(one)) - one.limit);
  };
  for (const Attempted& one : readings.all) {
    if (!was_answered(one) || one.limit == Time{} || (one.in_doubt && !one.is_late())) continue;
    const bool is_good = one.error == Error::none ||
                         unit.check(options, one.exchange.request.frame(), one.exchange.reply.frame()) == Error::none;
    if (!is_good) continue;
    ++timed;
    if (worst == nullptr || excess(one) > excess(*worst)) worst = &one;
  }
  result.evidence = "no good reply to a request came" + doubt_text(readings);
  if (worst == nullptr) return;
  const auto us = [](Time time) { return std::chrono::duration<double, std::micro>(time).count(); };
  const Time uncertainty = worst->latency + worst->sent_late;
  const Time waits = worst->limit - worst->latency;
  const std::string after =
      worst->answered_after >= Time{}
          ? fmt::format("after {}{:.1f} us", worst->in_doubt ? "at least " : "", us(worst->answered_after))
          : fmt::format("after less than the port's uncertainty of {:.1f} us", us(uncertainty));
  std::string seen =
      fmt::format("{} good replies, the latest {}, of {:.1f} us that a host waits", timed, after, us(waits));
  if (uncertainty > Time{}) seen += fmt::format("; this port tells it to within {:.1f} us", us(uncertainty));
  seen += doubt_text(readings);
  // The connection only adds to a reply's time, so a reply that is measured within the host's time is in time.
  result.evidence = seen + ": the limit lies within this uncertainty, so the reply may be late or not";
  if (worst->is_late()) return conclude(result, false, std::move(seen));
  if (latest(*worst) <= waits) conclude(result, true, std::move(seen));
}

void judge_frames(const Unit& unit, const Options& options, const Readings& readings, Errors errors,
                  ClauseResult& result) {
  std::size_t bad = 0;
  std::string first;
  for (const Attempted& one : readings.all) {
    if (one.error == Error::none || (errors & any_of(one.error)) == 0) continue;
    if (++bad == 1) first = fmt::format(": {}", error_text(one));
  }
  std::string seen = fmt::format("{} good replies, {} that break it{}", readings.good, bad, first);
  if (readings.discarded != 0) seen += fmt::format("; {} frames of the stream were discarded", readings.discarded);
  if (bad != 0) return conclude(result, false, std::move(seen));
  const Attempted* const good = readings.first_good();
  result.evidence = readings.good == 0
                        ? "no good reply came"
                        : "all bits were alike, as on a line that nobody drives: turn the shaft a little";
  if (good == nullptr) return;
  // an error of a counter shows only in two consecutive replies
  const bool about_counters = errors == any_of(Error::sequence_mismatch);
  const std::size_t noticed = about_counters ? 0 : detected_changes(unit, options, good->exchange, errors);
  if (noticed != 0) {
    return conclude(result, true, fmt::format("{}; of one changed it would be seen in {} ways", seen, noticed));
  }
  if (about_counters) {
    const std::size_t counters = distinct_counters(readings);
    result.evidence = "no reply carried a counter that moved";
    if (counters < 2) return;
    return conclude(result, true, fmt::format("{}; their counters had {} values", seen, counters));
  }
  const std::size_t mixed = detected_mixtures(unit, options, readings, errors);
  result.evidence = "with these options nothing could be wrong with it while the shaft stands still: turn it a little";
  if (mixed == 0) return;
  conclude(result, true, fmt::format("{}; of two mixed together it would be seen in {} ways", seen, mixed));
}

}  // namespace absenc::client
