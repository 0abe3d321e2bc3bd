// SPDX-License-Identifier: Apache-2.0
// The list of all verbs, and the help that lists them.
#include <fmt/format.h>

#include <array>
#include <utility>

#include "tools/absenc/help.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

std::span<const Subcommand* const> all_subcommands() {
  static constexpr std::array all{
      &ports_subcommand,
      &list_subcommand,
      &read_subcommand,
      &monitor_subcommand,
      &serve_subcommand,
      &record_subcommand,
      &info_subcommand,
      &alarms_subcommand,
      &temperature_subcommand,
      &zero_subcommand,
      &reset_multiturn_subcommand,
      &clear_alarms_subcommand,
      &memory_read_subcommand,
      &memory_write_subcommand,
      &memory_dump_subcommand,
      &memory_load_subcommand,
      &memory_verify_subcommand,
      &config_get_subcommand,
      &config_set_subcommand,
      &changes_subcommand,
      &run_subcommand,
      &scan_subcommand,
      &emulate_subcommand,
      &tap_subcommand,
      &decode_subcommand,
      &encode_subcommand,
      &wave_subcommand,
      &probe_subcommand,
      &identify_subcommand,
      &doctor_subcommand,
      &conform_subcommand,
      &conform_host_subcommand,
      &crc_find_subcommand,
      &vectors_subcommand,
      &campaign_subcommand,
      &bench_subcommand,
  };
  return all;
}

std::vector<std::string_view> words_after(std::string_view first) {
  std::vector<std::string_view> words;
  for (const Subcommand* subcommand : all_subcommands()) {
    const std::string_view group = first_word(*subcommand);
    const std::string_view word = first.empty() && !group.empty() ? group : last_word(*subcommand);
    const bool belongs = first.empty() || group == first;
    if (belongs && (words.empty() || words.back() != word)) words.push_back(word);
  }
  return words;
}

namespace {

std::string verb_line(const Subcommand& subcommand) {
  return fmt::format("  {:<17}{}\n", subcommand.name, subcommand.summary);
}

}  // namespace

std::string help(std::string_view group) {
  std::string text = fmt::format("Usage: absenc {} <verb> ...\n\nVerbs:\n", group);
  for (const Subcommand* subcommand : all_subcommands()) {
    if (first_word(*subcommand) == group) text += verb_line(*subcommand);
  }
  return text + fmt::format("\n`absenc {} <verb> --help` explains a verb.\n", group);
}

std::string help() {
  std::string text = fmt::format("absenc: {}\n\nUsage: absenc <verb> ...\n\nVerbs:\n", about);
  std::string_view group;
  for (const Subcommand* subcommand : all_subcommands()) {
    if (group != std::exchange(group, first_word(*subcommand))) text += '\n';
    text += verb_line(*subcommand);
  }
  text += "\nAn encoder is its protocol and where it is connected:\n";
  for (const Example& encoder : encoder_examples) {
    text += fmt::format("  {:<32}{}\n", encoder.command, encoder.meaning);
  }
  text += "with options behind it, as in \"tformat:/dev/ttyUSB0?model=23-bit&echo=on\".\n";
  text += fmt::format("\nExamples:\n{}", example_lines(general_examples));
  text += "\n`absenc <verb> --help` explains a verb, `absenc --version` prints the version.\n";
  text += "Exit status:";
  for (std::size_t i = 0; i < exit_statuses.size(); ++i)
    text += fmt::format("{} {} {}", i == 0 ? "" : ",", i, exit_statuses[i]);
  return with_ports_of_this_system(text + ".\n");
}

}  // namespace absenc::tool
