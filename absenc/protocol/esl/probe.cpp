// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/esl/probe.hpp"

#include <algorithm>
#include <array>

#include "absenc/protocol/esl/reply.hpp"

namespace absenc::esl {

namespace {

constexpr std::size_t option_sequence_step = options.find("sequence_step");
constexpr std::size_t option_parity_scope = options.find("parity_scope");

constexpr std::size_t choice_count(std::size_t option) { return options.infos[option].choices.size(); }

constexpr std::size_t combinations = [] {
  std::size_t product = 1;
  for (std::size_t i = 0; i < open_options; ++i) {
    if (i != option_sequence_step) product *= choice_count(i);
  }
  return product;
}();

// Returns a profile with combination `number` of the options that the document leaves open, without sequence_step.
// Number 0 is the combination of the defaults.
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

Profile with_other_parity(Profile profile) {
  profile.parity_scope = profile.parity_scope == ParityScope::all ? ParityScope::command : ParityScope::all;
  return profile;
}

// The request of a capture, decoded as far as a profile permits. If the request was not captured, it is the request
// that the reply echoes.
struct SentRequest {
  Request request{};
  bool parity_wrong = false;
  bool accepted = false;
};

SentRequest request_in(const Profile& profile, const Capture& capture) {
  const Bytes bytes = capture.request.empty() ? capture.reply : capture.request;
  const std::optional<DataId> id = data_id(bytes[0]);
  if (!id) return {};
  bool busy = false;
  const Request request = detail::split_request(profile, *id, bytes, busy);
  const bool good =
      !busy && bytes.size() == request_length(profile, *id) &&
      (bytes.size() == 1 || checksum8(profile.crc_bit_order, bytes.first(bytes.size() - 1)) == bytes.back());
  return {.request = request,
          .parity_wrong = bytes[0] != control_field(profile, request.encoder_address, *id),
          .accepted = good || capture.request.empty()};
}

// Returns the check that the reply of a capture fails under this profile. An encoder answers only requests that it
// accepts, so a reply to another request is a failure too.
Check explain(const Profile& profile, const Capture& capture) {
  if (capture.reply.empty()) return Check::passed;
  const SentRequest asked = request_in(profile, capture);
  if (!asked.accepted) return capture.request.empty() ? Check::other_command : Check::request_not_accepted;
  const Profile as_sent = asked.parity_wrong ? with_other_parity(profile) : profile;
  Reply reply;
  const Check check = check_reply(as_sent, asked.request, capture.reply, reply);
  if (!asked.parity_wrong) return check;
  if (check == Check::parity_reported) {
    // In a reply that reports a parity error, all the other parts must be right.
    reply.one.status &= static_cast<std::uint8_t>(~status::rejected);
    reply.two.status &= static_cast<std::uint8_t>(~status::rejected);
    return detail::check_content(as_sent, layout_of(reply.id), reply);
  }
  return check == Check::passed && !is_memory_access(asked.request.id) ? Check::request_not_accepted : check;
}

// Result of comparing a profile with captures: the first capture that it does not explain, and the check that this
// capture failed.
struct Progress {
  std::size_t capture = 0;
  Check failed = Check::passed;

