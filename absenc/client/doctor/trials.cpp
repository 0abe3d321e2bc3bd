// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/doctor/trials.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>

#include "absenc/client/doctor/damage.hpp"
#include "absenc/client/identify/probe_settings.hpp"
#include "absenc/client/text/unit_text.hpp"

namespace absenc::client {

namespace {

constexpr std::array<std::uint32_t, 16> usual_rates{2400,      4800,      9600,      19'200,   38'400,  57'600,
                                                    115'200,   128'000,   230'400,   460'800,  500'000, 921'600,
                                                    1'000'000, 2'000'000, 2'500'000, 5'000'000};

bool carries_characters(const Unit& unit) {
  return unit.link == LinkKind::half_duplex || unit.link == LinkKind::full_duplex;
}

// ---- Trials of other rates

// Returns the address with another rate; nothing if the unit cannot have this rate.
std::optional<EncoderAddress> with_rate(const EncoderAddress& address, std::uint32_t rate) {
  EncoderAddress other = address;
  const Option* option = find_role(address.unit->options, Role::rate);
  if (option == nullptr) {
    other.line.rate = rate;
    return other;
  }
  const auto index = static_cast<std::size_t>(option - address.unit->options.data());
  std::int64_t value = rate;
  if (!option->choices.empty()) {
    const auto choice = std::find(option->choices.begin(), option->choices.end(), std::to_string(rate));
    if (choice == option->choices.end()) return std::nullopt;
    value = choice - option->choices.begin();
  } else if (value < option->minimum || value > option->maximum) {
    return std::nullopt;
  }
  other.options.values[index] = value;
  other.line = line_settings(*address.unit, other.options);
  return other;
}

// Returns the baud rates to try: first those of the protocol and its models, then other common rates.
std::vector<std::uint32_t> rates_of(const Unit& unit) {
  std::vector<std::uint32_t> rates;
  const auto add = [&](std::uint32_t rate) {
    if (rate != 0 && std::find(rates.begin(), rates.end(), rate) == rates.end()) rates.push_back(rate);
  };
  add(unit.line.rate);
  for (const Model& model : unit.models) {
    Options options;
    const bool known = resolve_options(unit, model.name, {}, options).kind == OptionError::Kind::none;
    if (known) add(line_settings(unit, options).rate);
  }
  if (const Option* option = find_role(unit.options, Role::rate)) {
    for (const std::string_view choice : option->choices) {
      if (const auto rate = parse_number(choice)) add(static_cast<std::uint32_t>(*rate));
    }
  }
  for (const std::uint32_t rate : usual_rates) add(rate);
  return rates;
}

void add_rates(const EncoderAddress& address, std::vector<Other>& others) {
  const Option* option = find_role(address.unit->options, Role::rate);
  const std::string_view name = option != nullptr ? option->name : rate_setting;
  const auto text = [&](std::uint32_t rate) { return fmt::format("{}={}", name, rate); };
  for (const std::uint32_t rate : rates_of(*address.unit)) {
    if (rate == address.line.rate) continue;
    if (auto other = with_rate(address, rate)) {
      others.push_back({FindingKind::wrong_baud, text(address.line.rate), text(rate), std::move(*other)});
    }
  }
}

void add_spi(const EncoderAddress& address, std::vector<Other>& others) {
  const std::uint8_t mode = address.spi.mode.value_or(address.line.spi_mode);
  const std::uint32_t speed = address.spi.speed.value_or(address.line.rate);
  const auto add = [&](FindingKind finding_kind, std::string_view name, std::uint32_t said,
                       std::uint32_t set) -> Other& {
    return others.emplace_back(
        Other{finding_kind, fmt::format("{}={}", name, said), fmt::format("{}={}", name, set), address});
  };
  for (std::uint8_t other = 0; other < 4; ++other) {
    // The MPSSE of an FTDI chip can sample at only one edge for each idle level of the clock, so for it only an SPI
    // mode with the other idle level is another setting.
    const bool same =
        address.port_kind == PortKind::ftdi ? (other & 1) != 0 || (other & 2) == (mode & 2) : other == mode;
    if (!same) add(FindingKind::wrong_spi_mode, "spi_mode", mode, other).address.spi.mode = other;
  }
  for (const std::uint32_t divisor : {2u, 4u, 8u, 16u}) {
    if (speed / divisor == 0) break;
    add(FindingKind::clock_too_fast, "speed", speed, speed / divisor).address.spi.speed = speed / divisor;
  }
}

// ---- Trials of other models and addresses

/// Decides which options may be tried: the request to read with them must not change an encoder of another protocol.
class Safety {
 public:
  explicit Safety(const EncoderAddress& address)
      : unit_(*address.unit), read_(find_command(*address.unit, Verb::read)) {
    if (!carries_characters(unit_) || address.port_kind == PortKind::sim) return;
    harmful_ = harmful_to_others(unit_, address.line.rate, search_of(address));
    said_ = is_harmful(address.options);
  }
  /// Returns whether a request with these options may be sent; always true if the user's own options are harmful, too.
  [[nodiscard]] bool allows(const Options& options) const { return said_ || !is_harmful(options); }

