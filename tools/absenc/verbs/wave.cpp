// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "absenc/capture/annotate/drawing.hpp"
#include "absenc/client/text/text_file.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/way/address.hpp"
#include "absenc/host/drive.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/process.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/sim/sim_port.hpp"
#include "absenc/sim/waveform.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/text/progress.hpp"

namespace absenc::tool {

namespace {

using namespace std::chrono_literals;

constexpr Time first_request = 20us;              // so long is the encoder switched on
constexpr std::uint64_t fastest = 1'000'000'000;  // samples a second: those of the drawing

// Decoders want to see the line idle before and behind what they take for whole: CAN nodes 11 bits, Modbus 3.5
// characters, whoever guesses the rate a little more.
Time idle_around(const LineSettings& line) { return std::max(first_request, 5 * line.character()); }

enum class FileFormat : std::uint8_t { vcd, sigrok, saleae };

FileFormat format_of(const std::filesystem::path& path) {
  const std::string ending = path.extension();
  if (ending == ".vcd") return FileFormat::vcd;
  if (ending == ".sr") return FileFormat::sigrok;
  if (ending == ".csv") return FileFormat::saleae;
  throw UsageError(
      fmt::format("what to write is told by the end of the name: \"{}\" must end in .vcd (every viewer), .sr (sigrok, "
                  "PulseView) or "
                  ".csv (as Saleae Logic 2 exports it)",
                  path.string()));
}

/// A command with its arguments, as it was written in one text.
struct Spoken {
  const Command* command;
  std::vector<std::int64_t> arguments;
};

std::vector<Spoken> commands_of(const Unit& unit, std::span<const std::string> texts) {
  std::vector<Spoken> commands;
  for (const std::string& text : texts) {
    std::istringstream words(text);
    std::string name;
    words >> name;
    std::vector<std::string> arguments;
    for (std::string word; words >> word;) arguments.push_back(word);
    const Command& command = require_command(unit, name);
    commands.push_back({&command, require_arguments(command, arguments)});
  }
  if (!commands.empty()) return commands;
  const Command* read = find_command(unit, Verb::read);
  if (read == nullptr)
    throw UsageError(fmt::format("{} has no command that reads: choose one with --command", unit.id));
  return {{read, require_arguments(*read, {})}};
}

/// A virtual encoder and its host in virtual time.
struct Conversations {
  const EncoderAddress& uri;
  std::vector<Spoken> commands;
  std::uint64_t rounds;
  Time period;
  sim::Waveform& waveform;
  Progress& progress;

  std::uint64_t results = 0;
  std::uint64_t failures = 0;
  Time end{};  // of the last of them, which may have waited for nothing

  template <class Item>
  void hold(Machine<Item>& device) {
    sim::SimPort<Item> port(uri.unit->link, uri.line, device);
    waveform.observe(port.line());
    for (Time next = first_request; results < rounds; next += period) {
      pass(port, next);
      for (const Spoken& one : commands) hold(port, one);
    }
    end = port.now();
  }

 private:
  template <class Item>
  static void pass(sim::SimPort<Item>& port, Time until) {
    while (port.now() < until) static_cast<void>(port.wait({.at = until}));
  }

