// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "absenc/client/emulation/attended.hpp"
#include "absenc/client/memory/memory_file.hpp"
#include "absenc/client/memory/memory_saver.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/host/drive.hpp"
#include "absenc/os/emulator_port.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/slcan_port.hpp"
#include "absenc/os/spi_device.hpp"
#include "absenc/os/spidev.hpp"
#include "absenc/os/spidev_node.hpp"
#include "tools/absenc/console.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/verbs/served_port.hpp"
#include "tools/absenc/virtual_line.hpp"

namespace absenc::tool {

namespace {

using namespace std::chrono_literals;

constexpr Time late_reply = 50ms;
constexpr double default_gap_ms = 2;

std::string fault_counts(const sim::FaultCounts& faults) {
  std::vector<std::string> counts;
  for (std::size_t i = 0; i < faults.size(); ++i) {
    if (faults[i] != 0) counts.push_back(fmt::format("{} {}", faults[i], sim::fault_names[i]));
  }
  return counts.empty() ? "none" : fmt::format("{}", fmt::join(counts, ", "));
}

template <class Item>
void print_rules(const Device<Item>& encoder, const VirtualDevice& device, std::string_view name, Time start) {
  print_message(fmt::format("{}{} requests answered in {}", name, encoder.answer_count(), to_text(os::now() - start)));
  if (device.faults() != nullptr) print_note(fmt::format("  faults injected: {}", fault_counts(*device.faults())));
  if (device.damaged_replies()) print_note(fmt::format("  replies with faults: {}", *device.damaged_replies()));
  if (encoder.violation_count() == 0) return;
  print_note(fmt::format("  rules that the host broke: {}", encoder.violation_count()));
  for (const Violation& violation : encoder.violations()) {
    const double seconds = std::chrono::duration<double>(violation.at - start).count();
    print_note(fmt::format("    at {:.6f} s: {}", seconds, violation.rule));
  }
  if (encoder.violation_count() > encoder.violations().size()) print_note("    ...");
}

// Runs `machine` on `port` until a signal arrives or the time of --for ends.
template <class Item>
void serve(Machine<Item>& machine, Port<Item>& port) {
  try {
    host::drive(machine, port, [] { return true; });
  } catch (const os::Interrupted&) {
  } catch (const os::Ended&) {
  }
}

std::optional<std::uint16_t> tcp_port(const Invocation& invocation) {
  if (!invocation.has("--tcp")) return std::nullopt;
  return static_cast<std::uint16_t>(invocation.number("--tcp", 0, 0, 65535));
}

// Returns the unit to emulate; with the option --spidev, its variant for SPI if there is one.
const Unit& emulated_unit(const Invocation& invocation) {
  const Unit& unit = require_unit(invocation.text("protocol"));
  return invocation.has("--spidev") && unit.over_spi != nullptr ? *unit.over_spi : unit;
}

/// An option that selects the kind of line for the virtual encoder, and whether the unit can use such a line.
struct Where {
  std::string_view option;
  std::string_view line;
  bool fits;
};

// Throws UsageError if the option --gap is given for a line on which it has no meaning.
void check_gap(const Unit& unit, const Invocation& invocation) {
  if (!invocation.has("--gap")) return;
  const bool elsewhere = invocation.has("--port") || invocation.has("--spidev") || unit.link == LinkKind::can;
  if (elsewhere) throw UsageError("--gap is for bytes on --pty and --tcp: with --port write PATH?latency=MS");
}

void check_line(const Unit& unit, const Options& options, const Invocation& invocation) {
  if (unit.link == LinkKind::clocked_bidirectional) {
    throw UsageError(
        fmt::format("{0} ({1}): no port here takes the encoder's side of a data line that turns: use sim:{0}", unit.id,
                    line_of(unit)));
  }
  const bool is_spi = host_clocks(unit.link);
  const bool is_can = unit.link == LinkKind::can;
  const std::array<Where, 5> places{{{"--pty", "a serial line", !is_spi},
                                     {"--tcp", "a serial line", !is_spi},
                                     {"--port", "a serial line", !is_spi && !is_can},
                                     {"--spidev", "an SPI controller", is_spi},
                                     {"--can", "a CAN bus", is_can}}};
  const std::string_view instead = is_spi   ? "--spidev NAME"
                                   : is_can ? "--can INTERFACE, or --pty for an adapter"
                                            : "--pty, --tcp or --port";
  std::string_view chosen;
  for (const Where& place : places) {
    if (!invocation.has(place.option)) continue;
    if (!place.fits) {
      throw UsageError(fmt::format("{} ({}) does not go over {}: use {}, or sim:{}", unit.id, line_of(unit), place.line,
                                   instead, unit.id));
    }
    if (!chosen.empty() && place.option != "--tcp") {
      throw UsageError(fmt::format("{} is a line of its own: not with {}", chosen, place.option));
    }
    if (chosen.empty() || place.option != "--tcp") chosen = place.option;
  }
  if (is_spi && chosen.empty()) {
    throw UsageError(fmt::format("{0} does not go over a serial line: use {1}, or sim:{0}", unit.id, instead));
  }
  const ExtraWires wires = unit.extra_wires == nullptr ? ExtraWires{} : unit.extra_wires(options);
  if (wires.trigger) {
    throw UsageError(
        fmt::format("with these options a pulse asks {0} for each frame, and neither a pseudo-terminal nor TCP carries "
                    "pulses: use sim:{0} in place of a port, as in `absenc read \"sim:{0}?{1}\"`",
                    unit.id, fmt::join(invocation.texts("--option"), "&")));
  }
  if (wires.clear) {
    print_message(fmt::format("note: nothing here carries the pulse that sets the zero: sim:{} does", unit.id));
  }
  if (!invocation.has("--also")) return;
  if (unit.link != LinkKind::half_duplex && !is_can) {
    throw UsageError(fmt::format("{} has one encoder on a line", unit.id));
  }
  if (invocation.has("--memory")) throw UsageError("--memory keeps the memory of one encoder: not with --also");
}

/// The virtual line of the verb `emulate`, its memory file, and the duration given by --for.
template <class Item>
struct EmulationRun {
  EmulationRun(const Unit& unit, const Options& options, const Invocation& invocation)
      : line(unit, options, invocation),
        file(std::string(invocation.text("--memory")), unit.id,
             options.model != nullptr ? options.model->name : "none"),
        keeps_memory(invocation.has("--memory")),
        seconds(invocation.real("--for", 0, 0.001, 1e9)) {
    if (keeps_memory) file.load(line.first().memory());
  }

