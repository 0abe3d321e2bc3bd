// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <map>
#include <stdexcept>

#include "absenc/sim/bench_test.hpp"
#include "absenc/sim/place.hpp"
#include "tests/kit/changes.hpp"
#include "tests/kit/exchanges_without_faults.hpp"
#include "tests/kit/kit.hpp"
#include "tests/kit/undetected_damage.hpp"
#include "tests/kit/world.hpp"

namespace absenc::kit {
namespace {

constexpr unsigned places = 8;
// number of exchanges with a virtual encoder before a new one replaces it
constexpr std::uint64_t exchanges_per_encoder = 4000;
// Greatest number of runs of each command that changes the encoder, with one virtual encoder.
constexpr unsigned runs_per_change = 2;
constexpr std::string_view too_short =
    "; if it asks too soon: after a reply HostTimes::pause or silence, before a repetition Manner::pause, after an "
    "error "
    "Manner::hold is too short (the table in absenc/protocol/author/engine.hpp)";

bool is_repeatable(const Command& command) {
  return !command.changes_encoder &&
         (command.verb == Verb::read || command.verb == Verb::read_part || command.verb == Verb::info ||
          command.verb == Verb::temperature || command.verb == Verb::config_get || command.verb == Verb::memory_read);
}

/// Counters of a run of `check_exchanges`, summed over all of its virtual encoders.
struct Tally {
  std::uint64_t exchanges = 0;
  std::uint64_t conversations = 0;
  std::uint64_t accepted = 0;
  std::uint64_t damaged = 0;  // number of faults of the line that changed bytes
  std::uint64_t wrong = 0;    // number of wrong results of commands whose replies have a check
  // number of violations by the host of rules in the encoder's document; counted only with a model's options
  std::uint64_t rule_violations = 0;
  std::uint64_t damaged_request_bytes = 0;  // number of damaged bytes (CAN: frames) in requests
  // number of conversations with commands that change the encoder, without those that were refused
  std::uint64_t changes = 0;
  std::uint64_t changed = 0;  // number of changes that the host reported as successful
  // number of changes that the host reported as successful, although the encoder did not make them
  std::uint64_t failed_changes = 0;
  std::string broken_promise_text{};
  std::string violated_rule{};
  /// Counters of the conversations with one command; separate for each configuration that is not a model's.
  struct Command {
    DamagedReplies damage{};
    std::uint64_t cost = 0;         // greatest number of exchanges of one run on an undamaged line; 0: not known yet
    std::optional<bool> unchecked;  // whether a reply of the command has no check; empty if not known yet
  };
  std::map<std::string, Command> commands{};
};

/// Difference between a result and the true values; an empty text means no difference.
struct Difference {
  std::string text{};
  bool position = false;
};

template <class Item>
class Campaign {
 public:
  Campaign(const Unit& unit, const Configuration& configuration, const ExchangeTest& test, std::uint64_t seed,
           Tally& tally, Findings& findings)
      : unit_(unit),
        configuration_(configuration),
        random_(seed),
        world_(unit, configuration.options, seed),
        tally_(tally),
        findings_(findings) {
    rates_ = rates_for(unit, configuration.options, test);
  }

  [[nodiscard]] bool is_possible() { return world_.made(); }

