// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/doctor/examine.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <set>

#include "absenc/client/doctor/damage.hpp"
#include "absenc/client/doctor/examiner.hpp"
#include "absenc/client/doctor/trials.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/identify/line.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/delay_watch.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::client {

namespace {

// Number of readings with a tried setting, such as another baud rate, before it is compared with the user's setting. A
// tried setting without any good reply is dropped.
constexpr std::size_t first_readings = 2;
// number of readings with each of the two compared settings, in one turn of the comparison
constexpr std::size_t trial_readings = 5;
constexpr unsigned trial_turns = 2;
// Time limit for the readings with one setting in one turn of the comparison, to which the duration of 200 characters
// is added.
constexpr Time trial_limit = std::chrono::milliseconds(500);
constexpr int trial_characters = 200;
// An encoder that was powered on just before the first request is assumed to reply at most this time later. tformat
// needs 1.5 s.
constexpr Time longest_start = std::chrono::seconds(2);
// time limit of the readings with which other models and options are tried
constexpr Time models_limit = std::chrono::seconds(3);
constexpr Time addresses_limit = std::chrono::seconds(4);
constexpr Time identify_limit = std::chrono::seconds(16);
// Clocks that are tried, as multiples and divisors of the one that is set, the slowest first.
struct Ratio {
  std::uint32_t times, divisor;
};
constexpr std::array<Ratio, 7> swept{{{1, 8}, {1, 4}, {1, 2}, {1, 1}, {3, 2}, {2, 1}, {4, 1}}};
constexpr std::uint32_t slowest_swept = 10'000;  // lowest clock rate that is tried, in Hz
// highest clock rate that is tried, in Hz, if the document states no limit
constexpr std::uint32_t fastest_swept = 10'000'000;
// greatest difference between positions of a resting shaft, in counts
constexpr std::int64_t resting_counts = 8;

bool is_serial(const EncoderAddress& address) {
  return address.port_kind == PortKind::serial || address.port_kind == PortKind::slcan;
}

// Returns whether `identify` can search the port for encoders of other protocols.
bool may_be_another(const EncoderAddress& address) {
  const bool characters = address.unit->link == LinkKind::half_duplex || address.unit->link == LinkKind::full_duplex;
  return characters && (address.port_kind == PortKind::serial || address.port_kind == PortKind::tcp);
}

bool streams(const EncoderAddress& address) {
  return address.unit->streams != nullptr && address.unit->streams(address.options);
}

// Stores the addresses at which a scan receives damaged replies, or the replies of two encoders.
struct Clashes final : FieldSink {
  void put(const FieldValue& value) override {
    if (value.info->role == Role::encoder) address = value.number;
    if (value.info->role == Role::clash && value.number != 0 && address) all.insert(*address);
  }
  std::optional<std::int64_t> address;
  std::set<std::int64_t> all;
};

// ---- Class Doctor: the steps of an examination

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
    seen_.place = address.port_kind;
    seen_.echo = seen_.echo_said = address.echo;
    seen_.latency = address.latency;
  }

  Examination run() {
    try {
      look();
    } catch (const os::Failure& failure) {
      seen_.refusal = Refusal{failure.kind(), failure.what(), failure.bus(), failure.holder()};
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
    if (address_.port_kind == PortKind::ftdi) {
      tell("the data pin");
      const Link link = surroundings_.open(address_);
      if (link.is_data_driven) seen_.data_driven = link.is_data_driven();
    }
    if (address_.unit->link == LinkKind::can) {
      look_over<CanFrame>();
    } else {
      look_over<std::uint8_t>();
    }
    if (is_serial(address_)) count_damage();
  }

  // Reads the properties of the port again, after it was closed, and stores how much the driver's error counters have
  // grown.
  void count_damage() {
    const os::PortFacts now = surroundings_.facts(address_.path);
    if (now.counts && seen_.facts.counts) seen_.damage = now.counts->since(*seen_.facts.counts);
    // With rs485=on and rs485=rts the port opens only if RTS switches the direction.
    const bool by_rts = address_.rs485 == os::Rs485::on || address_.rs485 == os::Rs485::rts;
    seen_.facts.kernel_direction = by_rts ? true : now.kernel_direction;
    // the earlier value may be out of date: absenc may have shortened the driver's latency timer when it opened the
    // port
    seen_.facts.latency_timer = now.latency_timer;
  }

  template <class Item>
  void look_over() {
    {
      Examiner<Item> examiner(address_, surroundings_.open(address_), choices_);
      const bool wired = address_.unit->link == LinkKind::half_duplex || address_.unit->link == LinkKind::full_duplex;
      if (wired && !streams(address_)) {
        tell("listening");
        examiner.listen(seen_);
      }
      tell("reading");
      try {
        std::optional<os::DelayWatch> watch;
        if (surroundings_.on_the_clock && address_.port_kind != PortKind::sim) watch.emplace(is_serial(address_));
        examiner.observe(*read_, choices_.readings, choices_.limit, seen_);
        if (watch) seen_.computer_late = watch->latest();
        if (wired && !streams(address_)) examiner.listen_longer(seen_);
        if (any_good() && choices_.turning > Time{}) {
          tell("turn the shaft by hand now");
          examiner.read(*read_, most_turned, choices_.turning, seen_.turned);
        }
        if (wired && !any_heard() && seen_.unsolicited.empty()) examiner.listen_for_late();
        if (!any_good() && any_heard()) scan(examiner);
      } catch (...) {
        examiner.conclude(seen_);
        throw;
      }
      examiner.conclude(seen_);
    }
    // On a CAN bus other settings are tried only if nothing was received, because other bit rates would destroy frames
    // of other devices.
    const bool disturbs = std::is_same_v<Item, CanFrame> && any_heard();
    const bool may_be_settings = hardly_any_good(seen_.readings) && !seen_.never_silent && seen_.lateness == Time{};
    if (may_be_settings && !disturbs && !is_adapter()) try_others<Item>();
    if constexpr (std::is_same_v<Item, std::uint8_t>) {
      if (address_.port_kind == PortKind::ftdi && any_good() && !all_at_rest(seen_.readings)) sweep_clock();
      if (may_be_another(address_) && seen_.trials.empty() && is_unexplained()) identify_others();
      if (address_.port_kind != PortKind::sim && seen_.trials.empty() && !any_heard() && !seen_.refusal)
        ask_once_more();
    }
  }

  [[nodiscard]] bool any_good() const {
    return std::any_of(seen_.readings.begin(), seen_.readings.end(),
                       [](const Attempted& one) { return one.error == Error::none; });
  }
  [[nodiscard]] bool any_heard() const {
    return std::any_of(seen_.readings.begin(), seen_.readings.end(), [](const Attempted& one) { return one.heard; });
  }

  // Returns whether a change of bytes by an adapter explains the damaged replies. Other settings are not tried then:
  // the changed bytes may be a good reply of another format. A missing 8th bit is no such explanation, because replies
  // of text never have one.
  [[nodiscard]] bool is_adapter() const {
    const Case one{*address_.unit, address_.options, seen_, count_good(seen_.readings)};
    const std::optional<Finding> adapter = damage_by_adapter(one, damaged(seen_.readings));
    return adapter && adapter->finding_kind != FindingKind::seven_bits;
  }

  // Scans the bus, and stores the encoder's address if two encoders seem to share it.
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
    // Other rates are tried only if the port has a rate. A pseudo-terminal has none; the rate of a CAN adapter is the
    // bit rate of the bus.
    const bool has_rate = address_.port_kind == PortKind::slcan ||
                          (address_.port_kind == PortKind::serial && !seen_.facts.pseudo_terminal);
    if (try_each<Item>(other_models(address_), models_limit)) return;
    if (try_each<Item>(other_lines(address_, has_rate), never)) return;
    try_each<Item>(other_addresses(address_), addresses_limit);
  }

  // Reads with each of these settings in turn. Returns true as soon as one of them is far better than the user's, or
  // the user's settings give mostly good readings again, which ends the search; returns false after the last setting or
  // the time `limit`.
  template <class Item>
  bool try_each(const std::vector<Other>& others, Time limit) {
    Time spent{};
    for (const Other& other : others) {
      if (spent >= limit) return false;
      tell(other.setting);
      std::vector<Attempted> attempts;
      spent += ask<Item>(other.address, first_readings, attempts);
      if (count_good(attempts) == 0) continue;
      Trial trial{other.finding_kind, other.said, other.setting};
      if (compare<Item>(other.address, trial)) return true;
    }
    return false;
  }

  // Reads in turns with a tried setting and with the user's setting: if all readings with one setting came last, an
  // encoder that was silent for a while at first would make this setting look better. Stores the trial if the tried
  // setting is far better. Returns whether the search is over.
  template <class Item>
  bool compare(const EncoderAddress& other, Trial& trial) {
    std::vector<Attempted> theirs;
    std::vector<Attempted> ours;
    for (unsigned turn = 0; turn < trial_turns; ++turn) {
      ask<Item>(other, trial_readings, theirs);
      ask<Item>(address_, trial_readings, ours);
    }
    trial.tried = theirs.size();
    trial.good = count_good(theirs);
    trial.tried_as_said = ours.size();
    trial.good_as_said = count_good(ours);
    if (is_far_better(trial.good, trial.tried, trial.good_as_said, trial.tried_as_said)) {
      seen_.trials.push_back(std::move(trial));
      return true;
    }
    if (trial.good_as_said * 10 < trial.tried_as_said * 8) return false;
    read_again<Item>();
    return true;
  }

  // Reads twice more with the user's settings. If both readings are good, takes the whole series of readings again,
  // because the encoder may have been powered on meanwhile.
  void ask_once_more() {
    std::vector<Attempted> attempts;
    const Time first = seen_.readings.empty() ? Time::min() : seen_.readings.front().began + longest_start;
    ask<std::uint8_t>(address_, first_readings, attempts, first);
    if (count_good(attempts) == first_readings) read_again<std::uint8_t>();
  }

  // Takes a new series of readings with the user's settings, because the encoder replies now.
  template <class Item>
  void read_again() {
    tell("reading");
    Examiner<Item> examiner(address_, surroundings_.open(address_), choices_);
    examiner.observe(*read_, choices_.readings, choices_.limit, seen_);
    examiner.conclude(seen_);
  }

  // Reads with slower and faster clocks, up to the fastest that the document allows. A reading is good if its position
  // is also that of the readings before, provided that the shaft rested: SSI has no checksum.
  void sweep_clock() {
    const std::uint32_t set = address_.spi.speed.value_or(address_.line.rate);
    const std::uint32_t limit = address_.line.highest_rate != 0 ? address_.line.highest_rate : fastest_swept;
    std::optional<std::int64_t> least;
    std::optional<std::int64_t> most;
    for (const Attempted& one : seen_.readings) {
      if (one.error != Error::none || !one.reading) continue;
      least = std::min(least.value_or(position(one)), position(one));
      most = std::max(most.value_or(position(one)), position(one));
    }
    const bool rests = least && *most - *least <= resting_counts;
    for (const auto [times, divisor] : swept) {
      const std::uint32_t rate = set / divisor * times;
      if (rate > std::max(limit, set) || rate < slowest_swept) continue;
      tell(fmt::format("speed={}", rate));
      EncoderAddress other = address_;
      other.spi.speed = rate;
      std::vector<Attempted> attempts;
      ask<std::uint8_t>(other, trial_readings, attempts);
      const auto is_good = [&](const Attempted& one) {
        const bool same = !rests || std::abs(position(one) - *least) <= 2 * resting_counts;
        return one.error == Error::none && same;
      };
      const auto good = static_cast<std::size_t>(std::ranges::count_if(attempts, is_good));
      if (!attempts.empty()) seen_.clocks.push_back({rate, good, attempts.size(), times == divisor});
    }
  }
  [[nodiscard]] static std::int64_t position(const Attempted& one) {
    return one.reading ? static_cast<std::int64_t>(one.reading->singleturn) : 0;
  }

  // Takes up to `count` readings with these settings, none before `earliest`, and returns their duration, 0 if the port
  // fails. A port that does not open adds no attempts.
  template <class Item>
  Time ask(const EncoderAddress& address, std::size_t count, std::vector<Attempted>& attempts,
           Time earliest = Time::min()) {
    const Command* read = find_command(*address.unit, Verb::read);
    if (read == nullptr || read->changes_encoder) return {};
    try {
      Examiner<Item> examiner(address, surroundings_.open(address), choices_);
      examiner.wait_until(earliest);
      const Time begin = examiner.now();
      // A reading may take twice the latency: until its reply is there or missed, then until the line is silent.
      const Time latencies = 2 * static_cast<int>(count) * address.latency.value_or(Time{});
      const Time limit = trial_limit + trial_characters * address.line.with_some_rate().character() + latencies;
      examiner.read(*read, count, limit, attempts);
      return examiner.now() - begin;
    } catch (const os::Failure&) {  // the port does not support the tried setting, or the port was lost
    } catch (const UsageError&) {   // the tried options need a wire that is not connected
    }
    return {};
  }

  // Returns whether no reading is good and no finding explains with certainty why, so that the encoder may have another
  // protocol.
  [[nodiscard]] bool is_unexplained() const {
    if (any_good() || seen_.never_silent || seen_.lateness != Time{}) return false;
    const Examination so_far = judge(*address_.unit, address_.options, seen_);
    const Finding* first = so_far.first();
    if (first == nullptr) return true;
    constexpr std::array unsure{
        FindingKind::no_answer,     FindingKind::only_echo,      FindingKind::baud_pattern,
        FindingKind::extra_bytes,   FindingKind::bytes_missing,  FindingKind::other_checksum,
        FindingKind::contradictory, FindingKind::always_damaged, FindingKind::direction_unswitched,
        FindingKind::same_address,  FindingKind::few_readings};
    return std::ranges::find(unsure, first->finding_kind) != unsure.end();
  }

  void identify_others() {
    LineSearch search = search_of(address_);
    search.limit = identify_limit;
    search.open = surroundings_.open;
    search.over = choices_.over;
    search.progress = [this](const std::string& what) { tell(fmt::format("which protocol: {}", what)); };
    const LineFindings findings = search_line(search);
    if (findings.interrupted) throw os::Interrupted{};
    for (const Candidate& candidate : findings.candidates) {
      if (candidate.unsolicited || !is_found(candidate)) continue;
      const std::string command = address_of(candidate, search.place);
      const EncoderAddress other = parse_address(command);
      const bool is_ours = candidate.unit == address_.unit;
      Trial trial{
          is_ours ? FindingKind::wrong_settings : FindingKind::other_protocol,
          is_ours ? said_settings(*address_.unit, address_.options) : std::string(address_.unit->id),
          is_ours ? fmt::format("{}", fmt::join(all_settings(candidate), ", ")) : std::string(candidate.unit->id)};
      trial.command = command;
      tell(fmt::format("{} and {} in turns", address_.unit->id, candidate.unit->id));
      compare<std::uint8_t>(other, trial);
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
  if (measured.rate > 0) json.set("readings_per_second", measured.rate);
  if (!measured.echo.empty()) json.set("echo", measured.echo);
  if (measured.computer_late > Time{}) json.set("computer_late_ms", in_seconds(measured.computer_late) * 1e3);
  if (measured.latency) json.set("latency_ms", in_seconds(*measured.latency) * 1e3);
  if (measured.slowest > Time{}) {
    json.set("quickest_reply_ms", in_seconds(measured.quickest) * 1e3);
    json.set("slowest_reply_ms", in_seconds(measured.slowest) * 1e3);
  }
  json.set("not_looked_at", Json::list(examination.not_looked_at));
  return json.set("verdict", examination.verdict());
}

}  // namespace absenc::client
