// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/options.hpp"

#include "absenc/protocol/unit.hpp"

namespace absenc {

namespace {

OptionError parse_word(const Unit& unit, std::string_view text, WordFormat& word) {
  const WordFormatError error = parse_word_format(text, word, unit.fields);
  if (error.reason.empty()) return {};
  return {.kind = OptionError::Kind::bad_word, .text = text, .word = error};
}

// Returns an error if a model, or an option for a word, was given with a word format.
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
