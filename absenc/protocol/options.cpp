// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/options.hpp"

#include "absenc/core/text.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc {

Result<std::int64_t> parse_number(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative) text.remove_prefix(1);
  unsigned base = 10;
  if (text.starts_with("0x") || text.starts_with("0X")) {
    base = 16;
    text.remove_prefix(2);
  }
  if (text.empty()) return Error::invalid_argument;
  std::int64_t value = 0;
  for (const char c : text) {
    unsigned digit = base;
    if (c >= '0' && c <= '9') digit = static_cast<unsigned>(c - '0');
    if (c >= 'a' && c <= 'f') digit = static_cast<unsigned>(c - 'a' + 10);
    if (c >= 'A' && c <= 'F') digit = static_cast<unsigned>(c - 'A' + 10);
    if (digit >= base) return Error::invalid_argument;
    if (value > (INT64_MAX - digit) / base) return Error::invalid_argument;
    value = value * base + digit;
  }
  return negative ? -value : value;
}

Result<std::int64_t> parse_decimal(std::string_view text, unsigned decimals) {
  const std::size_t point = index_of(text, '.');
  const std::string_view whole = first_of(text, point);
  std::string_view fraction = behind(text, point + 1);
  const bool misplaced = whole.starts_with('-') || (point < text.size() && fraction.empty());
  if (misplaced || fraction.size() > decimals || whole.starts_with("0x") || whole.starts_with("0X")) {
    return Error::invalid_argument;
  }
  const Result<std::int64_t> number = parse_number(whole);
  if (!number) return number;
  std::int64_t value = *number;
  for (; decimals > 0; --decimals) {
    const char c = fraction.empty() ? '0' : fraction[0];
    if (!fraction.empty()) fraction.remove_prefix(1);
    if (c < '0' || c > '9' || value > (INT64_MAX - 9) / 10) return Error::invalid_argument;
    value = value * 10 + (c - '0');
  }
  return value;
}

namespace {

Result<std::int64_t> parse_value(const Option& option, std::string_view text) {
  for (std::size_t i = 0; i < option.choices.size(); ++i) {
    if (option.choices[i] == text) return static_cast<std::int64_t>(i);
  }
  if (!option.choices.empty()) return Error::invalid_argument;
  const Result<std::int64_t> number = option.decimals > 0 ? parse_decimal(text, option.decimals) : parse_number(text);
  if (!number || *number < option.minimum || *number > option.maximum) return Error::invalid_argument;
  if ((*number - option.minimum) % option.step != 0) return Error::invalid_argument;
  return number;
}

OptionError parse_word(const Unit& unit, std::string_view text, WordFormat& word) {
  const WordFormatError error = parse_word_format(text, word, unit.fields);
  if (error.reason.empty()) return {};
  return {.kind = OptionError::Kind::bad_word, .text = text, .word = error};
}

// What says the same as the word in another way.
OptionError check_beside_word(const Unit& unit, std::string_view model, std::span<const bool> set) {
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    if (set[i] && unit.options[i].describes_word) {
      return {.kind = OptionError::Kind::beside_word, .text = unit.options[i].name};
    }
  }
  if (!model.empty()) return {.kind = OptionError::Kind::beside_word, .text = "model"};
  return {};
}

bool agrees(const Model& model, std::span<const bool> set, const Options& options) {
  for (const OptionValue& value : model.values) {
    if (set[value.option] && options[value.option] != value.value) return false;
  }
  return true;
}

}  // namespace

void tell_shared(const Unit& unit, Options& options) {
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    const bool asks = unit.options[i].choices.data() == sharing_choices.data();
    if (asks && options[i] == sharing_automatic) options.values[i] = sharing_yes;
  }
}

OptionError resolve_options(const Unit& unit, std::string_view model, std::span<const OptionText> settings,
                            Options& resolved) {
  Options options;
  std::array<bool, maximum_options> set{};
  for (std::size_t i = 0; i < unit.options.size(); ++i) options.values[i] = unit.options[i].default_value;

  for (const OptionText& setting : settings) {
    if (setting.name == word_option_name && takes_word(unit)) {
      const OptionError error = parse_word(unit, setting.value, options.word);
      if (error.kind != OptionError::Kind::none) return error;
      continue;
    }
    std::size_t index = 0;
    while (index < unit.options.size() && unit.options[index].name != setting.name) ++index;
    if (index == unit.options.size()) return {.kind = OptionError::Kind::unknown_option, .text = setting.name};
    const Option& option = unit.options[index];
    const Result<std::int64_t> value = parse_value(option, setting.value);
    if (!value) return {.kind = OptionError::Kind::bad_value, .text = setting.value, .option = &option};
    options.values[index] = *value;
    set[index] = true;
  }

  if (options.has_word()) {
    resolved = options;
    return check_beside_word(unit, model, set);
  }
  for (const Model& candidate : unit.models) {
    if (model.empty() ? agrees(candidate, set, options) : candidate.name == model) {
      options.model = &candidate;
      break;
    }
  }
  if (options.model != nullptr) {
    for (const OptionValue& value : options.model->values) {
      if (!set[value.option]) options.values[value.option] = value.value;
    }
  } else if (!model.empty()) {
    return {.kind = OptionError::Kind::unknown_model, .text = model};
  }
  resolved = options;
  return {};
}

}  // namespace absenc
