// SPDX-License-Identifier: Apache-2.0
// Describes a subcommand as data, for the parser and for help.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace absenc::tool {

struct Parameter {
  std::string_view name;   // "encoder" is the name of an argument, "--count" that of an option
  std::string_view value;  // placeholder of the option's value in help; "": the option has no value
  std::string_view meaning;
  std::string_view fallback{};  // the default in words, for help; "": none
  bool required = false;
  // true for an argument that takes all words to the end, and for an option that may be given several times
  bool repeatable = false;

  [[nodiscard]] constexpr bool is_option() const { return name.starts_with("--"); }
};

struct Example {
  std::string_view command;
  std::string_view meaning;
};

/// The values of parameters that the user wrote on the command line, by parameter name.
class Invocation {
 public:
  void add(std::string_view name, std::string value) { values_[name].push_back(std::move(value)); }

  [[nodiscard]] bool has(std::string_view name) const { return values_.contains(name); }
  /// Returns the last value that the user gave for the parameter `name`, or `fallback` if there is none.
  [[nodiscard]] std::string_view text(std::string_view name, std::string_view fallback = {}) const;
  [[nodiscard]] std::span<const std::string> texts(std::string_view name) const;
  /// Returns the last value of the parameter `name` as a number, decimal or with 0x, or `fallback`. Throws UsageError.
  [[nodiscard]] std::int64_t number(std::string_view name, std::int64_t fallback, std::int64_t minimum,
                                    std::int64_t maximum) const;
  [[nodiscard]] double real(std::string_view name, double fallback, double minimum, double maximum) const;

 private:
  std::map<std::string_view, std::vector<std::string>> values_;
};

struct Subcommand {
  std::string_view name;         // name of the verb: one word, or two as in "memory read"
  std::string_view summary;      // one line about the verb in the list of verbs
  std::string_view description;  // further text in the help of the verb, already broken into lines
  std::span<const Parameter> parameters;
  std::span<const Example> examples;
  int (*run)(const Invocation& invocation);  // runs the verb and returns the exit status
  // name of the program that runs the verb in place of the command; "": the command runs it
  std::string_view program{};
  std::string_view package{};  // Debian package that has this program
};

/// All subcommands in the order of help; those with the same first word are adjacent.
[[nodiscard]] std::span<const Subcommand* const> all_subcommands();

/// Returns the first word of a verb of two words, "memory" for "memory read", otherwise "".
[[nodiscard]] std::string_view first_word(const Subcommand& subcommand);
/// Returns the last word of a verb: "read" for "memory read" and for "read".
[[nodiscard]] std::string_view last_word(const Subcommand& subcommand);
/// Returns the words that may follow `first` in a verb; for "" the first words of verbs.
[[nodiscard]] std::vector<std::string_view> words_after(std::string_view first);

extern const Subcommand ports_subcommand;
extern const Subcommand list_subcommand;
extern const Subcommand read_subcommand;
extern const Subcommand monitor_subcommand;
extern const Subcommand serve_subcommand;
extern const Subcommand record_subcommand;
extern const Subcommand info_subcommand;
extern const Subcommand alarms_subcommand;
extern const Subcommand temperature_subcommand;
extern const Subcommand zero_subcommand;
extern const Subcommand reset_multiturn_subcommand;
extern const Subcommand clear_alarms_subcommand;
extern const Subcommand memory_read_subcommand;
extern const Subcommand memory_write_subcommand;
extern const Subcommand memory_dump_subcommand;
extern const Subcommand memory_load_subcommand;
extern const Subcommand memory_verify_subcommand;
extern const Subcommand config_get_subcommand;
extern const Subcommand config_set_subcommand;
extern const Subcommand run_subcommand;
extern const Subcommand scan_subcommand;
extern const Subcommand emulate_subcommand;
extern const Subcommand decode_subcommand;
extern const Subcommand tap_subcommand;
extern const Subcommand encode_subcommand;
extern const Subcommand wave_subcommand;
extern const Subcommand probe_subcommand;
extern const Subcommand identify_subcommand;
extern const Subcommand doctor_subcommand;
extern const Subcommand conform_subcommand;
extern const Subcommand conform_host_subcommand;
extern const Subcommand crc_find_subcommand;
extern const Subcommand vectors_subcommand;
extern const Subcommand changes_subcommand;
extern const Subcommand campaign_subcommand;
extern const Subcommand bench_subcommand;

}  // namespace absenc::tool
