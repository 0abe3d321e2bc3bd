// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/conform.hpp"

#include <fmt/format.h>

#include <array>
#include <fstream>

#include "absenc/client/conform/conform_text.hpp"
#include "absenc/client/conform/host_stage.hpp"
#include "absenc/client/conform_host.hpp"
#include "absenc/client/emulation/request_watch.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/file_name.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/spidev_node.hpp"
#include "tools/absenc/consent.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

std::string without_end(std::string text) {
  if (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

int tell_verdict(const Invocation& invocation, const Conformance& conformance) {
  if (invocation.has("--junit")) {
    const std::string path(invocation.text("--junit"));
    std::ofstream file(os::path_of(path), std::ios::binary);
    file << conformance.junit() << std::flush;
    if (!file)
      throw UsageError(fmt::format("{} cannot be written: choose a folder that is there and may be written", path));
  }
  if (invocation.has("--json")) {
    print_line(to_json(conformance).line());
  } else {
    print_line(without_end(invocation.has("--tap") ? conformance.tap() : conformance.report()));
  }
  switch (conformance.verdict()) {
    case Verdict::kept:
      return exit_good;
    case Verdict::broken:
      return exit_failed;
    case Verdict::untested:
      break;
  }
  return exit_nothing_judged;
}

int run_conform(const Invocation& invocation) {
  os::catch_interrupts();
  const ConformChoices choices{.readings = static_cast<std::size_t>(invocation.number("--readings", 100, 1, 1'000'000)),
                               .changes = invocation.has("--changes"),
                               .resets = invocation.has("--resets")};
  if (choices.resets && !choices.changes) {
    throw UsageError("--resets says what --changes may lose: give both, or neither");
  }
  if (choices.changes) {
    const EncoderAddress uri = parse_address(invocation.text("encoder"), invocation.texts("--option"));
    const std::string_view meaning =
        choices.resets ? "memory and settings are written and put back; its zero, its turns and its alarms are lost"
                       : "memory and settings are written and put back, resets are sent";
    const std::string_view what = choices.resets ? "conform --changes --resets" : "conform --changes";
    if (must_ask(invocation, uri, what, meaning) && !confirmed(uri, meaning)) {
      print_message("nothing was changed");
      return exit_failed;
    }
  }
  const Conformance conformance = conform(invocation.text("encoder"), invocation.texts("--option"), choices);
  return tell_verdict(invocation, conformance);
}

/// The emulated SPI controller at which a host is tested. It is not in the library, because the library does not use
/// libfuse.
class SpidevStage final : public HostStage {
 public:
  SpidevStage(const EncoderAddress& address, const std::string& name)
      : device_(*address.unit, address.options, address.device),
        watch_(*device_.bytes(), address),
        controller_(address.unit->link, line_settings(*address.unit, address.options), watch_),
        spidev_(controller_),
        node_(name, spidev_) {
    device_.watch_rules(&rules_);
    device_.power_on(os::now());
    controller_.begin(os::now());
  }

  [[nodiscard]] const std::string& path() const { return node_.path(); }
  HostTrial::TrialCounts seen() override {
    return {.answered = device_.device().bytes->answer_count(),
            .missing = count_of(device_, HostTrial::Fault::silence),
            .damaged = count_of(device_, HostTrial::Fault::damage),
            .requests = watch_.counts(),
            .rules = with_mode(rules_.counts(), controller_)};
  }
  void set_fault(HostTrial::Fault fault) override {
    sim::FaultRates rates;
    if (fault != HostTrial::Fault::none) rates[require_fault(fmt::format("{}=1", name_of(fault))).kind] = 1;
    device_.set_faults(rates);
  }
  void play(Time until) override { node_.serve(until); }

 private:
  RuleCounter rules_;
  VirtualDevice device_;
  RequestWatch<std::uint8_t> watch_;
  os::SpiDevice controller_;
  os::Spidev spidev_;
  os::SpidevNode node_;
};

Conformance judge_on_spidev(const std::string& text, const Invocation& invocation, const ConformHostChoices& choices) {
  EncoderAddress address = parse_address("sim:" + text);
  address.device.faults_may_come = true;
  require_host(*address.unit, address.options);
  SpidevStage stage(address, std::string(invocation.text("--spidev")));
  print_message(fmt::format("ready: {}", stage.path()));
  return judge_host(*address.unit, stage, choices);
}

void check_place(const Unit& unit, const Invocation& invocation) {
  if (unit.link == LinkKind::clocked_bidirectional) {
    throw UsageError(fmt::format("{} ({}): no port here takes the encoder's side of a data line that turns", unit.id,
                                 line_of(unit)));
  }
  const bool is_spi = host_clocks(unit.link);
  const bool elsewhere = invocation.has("--pty") || invocation.has("--tcp") || invocation.has("--can");
  if (is_spi && (elsewhere || !invocation.has("--spidev"))) {
    throw UsageError(fmt::format("{} ({}) does not go over a pseudo-terminal, TCP or CAN: use --spidev NAME alone",
                                 unit.id, line_of(unit)));
  }
  if (!is_spi && invocation.has("--spidev")) {
    throw UsageError(
        fmt::format("{} ({}) does not go over an SPI controller: use --pty, --tcp or --can", unit.id, line_of(unit)));
  }
}

int run_conform_host(const Invocation& invocation) {
  os::catch_interrupts();
  const Unit* unit = &require_unit(invocation.text("protocol"));
  if (invocation.has("--spidev") && unit->over_spi != nullptr) unit = unit->over_spi;
  check_place(*unit, invocation);
  std::string text(unit->id);
  char joint = '?';
  for (const std::string& option : invocation.texts("--option")) {
    text += joint + option;
    joint = '&';
  }
  EmulateChoices place{.link = std::string(invocation.text("--pty")), .can = std::string(invocation.text("--can"))};
  if (invocation.has("--tcp")) place.tcp = static_cast<std::uint16_t>(invocation.number("--tcp", 0, 0, 65535));
  ConformHostChoices choices{.answers = static_cast<std::size_t>(invocation.number("--answers", 100, 2, 1'000'000))};
  choices.patience = Time(static_cast<std::int64_t>(invocation.real("--patience", 10, 0.1, 1e6) * 1e9));
  // The port's name is printed to standard error, because standard output is for the verdict.
  choices.ready = [](const Emulation& encoder) {
    print_message(fmt::format("ready: {}", encoder.path()));
    if (encoder.tcp_port() != 0) print_message(fmt::format("ready: tcp:127.0.0.1:{}", encoder.tcp_port()));
  };
  return tell_verdict(invocation, invocation.has("--spidev") ? judge_on_spidev(text, invocation, choices)
                                                             : conform_host(text, place, choices));
}

constexpr std::array<Parameter, 9> conform_parameters{{
    parameter::encoder,
    {"--readings", "N", "how many readings are looked at", "100"},
    {"--changes", "", "test also what is written, set and reset; it is put back as it was"},
    {"--resets", "",
     "with --changes: send resets also where the zero, turns or alarms are lost, which nothing brings back"},
    parameter::yes,
    {"--tap", "", "print the Test Anything Protocol"},
    {"--junit", "FILE", "write JUnit's XML to it as well"},
    parameter::json,
    parameter::option,
}};

constexpr std::array<Example, 4> conform_examples{{
    {"absenc conform sim:tformat", "what its document demands, and whether it does so"},
    {"absenc conform sim:tformat --changes", "also memory, settings and resets"},
    {"absenc conform tformat:/dev/ttyUSB0 --changes --resets",
     "an encoder on the bench, whose zero and turns may be lost"},
    {"absenc conform amt21:/dev/ttyUSB0 --tap --junit amt21.xml", "for programs that count tests"},
}};

constexpr std::array<Parameter, 11> host_parameters{{
    parameter::protocol,
    {"--pty", "PATH", "where to put the link to the pseudo-terminal; CAN: that of an slcan adapter",
     "only the pseudo-terminal itself"},
    {"--tcp", "PORT", "listen on 127.0.0.1 as well; 0: on a free port"},
    {"--can", "INTERFACE", "CAN: be on this interface, as vcan0"},
    {"--spidev", "NAME", "SPI: be a device /dev/NAME, which the kernel's module cuse makes"},
    {"--answers", "N", "how many requests are answered well", "100"},
    {"--patience", "SECONDS", "so long a silence of the host ends it, once it has asked", "10"},
    {"--tap", "", "print the Test Anything Protocol"},
    {"--junit", "FILE", "write JUnit's XML to it as well"},
    parameter::json,
    parameter::protocol_option,
}};

constexpr std::array<Example, 3> host_examples{{
    {"absenc conform-host tformat --pty /tmp/encoder", "then let the drive's program read tformat at /tmp/encoder"},
    {"absenc conform-host raa38-modbus --tcp 4001 --tap --junit host.xml", "for programs that count tests"},
    {"sudo absenc conform-host biss --spidev spidev9.0", "for a program that clocks its encoder by an SPI controller"},
}};

}  // namespace

const Subcommand conform_subcommand{
    "conform",
    "test an encoder against the clauses of its document",
    "Each clause has its paragraph, a verdict (kept, broken, untested) and what was seen: replies that come, in\n"
    "time, whole, with a right checksum and as drawn; requests that must not be answered. Nothing is written to\n"
    "the encoder without --changes, which asks first: it saves what it writes and puts it back, also after Ctrl-C, "
    "and\n"
    "says with which commands to do it by hand what it could not. A reset is sent only where nothing is lost by\n"
    "it; with --resets also where the zero, turns or alarms are lost, which nothing brings back.\n"
    "A clause is kept only when what it is about was seen: a request that was really sent and its reply, a check that\n"
    "these options have, a value that was another before. All else is untested, with the reason.\n"
    "Exit status 1 when a clause is broken, else 0 when one is kept, else 3: nothing was seen that could be judged.",
    conform_parameters,
    conform_examples,
    run_conform};

const Subcommand conform_host_subcommand{
    "conform-host",
    "be a virtual encoder and test the host that connects against the clauses of its document",
    "Says on standard error where it can be opened. Replies are good, stay away for a while and are damaged for a\n"
    "while; the host has to go on, and must not break a rule of the document: intervals, pauses, turns. Each clause "
    "has\n"
    "its paragraph, a verdict and what was seen. Rules of what the host never does are untested, and so is all that a\n"
    "host might have done by chance, because it also sent what is no request.\n"
    "Exit status 1 when a clause is broken, else 0 when one is kept, else 3: nothing was seen that could be judged.",
    host_parameters,
    host_examples,
    run_conform_host};

}  // namespace absenc::tool
