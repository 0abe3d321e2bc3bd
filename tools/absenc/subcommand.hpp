// SPDX-License-Identifier: Apache-2.0
// Describes a subcommand as data, from which main.cpp parses the command line and help.cpp prints help.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace absenc::tool {

struct Parameter {
  std::string_view name;   // "unit": an argument; "--count": an option
  std::string_view value;  // placeholder of its value in help; "": a flag without a value
  std::string_view meaning;
  std::string_view fallback{};  // the default in words, for help; "": none
  bool required = false;
  bool repeatable = false;  // an argument that takes all following words, or an option that may be given several times

  [[nodiscard]] constexpr bool is_option() const { return name.starts_with("--"); }
};

struct Example {
  std::string_view command;
  std::string_view meaning;
};

/// The values that the user wrote, by parameter name.
class Invocation {
 public:
  void add(std::string_view name, std::string value) { values_[name].push_back(std::move(value)); }

  [[nodiscard]] bool has(std::string_view name) const { return values_.contains(name); }
  /// Returns the last value of the parameter, or `fallback` if there is none.
  [[nodiscard]] std::string_view text(std::string_view name, std::string_view fallback = {}) const;
  [[nodiscard]] std::span<const std::string> texts(std::string_view name) const;
  /// Returns the value as a number, decimal or with 0x. Throws UsageError if it is no number or out of range.
  [[nodiscard]] std::int64_t number(std::string_view name, std::int64_t fallback, std::int64_t minimum,
                                    std::int64_t maximum) const;
  [[nodiscard]] double real(std::string_view name, double fallback, double minimum, double maximum) const;

 private:
  std::map<std::string_view, std::vector<std::string>> values_;
};

struct Subcommand {
  std::string_view name;         // one word, or two as in "memory read"
  std::string_view summary;      // one line of help
  std::string_view description;  // further help text, with its line ends
  std::span<const Parameter> parameters;
  std::span<const Example> examples;
  int (*run)(const Invocation& invocation);  // returns the exit status
};

/// All subcommands in the order of help; those with the same first word are adjacent.
[[nodiscard]] std::span<const Subcommand* const> all_subcommands();

/// Returns "memory" for "memory read"; "" for a verb of one word.
[[nodiscard]] std::string_view first_word(const Subcommand& subcommand);
/// Returns "read" for "memory read" and for "read".
[[nodiscard]] std::string_view last_word(const Subcommand& subcommand);
/// Returns the words that may follow `first`; if `first` is "", the words with which a verb may begin.
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
