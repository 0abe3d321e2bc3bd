// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/doctor/examine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <set>

#include "absenc/client/doctor/examiner.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/wakeup_watch.hpp"

namespace absenc::client {

namespace {

constexpr std::size_t trial_readings = 5;
constexpr std::size_t trial_good = 4;  // of them: then it helps
constexpr Time trial_limit = std::chrono::milliseconds(500);
constexpr std::array<std::uint32_t, 16> usual_rates{2400,      4800,      9600,      19'200,   38'400,  57'600,
                                                    115'200,   128'000,   230'400,   460'800,  500'000, 921'600,
                                                    1'000'000, 2'000'000, 2'500'000, 5'000'000};

bool is_serial(const EncoderAddress& address) {
  return address.place == Place::serial || address.place == Place::slcan;
}

bool streams(const EncoderAddress& address) {
  return address.unit->streams != nullptr && address.unit->streams(address.options);
}

// Address at which a scan finds what is damaged every time.
struct Clashes final : FieldSink {
  void put(const FieldValue& value) override {
    if (value.info->role == Role::encoder) address = value.number;
    if (value.info->role == Role::clash && value.number != 0 && address) all.insert(*address);
  }
  std::optional<std::int64_t> address;
  std::set<std::int64_t> all;
};

// ---- What could be set instead

struct Other {
  Ailment ailment;
  std::string said;
  std::string setting;
  EncoderAddress address;
};

// Nothing where the unit has no such rate.
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

// Those of the protocol and its models first, then those that are common.
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
      others.push_back({Ailment::wrong_baud, text(address.line.rate), text(rate), std::move(*other)});
    }
  }
}

void add_spi(const EncoderAddress& address, std::vector<Other>& others) {
  const std::uint8_t mode = address.spi.mode.value_or(address.line.spi_mode);
  const std::uint32_t speed = address.spi.speed.value_or(address.line.rate);
  const auto add = [&](Ailment ailment, std::string_view name, std::uint32_t said, std::uint32_t set) -> Other& {
    return others.emplace_back(
        Other{ailment, fmt::format("{}={}", name, said), fmt::format("{}={}", name, set), address});
  };
  for (std::uint8_t other = 0; other < 4; ++other) {
    if (other != mode) add(Ailment::wrong_spi_mode, "spi_mode", mode, other).address.spi.mode = other;
  }
  for (const std::uint32_t divisor : {2u, 4u, 8u, 16u}) {
    if (speed / divisor == 0) break;
    add(Ailment::clock_too_fast, "speed", speed, speed / divisor).address.spi.speed = speed / divisor;
  }
}

std::vector<Other> others_of(const EncoderAddress& address) {
  std::vector<Other> others;
  if (address.place == Place::spi) add_spi(address, others);
  const bool characters = address.unit->link == LinkKind::half_duplex || address.unit->link == LinkKind::full_duplex;
  if (characters && address.echo != host::EchoMode::automatic) {
    const bool on = address.echo == host::EchoMode::on;
    others.push_back({Ailment::wrong_echo, on ? "echo=on" : "echo=off", on ? "echo=off" : "echo=on", address});
    others.back().address.echo = on ? host::EchoMode::off : host::EchoMode::on;
  }
  if (is_serial(address)) add_rates(address, others);
  return others;
}

// ---- One after the other

class Doctor {
 public:
  Doctor(const EncoderAddress& address, const DoctorChoices& choices, const Surroundings& surroundings)
      : address_(address),
        choices_(choices),
        surroundings_(surroundings),
        read_(find_command(*address.unit, Verb::read)) {
    if (read_ == nullptr || read_->changes_encoder) {
      throw UsageError(fmt::format("{} has no command that reads the position", address.unit->id));
    }
    seen_.limit = speed_limit(address);
  }

  Examination run() {
    try {
      look();
    } catch (const os::Failure& failure) {
      seen_.refusal = Refusal{failure.kind(), failure.what(), failure.bus()};
    } catch (const os::Interrupted&) {
      seen_.complete = false;
    }
    return judge(*address_.unit, address_.options, seen_);
  }

 private:
  void look() {
    if (is_serial(address_)) {
      tell("the port");
      seen_.port = address_.path;
      seen_.facts = surroundings_.facts(address_.path);
    }
    // What a controller has no connection for goes on: others of its settings may help.
    if (address_.unit->link == LinkKind::can) {
      look_over<CanFrame>();
    } else {
      look_over<std::uint8_t>();
    }
    if (is_serial(address_)) count_damage();
  }

  // The port is closed again: what its driver counted can be asked for.
  void count_damage() {
    const os::PortFacts now = surroundings_.facts(address_.path);
    if (now.counts && seen_.facts.counts) seen_.damage = now.counts->since(*seen_.facts.counts);
    seen_.facts.kernel_direction = now.kernel_direction;
    seen_.facts.latency_timer = now.latency_timer;  // a port's driver may have shortened it
  }