 private:
  [[nodiscard]] bool is_harmful(const Options& options) const {
    const std::vector<std::uint8_t> request = request_of(unit_, options, *read_);
    return std::ranges::any_of(harmful_, [&](const std::vector<std::uint8_t>& one) {
      return request.size() >= one.size() && std::equal(one.begin(), one.end(), request.begin());
    });
  }

  const Unit& unit_;
  const Command* read_;
  std::vector<std::vector<std::uint8_t>> harmful_;
  bool said_ = false;
};

EncoderAddress with_options(const EncoderAddress& address, const Options& options) {
  EncoderAddress other = address;
  other.options = options;
  const LineSettings line = line_settings(*address.unit, options);
  const LineSettings said = line_settings(*address.unit, address.options);
  if (line.rate != said.rate) other.line = line;
  return other;
}

// Returns whether the unit accepts these options.
bool is_possible(const Unit& unit, const Options& options) {
  std::vector<std::string> texts = option_texts(unit, options);
  std::vector<OptionText> settings;
  for (const std::string& text : texts) settings.push_back(split_setting(text));
  Options ignored;
  return resolve_options(unit, {}, settings, ignored).kind == OptionError::Kind::none;
}

}  // namespace

LineSearch search_of(const EncoderAddress& address) {
  LineSearch search;
  // On a line of 8-bit characters, a request in longer characters would arrive as a different request.
  search.most_data_bits = address.unit->line.data_bits > 8 ? search.most_data_bits : 8;
  search.place =
      address.port_kind == PortKind::tcp ? fmt::format("tcp:{}:{}", address.host, address.port) : address.path;
  if (address.latency) {
    const auto ms = std::chrono::ceil<std::chrono::milliseconds>(*address.latency).count();
    search.settings.push_back(fmt::format("latency={}", ms));
  }
  if (address.port_kind == PortKind::serial && address.rs485 != os::Rs485::automatic) {
    search.settings.push_back(fmt::format("rs485={}", os::rs485_names[static_cast<std::size_t>(address.rs485)]));
  }
  return search;
}

std::vector<Other> other_lines(const EncoderAddress& address, bool has_rate) {
  std::vector<Other> others;
  if (address.port_kind == PortKind::spi || address.port_kind == PortKind::ftdi) add_spi(address, others);
  if (carries_characters(*address.unit) && address.echo != host::EchoMode::automatic) {
    const bool on = address.echo == host::EchoMode::on;
    others.push_back({FindingKind::wrong_echo, on ? "echo=on" : "echo=off", on ? "echo=off" : "echo=on", address});
    others.back().address.echo = on ? host::EchoMode::off : host::EchoMode::on;
  }
  if (has_rate) add_rates(address, others);
  return others;
}

std::vector<Other> other_models(const EncoderAddress& address) {
  constexpr std::size_t most = 32;
  std::vector<Other> others;
  if (address.port_kind == PortKind::sim || address.unit->link == LinkKind::can) return others;
  const Unit& unit = *address.unit;
  const Option* encoder = find_role(unit.options, Role::encoder);
  const Safety safety(address);
  const std::string said = said_settings(unit, address.options);
  const auto add = [&](Options options) {
    // Keeps the address of the encoder: another model is tried, but of the same encoder on the line.
    if (encoder != nullptr) {
      const auto index = static_cast<std::size_t>(encoder - unit.options.data());
      options.values[index] = address.options[index];
    }
    const auto is_same = [&](const Other& one) { return one.address.options.values == options.values; };
    if (others.size() >= most || options.values == address.options.values || std::ranges::any_of(others, is_same)) {
      return;
    }
    if (!safety.allows(options)) return;
    const std::vector<std::string> settings = settings_to_set(unit, options, address.options);
    others.push_back({FindingKind::wrong_settings, said, fmt::format("{}", fmt::join(settings, ", ")),
                      with_options(address, options)});
  };
  const auto is_of_models = [&](std::size_t option) {
    return std::ranges::any_of(unit.models, [option](const Model& model) {
      return std::ranges::any_of(model.values, [option](const OptionValue& value) { return value.option == option; });
    });
  };
  for (const Model& model : unit.models) {
    Options options;
    if (resolve_options(unit, model.name, {}, options).kind != OptionError::Kind::none) continue;
    // Options that no model sets, such as the rate of a clock, keep the value that the user gave.
    for (std::size_t i = 0; i < unit.options.size(); ++i) {
      if (!is_of_models(i)) options.values[i] = address.options[i];
    }
    if (is_possible(unit, options)) add(options);
  }
  if (!carries_characters(unit)) return others;
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    const Option& option = unit.options[i];
    if (option.role == Role::rate || option.role == Role::encoder) continue;
    for (std::size_t value = 0; value < option.choices.size(); ++value) {
      Options options = address.options;
      options.values[i] = static_cast<std::int64_t>(value);
      options.model = nullptr;
      if (is_possible(unit, options)) add(options);
    }
  }
  return others;
}

