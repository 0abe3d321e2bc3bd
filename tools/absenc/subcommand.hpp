// SPDX-License-Identifier: Apache-2.0
// A subcommand as data: main.cpp makes the command line and the help text of it.
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
  std::string_view value;  // stands for its value in help; "": a flag
  std::string_view meaning;
  std::string_view fallback{};  // the default, in words; "": none
  bool required = false;
  bool repeatable = false;  // an argument that takes all that follow, or an option that may come often

  [[nodiscard]] constexpr bool is_option() const { return name.starts_with("--"); }
};

struct Example {
  std::string_view command;
  std::string_view meaning;
};

/// What the user wrote, by the names of the parameters.
class Invocation {
 public:
  void add(std::string_view name, std::string value) { values_[name].push_back(std::move(value)); }

  [[nodiscard]] bool has(std::string_view name) const { return values_.contains(name); }
  /// The last value, or `fallback`.
  [[nodiscard]] std::string_view text(std::string_view name, std::string_view fallback = {}) const;
  [[nodiscard]] std::span<const std::string> texts(std::string_view name) const;
  /// Decimal or 0x. Throws UsageError for what is no number or outside the range.
  [[nodiscard]] std::int64_t number(std::string_view name, std::int64_t fallback, std::int64_t minimum,
                                    std::int64_t maximum) const;
  [[nodiscard]] double real(std::string_view name, double fallback, double minimum, double maximum) const;

 private:
  std::map<std::string_view, std::vector<std::string>> values_;
};

struct Subcommand {
  std::string_view name;         // one word, or two as in "memory read"
  std::string_view summary;      // one line
  std::string_view description;  // more, for the help text; lines end where they should
  std::span<const Parameter> parameters;
  std::span<const Example> examples;
  int (*run)(const Invocation& invocation);  // returns the exit status
};

/// In the order in which help shows them; those that share their first word stand together.
[[nodiscard]] std::span<const Subcommand* const> all_subcommands();

/// "memory" of "memory read"; "" of one word.
[[nodiscard]] std::string_view first_word(const Subcommand& subcommand);
/// "read" of "memory read" and of "read"
[[nodiscard]] std::string_view last_word(const Subcommand& subcommand);
/// The words that may come after `first`, or, when that is "", those that a verb may begin with.
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
