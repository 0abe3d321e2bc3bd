// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/esl/probe.hpp"

namespace absenc::esl {

namespace {

constexpr std::size_t choice_count(std::size_t option) { return options.infos[option].choices.size(); }

constexpr std::size_t combinations = [] {
  std::size_t product = 1;
  for (std::size_t i = 0; i < open_options; ++i) {
    if (i != option_sequence_step) product *= choice_count(i);
  }
  return product;
}();

// The n-th profile; number 0 has every default.
Profile nth_profile(const Profile& base, std::size_t number) {
  Profile profile = base;
  for (std::size_t i = 0; i < open_options; ++i) {
    if (i == option_sequence_step) continue;
    const std::size_t count = choice_count(i);
    const std::size_t value = (static_cast<std::size_t>(options.infos[i].default_value) + number % count) % count;
    options.put(profile, i, static_cast<std::int64_t>(value));
    number /= count;
  }
  return profile;
}

// What was asked, as far as the bytes of the request tell under this profile.
struct Asked {
  Request request{};
  bool parity_wrong = false;
  bool accepted = true;
};

Asked asked_by(const Profile& profile, const Capture& capture) {
  const Bytes bytes = capture.request.empty() ? capture.reply : capture.request;
  Asked asked;
  const std::optional<DataId> id = data_id(bytes[0]);
  if (!id) return {.accepted = false};
  asked.request = {*id, address_of(bytes[0])};
  asked.parity_wrong = bytes[0] != control_field(profile, asked.request.encoder_address, *id);
  if (is_memory_access(*id) && bytes.size() >= 3) {
    asked.request.memory_address = detail::address_from_wire(profile, bytes[1]);
    asked.request.value = bytes[2];
  }
  if (capture.request.empty()) return asked;
  const bool busy = is_memory_access(*id) && bytes.size() >= 3 && detail::busy_from_wire(profile, bytes[1]);
  asked.accepted =
      !busy && bytes.size() == request_length(profile, *id) &&
      (bytes.size() == 1 || checksum8(profile.crc_bit_order, bytes.first(bytes.size() - 1)) == bytes.back());
  return asked;
}

// An encoder answers only what it accepts, and reports a wrong parity bit only where there is one.
Check explain(const Profile& profile, const Capture& capture) {
  if (capture.reply.empty()) return Check::passed;
  const Asked asked = asked_by(profile, capture);
  if (!asked.accepted) return capture.request.empty() ? Check::other_command : Check::request_not_accepted;
  Profile as_sent = profile;
  if (asked.parity_wrong) {
    as_sent.parity_scope = profile.parity_scope == ParityScope::all ? ParityScope::command : ParityScope::all;
  }
  Reply reply;
  const Check check = check_reply(as_sent, asked.request, capture.reply, reply);
  if (!asked.parity_wrong) return check;
  if (check == Check::parity_reported) {
    // All else must be right.
    reply.one.status &= static_cast<std::uint8_t>(~status::rejected);
    reply.two.status &= static_cast<std::uint8_t>(~status::rejected);
    return detail::check_content(as_sent, layout_of(reply.id), reply);
  }
  return check == Check::passed && !is_memory_access(asked.request.id) ? Check::request_not_accepted : check;
}

// How far a profile comes: a later capture, then a later check.
struct Progress {
  std::size_t capture = 0;
  Check failed = Check::passed;