  template <class Item>
  void look_over() {
    {
      Examiner<Item> examiner(address_, surroundings_.open(address_), choices_.over);
      const bool wired = address_.unit->link == LinkKind::half_duplex || address_.unit->link == LinkKind::full_duplex;
      if (wired && !streams(address_)) {
        tell("listening");
        examiner.listen(seen_);
      }
      tell("reading");
      try {
        std::optional<os::WakeupWatch> watch;
        if (surroundings_.on_the_clock && address_.place != Place::sim) watch.emplace();
        examiner.read(*read_, choices_.readings, choices_.limit, seen_.readings);
        if (watch) seen_.woken_late = watch->latest();
        if (any_good() && choices_.turning > Time{}) {
          tell("turn the shaft by hand now");
          examiner.read(*read_, most_turned, choices_.turning, seen_.turned);
        }
        if (wired && !any_heard() && seen_.unasked.empty()) examiner.listen_for_late();
        if (!any_good() && any_heard()) scan(examiner);
      } catch (...) {
        examiner.conclude(seen_);
        throw;
      }
      examiner.conclude(seen_);
    }
    // Another bit rate would destroy what others say on a bus: only where nobody does.
    const bool disturbs = std::is_same_v<Item, CanFrame> && any_heard();
    if (!any_good() && !seen_.never_silent && seen_.lateness == Time{} && !disturbs) try_others<Item>();
  }

  [[nodiscard]] bool any_good() const {
    return std::any_of(seen_.readings.begin(), seen_.readings.end(),
                       [](const Attempted& one) { return one.error == Error::none; });
  }
  [[nodiscard]] bool any_heard() const {
    return std::any_of(seen_.readings.begin(), seen_.readings.end(), [](const Attempted& one) { return one.heard; });
  }

  // Whether two encoders have the address that is read.
  template <class Item>
  void scan(Examiner<Item>& examiner) {
    const Command* command = find_command(*address_.unit, Verb::scan);
    const Option* option = find_role(address_.unit->options, Role::encoder);
    if (command == nullptr || command->changes_encoder || !command->disturbs.empty() || option == nullptr) return;
    tell("who else is on the line");
    Clashes clashes;
    examiner.report(*command, complete_arguments(*command, {}), clashes);
    const std::int64_t own = address_.options[static_cast<std::size_t>(option - address_.unit->options.data())];
    if (clashes.all.contains(own)) seen_.clash = fmt::format("{} {}", option->name, to_text(*option, own));
  }

  template <class Item>
  void try_others() {
    for (const Other& other : others_of(address_)) {
      tell(other.setting);
      Trial trial{other.ailment, other.said, other.setting};
      try {
        Examiner<Item> examiner(other.address, surroundings_.open(other.address), choices_.over);
        std::vector<Attempted> attempts;
        const auto good = [](const Attempted& one) { return one.error == Error::none; };
        // One that is not answered at all is asked no more.
        examiner.read(*read_, 2, trial_limit, attempts);
        if (std::any_of(attempts.begin(), attempts.end(), good)) {
          examiner.read(*read_, trial_readings - 2, trial_limit, attempts);
        }
        trial.tried = attempts.size();
        trial.good = static_cast<std::size_t>(std::count_if(attempts.begin(), attempts.end(), good));
      } catch (const os::Failure&) {  // a rate that this port has not
        continue;
      }
      if (trial.good < trial_good) continue;
      seen_.trials.push_back(std::move(trial));
      return;
    }
  }

  void tell(const std::string& what) const {
    if (choices_.progress) choices_.progress(what);
  }

  static constexpr std::size_t most_turned = 100'000;

  const EncoderAddress& address_;
  const DoctorChoices& choices_;
  const Surroundings& surroundings_;
  const Command* read_;
  Observations seen_;
};

}  // namespace

Examination examine(const EncoderAddress& address, const DoctorChoices& choices, const Surroundings& surroundings) {
  return Doctor(address, choices, surroundings).run();
}

Examination examine(std::string_view text, std::span<const std::string> settings, const DoctorChoices& choices) {
  return examine(parse_address(text, settings), choices);
}

Json to_json(const Examination& examination) {
  const auto in_seconds = [](Time time) { return std::chrono::duration<double>(time).count(); };
  const Json findings = Json::list(examination.findings, [](const Finding& one) {
    return Json::object()
        .set("id", one.id)
        .set("severity", name_of(one.severity))
        .set("evidence", one.evidence)
        .set("cause", one.cause)
        .set("action", one.action);
  });
  Json json = Json::object().set("ok", examination.healthy()).set("findings", findings);
  json.set("readings", examination.tried).set("good", examination.good).set("complete", examination.complete);
  const Measured& measured = examination.measured;
  json.set("seconds", in_seconds(measured.time)).set("failures_below", measured.failures);
  if (measured.slowest > Time{}) {
    json.set("quickest_reply_ms", in_seconds(measured.quickest) * 1e3);
    json.set("slowest_reply_ms", in_seconds(measured.slowest) * 1e3);
  }
  return json.set("verdict", examination.verdict());
}

}  // namespace absenc::client
