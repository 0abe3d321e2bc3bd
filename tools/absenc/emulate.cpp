// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "absenc/host/drive.hpp"
#include "absenc/os/cuse/spidev_node.hpp"
#include "absenc/os/emulator_port.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/sim/bus.hpp"
#include "tools/absenc/encoder_uri.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/memory_file.hpp"
#include "tools/absenc/memory_keeper.hpp"
#include "tools/absenc/output.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/served_port.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/unit_text.hpp"
#include "tools/absenc/virtual_device.hpp"

namespace absenc::tool {

namespace {

using namespace std::chrono_literals;

// A host on a pseudo-terminal waits milliseconds for what takes microseconds on a wire.
constexpr Time send_slack = 500us;
constexpr Time late_reply = 50ms;

DeviceSettings device_settings(const Invocation& invocation) {
  DeviceSettings settings;
  if (invocation.has("--singleturn")) settings.singleturn = invocation.number("--singleturn", 0, 0, INT64_MAX);
  if (invocation.has("--multiturn")) settings.multiturn = invocation.number("--multiturn", 0, 0, INT64_MAX);
  settings.motion = invocation.text("--motion", "still");
  for (const std::string& alarm : invocation.texts("--alarm")) settings.alarms.push_back(alarm);
  for (const std::string& fault : invocation.texts("--fault")) settings.faults.push_back(fault);
  settings.seed = static_cast<std::uint64_t>(invocation.number("--seed", 1, 0, INT64_MAX));
  settings.delay = late_reply;
  const std::string_view power_on = invocation.text("--power-on", "skip");
  if (power_on != "real" && power_on != "skip") {
    throw UsageError(fmt::format("--power-on is \"{}\", but must be real or skip", power_on));
  }
  settings.real_power_on = power_on == "real";
  return settings;
}

std::string fault_counts(const sim::FaultyDevice& faults) {
  std::vector<std::string> counts;
  for (std::size_t i = 0; i < sim::fault_names.size(); ++i) {
    const std::uint64_t count = faults.count(static_cast<sim::FaultKind>(i));
    if (count != 0) counts.push_back(fmt::format("{} {}", count, sim::fault_names[i]));
  }
  return counts.empty() ? "none" : fmt::format("{}", fmt::join(counts, ", "));
}

void summarize(const VirtualDevice& device, std::string_view name, Time start) {
  const Device<std::uint8_t>& encoder = *device.device().bytes;
  print_message(fmt::format("{}{} requests answered in {}", name, encoder.answered(), to_text(os::now() - start)));
  if (device.faults() != nullptr) print_note(fmt::format("  faults injected: {}", fault_counts(*device.faults())));
  if (encoder.violation_count() == 0) return;
  print_note(fmt::format("  rules that the host broke: {}", encoder.violation_count()));
  for (const Violation& violation : encoder.violations()) {
    const double seconds = std::chrono::duration<double>(violation.at - start).count();
    print_note(fmt::format("    at {:.6f} s: {}", seconds, violation.rule));
  }
  if (encoder.violation_count() > encoder.violations().size()) print_note("    ...");
}

std::optional<std::uint16_t> tcp_port(const Invocation& invocation) {
  if (!invocation.has("--tcp")) return std::nullopt;
  return static_cast<std::uint16_t>(invocation.number("--tcp", 0, 0, 65535));
}

/// All encoders on the line: the one of the other options, and those of --also.
class VirtualLine {
 public:
  VirtualLine(const Unit& unit, const Options& options, const Invocation& invocation)
      : further_(invocation.texts("--also")) {
    const DeviceSettings settings = device_settings(invocation);
    devices_.push_back(std::make_unique<VirtualDevice>(unit, options, settings));
    std::string base = fmt::format("sim:{}?", unit.id);
    if (invocation.has("--model")) base += fmt::format("model={}&", invocation.text("--model"));
    for (const std::string& option : invocation.texts("--option")) base += option + '&';
    for (const std::string& further : further_) {
      EncoderUri uri = parse_encoder(base + further);
      uri.device.delay = settings.delay;
      uri.device.real_power_on = settings.real_power_on;
      devices_.push_back(std::make_unique<VirtualDevice>(unit, uri.options, uri.device));
    }
    std::vector<Machine<std::uint8_t>*> machines;
    for (const auto& device : devices_) machines.push_back(device->bytes());
    if (machines.size() > 1) bus_ = std::make_unique<sim::Bus>(machines, unit.line.character());
  }

