// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/conform_host.hpp"

#include <fmt/format.h>

#include <utility>

#include "absenc/client/conform/host_stage.hpp"
#include "absenc/client/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::client {

namespace {

constexpr Time between_looks = std::chrono::milliseconds(5);

class EmulationStage final : public HostStage {
 public:
  explicit EmulationStage(Emulation& encoder) : encoder_(encoder) {}

  HostTrial::TrialCounts seen() override {
    return {.answered = encoder_.answer_count(),
            .missing = encoder_.fault_count(name_of(HostTrial::Fault::silence)),
            .damaged = encoder_.fault_count(name_of(HostTrial::Fault::damage)),
            .requests = encoder_.request_counts(),
            .rules = encoder_.rule_counts()};
  }
  void set_fault(HostTrial::Fault fault) override {
    encoder_.clear_faults();
    if (fault != HostTrial::Fault::none) encoder_.set_fault(name_of(fault), 1);
  }
  void play(Time until) override { os::sleep_until(until); }

 private:
  Emulation& encoder_;
};

}  // namespace

void require_host(const Unit& unit, const Options& options) {
  if (host_clauses_of(unit).empty()) {
    throw UsageError(fmt::format("no clauses are known of a host of {}", unit.id));
  }
  if (unit.streams != nullptr && unit.streams(options)) {
    throw UsageError(
        fmt::format("{} is asked nothing with these options, so there is no host to judge: choose others "
                    "(absenc list {} has them)",
                    unit.id, unit.id));
  }
}

Conformance judge_host(const Unit& unit, HostStage& stage, const ConformHostChoices& choices) {
  HostTrial trial(unit, choices.answers);
  HostTrial::Fault fault = HostTrial::Fault::none;
  std::uint64_t sent = 0;
  Time heard_at = os::now();
  while (!trial.over() && !(choices.over && choices.over())) {
    HostTrial::TrialCounts seen = stage.seen();
    const std::uint64_t now_sent = seen.answered + seen.requests.good + seen.requests.bad;
    // Measures the host's silence only after it has sent something.
    if (now_sent != sent || sent == 0) heard_at = os::now();
    sent = now_sent;
    if (os::now() - heard_at > choices.patience) break;
    const HostTrial::Fault wanted = trial.look(std::move(seen));
    if (wanted != fault) stage.set_fault(wanted);
    fault = wanted;
    stage.play(os::now() + between_looks);
  }
  trial.look(stage.seen());
  return trial.judge();
}

Conformance conform_host(std::string_view text, const EmulateChoices& place, const ConformHostChoices& choices) {
  Emulation encoder(text, place);
  require_host(encoder.unit(), encoder.options());
  if (choices.ready) choices.ready(encoder);
  EmulationStage stage(encoder);
  return judge_host(encoder.unit(), stage, choices);
}

}  // namespace absenc::client
