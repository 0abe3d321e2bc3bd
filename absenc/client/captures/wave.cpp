// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/wave.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "absenc/capture/annotate/drawing.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/port/address.hpp"
#include "absenc/client/text/text_file.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/host/drive.hpp"
#include "absenc/os/file_name.hpp"
#include "absenc/os/process.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/sim/sim_port.hpp"
#include "absenc/sim/waveform.hpp"

namespace absenc::client {

namespace {

using namespace std::chrono_literals;

// time that passes in the drawing between power-on and the first request
constexpr Time first_request = 20us;
constexpr std::uint64_t fastest = 1'000'000'000;  // highest sample rate: the drawing has a resolution of 1 ns

// Returns the idle time that decoders need before the first and after the last character.
Time idle_around(const LineSettings& line) { return std::max(first_request, 5 * line.character()); }

enum class FileFormat : std::uint8_t { vcd, sigrok, saleae };

FileFormat format_of(const std::string& name) {
  const std::string ending = os::name_of(os::path_of(name).extension());
  if (ending == ".vcd") return FileFormat::vcd;
  if (ending == ".sr") return FileFormat::sigrok;
  if (ending == ".csv") return FileFormat::saleae;
  throw UsageError(
      fmt::format("what to write is told by the end of the name: \"{}\" must end in .vcd (every viewer), .sr (sigrok, "
                  "PulseView) or "
                  ".csv (as Saleae Logic 2 exports it)",
                  name));
}

/// A command with its arguments, parsed from one text.
struct Spoken {
  const Command* command;
  std::vector<std::int64_t> arguments;
};

std::vector<Spoken> commands_of(const Unit& unit, std::span<const std::string> texts) {
  std::vector<Spoken> commands;
  for (const std::string& text : texts) {
    std::istringstream rest(text);
    std::string name;
    rest >> name;
    std::vector<std::string> arguments;
    for (std::string word; rest >> word;) arguments.push_back(word);
    const Command& command = require_command(unit, name);
    commands.push_back({&command, require_arguments(command, arguments)});
  }
  if (!commands.empty()) return commands;
  const Command* read = find_command(unit, Verb::read);
  if (read == nullptr) throw UsageError(fmt::format("{} has no command that reads: choose one", unit.id));
  return {{read, require_arguments(*read, {})}};
}

/// Runs a virtual encoder and its host in virtual time and draws their wires.
struct Conversations {
  const EncoderAddress& uri;
  std::vector<Spoken> commands;
  std::uint64_t rounds;
  Time period;
  sim::Waveform& waveform;
  const std::function<void(const std::string&)>& progress;

  std::uint64_t results = 0;
  std::uint64_t failures = 0;
  Time end{};  // time at which the last conversation ended, perhaps with a timeout

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

  // A stream never ends by itself, so it is stopped after the last result.
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
      constexpr std::uint64_t now_and_then = 64;
      if (results++ % now_and_then == 0 && progress) progress(fmt::format("{} of {} results", results, rounds));
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

// Makes a temporary file on the disk of the result, so that lack of space is found there.
capture::ScratchFile scratch_file(const std::string& path) {
  os::Descriptor file = os::nameless_file(os::name_of(os::path_of(path).parent_path()));
  return capture::ScratchFile(::fdopen(file.release(), "w+b"));
}

void write_drawing(const WaveChoices& choices, const std::string& path, capture::Drawing& drawing,
                   const LineSettings& line) {
  const FileFormat format = format_of(path);
  if (format == FileFormat::sigrok) {  // an existing file needs no removal: the sigrok writer replaces it itself
    const std::uint64_t usual = std::min<std::uint64_t>(fastest, std::uint64_t{16} * line.rate);
    return capture::write_sigrok(os::path_of(path), drawing,
                                 choices.samples_per_second == 0 ? usual : choices.samples_per_second);
  }
  os::NewFile file(path);
  std::ofstream out(os::path_of(file.path()), std::ios::binary);
  format == FileFormat::vcd ? capture::write_vcd(out, drawing) : capture::write_saleae_csv(out, drawing);
  out.close();  // on Windows no open file can be renamed
  if (!out) throw Failure(fmt::format("{} cannot be written: {}", path, std::strerror(errno)));
  file.take_place(os::Durable::no);
}

// Adds "sim:" if the user left it out: only virtual encoders can be drawn.
EncoderAddress virtual_encoder(std::string_view text, std::span<const std::string> settings) {
  const std::string_view id = text.substr(0, text.find_first_of("?:"));
  const bool bare = find_unit(id) != nullptr && (id.size() == text.size() || text[id.size()] == '?');
  EncoderAddress uri = parse_address(bare ? fmt::format("sim:{}", text) : std::string(text), settings);
  if (uri.port_kind != PortKind::sim) {
    throw UsageError(fmt::format("{} is no virtual encoder: waveforms are drawn of sim:{}", text, uri.unit->id));
  }
  return uri;
}

}  // namespace

Waved draw_wave(std::string_view text, std::span<const std::string> settings, const std::string& file,
                const WaveChoices& choices) {
  const std::string path = link_target(file);
  if (format_of(path) != FileFormat::sigrok && choices.samples_per_second != 0) {
    throw UsageError("a sample rate is for .sr: the other files keep every nanosecond");
  }
  if (choices.samples_per_second > fastest) {
    throw UsageError(fmt::format("the sample rate must be 1 to {}", fastest));
  }
  if (choices.count == 0 || !(choices.rate > 0)) throw UsageError("results, and how many a second, are more than 0");
  if (std::filesystem::exists(os::path_of(path)) && !choices.replaces) {
    throw UsageError(
        fmt::format("{} exists: give another name, or --force (in Python replaces=True) to replace it", file));
  }
  const EncoderAddress uri = virtual_encoder(text, settings);
  require_replaceable(path);

  capture::Drawing drawing(std::string(uri.unit->id), scratch_file(path), scratch_file(path));
  capture::WaveformSink<sim::Waveform> sink(drawing, idle_around(uri.line));
  sim::Waveform waveform(uri.unit->link, uri.line, sink);
  Conversations conversations{uri,           commands_of(*uri.unit, choices.commands),
                              choices.count, Time(static_cast<std::int64_t>(1e9 / choices.rate)),
                              waveform,      choices.progress};
  converse(conversations);
  sink.finish(waveform, idle_around(uri.line), conversations.end);
  const auto tell = [&] {
    if (choices.progress) choices.progress(fmt::format("writing {}", file));
  };
  tell();
  drawing.watch(tell);
  write_drawing(choices, path, drawing, uri.line);
  Waved waved{.results = conversations.results, .failures = conversations.failures, .time = waveform.end()};
  for (const capture::Drawing::Wire& wire : drawing.wires()) waved.wires.push_back(wire.name);
  return waved;
}

}  // namespace absenc::client