  [[nodiscard]] VirtualDevice& first() { return *devices_.front(); }
  [[nodiscard]] Machine<std::uint8_t>& machine() { return bus_ != nullptr ? *bus_ : *first().bytes(); }

  void power_on(Time now) {
    for (const auto& device : devices_) device->power_on(now);
  }

  void summarize_all(Time start) const {
    for (std::size_t i = 0; i < devices_.size(); ++i) {
      const std::string name = i > 0 ? further_[i - 1] + ": " : devices_.size() > 1 ? "the first: " : "";
      summarize(*devices_[i], name, start);
    }
  }

 private:
  std::span<const std::string> further_;
  std::vector<std::unique_ptr<VirtualDevice>> devices_;
  std::unique_ptr<sim::Bus> bus_;
};

// Until a signal or the end of the time. Returns what is to be noted of the line.
std::string serve_serial(Machine<std::uint8_t>& machine, const Invocation& invocation, Time end) {
  const std::optional<std::uint16_t> listen = tcp_port(invocation);
  os::EmulatorPort port(std::string(invocation.text("--pty")), listen);
  port.set_send_slack(send_slack);
  if (end != never) port.set_end(end);
  print_line(fmt::format("ready: {}", port.path()));
  if (listen) print_line(fmt::format("ready: tcp:127.0.0.1:{}", port.tcp_port()));
  try {
    host::drive(machine, port, [] { return true; });
  } catch (const os::Interrupted&) {
  } catch (const os::Ended&) {
  }
  if (port.dropped() == 0) return {};
  return fmt::format("bytes that nobody read: {}", port.dropped());
}

std::string serve_spi(Machine<std::uint8_t>& machine, const Unit& unit, const Invocation& invocation, Time end) {
  os::SpiDevice device(unit.link, unit.line, machine);
  os::Spidev spidev(device);
  os::SpidevNode node(std::string(invocation.text("--spidev")), spidev);
  print_line(fmt::format("ready: {}", node.path()));
  try {
    node.serve(end);
  } catch (const os::Interrupted&) {
  }
  if (device.wrong_modes() == 0) return {};
  return fmt::format("messages in another SPI mode than the encoder's, which is {}: {}", unit.line.spi_mode,
                     device.wrong_modes());
}

// The unit of what --spidev asks for is that of the SPI controller.
const Unit& emulated_unit(const Invocation& invocation) {
  const Unit& unit = require_unit(invocation.text("protocol"));
  return invocation.has("--spidev") && unit.over_spi != nullptr ? *unit.over_spi : unit;
}

void check_line(const Unit& unit, const Invocation& invocation) {
  const bool goes_over_spi = unit.link == LinkKind::exchange || unit.link == LinkKind::clocked;
  const bool goes_over_serial = unit.link == LinkKind::half_duplex || unit.link == LinkKind::full_duplex;
  if (invocation.has("--spidev")) {
    if (!goes_over_spi) {
      throw UsageError(fmt::format("{} ({}) does not go over an SPI controller: use --pty", unit.id, line_of(unit)));
    }
    if (invocation.has("--pty") || invocation.has("--tcp") || invocation.has("--port")) {
      throw UsageError("--spidev is a line of its own: not with --pty, --tcp or --port");
    }
  } else if (goes_over_spi) {
    throw UsageError(fmt::format("{0} does not go over a serial line: use --spidev NAME, or sim:{0}", unit.id));
  } else if (!goes_over_serial) {
    throw UsageError(fmt::format("{} does not go over a serial line: use sim:{}", unit.id, unit.id));
  }
  if (invocation.has("--port") && (invocation.has("--pty") || invocation.has("--tcp"))) {
    throw UsageError("--port is a line of its own: not with --pty or --tcp");
  }
  if (!invocation.has("--also")) return;
  if (unit.link != LinkKind::half_duplex) throw UsageError(fmt::format("{} has one encoder on a line", unit.id));
  if (invocation.has("--memory")) throw UsageError("--memory keeps the memory of one encoder: not with --also");
}

int run_emulate(const Invocation& invocation) {
  os::catch_interrupts();
  const Unit& unit = emulated_unit(invocation);
  const Options options = require_options(unit, invocation.text("--model"), invocation.texts("--option"));
  const double seconds = invocation.real("--for", 0, 0.001, 1e9);
  check_line(unit, invocation);
  std::optional<EncoderUri> served;
  if (invocation.has("--port")) served = parse_served_port(unit, invocation.text("--port"));
  VirtualLine line(unit, options, invocation);
  Device<std::uint8_t>& encoder = *line.first().device().bytes;
  const MemoryFile file(std::string(invocation.text("--memory")), unit.id,
                        options.model != nullptr ? options.model->name : "none");
  const bool keeps_memory = invocation.has("--memory");
  if (keeps_memory) file.load(encoder.memory());

  const Time start = os::now();
  const Time end = seconds > 0 ? start + Time(static_cast<std::int64_t>(seconds * 1e9)) : never;
  line.power_on(start);
  MemoryKeeper<std::uint8_t> keeper(line.machine(), encoder, file);
  Machine<std::uint8_t>& machine = keeps_memory ? static_cast<Machine<std::uint8_t>&>(keeper) : line.machine();
  std::string note;
  if (served) {
    serve_port(machine, *served, send_slack, end);
  } else if (invocation.has("--spidev")) {
    note = serve_spi(machine, unit, invocation, end);
  } else {
    note = serve_serial(machine, invocation, end);
  }
  const bool saved = !keeps_memory || keeper.finish();
  line.summarize_all(start);
  if (!note.empty()) print_note("  " + note);
  return saved ? exit_good : exit_failed;
}

constexpr std::array<Parameter, 17> parameters{{
    parameter::protocol,
    {"--pty", "PATH", "where to put the link to the pseudo-terminal", "only the pseudo-terminal itself"},
    {"--spidev", "NAME", "instead: be an SPI device /dev/NAME, which the kernel's module cuse makes"},
    {"--port", "PATH", "instead: a serial port that is there already, with ?baud=RATE and more as behind an encoder"},
    {"--tcp", "PORT", "listen on 127.0.0.1 as well; 0: on a free port"},
    parameter::model,
    parameter::protocol_option,
    {"--singleturn", "COUNTS", "position within the turn at the start", "0"},
    {"--multiturn", "TURNS", "turns at the start", "0"},
    {"--motion", "MOTION", "still, rpm=R, sine=DEGREES,HZ or file=CSV (lines of seconds,degrees)", "still"},
    {"--alarm", "NAME", "raise this alarm", "", false, true},
    {"--fault", "KIND=RATE",
     "how often a reply is damaged, from 0 to 1; kinds: drop, corrupt, truncate, delay, echo, "
     "garbage, silence, repeat, request_corrupt",
     "", false, true},
    {"--seed", "N", "another series of faults", "1"},
    {"--also", "SETTINGS",
     "one more encoder on the line: what stands behind sim:PROTOCOL? to set it; --model and --option are for all", "",
     false, true},
    {"--memory", "FILE", "keep the encoder's memory in this file; it is made if missing"},
    {"--power-on", "real|skip", "whether the encoder takes its time to start", "skip"},
    {"--for", "SECONDS", "end by itself", "until Ctrl-C"},
}};

constexpr std::array<Example, 5> examples{{
    {"absenc emulate tformat --pty /tmp/encoder --motion rpm=60", "a turning encoder; read it as tformat:/tmp/encoder"},
    {"absenc emulate tformat --tcp 4001 --alarm battery_alarm --fault corrupt=0.01 --memory encoder.txt",
     "one that misbehaves, for whoever connects, and remembers what was written"},
    {"absenc emulate esl --pty /tmp/line --also address=3 --also \"address=5&singleturn=1000&motion=rpm=60\"",
     "three on one line; `absenc scan esl:/tmp/line` finds them"},
    {"sudo absenc emulate encolink --spidev spidev9.0", "one behind an SPI controller: encolink:spi:/dev/spidev9.0"},
    {"absenc emulate e201 --port /dev/ttyUSB1", "for whoever is at the other end of a cable"},
}};

}  // namespace

const Subcommand emulate_subcommand{
    "emulate",
    "be a virtual encoder on a pseudo-terminal, serial or TCP port, or SPI device",
    "Prints \"ready: PATH\" when it can be opened, and with --tcp also \"ready: tcp:127.0.0.1:PORT\".\n"
    "At the end, a summary goes to standard error: requests, faults, and the rules that the host broke.",
    parameters,
    examples,
    run_emulate};

}  // namespace absenc::tool