  // An encoder that would not even have answered explains least.
  [[nodiscard]] int rank() const { return failed == Check::request_not_accepted ? 0 : static_cast<int>(failed); }
  [[nodiscard]] bool fits() const { return failed == Check::passed; }
  [[nodiscard]] bool better_than(const Progress& other) const {
    if (fits() != other.fits()) return fits();
    if (capture != other.capture) return capture > other.capture;
    return rank() > other.rank();
  }
};

Progress progress_of(const Profile& profile, std::span<const Capture> captures) {
  for (std::size_t i = 0; i < captures.size(); ++i) {
    const Check check = explain(profile, captures[i]);
    if (check != Check::passed) return {i, check};
  }
  return {};
}

void judge_sequence(ProbeResult& result, std::span<const Capture> captures) {
  auto& values = result.values[option_sequence_step];
  for (Evidence& evidence : values) evidence.possible = true;
  bool known = false;
  std::uint8_t last = 0;
  std::uint8_t safety = 0;   // replies with a counter since the last one seen
  std::uint8_t request = 0;  // requests
  for (std::size_t i = 0; i < captures.size(); ++i) {
    ++request;
    if (captures[i].reply.empty()) {  // whether it was counted is not known
      known = false;
      continue;
    }
    const Asked asked = asked_by(result.best, captures[i]);
    if (!has_sequence(asked.request.id)) continue;
    ++safety;
    Reply reply;
    static_cast<void>(check_reply(result.best, asked.request, captures[i].reply, reply));
    const auto moved = static_cast<std::uint8_t>(reply.one.sequence - last);
    if (known) {
      const auto exclude = [&values, i](SequenceStep step, Check why) {
        Evidence& evidence = values[static_cast<std::size_t>(step)];
        if (evidence.possible) evidence = {false, i, why};
      };
      if (moved == 0) exclude(SequenceStep::change, Check::sequence_still);
      if (moved != safety) exclude(SequenceStep::safety, Check::sequence_jumped);
      if (moved != request) exclude(SequenceStep::request, Check::sequence_jumped);
    }
    known = true;
    last = reply.one.sequence;
    safety = request = 0;
  }
  for (std::size_t i = values.size(); i-- > 0;) {
    if (values[i].possible) options.put(result.best, option_sequence_step, static_cast<std::int64_t>(i));
  }
}

}  // namespace

ProbeResult probe(const Profile& base, std::span<const Capture> captures) {
  ProbeResult result;
  result.best = nth_profile(base, 0);
  std::array<std::array<Progress, 3>, open_options> best{};
  for (auto& option : best) option.fill({0, Check::request_not_accepted});  // explains least
  for (std::size_t number = 0; number < combinations; ++number) {
    const Profile profile = nth_profile(base, number);
    const Progress progress = progress_of(profile, captures);
    if (progress.fits() && result.profiles++ == 0) result.best = profile;
    for (std::size_t i = 0; i < open_options; ++i) {
      Progress& so_far = best[i][static_cast<std::size_t>(options.get(profile, i))];
      if (progress.better_than(so_far)) so_far = progress;
    }
  }
  // Of one frame it changes nothing.
  best[option_sequence_step].fill(
      best[option_sequence_step][static_cast<std::size_t>(options.get(result.best, option_sequence_step))]);
  for (std::size_t i = 0; i < open_options; ++i) {
    for (std::size_t value = 0; value < choice_count(i); ++value) {
      const Progress& progress = best[i][value];
      result.values[i][value] = {progress.fits(), progress.capture, progress.failed};
    }
  }
  if (result.profiles != 0) judge_sequence(result, captures);
  return result;
}

std::string_view sentence(const ProbeResult& result, std::size_t option, std::size_t value) {
  const Evidence& evidence = result.values[option][value];
  if (!evidence.possible) return text_of(evidence.why).sentence;
  return result.possible(option) == 1 ? "only this value explains all frames" : "these frames do not tell";
}

namespace {

// Whether the reply alone is good: the request went out under the profile in use.
bool explains(const Profile& profile, Bytes reply) { return explain(profile, {.reply = reply}) == Check::passed; }

// The request's parity bit was wrong only if the other scope makes another one.
bool parity_is_it(const Profile& profile, const Capture& capture) {
  const Asked asked = asked_by(profile, {.reply = capture.reply});
  Reply reply;
  if (!asked.accepted || check_reply(profile, asked.request, capture.reply, reply) != Check::parity_reported) {
    return false;
  }
  Profile other = profile;
  other.parity_scope = profile.parity_scope == ParityScope::all ? ParityScope::command : ParityScope::all;
  return asked_by(other, {.reply = capture.reply}).parity_wrong;
}

constexpr bool changes_replies(std::size_t option) {
  return option != option_sequence_step && option != option_request_crc && option != option_parity_scope;
}

}  // namespace

Change find_change(const Profile& profile, const Capture& capture) {
  if (capture.reply.empty()) return {};
  if (parity_is_it(profile, capture)) {
    return {{{{option_parity_scope, profile.parity_scope == ParityScope::all ? 0 : 1}}}, 1};
  }
  if (explains(profile, capture.reply)) return {};  // something else is wrong with it
  Change pair;
  for (std::size_t first = 0; first < open_options; ++first) {
    for (std::size_t a = 0; changes_replies(first) && a < choice_count(first); ++a) {
      Profile one = profile;
      const OptionValue change{first, static_cast<std::int64_t>(a)};
      options.put(one, first, change.value);
      if (change.value == options.get(profile, first)) continue;
      if (explains(one, capture.reply)) return {{change}, 1};
      for (std::size_t second = first + 1; pair.count == 0 && second < open_options; ++second) {
        for (std::size_t b = 0; changes_replies(second) && b < choice_count(second); ++b) {
          Profile two = one;
          const OptionValue also{second, static_cast<std::int64_t>(b)};
          options.put(two, second, also.value);
          if (also.value != options.get(profile, second) && explains(two, capture.reply)) pair = {{change, also}, 2};
        }
      }
    }
  }
  return pair;
}

}  // namespace absenc::esl
