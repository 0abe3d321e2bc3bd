// SPDX-License-Identifier: Apache-2.0
// Judges damaged replies by their content, and failures among good replies.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <bit>
#include <map>
#include <optional>

#include "absenc/client/doctor/damage.hpp"
#include "absenc/client/doctor/judges.hpp"
#include "absenc/client/doctor/words.hpp"
#include "absenc/client/port/diagnosis.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/core/bit_view.hpp"

namespace absenc::client {

namespace {

using ByteList = std::vector<std::uint8_t>;

bool is_damaged(const Attempted& one) { return one.error != Error::none && one.heard; }

// Returns the names of all errors of these replies: "bad_checksum, wrong_length".
std::string errors_of(const All& all) {
  std::vector<std::string_view> names;
  for (const Attempted* one : all) {
    const std::string_view name = text_of(one->error).name;
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

bool is_good(const Case& one, const Frame& request, Bytes reply) { return decodes(one, request, {.bytes = reply}); }

// ---- Judges for lines on which hardly any reply is good

Finding counted(FindingKind finding_kind, const Case& one, const All& those) {
  return finding(finding_kind,
                 {fmt::format("{}", those.size()), fmt::format("{}", one.seen.readings.size()),
                  to_hex(Bytes(those.front()->raw).first(std::min<std::size_t>(those.front()->raw.size(), 16)))});
}

// Returns whether `is` returns true for at least 8 of 10 readings; the remaining readings may be disturbed.
template <class Is>
bool most(const All& all, const Is& is) {
  const auto those = std::count_if(all.begin(), all.end(), [&](const Attempted* one) { return is(*one); });
  return !all.empty() && static_cast<std::size_t>(those) * 10 >= all.size() * 8;
}

// Gives the finding the unit's explanation of the error instead of the general one, if most replies have the same.
Finding explained(Finding found, const All& all) {
  const Attempted& last = *all.back();
  if (last.detail.empty() || !most(all, [&](const Attempted& one) { return one.detail == last.detail; })) return found;
  found.cause = last.detail;
  if (!last.advice.empty()) found.action = last.advice;
  return found;
}

// Returns the finding for transfers in which every bit was `level`.
Finding stuck_at(const Case& one, std::size_t transfers, bool level, FindingKind otherwise) {
  return finding(one.seen.data_driven == false ? FindingKind::transceiver_missing : otherwise,
                 {fmt::format("{}", transfers), level ? "1" : "0"});
}

std::optional<Finding> stuck_data(const Case& one, const All& all) {
  if (!host_clocks(one.unit.link)) return {};
  for (const std::uint8_t level : {std::uint8_t{0x00}, std::uint8_t{0xFF}}) {
    const auto is_level = [level](std::uint8_t byte) { return byte == level; };
    const bool stuck = most(all, [&](const Attempted& attempt) {
      return !attempt.raw.empty() && std::all_of(attempt.raw.begin(), attempt.raw.end(), is_level);
    });
    const bool is_stuck = most(all, [](const Attempted& attempt) { return attempt.error == Error::line_stuck; });
    if (!stuck && !(is_stuck && level == 0xFF)) continue;
    const Finding found = stuck_at(one, all.size(), level != 0, FindingKind::miso_stuck);
    return found.finding_kind == FindingKind::miso_stuck ? explained(found, all) : found;
  }
  return {};
}

std::optional<Finding> own_echo(const Case& one, const All& all) {
  if (one.unit.link != LinkKind::half_duplex && one.unit.link != LinkKind::full_duplex) return {};
  const auto echoes = [](const Attempted& attempt) {
    return !attempt.raw.empty() && attempt.raw == attempt.exchange.request.bytes;
  };
  if (!most(all, echoes)) return {};
  return finding(FindingKind::only_echo, {fmt::format("{}", all.size()), to_hex(all.front()->exchange.request.bytes)});
}

bool holds_two(const Case& one, const Attempted& attempt, const Frame& first) {
  const Frame request = attempt.exchange.request.frame();
  const Bytes bytes = attempt.exchange.reply.bytes;
  for (std::size_t size = 2; size + 1 < bytes.size(); ++size) {
    if (is_good(one, first, bytes.first(size)) && is_good(one, request, bytes.subspan(size))) return true;
  }
  return false;
}

std::optional<Finding> two_frames(const Case& one, const All& all) {
  if (one.unit.link != LinkKind::half_duplex && one.unit.link != LinkKind::full_duplex) return {};
  const auto is_double = [&](const Attempted* attempt) {
    return holds_two(one, *attempt, attempt->exchange.request.frame());
  };
  const auto two = static_cast<std::size_t>(std::count_if(all.begin(), all.end(), is_double));
  if (two * 2 < all.size() || two == 0) return {};
  const auto first = std::find_if(all.begin(), all.end(), is_double);
  return finding(FindingKind::two_answer, {fmt::format("{}", two), fmt::format("{}", all.size()), shown(**first)});
}

// Reports that two encoders reply at the same address, if a scan of the bus has found such an address.
std::optional<Finding> same_address(const Case& one, const All&) {
  if (one.seen.clash.empty()) return {};
  return finding(FindingKind::same_address, {one.seen.clash});
}

std::optional<Finding> extra_bytes(const Case& one, const All& all) {
  const All those = chosen(all, [&](const Attempted& attempt) { return has_good_part(one, attempt); });
  if (those.empty() || those.size() * 2 < all.size()) return {};
  return counted(FindingKind::extra_bytes, one, those);
}

std::optional<Finding> bytes_missing(const Case& one, const All& all) {
  const All those = chosen(all, [&](const Attempted& attempt) { return is_cut(one, attempt); });
  if (those.empty() || those.size() * 2 < all.size()) return {};
  return counted(FindingKind::bytes_missing, one, those);
}

std::optional<Finding> single_bits(const Case& one, const All& all) {
  const std::size_t mended = mended_by_one_bit(one, all);
  if (mended == 0) return {};
  return finding(FindingKind::damaged_bits,
                 {fmt::format("{}", all.size()), fmt::format("{}", one.seen.readings.size()), errors_of(all),
                  fmt::format("{} would be good with one bit changed", mended)});
}

// Returns whether the reply is good by itself but is no reply to this request.
bool answers_another(const Case& one, const Attempted& attempt) {
  return attempt.error != Error::none && one.unit.link != LinkKind::can && !attempt.exchange.request.frame().empty() &&
         !attempt.exchange.reply.frame().empty() && decodes(one, {}, attempt.exchange.reply.frame());
}

bool is_contradiction(const Attempted& attempt) {
  return attempt.error == Error::cross_check_failed || attempt.error == Error::sequence_mismatch ||
         attempt.error == Error::unexpected_reply;
}

// Makes the finding `contradictory`. At least one reading of `all` must have a reply that contradicts its request, an
// earlier reply or itself.
Finding contradiction(const Case& one, const All& all) {
  std::size_t count = 0;
  const Attempted* last = nullptr;
  for (const Attempted* attempt : all) {
    if (!is_contradiction(*attempt)) continue;
    ++count;
    last = attempt;
  }
  const ErrorText& text = text_of(last->error);
  return finding(FindingKind::contradictory,
                 {fmt::format("{}", count), fmt::format("{}", one.seen.readings.size()), std::string(text.name),
                  last->detail.empty() ? "" : fmt::format(": {}", last->detail),
                  last->advice.empty() ? std::string(text.advice) : last->advice});
}

std::optional<Finding> contradictory(const Case& one, const All& all) {
  if (!most(all, is_contradiction)) return {};
  return contradiction(one, all);
}

bool is_refusal(const Attempted& attempt) {
  return attempt.error == Error::busy || attempt.error == Error::request_rejected;
}

std::optional<Finding> refusal(const Case&, const All& all) {
  if (!most(all, is_refusal)) return {};
  const Attempted& last = *all.back();
  const ErrorText& text = text_of(last.error);
  return finding(FindingKind::refused, {last.detail.empty() ? std::string(text.description) : last.detail,
                                        last.advice.empty() ? std::string(text.advice) : last.advice});
}

std::optional<Finding> stretched(const Case& one, const All& all) {
  if (one.unit.link != LinkKind::half_duplex && one.unit.link != LinkKind::full_duplex) return {};
  if (const auto& damage = one.seen.damage; damage && damage->framing > 0) {
    return finding(FindingKind::baud_pattern,
                   {fmt::format("the UART counted {} characters without a stop bit", damage->framing)});
  }
  ByteList bytes;
  for (const Attempted* attempt : all) {
    const auto& reply = attempt->exchange.reply.bytes;
    bytes.insert(bytes.end(), reply.begin(), reply.end());
  }
  const auto is_run = [](std::uint8_t byte) {
    return std::popcount(static_cast<unsigned>((byte ^ (byte >> 1)) & 0x7F)) <= 1;
  };
  std::map<std::uint8_t, int> distinct;
  for (const std::uint8_t byte : bytes) ++distinct[byte];
  constexpr std::size_t enough = 16;
  if (bytes.size() < enough || distinct.size() < 3 || !std::all_of(bytes.begin(), bytes.end(), is_run)) return {};
  return finding(FindingKind::baud_pattern, {fmt::format("long runs of equal bits, such as {}", shown(*all.front()))});
}

// ---- Judges for lines on which some replies are good

// The bytes and bits in which a damaged reply differs from the usual reply of a shaft at rest.
struct Damage {
  std::size_t first = 0;  // indexes in the reply of the first and the last byte that differ from the usual reply
  std::size_t last = 0;
  std::size_t flips = 0;
};

std::optional<Damage> compare(const ByteList& reply, const ByteList& good) {
  if (reply.size() != good.size()) return {};
  Damage damage{.first = good.size()};
  for (std::size_t i = 0; i < good.size(); ++i) {
    const auto flips = static_cast<std::size_t>(std::popcount(static_cast<unsigned>(reply[i] ^ good[i])));
    if (flips == 0) continue;
    damage.first = std::min(damage.first, i);
    damage.last = i;
    damage.flips += flips;
  }
  return damage;
}

// Returns the reply that nearly all good replies are equal to; empty if there is none.
ByteList usual_reply(const std::vector<Attempted>& readings) {
  std::map<ByteList, std::size_t> counts;
  std::size_t good = 0;
  for (const Attempted& one : readings) {
    if (one.error != Error::none || one.exchange.reply.bytes.empty()) continue;
    ++good;
    ++counts[one.exchange.reply.bytes];
  }
  const auto usual = std::max_element(counts.begin(), counts.end(),
                                      [](const auto& one, const auto& other) { return one.second < other.second; });
  const bool is_usual = usual != counts.end() && good >= 8 && usual->second * 10 >= good * 9;
  return is_usual ? usual->first : ByteList{};
}

// Counts the damaged frames of a stream that were discarded without making a reading fail.
std::uint64_t unreported(const std::vector<Attempted>& readings) {
  std::uint64_t count = 0;
  for (const Attempted& one : readings) {
    count += one.discarded - std::min<std::uint64_t>(one.discarded, is_damaged(one) ? 1 : 0);
  }
  return count;
}

All heard(const std::vector<Attempted>& attempts) {
  All all;
  for (const Attempted& attempt : attempts) {
    if (attempt.heard) all.push_back(&attempt);
  }
  return all;
}

// A clocked line always delivers bits, so a constant level counts as silence.
bool is_silent(const Attempted& one) {
  return one.error != Error::none && (!one.heard || one.error == Error::line_stuck);
}

// Returns whether the reply is shorter than each good reply: this computer may have read the end of it too late.
bool is_cut(const Observations& seen, const Attempted& attempt) {
  return std::ranges::none_of(seen.readings, [&](const Attempted& one) {
    return one.error == Error::none && one.exchange.reply.bytes.size() <= attempt.exchange.reply.bytes.size();
  });
}

// Returns the damaged replies to requests that were then repeated; none if as many of these requests got no reply at
// all, because then late replies may have collided with the next requests.
All damaged_requests(const Case& one) {
  All all = damaged(one.seen.repeated);
  std::erase_if(all, [&](const Attempted* attempt) {
    return is_silent(*attempt) || is_refusal(*attempt) || has_good_part(one, *attempt);
  });
  const auto silent = static_cast<std::size_t>(std::ranges::count_if(one.seen.repeated, is_silent));
  return silent >= all.size() ? All{} : all;
}

Finding some_damage(const Case& one, const All& all) {
  const std::uint64_t more = unreported(one.seen.readings);
  std::vector<std::string> values{fmt::format("{}", all.size() + more),
                                  fmt::format("{}", one.seen.readings.size() + one.seen.repeated.size() + more),
                                  errors_of(all)};
  const ByteList usual = usual_reply(one.seen.readings);
  if (usual.empty()) return finding(FindingKind::sometimes_damaged, values);
  // greatest number of wrong bits that count as a short disturbance, one that lasts about as long as a bit
  constexpr std::size_t few = 3;
  std::size_t single = 0;
  std::size_t compared = 0;
  Damage sum{.first = usual.size()};
  for (const Attempted* attempt : all) {
    const auto damage = compare(attempt->exchange.reply.bytes, usual);
    if (!damage || damage->flips == 0) continue;
    ++compared;
    single += damage->flips <= few ? 1 : 0;
    sum.first = std::min(sum.first, damage->first);
    sum.last = std::max(sum.last, damage->last);
    sum.flips += damage->flips;
  }
  const bool bits = single * 2 > all.size();
  values.push_back(compared == 0 ? "bytes are missing or too many"
                                 : fmt::format("{} in all, in bytes {} to {} of {}", sum.flips, sum.first + 1,
                                               sum.last + 1, usual.size()));
  return finding(bits ? FindingKind::damaged_bits : FindingKind::damaged_bursts, values);
}

}  // namespace

bool all_at_rest(const std::vector<Attempted>& readings) {
  return !readings.empty() && std::ranges::all_of(readings, [](const Attempted& one) {
    const std::size_t bits = std::min(one.exchange.reply.bits, 8 * one.raw.size());
    const BitView view(one.raw, bits);
    for (std::size_t i = 0; i < bits; ++i) {
      if (!view[i]) return false;
    }
    return bits != 0;
  });
}

void judge_rest(const Case& one, std::vector<Finding>& findings) {
  if (!host_clocks(one.unit.link) || one.good == 0 || !all_at_rest(one.seen.readings)) return;
  findings.push_back(stuck_at(one, one.seen.readings.size(), true, FindingKind::data_at_rest));
}

Finding some_silence(const Observations& seen, std::size_t silent, std::size_t all) {
  return finding(FindingKind::sometimes_silent,
                 {fmt::format("{}", silent), fmt::format("{}", all),
                  seen.is_stream ? "frames of the stream did not come" : "requests were not answered"});
}

void judge_bad_frames(const Case& one, std::vector<Finding>& findings) {
  const All all = damaged(one.seen.readings);
  if (all.empty()) return;
  constexpr std::array looks{stuck_data,     own_echo,       damage_by_adapter, two_frames, extra_bytes,
                             other_settings, single_bits,    bytes_missing,     refusal,    contradictory,
                             same_address,   other_checksum, stretched};
  for (const auto& look : looks) {
    if (std::optional<Finding> found = look(one, all)) {
      findings.push_back(std::move(*found));
      return;
    }
  }
  // Reports no damage if fewer than one in ten replies are damaged: then the main fault is silence, which another judge
  // reports.
  if (all.size() * 10 < one.seen.readings.size()) return;
  findings.push_back(explained(
      finding(FindingKind::always_damaged, {fmt::format("{}", all.size()), errors_of(all), shown(*all.front())}), all));
}

Finding finding_of(const Unit& unit, const Options& options, PortKind place, const Attempted& last, bool usually_good,
                   bool late) {
  const auto suited = [place](Finding found) {
    suit(found, place);
    return found;
  };
  if (late && last.error == Error::timeout) return suited(finding(FindingKind::reply_late, {"", "", "", ""}));
  if (usually_good) {
    return suited(last.heard ? finding(FindingKind::sometimes_damaged, {"", "", ""})
                             : finding(FindingKind::sometimes_silent, {"", "", ""}));
  }
  // Even a single frame can show that another model is connected.
  const auto& [request, reply] = last.exchange;
  if (last.error != Error::none && !reply.frame().empty()) {
    const std::string setting = diagnose(unit, options, request.frame(), reply.frame()).setting;
    if (!setting.empty()) return finding(FindingKind::wrong_settings, {"", setting, "", "", "", ""});
  }
  Observations seen;
  seen.place = place;
  seen.readings.push_back(last);
  const Examination one = judge(unit, options, seen);
  return one.findings.empty() ? finding(FindingKind::always_damaged, {"", "", ""}) : one.findings.front();
}

void judge_mixed_frames(const Case& one, std::vector<Finding>& findings) {
  All all = damaged(one.seen.readings);
  const All repeated = damaged_requests(one);
  const All of_stream = damaged(one.seen.damaged_frames);
  // A reading that repeats its requests may be good although an adapter damages some replies.
  All by_adapter = one.seen.is_stream ? of_stream : all;
  by_adapter.insert(by_adapter.end(), repeated.begin(), repeated.end());
  if (std::optional<Finding> adapter = damage_by_adapter(one, by_adapter)) {
    findings.push_back(std::move(*adapter));
    return;
  }
  if (one.seen.doubled > 0) {
    const std::string frame = shown(one.seen.readings.front());
    findings.push_back(finding(FindingKind::extra_bytes,
                               {fmt::format("{}", one.seen.doubled), fmt::format("{}", one.seen.readings.size()),
                                fmt::format("{} {}", frame, frame)}));
    return;
  }
  if (most(all, [](const Attempted& attempt) { return attempt.error == Error::out_of_range; })) {
    // The checksums are right, but values are out of range, so the frames may have another format than the options
    // state. With other options all replies may be good, including those that are good with the present options.
    if (std::optional<Finding> other = other_settings(one, heard(one.seen.readings))) {
      findings.push_back(std::move(*other));
      return;
    }
  }
  if (std::optional<Finding> bursts = coming_and_going(one)) {
    findings.push_back(std::move(*bursts));
    return;
  }
  const auto take = [&all](const auto& is) {
    All taken;
    std::erase_if(all, [&](const Attempted* attempt) {
      if (is(*attempt)) taken.push_back(attempt);
      return is(*attempt);
    });
    return taken;
  };
  std::erase_if(all, [](const Attempted* attempt) { return is_silent(*attempt); });
  const auto is_misheard = [&](const Attempted& attempt) {
    return is_refusal(attempt) || (!has_good_part(one, attempt) && answers_another(one, attempt));
  };
  // A checksum misses some damaged replies, which may then look like replies to other requests.
  constexpr std::size_t damaged_for_each_missed = 20;
  const All misheard = take(is_misheard);
  const bool is_any_refused = std::ranges::any_of(misheard, [](const Attempted* each) { return is_refusal(*each); });
  if (!is_any_refused && misheard.size() * damaged_for_each_missed <= all.size()) {
    all.insert(all.end(), misheard.begin(), misheard.end());
  } else if (!misheard.empty()) {
    findings.push_back(
        finding(FindingKind::requests_damaged,
                {fmt::format("{}", misheard.size()), fmt::format("{}", one.seen.readings.size()),
                 misheard.back()->detail.empty() ? std::string(text_of(misheard.back()->error).description)
                                                 : misheard.back()->detail}));
  }
  // A reply that contradicts its request, an earlier reply or itself is reported only if no reply has other damage: the
  // contradiction may come from damage that the checksum missed.
  if (!all.empty() && std::ranges::all_of(all, [](const Attempted* attempt) { return is_contradiction(*attempt); })) {
    findings.push_back(contradiction(one, all));
    all.clear();
  }
  const auto silent = static_cast<std::size_t>(std::ranges::count_if(one.seen.readings, is_silent) +
                                               std::ranges::count_if(one.seen.repeated, is_silent));
  if (std::optional<Finding> two = two_frames(one, all); two && all.size() * 4 > one.seen.readings.size()) {
    findings.push_back(std::move(*two));
  } else if (one.seen.overfull * 4 > one.seen.readings.size()) {
    constexpr std::size_t most_shown = 32;
    const Bytes example = one.seen.overfull_example;
    findings.push_back(finding(FindingKind::two_answer,
                               {fmt::format("{}", one.seen.overfull), fmt::format("{}", one.seen.readings.size()),
                                to_hex(example.first(std::min(example.size(), most_shown)))}));
  } else if (std::optional<Finding> extra = extra_bytes(one, all)) {
    // A late reply arrives before the reply to the next request, and both together look like a reply with extra bytes.
    const bool are_late =
        std::ranges::all_of(all, [&](const Attempted* one_of) { return holds_two(one, *one_of, {}); });
    const bool is_explained = are_late && (silent >= all.size() || may_be_the_computer(one.seen, all.size()));
    if (!is_explained) findings.push_back(std::move(*extra));
  } else if (!all.empty() || !repeated.empty()) {
    All both = all;
    both.insert(both.end(), repeated.begin(), repeated.end());
    const bool are_cut = std::ranges::all_of(all, [&](const Attempted* attempt) { return is_cut(one.seen, *attempt); });
    if (!are_cut || !may_be_the_computer(one.seen, both.size())) findings.push_back(some_damage(one, both));
  }
  const std::uint64_t late = one.unit.link == LinkKind::can ? 0 : one.seen.late;
  // A late reply may collide with the next request, so that the next reading fails as well.
  if (silent > 2 * late && !may_be_the_computer(one.seen, silent)) {
    findings.push_back(some_silence(one.seen, silent, one.seen.readings.size() + one.seen.repeated.size()));
  }
}

}  // namespace absenc::client