  // One that never ends by itself, as a stream, ends with the last round; one that asks without end after a result.
  template <class Item>
  void hold(sim::SimPort<Item>& port, const Spoken& one) {
    std::vector<std::byte> storage(uri.unit->host_storage);
    Conversation<Item>* const conversation =
        uri.unit->host(uri.options, *one.command, one.arguments, storage).template of<Item>();
    if (conversation == nullptr) {
      throw UsageError(fmt::format("{} cannot do {} with these options", uri.unit->id, one.command->name));
    }
    const bool reads = one.command->verb == Verb::read;
    const auto count = [&] {
      constexpr std::uint64_t now_and_then = 256;
      if (os::interrupted()) throw os::Interrupted{};
      if (results++ % now_and_then == 0) progress.show(fmt::format("{} of {} results", results, rounds));
      if (conversation->error() != Error::none) ++failures;
    };
    const bool ended = host::drive(*conversation, port, [&] {
      if (reads) count();
      return results < rounds && !conversation->asks();
    });
    if ((ended || conversation->asks()) && (&one == &commands.back() || conversation->error() != Error::none)) count();
  }
};

void converse(Conversations& conversations) {
  const EncoderAddress& uri = conversations.uri;
  VirtualDevice device(*uri.unit, uri.options, uri.device);
  device.power_on(Time{});
  if (device.bytes() != nullptr) {
    conversations.hold(*device.bytes());
  } else {
    conversations.hold(*device.frames());
  }
}

// Room on the disk that the file will be on.
capture::ScratchFile scratch_file(const std::string& path) {
  os::Descriptor file = os::nameless_file(std::filesystem::path(path).parent_path());
  return capture::ScratchFile(::fdopen(file.release(), "w+"));
}

void write(const Invocation& invocation, const std::string& path, capture::Drawing& drawing, const LineSettings& line) {
  const FileFormat format = format_of(path);
  if (format == FileFormat::sigrok) {  // which takes the place of the old one by itself
    const std::uint64_t usual = std::min<std::uint64_t>(fastest, std::uint64_t{16} * line.rate);
    const std::int64_t rate =
        invocation.number("--samplerate", static_cast<std::int64_t>(usual), 1, static_cast<std::int64_t>(fastest));
    return capture::write_sigrok(path, drawing, static_cast<std::uint64_t>(rate));
  }
  os::NewFile file(path);
  std::ofstream out(file.path(), std::ios::binary);
  format == FileFormat::vcd ? capture::write_vcd(out, drawing) : capture::write_saleae_csv(out, drawing);
  out.flush();
  if (!out) throw Failure(fmt::format("{} cannot be written: {}", path, std::strerror(errno)));
  file.take_place(os::Durable::no);
}

// "sim:" may be left out: no other encoder shows its wires.
EncoderAddress virtual_encoder(const Invocation& invocation) {
  const std::string_view text = invocation.text("encoder");
  const std::string_view id = text.substr(0, text.find_first_of("?:"));
  const bool bare = find_unit(id) != nullptr && (id.size() == text.size() || text[id.size()] == '?');
  EncoderAddress uri =
      parse_address(bare ? fmt::format("sim:{}", text) : std::string(text), invocation.texts("--option"));
  if (uri.place != Place::sim) {
    throw UsageError(fmt::format("{} is no virtual encoder: waveforms are drawn of sim:{}", text, uri.unit->id));
  }
  return uri;
}

int run_wave(const Invocation& invocation) {
  os::catch_interrupts();
  const std::string_view name = invocation.text("file");
  const std::string path = link_target(std::string(name));
  if (format_of(path) != FileFormat::sigrok && invocation.has("--samplerate")) {
    throw UsageError("--samplerate is for .sr: the other files keep every nanosecond");
  }
  if (std::filesystem::exists(path) && !invocation.has("--force")) {
    throw UsageError(fmt::format("{} exists: give another name, or --force to replace it", name));
  }
  const EncoderAddress uri = virtual_encoder(invocation);
  require_replaceable(path);

  capture::Drawing drawing(std::string(uri.unit->id), scratch_file(path), scratch_file(path));
  capture::WaveformSink<sim::Waveform> sink(drawing, idle_around(uri.line));
  sim::Waveform waveform(uri.unit->link, uri.line, sink);
  Progress progress;
  const double rate = invocation.real("--rate", 1000, 0.001, 1e6);
  Conversations conversations{uri,
                              commands_of(*uri.unit, invocation.texts("--command")),
                              static_cast<std::uint64_t>(invocation.number("--count", 1, 1, 1'000'000)),
                              Time(static_cast<std::int64_t>(1e9 / rate)),
                              waveform,
                              progress};
  converse(conversations);
  sink.finish(waveform, idle_around(uri.line), conversations.end);
  progress.show(fmt::format("writing {}", name));
  drawing.watch([] {
    if (os::interrupted()) throw os::Interrupted{};
  });
  write(invocation, path, drawing, uri.line);
  progress.clear();
  std::string wires;
  for (const capture::Drawing::Wire& wire : drawing.wires()) wires += (wires.empty() ? "" : ", ") + wire.name;
  print_line(fmt::format("{}: {} result{} in {}, {} of them an error; wires: {}", name, conversations.results,
                         conversations.results == 1 ? "" : "s", to_text(waveform.end()), conversations.failures,
                         wires));
  return exit_good;
}

constexpr std::array<Parameter, 8> wave_parameters{{
    {"encoder", "", "PROTOCOL, with ?NAME=VALUE&NAME=VALUE behind it as for sim:PROTOCOL: options, motion, faults", "",
     true},
    {"file", "", "what to write: .vcd, .sr or .csv (Saleae Logic 2)", "", true},
    {"--command", "COMMAND", "what the host asks, its arguments behind it; several: one after the other",
     "what `absenc read` asks", false, true},
    {"--count", "N", "how many results", "1"},
    {"--rate", "HZ", "how many a second; less where the line cannot", "1000"},
    {"--samplerate", "HZ", "of .sr files", "16 for each bit of the line"},
    {"--force", "", "replace the file if it exists"},
    parameter::option,
}};

constexpr std::array<Example, 3> wave_examples{{
    {"absenc wave tformat position.vcd", "one position as GTKWave and PulseView show it"},
    {"absenc wave \"esl?fault=corrupt=0.1&motion=rpm=600\" damaged.sr --count 100",
     "what a damaged line looks like, for comparison with a capture"},
    {"absenc wave encolink-spi spi.csv --command position --count 3", "for Saleae's program"},
}};

}  // namespace

const Subcommand wave_subcommand{"wave",
                                 "write a conversation with a virtual encoder as a waveform",
                                 "Time is virtual and exact to the nanosecond: what the protocol's document says, with "
                                 "the faults that are asked for.",
                                 wave_parameters,
                                 wave_examples,
                                 run_wave};

}  // namespace absenc::tool