  // Returns the rank of the failed check: of two profiles that fail at the same capture, the one with the higher rank
  // is better. The lowest rank is for `request_not_accepted`, because the encoder would not have answered the request.
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

// For each value of an option: how far the captures agree with the best of all profiles that have this value.
using ReachedByValue = std::array<Progress, most_choices>;
using Reached = std::array<ReachedByValue, open_options>;

// Stores in `values` which values of the option sequence_step fit the captures, and in `best` the first of them.
void judge_sequence(Profile& best, std::span<const Capture> captures, ReachedByValue& values) {
  values.fill({});
  bool known = false;
  std::uint8_t last = 0;
  // number of replies with a sequence counter after the last captured counter, up to the present reply
  std::uint8_t safety = 0;
  std::uint8_t request = 0;  // number of requests after the last captured sequence counter, up to the present request
  for (std::size_t i = 0; i < captures.size(); ++i) {
    ++request;
    if (captures[i].reply.empty()) {  // without a reply it is unknown whether the encoder counted the request
      known = false;
      continue;
    }
    const SentRequest asked = request_in(best, captures[i]);
    if (!has_sequence(asked.request.id)) continue;
    ++safety;
    Reply reply;
    static_cast<void>(check_reply(best, asked.request, captures[i].reply, reply));
    const auto moved = static_cast<std::uint8_t>(reply.one.sequence - last);
    const auto exclude_if = [&](bool wrong, SequenceStep step, Check why) {
      Progress& progress = values[static_cast<std::size_t>(step)];
      if (known && wrong && progress.fits()) progress = {i, why};
    };
    exclude_if(moved == 0, SequenceStep::change, Check::sequence_still);
    exclude_if(moved != safety, SequenceStep::safety, Check::sequence_jumped);
    exclude_if(moved != request, SequenceStep::request, Check::sequence_jumped);
    known = true;
    last = reply.one.sequence;
    safety = request = 0;
  }
  for (std::size_t i = values.size(); i-- > 0;) {
    if (values[i].fits()) best.sequence_step = static_cast<SequenceStep>(i);
  }
}

void put_evidence(EvidenceSink& sink, const Reached& reached) {
  for (std::size_t option = 0; option < open_options; ++option) {
    const std::span<const Progress> values = std::span(reached[option]).first(choice_count(option));
    const bool only_one =
        std::count_if(values.begin(), values.end(), [](const Progress& one) { return one.fits(); }) == 1;
    const std::string_view fits = only_one ? "only this value explains all frames" : "these frames do not tell";
    for (std::size_t value = 0; value < values.size(); ++value) {
      const Progress& one = values[value];
      sink.put({option, static_cast<std::int64_t>(value), one.fits(), one.capture,
                one.fits() ? fits : text_of(one.failed).sentence});
    }
  }
}

}  // namespace

bool probe(Options& values, std::span<const Capture> captures, EvidenceSink& sink) {
  const Profile base = options.format(values);
  Profile best = nth_profile(base, 0);
  bool any = false;
  Reached reached;
  // Each value of each option begins with the worst Progress: the first capture fails the check of the lowest rank.
  for (auto& option : reached) option.fill({0, Check::request_not_accepted});
  for (std::size_t number = 0; number < combinations; ++number) {
    const Profile profile = nth_profile(base, number);
    const Progress progress = progress_of(profile, captures);
    if (progress.fits() && !any) best = profile;
    any = any || progress.fits();
    for (std::size_t i = 0; i < open_options; ++i) {
      Progress& so_far = reached[i][static_cast<std::size_t>(options.get(profile, i))];
      if (progress.better_than(so_far)) so_far = progress;
    }
  }
  // The option sequence_step does not change single frames, so only a sequence of replies can show its value.
  auto& sequence = reached[option_sequence_step];
  sequence.fill(sequence[static_cast<std::size_t>(best.sequence_step)]);
  if (any) judge_sequence(best, captures, sequence);
  put_evidence(sink, reached);
  for (std::size_t i = 0; any && i < open_options; ++i) values.values[i] = options.get(best, i);
  return any;
}

namespace {

// Returns whether the other value of the option parity_scope explains the parity error that the reply reports.
bool parity_is_it(const Profile& profile, const Capture& capture) {
  const SentRequest asked = request_in(profile, capture);
  Reply reply;
  return asked.accepted && check_reply(profile, asked.request, capture.reply, reply) == Check::parity_reported &&
         request_in(with_other_parity(profile), capture).parity_wrong;
}

// All values of the options that `find_change` tries alone and in pairs.
constexpr auto changes = [] {
  Buffer<OptionValue, most_choices * open_options> all;
  for (std::size_t option = 0; option < open_options; ++option) {
    if (option == option_sequence_step || option == option_parity_scope || option == options.find("request_crc"))
      continue;
    for (std::size_t value = 0; value < choice_count(option); ++value) {
      all.push_back({option, static_cast<std::int64_t>(value)});
    }
  }
  return all;
}();

Profile changed(Profile profile, const OptionValue& change) {
  options.put(profile, change.option, change.value);
  return profile;
}

}  // namespace

// Only the reply is evidence for other option values: the host itself has encoded the request with `profile`.
Buffer<OptionValue, 2> find_change(const Profile& profile, Bytes reply) {
  const Capture capture{.reply = reply};
  Buffer<OptionValue, 2> found;
  if (reply.empty()) return found;
  if (parity_is_it(profile, capture)) {
    found.push_back({option_parity_scope, profile.parity_scope == ParityScope::all ? 0 : 1});
    return found;
  }
  // the reply is valid under this profile, so no option must change
  if (explain(profile, capture) == Check::passed) return found;
  for (const OptionValue& one : changes.view()) {
    if (explain(changed(profile, one), capture) != Check::passed) continue;
    found.push_back(one);
    return found;
  }
  for (const OptionValue& one : changes.view()) {
    for (const OptionValue& two : changes.view()) {
      if (two.option <= one.option || explain(changed(changed(profile, one), two), capture) != Check::passed) continue;
      found.push_back(one);
      found.push_back(two);
      return found;
    }
  }
  return found;
}

}  // namespace absenc::esl