std::vector<Other> other_addresses(const EncoderAddress& address) {
  std::vector<Other> others;
  const Unit& unit = *address.unit;
  const Option* option = find_role(unit.options, Role::encoder);
  const Command* scan = find_command(unit, Verb::scan);
  const bool disturbs = scan != nullptr && !scan->disturbs.empty();
  const bool streams = unit.streams != nullptr && unit.streams(address.options);
  if (option == nullptr || disturbs || streams || address.port_kind == PortKind::sim || unit.link == LinkKind::can) {
    return others;
  }
  const auto index = static_cast<std::size_t>(option - unit.options.data());
  const Safety safety(address);
  const auto text = [&](std::int64_t value) { return fmt::format("{}={}", option->name, to_text(*option, value)); };
  for (std::int64_t value = option->minimum; value <= option->maximum; value += option->step) {
    if (value == address.options[index]) continue;
    Options options = address.options;
    options.values[index] = value;
    if (!safety.allows(options)) continue;
    others.push_back({FindingKind::wrong_address, text(address.options[index]), text(value), address});
    others.back().address.options = options;
  }
  return others;
}

bool is_far_better(std::size_t good, std::size_t tried, std::size_t good_as_said, std::size_t tried_as_said) {
  constexpr double chance = 1e-3;
  if (tried == 0 || good * 10 < tried * 8) return false;
  const auto log_choose = [](std::size_t all, std::size_t some) {
    return std::lgamma(static_cast<double>(all + 1)) - std::lgamma(static_cast<double>(some + 1)) -
           std::lgamma(static_cast<double>(all - some + 1));
  };
  const std::size_t all_good = good + good_as_said;
  // probability that at least `good` of all good readings would have the tried setting if both settings were equally
  // good
  double sum = 0;
  for (std::size_t more = good; more <= std::min(tried, all_good); ++more) {
    if (all_good - more > tried_as_said) continue;
    sum += std::exp(log_choose(tried, more) + log_choose(tried_as_said, all_good - more) -
                    log_choose(tried + tried_as_said, all_good));
  }
  return sum < chance;
}

}  // namespace absenc::client
