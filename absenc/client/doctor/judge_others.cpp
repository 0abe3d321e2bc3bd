// SPDX-License-Identifier: Apache-2.0
// Judges replies of another model or another kind of device.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absenc/capture/search/hypotheses.hpp"
#include "absenc/client/doctor/damage.hpp"
#include "absenc/client/doctor/judges.hpp"
#include "absenc/client/doctor/words.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/find_crc.hpp"
#include "absenc/client/identify/candidate.hpp"
#include "absenc/client/text/unit_text.hpp"

namespace absenc::client {

namespace {

// Returns the setting of the encoder's address, as "address=3"; empty if the unit has no addresses.
std::vector<std::string> address_settings(const Unit& unit, const Options& options) {
  const Option* option = find_role(unit.options, Role::encoder);
  if (option == nullptr) return {};
  return {fmt::format("{}={}", option->name,
                      to_text(*option, options[static_cast<std::size_t>(option - unit.options.data())]))};
}

bool is_printed(std::uint8_t byte) { return std::isprint(byte) != 0 || byte == '\r' || byte == '\n' || byte == '\t'; }

std::size_t printed(Bytes bytes) {
  return static_cast<std::size_t>(std::count_if(bytes.begin(), bytes.end(), is_printed));
}

// Returns whether at least 90 % of the bytes of the unit's good example replies are text.
bool speaks_text(const Unit& unit) {
  std::size_t all = 0;
  std::size_t text = 0;
  for (const Vector& vector : unit.vectors) {
    if (vector.error != Error::none) continue;
    all += vector.reply.size();
    text += printed(vector.reply);
  }
  return all != 0 && text * 10 >= all * 9;
}

// Returns the line of text at the index `at` in quotes, with up to 32 characters, and '.' for those that are not
// printable.
std::string quoted(Bytes bytes, std::size_t at) {
  constexpr std::size_t most = 32;
  std::string text = "\"";
  for (const std::uint8_t byte : bytes.subspan(at).first(std::min(most, bytes.size() - at))) {
    if (byte == '\r' || byte == '\n') break;
    text += std::isprint(byte) != 0 && byte != '"' ? static_cast<char>(byte) : '.';
  }
  return text + "\"";
}

// Returns the checksums that would explain the received frames; returns none if `find_crc` refuses the frames.
CheckFindings checks_of(const std::vector<CheckedFrame>& frames) {
  try {
    return find_crc(frames);
  } catch (const UsageError&) {  // `find_crc` throws this if, for example, there are too few frames
    return {};
  }
}

bool is_same_kind(const FoundCheck& one, const FoundCheck& other) {
  return one.name == other.name && (one.name != "crc" || (one.parameters.width == other.parameters.width &&
                                                          one.parameters.poly == other.parameters.poly));
}

bool is_of_unit(const FoundCheck& check, const Unit& unit) {
  std::vector<CheckedFrame> frames;
  for (const Vector& vector : unit.vectors) {
    if (vector.error == Error::none && vector.reply.size() > 2) {
      frames.push_back({{vector.reply.begin(), vector.reply.end()}, 0});
    }
  }
  return std::ranges::any_of(checks_of(frames).checks, [&](const FoundCheck& own) { return is_same_kind(own, check); });
}

}  // namespace

std::vector<std::string> settings_to_set(const Unit& unit, const Options& wanted, const Options& now) {
  if (wanted.values == now.values) return {};
  std::vector<std::string> settings = settings_for(unit, wanted);
  std::erase_if(settings, [&](const std::string& setting) {
    const std::vector<std::string> said = option_texts(unit, now);
    return std::find(said.begin(), said.end(), setting) != said.end();
  });
  if (!settings.empty()) return settings;
  if (wanted.model != nullptr) return {fmt::format("model={}", wanted.model->name)};
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    if (wanted[i] == now[i]) continue;
    settings.push_back(fmt::format("{}={}", unit.options[i].name, to_text(unit.options[i], wanted[i])));
  }
  return settings;
}

std::string good_as_said(std::size_t good, std::size_t tried) {
  return good == 0 ? "no good reply" : fmt::format("{} of {} replies good", good, tried);
}

std::string said_settings(const Unit& unit, const Options& options) {
  const std::vector<std::string> settings = settings_for(unit, options);
  return settings.empty() ? "the usual settings" : fmt::format("{}", fmt::join(settings, ", "));
}

