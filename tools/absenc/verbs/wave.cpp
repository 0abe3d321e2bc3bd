// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/wave.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>

#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/text/progress.hpp"

namespace absenc::tool {

namespace {

int run_wave(const Invocation& invocation) {
  os::catch_interrupts();
  const std::string file(invocation.text("file"));
  const std::span<const std::string> commands = invocation.texts("--command");
  Progress progress;
  const WaveChoices choices{
      .commands = {commands.begin(), commands.end()},
      .count = static_cast<std::uint64_t>(invocation.number("--count", 1, 1, 1'000'000)),
      .rate = invocation.real("--rate", 1000, 0.001, 1e6),
      .samples_per_second = invocation.has("--samplerate")
                                ? static_cast<std::uint64_t>(invocation.number("--samplerate", 1, 1, 1'000'000'000))
                                : 0,
      .replaces = invocation.has("--force"),
      .progress = [&](const std::string& what) {
        if (os::interrupted()) throw os::Interrupted{};
        progress.show(what);
      }};
  const Waved waved = draw_wave(invocation.text("encoder"), invocation.texts("--option"), file, choices);
  progress.clear();
  print_line(fmt::format("{}: {} result{} in {}, {} of them an error; wires: {}", file, waved.results,
                         waved.results == 1 ? "" : "s", to_text(waved.time), waved.failures,
                         fmt::join(waved.wires, ", ")));
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