  void run(std::uint64_t exchanges) {
    raise_an_alarm();
    record_truth();
    if (queries_.empty()) return;
    const std::uint64_t end = world_.device().answer_count() + exchanges;
    const std::uint64_t begin = world_.device().answer_count();
    for (unsigned idle = 0; world_.device().answer_count() < end && findings_.count() == 0 && idle < 10'000; ++idle)
      run_conversation();
    if (configuration_.is_model) change();
    tally_.exchanges += world_.device().answer_count() - begin;
    tally_.damaged_request_bytes += world_.faulty().counts()[static_cast<std::size_t>(sim::FaultKind::request_corrupt)];
  }

 private:
  /// A command and, for each position of the shaft, its result on a line without faults; no result if not recorded.
  struct Query {
    const Command* command;
    Values arguments;
    std::array<std::optional<ReportedFields>, places> truth{};
    std::uint64_t cost = 0;  // greatest number of exchanges of one run of the command on an undamaged line
    // names of fields whose values differ between two runs at the same position of the shaft
    std::vector<std::string> varying{};
  };

  static sim::FaultRates rates_for(const Unit& unit, const Options& options, const ExchangeTest& test) {
    using sim::FaultKind;
    sim::FaultRates rates = sim::testing::damaged_replies(0.1);
    // On SPI the host clocks the reply, so faults of its length or time cannot occur.
    if (unit.link == LinkKind::spi) rates = {};
    // CAN frames are not damaged, because CAN's own checksum detects that
    rates[FaultKind::corrupt] = unit.link == LinkKind::can ? 0 : 0.1;
    if (test.requests_too) rates[FaultKind::request_corrupt] = 0.02;
    // Replies are not delayed if the encoder sends unsolicited frames, or on CAN: a host cannot know the age of such
    // a frame.
    const bool unsolicited = unit.link == LinkKind::can || (unit.streams != nullptr && unit.streams(options));
    if (test.seed % 2 == 1 && !test.requests_too && !unsolicited) rates.delay = unit.timing.turnaround_limit * 3 / 2;
    return rates;
  }

  [[nodiscard]] std::string where(const Query& query) const {
    return configuration_.text + ", " + std::string(query.command->name) + to_text(Arguments(query.arguments)) + ": ";
  }

  void raise_an_alarm() {
    if (unit_.alarms == nullptr || random_.chance(0.5)) return;
    const std::uint64_t bit = random_.below(unit_.alarms->flags.size());
    if (!unit_.alarms->flags[bit].name.empty()) world_.device().raise_alarms(1u << bit);
  }

  // Records the results of commands that can be repeated, on an undamaged line. Commands with more than 20 exchanges
  // are mostly left out.
  void record_truth() {
    for (std::int64_t& place : places_) place = static_cast<std::int64_t>(random_.next());
    for (const Command& command : unit_.commands) {
      if (!is_repeatable(command)) continue;
      std::uint64_t& cost = tally_.commands[std::string(command.name)].cost;
      if (cost > 20 && !random_.chance(0.1)) continue;
      Query query{&command,
                  command.verb == Verb::memory_read ? least_arguments(command) : random_arguments(command, random_)};
      // `read` is recorded at all positions of the shaft, other commands only at the first: some take a hundred
      // exchanges.
      if (!record_truth_at(query, 0)) continue;
      cost = query.cost;
      if (command.verb == Verb::read) {
        for (unsigned place = 1; place < places; ++place) record_truth_at(query, place);
      }
      if (command.verb == Verb::read) reads_.push_back(queries_.size());
      queries_.push_back(std::move(query));
    }
    findings_.require(!configuration_.is_model || !reads_.empty(),
                      [&] { return configuration_.text + ": no position can be read"; });
  }

  bool record_truth_at(Query& query, unsigned place) {
    world_.move(places_[place]);
    for (unsigned twice = 0; twice < 2; ++twice) {
      const ConversationResult result = world_.run(*query.command, query.arguments);
      if (!result.good()) return false;
      if (result.seen.reading) {
        findings_.require(sim::is_at(*result.seen.reading, places_[place]),
                          [&] { return where(query) + "another position than the shaft's, on a good line"; });
      }
      query.cost = std::max(query.cost, result.request_count);
      if (twice == 0) {
        query.truth[place] = result.seen;
        continue;
      }
      for (const auto& [name, value] : result.seen.fields) {
        const auto first = query.truth[place]->fields.find(name);
        if (first != query.truth[place]->fields.end() && first->second == value) continue;
        findings_.require(!is_of_reading(value.role),
                          [&, &changed = name] { return where(query) + changed + " changes though the shaft stands"; });
        query.varying.push_back(name);
      }
    }
    return true;
  }

  void run_conversation() {
    const bool reads = !reads_.empty() && random_.chance(0.95);
    Query* chosen = &queries_[reads ? reads_[random_.below(reads_.size())] : random_.below(queries_.size())];
    // A command with more than four exchanges is chosen less often, the more exchanges it has.
    if (chosen->cost > 4 && !reads_.empty() && !random_.chance(4.0 / static_cast<double>(chosen->cost))) {
      chosen = &queries_[reads_[random_.below(reads_.size())]];
    }
    Query& query = *chosen;
    place_ = query.cost > 20 ? 1 - std::min(place_, 1u)
                             : (place_ + 1 + static_cast<unsigned>(random_.below(places - 1))) % places;
    if (!query.truth[place_]) {
      world_.set_rates({});
      world_.pass(std::chrono::seconds(1));
      // The result of this run is ignored, because late replies to earlier requests may arrive during it.
      (void)world_.run(*query.command, query.arguments);
      if (!record_truth_at(query, place_)) return;
    }
    world_.move(places_[place_]);
    world_.set_rates(rates_);
    const std::uint32_t rules = world_.device().violation_count();
    const ConversationResult result = world_.run(*query.command, query.arguments);
    judge_rules(query, result.faults != 0, rules);
    ++tally_.conversations;
    tally_.damaged += result.damaged;
    findings_.require(result.ended, [&] { return where(query) + "hangs"; });
    if (result.damaged != 0) measure_check(query, result.damaged);
    findings_.require(!result.premature_reading,
                      [&] { return where(query) + "has a reading before any reply, or with an error"; });
    if (!result.good()) return;
    ++tally_.accepted;
    // The command `info` has several replies; if a fault removes one, its fields are missing from the result.
    const bool may_miss = query.command->verb == Verb::info && result.faults != 0;
    const Difference wrong = difference(query, result, may_miss);
    if (wrong.text.empty()) return;
    // A damaged request may be another valid one, which has changed the encoder.
    if (rates_[sim::FaultKind::request_corrupt] > 0 && is_true_now(query, result.seen)) return;
    // If a reply has no check, a host accepts any bytes as the reply, also those of the previous reply.
    const bool unchecked = is_unchecked(query);
    findings_.require(result.damaged != 0 || (unchecked && !faultless_),
                      [&] { return where(query) + wrong.text + ", though no byte was damaged"; });
    if (unchecked) return;
    ++tally_.wrong;
    DamagedReplies& damage = tally_.commands[counter_key(query)].damage;
    ++(wrong.position ? damage.wrong_positions : damage.wrong_values);
    if (damage.example.empty()) damage.example = wrong.text;
  }

  // Runs the command again, on an undamaged line, and returns whether it reports all fields of `seen` with the same
  // values. If so, the encoder has changed, and all recorded results are discarded.
  bool is_true_now(const Query& query, const ReportedFields& seen) {
    world_.set_rates({});
    const ConversationResult now = world_.run(*query.command, query.arguments);
    if (!now.good()) return false;
    for (const auto& [name, value] : seen.fields) {
      if (!now.seen.fields.contains(name) || !(now.seen.fields.at(name) == value)) return false;
    }
    for (Query& recorded : queries_) recorded.truth = {};
    return true;
  }

  // Runs commands that change the encoder, except Verb::run, over the faulty line.
  void change() {
    for (const Command& command : unit_.commands) {
      if (!command.changes_encoder || command.verb == Verb::run) continue;
      for (unsigned i = 0; i < runs_per_change && findings_.count() == 0; ++i) {
        // Every second run has fewer faults on the line: some changes need a hundred exchanges without a fault.
        sim::FaultRates rates = rates_;
        for (double& rate : rates.rates) rate *= i % 2 == 0 ? 1 : 0.03;
        change(command, rates);
      }
    }
    world_.set_rates({});
  }
  void change(const Command& command, const sim::FaultRates& rates) {
    std::optional<Values> values = change_arguments(unit_, command, random_);
    if (!values) return;
    world_.set_rates({});
    world_.device().lower_alarms(0xFFFF'FFFF);
    world_.pass(std::chrono::seconds(2));  // waits until replies that were delayed have arrived
    world_.move(static_cast<std::int64_t>(random_.next()));
    world_.set_rates(rates);
    const ConversationResult result = world_.run(command, *values);
    world_.set_rates({});
    world_.pass(std::chrono::seconds(2));
    const auto what = [&] {
      return configuration_.text + ", " + std::string(command.name) + to_text(Arguments(*values)) + ": ";
    };
    findings_.require(result.ended || !result.made, [&] { return what() + "hangs"; });
    if (!result.made || result.error == Error::invalid_argument || result.error == Error::unsupported) return;
    ++tally_.changes;
    if (!result.good()) return;
    ++tally_.changed;
    apply_to_host(world_, unit_, command, *values);
    const std::string broken = broken_promise(world_, unit_, command, *values, result.seen);
    if (broken.empty()) return;
    findings_.require(result.damaged != 0, [&] { return what() + broken + ", though no byte was damaged"; });
    ++tally_.failed_changes;
    if (tally_.broken_promise_text.empty()) tally_.broken_promise_text = what() + broken;
  }

  [[nodiscard]] Difference difference(const Query& query, const ConversationResult& result, bool may_miss) const {
    const ReportedFields& truth = *query.truth[place_];
    const ReportedFields& seen = result.seen;
    if (seen.reading.has_value() != truth.reading.has_value()) return {"has another reading"};
    if (seen.reading && !sim::is_at(*seen.reading, places_[place_])) return {"another position than the shaft's", true};
    if (seen.reading && is_part_of(*seen.reading, *truth.reading)) return {};
    for (const auto& [name, value] : truth.fields) {
      if (std::find(query.varying.begin(), query.varying.end(), name) != query.varying.end()) continue;
      const auto found = seen.fields.find(name);
      if (found == seen.fields.end() && may_miss) continue;
      if (found == seen.fields.end()) return {"no " + name};
      if (!(found->second == value)) return {"another " + name + " than on a good line"};
    }
    return {};
  }

  // Returns whether `seen` reports only some of the alarms that `truth` reports, and the same value of each flag that
  // both report.
  [[nodiscard]] static bool is_part_of(const Reading& seen, const Reading& truth) {
    const std::uint32_t reported = seen.alarms_reported;
    if (reported == truth.alarms_reported || (reported & ~truth.alarms_reported) != 0) return false;
    return ((seen.alarms ^ truth.alarms) & reported) == 0 &&
           ((seen.status ^ truth.status) & seen.status_reported & truth.status_reported) == 0;
  }

  // Returns the key of the counters of a command: its name and its options, which
  // may select another frame check.
  [[nodiscard]] std::string counter_key(const Query& query) const {
    return std::string(query.command->name) + " " + configuration_.text;
  }

  // Counts damaged replies. For each `counter_key`, measures once how many damaged replies the check accepts.
  void measure_check(const Query& query, std::uint64_t damaged) {
    DamagedReplies& damage = tally_.commands[counter_key(query)].damage;
    damage.count += damaged;
    if (damage.undetected) return;
    damage.undetected.emplace();
    for (const auto& [request, reply] : frames_of(query)) {
      damage.undetected->add(measure_undetected_damage(unit_, world_.options(), request, reply, rates_,
                                                       query.command->verb == Verb::read ? 20'000 : 4'000));
    }
  }

  // Returns whether the command has a reply in which a frame check covers no bit.
  bool is_unchecked(const Query& query) {
    std::optional<bool>& unchecked = tally_.commands[counter_key(query)].unchecked;
    if (unchecked) return *unchecked;
    const auto frames = frames_of(query);
    const auto open = [&](const Exchange& one) {
      if (unit_.is_checked == nullptr) return false;
      for (std::size_t bit = 0; bit < one.reply.bit_count(); ++bit) {
        if (unit_.is_checked(world_.options(), one.request.frame(), one.reply.frame(), bit)) return false;
      }
      return true;
    };
    unchecked = std::any_of(frames.begin(), frames.end(), open);
    return *unchecked;
  }

  [[nodiscard]] std::vector<Exchange> frames_of(const Query& query) {
    return exchanges_without_faults<Item>(unit_, configuration_.options, places_[place_], *query.command,
                                          query.arguments);
  }

  // Counts how often the host broke rules in the encoder's document, if the options are a model's.
  void judge_rules(const Query& query, bool had_faults, std::uint32_t before) {
    const std::uint32_t new_violations = world_.device().violation_count() - before;
    faultless_ = faultless_ && !had_faults;
    // The rules are not counted with options that no model has: the host may then have to send requests that the
    // rules forbid.
    if (new_violations == 0 || !configuration_.is_model) return;
    tally_.rule_violations += new_violations;
    const std::span<const Violation> rules = world_.device().violations();
    if (tally_.violated_rule.empty() && !rules.empty()) {
      tally_.violated_rule = where(query) + std::string(rules.back().rule);
      for (const auto& [request, reply] : frames_of(query)) {
        tally_.violated_rule += "; without faults " + to_text(request) + " is answered by " + to_text(reply);
      }
    }
    findings_.require(!faultless_,
                      [&] { return "the host broke a rule: " + tally_.violated_rule + std::string(too_short); });
  }

  const Unit& unit_;
  const Configuration& configuration_;
  sim::Random random_;
  World<Item> world_;
  Tally& tally_;
  Findings& findings_;
  sim::FaultRates rates_;
  std::array<std::int64_t, places> places_{};
  unsigned place_ = 0;
  // Whether no conversation with this virtual encoder had a fault so far.
  bool faultless_ = true;
  std::vector<Query> queries_;
  std::vector<std::size_t> reads_;  // indexes in `queries_` of the commands that read the position
};

template <class Item>
void exchange(const Unit& unit, const ExchangeTest& test, Tally& tally, Findings& findings) {
  const std::vector<Configuration> setups = configurations(unit);
  const auto models = static_cast<std::size_t>(std::ranges::count_if(setups, &Configuration::is_model));
  for (std::uint64_t round = 0; tally.exchanges < test.count && findings.count() == 0; ++round) {
    if (round > 100 + test.count / 100) {
      findings.add("too few exchanges per round");
      break;
    }
    // Even rounds use only the configurations of models, which stand first in `setups`.
    const Configuration& configuration = setups[round / 2 % (round % 2 == 0 ? models : setups.size())];
    Campaign<Item> campaign(unit, configuration, test, 1000 * test.seed + round, tally, findings);
    if (!campaign.is_possible()) continue;
    try {
      campaign.run(std::min(exchanges_per_encoder, test.count - tally.exchanges));
    } catch (const std::logic_error& error) {
      findings.add(configuration.text + ": " + error.what());
    }
  }
}

}  // namespace

Findings check_exchanges(const Unit& unit, const ExchangeTest& test) {
  Findings findings;
  Tally tally;
  if (unit.link == LinkKind::can) {
    exchange<CanFrame>(unit, test, tally, findings);
  } else {
    exchange<std::uint8_t>(unit, test, tally, findings);
  }
  for (const auto& [name, command] : tally.commands) command.damage.judge(name, findings);
  // Rules are checked only if requests are not damaged: a damaged request may itself break a rule.
  findings.require(tally.rule_violations <= tally.damaged_request_bytes, [&] {
    return "the host broke rules " + std::to_string(tally.rule_violations) + " times, of which " +
           std::to_string(tally.damaged_request_bytes) +
           " damaged request bytes may be the reason; the first: " + tally.violated_rule + std::string(too_short);
  });
  findings.require(tally.failed_changes == 0, [&] {
    return std::to_string(tally.failed_changes) + " changes were not made: " + tally.broken_promise_text;
  });
  findings.note(std::to_string(tally.changed) + " of " + std::to_string(tally.changes) + " changes were made");
  findings.require(tally.accepted > tally.conversations / 50, [&] {
    return "only " + std::to_string(tally.accepted) + " of " + std::to_string(tally.conversations) + " ended well";
  });
  findings.require(tally.damaged > tally.exchanges / 100, [] { return "too few bytes were damaged"; });
  findings.note(std::to_string(tally.exchanges) + " exchanges in " + std::to_string(tally.conversations) +
                " conversations, " + std::to_string(tally.damaged) + " damaged, " + std::to_string(tally.accepted) +
                " ended well, " + std::to_string(tally.wrong) + " of them wrong");
  return findings;
}

}  // namespace absenc::kit