  /// Calls `serve(machine)`, which runs the encoders and returns notes about the line. Returns the exit status.
  template <class Serve>
  int run(const Serve& serve) {
    const Time start = os::now();
    line.power_on(start);
    Console console(line.unit(), line.devices());
    Attended<Item> attended(line.machine(), [&](Time now) {
      console.look(now);
      return !console.ended();
    });
    MemorySaver<Item> keeper(attended, line.first(), file);
    std::vector<std::string> notes;
    int status = exit_good;
    try {
      notes = serve(keeps_memory ? static_cast<Machine<Item>&>(keeper) : attended);
      if (keeps_memory) keeper.finish();
    } catch (const Failure& failure) {
      print_message(failure.what());
      status = exit_failed;
    }
    line.summarize(start);
    for (const std::string& note : notes) print_note("  " + note);
    return status;
  }

  // Returns the time at which --for ends the verb; `never` without --for.
  [[nodiscard]] Time end() const {
    return seconds > 0 ? os::now() + Time(static_cast<std::int64_t>(seconds * 1e9)) : never;
  }

  VirtualLine<Item> line;
  MemoryFile file;
  bool keeps_memory;
  double seconds;
};

using Notes = std::vector<std::string>;

void note_count(Notes& notes, std::string_view what, std::uint64_t count) {
  if (count != 0) notes.push_back(fmt::format("{}: {}", what, count));
}

void print_ready(const os::EmulatorPort& port) {
  if (!port.path().empty()) print_line(fmt::format("ready: {}", port.path()));
  if (port.tcp_port() != 0) print_line(fmt::format("ready: tcp:127.0.0.1:{}", port.tcp_port()));
}

Notes serve_terminal(Machine<std::uint8_t>& machine, const Invocation& invocation, Time end) {
  os::EmulatorPort port(std::string(invocation.text("--pty")), tcp_port(invocation));
  const double gap_ms = invocation.real("--gap", default_gap_ms, 0.01, 60'000);
  port.set_latency(Time(static_cast<std::int64_t>(gap_ms * 1e6)));
  port.set_send_slack(send_slack);
  port.set_end(end);
  print_ready(port);
  serve(machine, port);
  Notes notes;
  note_count(notes, "bytes that nobody read", port.dropped());
  return notes;
}

Notes serve_spi(Machine<std::uint8_t>& machine, const Unit& unit, const LineSettings& line,
                const Invocation& invocation, Time end) {
  os::SpiDevice device(unit.link, line, machine);
  device.begin(os::now());
  os::Spidev spidev(device);
  os::SpidevNode node(std::string(invocation.text("--spidev")), spidev);
  print_line(fmt::format("ready: {}", node.path()));
  try {
    node.serve(end);
  } catch (const os::Interrupted&) {
  }
  Notes notes;
  note_count(notes, fmt::format("messages in another SPI mode than the encoder's, which is {}", line.spi_mode),
             device.wrong_modes());
  return notes;
}

int emulate_bytes(const Unit& unit, const Options& options, const Invocation& invocation) {
  std::optional<EncoderAddress> served;
  if (invocation.has("--port")) served = parse_served_port(unit, invocation.text("--port"));
  EmulationRun<std::uint8_t> emulation(unit, options, invocation);
  const Time end = emulation.end();
  return emulation.run([&](Machine<std::uint8_t>& machine) -> Notes {
    if (invocation.has("--spidev")) return serve_spi(machine, unit, line_settings(unit, options), invocation, end);
    if (!served) return serve_terminal(machine, invocation, end);
    serve_port(machine, *served, end);
    return {};
  });
}

// Serves the virtual encoders behind an emulated slcan adapter. Returns notes about the line.
Notes serve_adapter(Machine<CanFrame>& machine, const LineSettings& line, const Invocation& invocation, Time end) {
  const auto bytes = std::make_shared<os::EmulatorPort>(std::string(invocation.text("--pty")), tcp_port(invocation));
  bytes->set_end(end);
  os::SlcanAdapter port(bytes, line);
  print_ready(*bytes);
  serve(machine, port);
  Notes notes;
  note_count(notes, "frames lost while the adapter was closed or at another bit rate", port.lost());
  note_count(notes, "frames refused because too many waited for the bus", port.overflowed());
  note_count(notes, "lines that are no command of the adapter", port.garbage());
  note_count(notes, "bytes that nobody read", bytes->dropped());
  return notes;
}

int emulate_frames(const Unit& unit, const Options& options, const Invocation& invocation) {
  EmulationRun<CanFrame> emulation(unit, options, invocation);
  const Time end = emulation.end();
  const LineSettings line = line_settings(unit, options);
  return emulation.run([&](Machine<CanFrame>& machine) -> Notes {
    if (!invocation.has("--can")) return serve_adapter(machine, line, invocation, end);
    serve_interface(machine, std::string(invocation.text("--can")), line, end);
    return {};
  });
}

int run_emulate(const Invocation& invocation) {
  os::catch_interrupts();
  const Unit& unit = emulated_unit(invocation);
  const Options options = require_options(unit, invocation.text("--model"), invocation.texts("--option"));
  check_line(unit, options, invocation);
  check_gap(unit, invocation);
  return unit.link == LinkKind::can ? emulate_frames(unit, options, invocation)
                                    : emulate_bytes(unit, options, invocation);
}

constexpr std::array<Parameter, 20> emulate_parameters{{
    parameter::protocol,
    {"--pty", "PATH", "where to put the link to the pseudo-terminal; CAN: that of an slcan adapter",
     "only the pseudo-terminal itself"},
    {"--tcp", "PORT", "listen on 127.0.0.1 as well; 0: on a free port"},
    {"--gap", "MS",
     "on --pty and --tcp, the pause that ends a request which is not complete: longer for a host that is slow with its "
     "bytes",
     "2"},
    {"--port", "PATH", "instead: a serial port that is there already, with ?baud=RATE and more as behind an encoder"},
    {"--spidev", "NAME", "SPI: be a device /dev/NAME, which the kernel's module cuse makes"},
    {"--can", "INTERFACE", "CAN: be on this interface, as vcan0"},
    parameter::model,
    parameter::protocol_option,
    {"--singleturn", "COUNTS", "position within the turn at the start", "0"},
    {"--multiturn", "TURNS", "turns at the start", "0"},
    {"--motion", "MOTION", "still, rpm=R, sine=DEGREES,HZ or file=CSV (lines of seconds,degrees)", "still"},
    {"--condition", "NAME=VALUE", "set this condition: temperature, battery ..., as `absenc list <protocol>` has them",
     "", false, true},
    {"--alarm", "NAME", "raise this alarm", "", false, true},
    {"--fault", "KIND=RATE",
     "how often a reply is damaged, from 0 to 1; kinds: drop, corrupt, truncate, delay, echo, garbage, silence, "
     "repeat; and request_corrupt: how often a byte (CAN: a frame) of the requests that it hears is",
     "", false, true},
    {"--seed", "N", "another series of faults", "1"},
    {"--also", "SETTINGS",
     "one more encoder on the line: what stands behind sim:PROTOCOL? to set it; --model and --option are for all", "",
     false, true},
    {"--memory", "FILE", "keep the encoder's memory in this file, which it locks; it is made if missing"},
    {"--power-on", "real|skip",
     "whether the encoder takes its time to start, while the shaft moves already; skip: it is switched on at rest",
     "skip"},
    {"--for", "SECONDS", "end by itself", "until Ctrl-C"},
}};

constexpr std::array<Example, 7> emulate_examples{{
    {"absenc emulate tformat --pty /tmp/encoder --motion rpm=60", "a turning encoder; read it as tformat:/tmp/encoder"},
    {"absenc emulate tformat --tcp 4001 --alarm battery_alarm --fault corrupt=0.01 --memory encoder.txt",
     "one that misbehaves, for whoever connects, and remembers what was written"},
    {"echo temperature=120 | absenc emulate tformat --pty /tmp/encoder --condition battery=0",
     "one without a battery, that gets too hot"},
    {"absenc emulate esl --pty /tmp/line --also address=3 --also \"address=5&singleturn=1000&motion=rpm=60\"",
     "three on one line; `absenc scan esl:/tmp/line` finds them"},
    {"absenc emulate e201 --port /dev/ttyUSB1", "for whoever is at the other end of a cable"},
    {"sudo absenc emulate encolink --spidev spidev9.0", "one behind an SPI controller: encolink:spi:/dev/spidev9.0"},
    {"absenc emulate raa38-can --pty /tmp/adapter --also node=0x21", "two on a CAN bus: raa38-can:slcan:/tmp/adapter"},
}};

}  // namespace

DeviceSettings device_settings(const Invocation& invocation) {
  DeviceSettings settings;
  if (invocation.has("--singleturn")) settings.singleturn = invocation.number("--singleturn", 0, 0, INT64_MAX);
  if (invocation.has("--multiturn")) settings.multiturn = invocation.number("--multiturn", 0, INT64_MIN, INT64_MAX);
  settings.motion = invocation.text("--motion", "still");
  for (const std::string& condition : invocation.texts("--condition")) settings.conditions.push_back(condition);
  for (const std::string& alarm : invocation.texts("--alarm")) settings.alarms.push_back(alarm);
  for (const std::string& fault : invocation.texts("--fault")) settings.faults.push_back(fault);
  settings.seed = static_cast<std::uint64_t>(invocation.number("--seed", 1, 0, INT64_MAX));
  settings.delay = late_reply;
  settings.faults_may_come = true;
  const std::string_view power_on = invocation.text("--power-on", "skip");
  if (power_on != "real" && power_on != "skip") {
    throw UsageError(fmt::format("--power-on is \"{}\", but must be real or skip", power_on));
  }
  settings.real_power_on = power_on == "real";
  return settings;
}

EncoderAddress further_encoder(const Unit& unit, const Invocation& invocation, const std::string& further,
                               const DeviceSettings& settings) {
  // For a further encoder, the settings in --also replace those of the first encoder.
  std::string base = fmt::format("sim:{}?", unit.id);
  const auto add = [&](const std::string& setting) {
    const std::string assigned = setting.substr(0, setting.find('=')) + '=';
    if (fmt::format("&{}", further).find(fmt::format("&{}", assigned)) == std::string::npos) base += setting + '&';
  };
  if (invocation.has("--model")) add(fmt::format("model={}", invocation.text("--model")));
  for (const std::string& option : invocation.texts("--option")) add(option);
  EncoderAddress uri = parse_address(base + further);
  uri.device.delay = settings.delay;
  uri.device.faults_may_come = settings.faults_may_come;
  uri.device.real_power_on = settings.real_power_on;
  return uri;
}

void print_summary(const VirtualDevice& device, std::string_view name, Time start) {
  if (device.device().bytes != nullptr) print_rules(*device.device().bytes, device, name, start);
  if (device.device().frames != nullptr) print_rules(*device.device().frames, device, name, start);
}

const Subcommand emulate_subcommand{
    "emulate",
    "be a virtual encoder on a pseudo-terminal, a serial or TCP port, an SPI device or a CAN interface",
    "Prints \"ready: PATH\" when it can be opened, and with --tcp also \"ready: tcp:127.0.0.1:PORT\".\n"
    "While it runs, each line on standard input is answered by one on standard output, \"ok: ...\" or \"error: ...\":\n"
    "  NAME=VALUE       set a condition; NAME alone asks for it\n"
    "  power off        and power on, which takes the time of the document\n"
    "  alarm NAME       raise alarms; clear NAME lowers them\n"
    "  fault KIND=RATE  damage replies as --fault does; fault none ends it\n"
    "  help             what this encoder can be told\n"
    "With --also a line is for all of them, with a number in front for one: \"2: power off\" is the first of --also.\n"
    "At the end, a summary goes to standard error: requests, faults, and the rules that the host broke.",
    emulate_parameters,
    emulate_examples,
    run_emulate};

}  // namespace absenc::tool
