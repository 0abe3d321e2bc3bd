// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/conform_host.hpp"

#include <fmt/format.h>

#include "absenc/client/conform/host_trial.hpp"
#include "absenc/client/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::client {

namespace {

constexpr Time between_looks = std::chrono::milliseconds(5);

void set_fault(Emulation& encoder, HostTrial::Fault fault) {
  encoder.clear_faults();
  if (fault != HostTrial::Fault::none) encoder.set_fault(name_of(fault), 1);
}

}  // namespace

Conformance conform_host(std::string_view text, const EmulateChoices& place, const ConformHostChoices& choices) {
  Emulation encoder(text, place);
  if (host_clauses_of(encoder.unit()).empty()) {
    throw UsageError(fmt::format("no clauses are known of a host of {}", encoder.unit().id));
  }
  if (encoder.unit().streams != nullptr && encoder.unit().streams(encoder.options())) {
    throw UsageError(
        fmt::format("{} is asked nothing with these options, so there is no host to judge: choose others "
                    "(absenc list {} has them)",
                    encoder.unit().id, encoder.unit().id));
  }
  if (choices.ready) choices.ready(encoder);
  HostTrial trial(choices.answers);
  HostTrial::Fault fault = HostTrial::Fault::none;
  std::uint64_t answered = 0;
  Time heard_at = os::now();
  while (!trial.over() && !(choices.over && choices.over())) {
    const std::uint64_t now_answered = encoder.answer_count();
    // Nobody is impatient with a host that has not come yet.
    if (now_answered != answered || answered == 0) heard_at = os::now();
    answered = now_answered;
    if (os::now() - heard_at > choices.patience) break;
    const HostTrial::Fault wanted = trial.look(answered, encoder.rule_counts());
    if (wanted != fault) set_fault(encoder, wanted);
    fault = wanted;
    os::sleep_until(os::now() + between_looks);
  }
  trial.look(encoder.answer_count(), encoder.rule_counts());
  return trial.judge(encoder.unit());
}

}  // namespace absenc::client
