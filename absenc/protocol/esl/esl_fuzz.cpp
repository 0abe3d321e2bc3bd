// SPDX-License-Identifier: Apache-2.0
// Any bytes as a reply in many profiles, and as a capture of which the probe says what would make it good.
#include <cstddef>
#include <cstdint>

#include "absenc/protocol/esl/probe.hpp"
#include "tests/fuzz_toys.hpp"

namespace {

using namespace absenc;
using namespace absenc::esl;
using namespace absenc::fuzz;

// The profile that the first byte stands for.
Profile profile_of(Bytes input) {
  Profile profile;
  unsigned rest = input.empty() ? 0 : input[0];
  for (std::size_t option = 0; option < open_options; ++option) {
    const auto count = static_cast<unsigned>(options.infos[option].choices.size());
    options.put(profile, option, rest % count);
    rest /= count;
  }
  return profile;
}

// What passes as a reply is the reply that its fields make.
void decode_and_encode(const Profile& profile, Bytes input) {
  if (input.empty() || !data_id(input[0])) return;
  const Request request{*data_id(input[0]), address_of(input[0]),
                        input.size() > 1 ? esl::detail::address_from_wire(profile, input[1]) : std::uint8_t{0},
                        input.size() > 2 ? input[2] : std::uint8_t{0}};
  const Result<Reply> reply = decode_reply(profile, request, input);
  if (!reply) return;
  const ReplyBytes bytes = encode_reply(profile, *reply);
  require(bytes.size() == input.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) require(bytes[i] == input[i]);
}

void probe_it(const Profile& profile, Bytes input) {
  const Change change = find_change(profile, {.reply = input});
  require(change.count <= change.options.size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes input(data, size);
  const Profile profile = profile_of(input);
  decode_and_encode({}, input);
  decode_and_encode(profile, input);
  probe_it(profile, input);
  return 0;
}
