// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/esl/words.hpp"

#include "absenc/protocol/esl/fields.hpp"
#include "absenc/protocol/esl/probe.hpp"

namespace absenc::esl {

namespace {

// The check behind `error`; `passed` where the error is none of the frame's.
Check check_behind(const Profile& profile, Error error, Bytes request, Bytes reply) {
  const Result<Request> asked = asked_by(profile, request, reply);
  if (!asked) return Check::passed;
  Reply ignored;
  const Check check = check_reply(profile, *asked, reply, ignored);
  return error_of(check) == error ? check : Check::passed;
}

void add_change(Sentence& words, const Profile& profile, Bytes reply) {
  const Change change = find_change(profile, {.reply = reply});
  for (std::size_t i = 0; i < change.count; ++i) {
    const Option& option = options.infos[change.options[i].option];
    words.add(i == 0 ? "; the reply is good with the profile " : " ");
    words.add(option.name).add("=").add(option.choices[static_cast<std::size_t>(change.options[i].value)]);
  }
}

}  // namespace

void tell(Sentence& words, const Profile& profile, const author::Engine& host) {
  const Bytes request = host.exchange().sent;
  if (host.error() == Error::timeout) {
    words.add("it is also silent when request_crc, crc_bit_order or address is another");
    const std::optional<DataId> id = request.empty() ? std::nullopt : data_id(request[0]);
    if (id && is_memory_access(*id)) {
      words.add_part("and to memory requests when others share its line (Figure 18)");
    }
    return;
  }
  if (host.is_disturbed() || host.reply().empty()) return;
  const Check check = check_behind(profile, host.error(), request, host.reply());
  if (check == Check::passed) return;
  words.add(text_of(check).sentence);
  add_change(words, profile, host.reply());
}

Explanation explain(const Profile& profile, Error error, Bytes request, Bytes reply) {
  if (reply.empty()) return {};
  const Check check = check_behind(profile, error, request, reply);
  if (check == Check::length) return {};  // the error says all of it
  return {.found = text_of(check).sentence};
}

void name_what_remains(Sentence& words, std::uint8_t remaining) {
  constexpr unsigned until_power_off =
      alarms::led_or_lissajous_error | alarms::overspeed | alarms::memory_error | alarms::singleturn_error;
  for (unsigned bit = 0; bit < 8; ++bit) {
    if ((remaining >> bit & 1) != 0) words.add(words.empty() ? "" : ", ").add(alarm_flags[bit].name);
  }
  words.add((remaining & (remaining - 1)) == 0 ? " remains" : " remain");
  if ((remaining & alarms::multiturn_error) != 0) words.add("; multiturn_error: reset-multiturn first");
  if ((remaining & until_power_off) != 0) words.add("; switch the encoder off and on");
  if ((remaining & alarms::voltage) != 0) words.add("; the supply voltage is wrong");
}

}  // namespace absenc::esl