std::optional<Finding> text_of_others(const Case& one, Bytes bytes) {
  constexpr std::size_t enough = 12;
  constexpr std::array<std::string_view, 6> words{"ERROR\r\n", "NO CARRIER", "OK\r\n", "login:", "Password:", "$G"};
  const std::string text(bytes.begin(), bytes.end());
  for (const std::string_view word : words) {
    const std::size_t at = text.find(word);
    if (at != std::string::npos) return finding(FindingKind::modem_answers, {quoted(bytes, at)});
  }
  // least number of different characters that a text has: a repeated frame of another protocol may contain a few
  // letters, too
  constexpr std::size_t enough_kinds = 6;
  const bool has_lines = text.find_first_of("\r\n") != std::string::npos;
  if (bytes.size() < enough || !has_lines || std::set(text.begin(), text.end()).size() < enough_kinds) return {};
  if (printed(bytes) * 20 < bytes.size() * 19 || speaks_text(one.unit)) return {};
  const auto begin =
      std::find_if(bytes.begin(), bytes.end(), [](std::uint8_t byte) { return std::isgraph(byte) != 0; });
  return finding(FindingKind::modem_answers, {quoted(bytes, static_cast<std::size_t>(begin - bytes.begin()))});
}

// Searches, as `identify` does, for options that explain the replies, but only options of this unit, and with the
// encoder's address unchanged.
std::optional<Finding> other_settings(const Case& one, const All& all) {
  // least number of replies from which other options are concluded; fewer replies are too weak evidence
  constexpr std::size_t enough = 4;
  if (all.size() < enough) return {};
  std::vector<capture::ObservedExchange> exchanges;
  for (const Attempted* attempt : all) exchanges.push_back(attempt->exchange);
  // Takes at most 32 replies, spread over all: if the shaft is slow, the first ones may also fit a lower resolution.
  constexpr std::size_t most_tried = 32;
  const std::size_t count = std::min(exchanges.size(), most_tried);
  for (std::size_t i = 0; i < count; ++i) exchanges[i] = exchanges[i * exchanges.size() / count];
  exchanges.resize(count);
  const std::vector<std::string> address = address_settings(one.unit, one.options);
  std::vector<OptionText> known;
  for (const std::string& setting : address) known.push_back(split_setting(setting));
  const std::vector<capture::Hypothesis> found = capture::find_hypotheses(one.unit, known, exchanges);
  if (found.empty()) return {};
  const capture::Hypothesis& best = found.front();
  const bool mostly = best.evidence.explained * 10 >= best.evidence.tried * 9;
  if (!mostly || best.evidence.frames > capture::frames_suffice) return {};
  const std::vector<std::string> settings = settings_to_set(one.unit, best.options, one.options);
  if (settings.empty()) return {};
  return finding(FindingKind::wrong_settings,
                 {said_settings(one.unit, one.options), fmt::format("{}", fmt::join(settings, ", ")),
                  fmt::format("{}", best.evidence.explained), fmt::format("{}", exchanges.size()),
                  good_as_said(one.good, one.seen.readings.size())});
}

std::optional<Finding> other_checksum(const Case& one, const All& all) {
  const auto wrong = std::count_if(all.begin(), all.end(),
                                   [](const Attempted* attempt) { return attempt->error == Error::bad_checksum; });
  if (all.empty() || static_cast<std::size_t>(wrong) * 10 < all.size() * 8) return {};
  std::vector<CheckedFrame> frames;
  for (const Attempted* attempt : all) {
    const auto& reply = attempt->exchange.reply;
    if (!reply.bytes.empty()) frames.push_back({reply.bytes, reply.bits});
  }
  const CheckFindings checks = checks_of(frames);
  if (checks.checks.empty() || checks.checks.front().chance > 1e-4) return {};
  const FoundCheck& check = checks.checks.front();
  if (is_of_unit(check, one.unit)) return {};
  const std::string name = check.name != "crc"
                               ? std::string(check.name)
                               : fmt::format("a CRC of {} bits with polynomial {:#x} and init {:#x}",
                                             check.parameters.width, check.parameters.poly, check.parameters.init);
  return finding(FindingKind::other_checksum, {fmt::format("{}", frames.size()), name});
}

}  // namespace absenc::client
