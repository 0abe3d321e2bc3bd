// SPDX-License-Identifier: Apache-2.0
// Help texts of the command, made from the same data as the parser of the command line.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>

#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

inline constexpr std::string_view about =
    "absolute encoders - read them, set them up, emulate them, decode what was captured";

inline constexpr std::array<Example, 6> encoder_examples{{
    {"tformat:/dev/ttyUSB0", "a serial port"},
    {"tformat:tcp:192.168.1.20:4001", "a serial server on the network"},
    {"ssi:spi:/dev/spidev0.0", "an SPI controller, which also clocks SSI and BiSS"},
    {"biss:ftdi", "an FT232H with an RS-422 transceiver: ftdi:SERIAL picks a chip, ftdi:SERIAL/B a channel"},
    {"sim:tformat", "a virtual encoder inside the command: no hardware needed"},
    {"elbow", "a name from absenc.toml: see `absenc list --help`"},
}};

inline constexpr std::array<Example, 4> general_examples{{
    {"absenc list", "which encoders are supported"},
    {"absenc emulate tformat --pty /tmp/encoder", "a virtual encoder for any program to open"},
    {"absenc read tformat:/tmp/encoder --count 0", "its position, until Ctrl-C"},
    {"absenc decode tformat --request 1A --hex \"1A 00 45 23 01 11 34 12 00 00 4A\"", "what a captured frame says"},
}};

inline constexpr std::array<Example, 3> files{{
    {"./absenc.toml", "names for encoders; `absenc list --help` shows how to write it"},
    {"~/.config/absenc/absenc.toml", "the same, where there is none in the working directory"},
    {"~/.local/state/absenc/changes.tsv", "what was changed in encoders: `absenc changes` shows it"},
}};

inline constexpr std::array<Example, 6> environment{{
    {"ABSENC_CONFIG", "the only absenc.toml to look at"},
    {"XDG_CONFIG_HOME", "instead of ~/.config"},
    {"XDG_STATE_HOME", "instead of ~/.local/state"},
    {"STATE_DIRECTORY", "of a service of systemd: in place of $XDG_STATE_HOME/absenc"},
    {"ABSENC_CHANGES", "the file of the journal of changes; none: no journal is kept"},
    {"NO_COLOR", "if not empty, `absenc monitor` does without colours"},
}};

/// Descriptions of the exit statuses of the command, indexed by the status.
inline constexpr std::array<std::string_view, 4> exit_statuses{
    "good", "the encoder or the line failed", "wrong usage",
    "nothing was seen that could be judged (conform, conform-host)"};

/// Returns the help text of the whole command, or of a verb.
[[nodiscard]] std::string help();
[[nodiscard]] std::string help(const Subcommand& subcommand);
/// Returns the help text of all verbs of two words that begin with `first_word_of_two`, such as "memory".
[[nodiscard]] std::string help(std::string_view first_word_of_two);

/// Returns a text of the tables with the names that serial ports have here, in place of those of Linux.
[[nodiscard]] std::string with_ports_of_this_system(std::string_view written);

/// Returns the examples as help lists them, one below the other.
[[nodiscard]] std::string example_lines(std::span<const Example> examples);

/// Returns the usage line of a verb: "absenc read <encoder> [options]".
[[nodiscard]] std::string usage(const Subcommand& subcommand);

/// Returns a parameter as help shows it: "<encoder>", "--count N".
[[nodiscard]] std::string title(const Parameter& parameter);
/// Returns a parameter's meaning, default and repeatability in words.
[[nodiscard]] std::string words(const Parameter& parameter);

}  // namespace absenc::tool
