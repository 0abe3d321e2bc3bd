// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/identify/candidate.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "absenc/client/port/address.hpp"
#include "absenc/client/text/unit_text.hpp"

namespace absenc::client {

namespace {

bool resolves_to(const Unit& unit, std::string_view model, const std::vector<std::string>& settings,
                 const Options& wanted) {
  std::vector<OptionText> texts;
  for (const std::string& setting : settings) texts.push_back(split_setting(setting));
  Options options;
  const OptionError error = resolve_options(unit, model, texts, options);
  return error.kind == OptionError::Kind::none && options.values == wanted.values;
}

// Returns the settings that change the options of `model` into `options`; model "" is the default model.
std::vector<std::string> differences(const Unit& unit, std::string_view model, const Options& options) {
  Options usual;
  static_cast<void>(resolve_options(unit, model, {}, usual));
  std::vector<std::string> settings;
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    if (options[i] == usual[i]) continue;
    settings.push_back(fmt::format("{}={}", unit.options[i].name, to_text(unit.options[i], options[i])));
  }
  return settings;
}

}  // namespace

bool is_found(const Candidate& candidate) { return candidate.hypothesis.chance() <= capture::is_found; }

bool is_as_likely(const Candidate& one, const Candidate& best) {
  // log10 of the factor, about three, by which the chances of two equally likely candidates may differ
  constexpr double same_likelihood = 0.5;
  return one.hypothesis.is_proven() == best.hypothesis.is_proven() &&
         one.hypothesis.chance() <= best.hypothesis.chance() + same_likelihood;
}

void rank(std::vector<Candidate>& candidates, std::size_t searches) {
  for (Candidate& one : candidates) one.hypothesis.tried *= std::max<std::size_t>(searches, 1);
  std::stable_sort(candidates.begin(), candidates.end(), [](const Candidate& one, const Candidate& other) {
    return capture::is_likelier(one.hypothesis, other.hypothesis);
  });
}

std::vector<std::string> settings_for(const Unit& unit, const Options& options) {
  std::vector<std::string> settings = differences(unit, {}, options);
  if (options.model != nullptr && !settings.empty()) {
    std::vector<std::string> by_model = differences(unit, options.model->name, options);
    by_model.insert(by_model.begin(), fmt::format("model={}", options.model->name));
    if (by_model.size() <= settings.size()) return by_model;
  }
  if (resolves_to(unit, {}, settings, options)) return settings;
  // The settings that differ from the defaults do not select these options by themselves, so all options are named.
  return option_texts(unit, options);
}

std::vector<std::string> all_settings(const Candidate& candidate) {
  std::vector<std::string> settings = settings_for(*candidate.unit, candidate.hypothesis.options);
  for (const std::string& one : candidate.link_settings) {
    const std::string_view name = split_setting(one).name;
    const Option* option = find_option(*candidate.unit, name);
    const bool said = std::any_of(settings.begin(), settings.end(), [&](const std::string& other) {
      return split_setting(other).name == (option != nullptr ? option->name : name);
    });
    if (!said) settings.push_back(one);
  }
  return settings;
}

std::string address_of(const Candidate& candidate, std::string_view place) {
  const std::vector<std::string> settings = all_settings(candidate);
  const std::string address = fmt::format("{}:{}", candidate.unit->id, place);
  return settings.empty() ? address : fmt::format("{}?{}", address, fmt::join(settings, "&"));
}

}  // namespace absenc::client
