// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/identify/line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <tuple>
#include <utility>

#include "absenc/capture/search/stream.hpp"
#include "absenc/client/identify/attempt.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/serial.hpp"
#include "absenc/os/serial_ports.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {

namespace {

// number of unsolicited bytes from which on the search sends no requests on the line
constexpr std::size_t busy_line = 32;
constexpr std::size_t most_introduced = 4;  // number of candidates of one encoder that are asked for their identity
// a candidate is beyond doubt if chance explains its replies with a probability of at most 10^-3
constexpr double beyond_doubt = -3;
constexpr std::array<std::uint32_t, 10> common_rates{9600,    19'200,  38'400,    57'600,    115'200,
                                                     230'400, 460'800, 1'000'000, 2'500'000, 5'000'000};

/// Unsolicited frames that came from the same encoder.
struct Sender {
  const Option* option = nullptr;  // the option that holds the encoder's address; null: the frames show no address
  std::string number{};            // value of the address option; "": none
  std::vector<ObservedExchange> exchanges{};

  [[nodiscard]] std::string name() const {
    return option != nullptr ? fmt::format("{}={}", option->name, number) : std::string();
  }
};

// Groups frames by the encoder address in them, so that frames of two encoders are not mixed.
std::vector<Sender> senders(const Unit& unit, std::span<const CanFrame> frames) {
  const std::vector<Options> likely = capture::likely_options(unit, {});
  std::vector<Sender> all;
  for (const CanFrame& frame : frames) {
    Sender sender{.exchanges = {{.reply = {.can = frame}}}};
    ScannedAddresses addresses;
    const Frame reply = sender.exchanges.front().reply.frame();
    if (!likely.empty() && unit.decode(likely.front(), {}, reply, addresses) == Error::none) {
      if (!addresses.all.empty()) sender.option = find_role(unit.options, Role::encoder);
      if (sender.option != nullptr) sender.number = fmt::format("{}", addresses.all.front());
    }
    const auto same = std::find_if(all.begin(), all.end(), [&](const Sender& one) {
      return one.option == sender.option && one.number == sender.number;
    });
    if (same == all.end()) {
      all.push_back(std::move(sender));
    } else {
      same->exchanges.push_back(std::move(sender.exchanges.front()));
    }
  }
  return all;
}

/// A search for encoders: tries the usual settings of each fitting unit, then other rates and, if no encoder is found
/// beyond doubt, silent units again.
class Search {
 public:
  explicit Search(const LineSearch& search) : search_(search), deadline_(search.now() + search.limit) {}

  LineFindings run() {
    while_there_is_time([this] { ask_everybody(); });
    if (!opened_ && failure_) throw os::Failure(*failure_);
    rank(findings_.candidates, findings_.searches);
    drop_repeated();
    while_there_is_time([this] { ask_who_they_are(); });
    if (findings_.out_of_time) note_who_was_not_asked();
    return std::move(findings_);
  }

 private:
  template <class Work>
  void while_there_is_time(const Work& work) {
    if (findings_.out_of_time || findings_.interrupted) return;
    try {
      work();
    } catch (const OutOfTime&) {
      findings_.out_of_time = true;
    } catch (const os::Interrupted&) {
      findings_.interrupted = true;
    }
  }

  void ask_everybody() {
    for (const Unit* unit : all_units()) {
      if (fits(*unit, search_)) attempt(*unit, search_.settings, quick);
    }
    for (const Unit* unit : all_units()) {
      if (fits(*unit, search_)) try_rates(*unit);
    }
    if (is_beyond_doubt()) return;
    for (const Unit* unit : std::exchange(silent_, {})) attempt(*unit, search_.settings, thorough);
  }

  // Reads the identity of each found encoder that replies to requests, with the options of its likeliest candidate and
  // of equally likely ones, at most four in all, which the identity may distinguish. Skips an encoder with a single
  // such candidate if the unit has no identity. Removes the candidates that `judge` drops.
  void ask_who_they_are() {
    std::vector<Candidate>& all = findings_.candidates;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!is_to_be_asked(all[i])) continue;
      const auto encoder = std::pair(all[i].unit, all[i].encoder);
      const std::vector<std::size_t> alike = same_as(i);
      if (alike.size() > 1 || find_role(all[i].unit->fields, Role::identity) != nullptr) {
        if (search_.progress) search_.progress(fmt::format("{}: who it is", all[i].unit->id));
        std::vector<Introduction> said;
        for (const std::size_t one : alike) said.push_back(introduce(all[one]));
        judge(alike, said);
      }
      asked_.insert(encoder);
    }
    std::erase_if(all, [](const Candidate& one) { return one.unit == nullptr; });
  }

  // Returns whether the candidate is the likeliest of an encoder that replies to requests and whose identity was not
  // asked for.
  [[nodiscard]] bool is_to_be_asked(const Candidate& one) const {
    return one.unit != nullptr && !one.unsolicited && is_found(one) && !asked_.contains({one.unit, one.encoder});
  }

  void note_who_was_not_asked() {
    for (const Candidate& one : findings_.candidates) {
      if (!is_to_be_asked(one) || find_role(one.unit->fields, Role::identity) == nullptr) continue;
      asked_.emplace(one.unit, one.encoder);  // one note for all candidates of an encoder
      findings_.notes.push_back(
          fmt::format("not asked who it is: {}: the time is over; `absenc info` asks it", one.unit->id));
    }
  }

  // Returns the indexes of the candidate `first` and of equally likely candidates of the same encoder, at most four in
  // all.
  [[nodiscard]] std::vector<std::size_t> same_as(std::size_t first) const {
    const std::vector<Candidate>& all = findings_.candidates;
    std::vector<std::size_t> alike;
    for (std::size_t i = first; i < all.size() && alike.size() < most_introduced; ++i) {
      const bool same = all[i].unit == all[first].unit && all[i].encoder == all[first].encoder && !all[i].unsolicited;
      if (same && is_as_likely(all[i], all[first])) alike.push_back(i);
    }
    return alike;
  }

  // Stores the reported identities. Drops candidates whose options the identity contradicts, if it agrees with those of
  // another candidate; otherwise adds a note if the identity contradicts the likeliest candidate. Adds a note for each
  // part of the identity that could not be read with the options of the likeliest candidate.
  void judge(const std::vector<std::size_t>& alike, const std::vector<Introduction>& said) {
    for (const std::string& one : said.front().unread) {
      const Unit& unit = *findings_.candidates[alike.front()].unit;
      findings_.notes.push_back(fmt::format("{}: not known who it is: {}; `absenc info` tries it again", unit.id, one));
    }
    const bool known = std::any_of(said.begin(), said.end(), [](const Introduction& one) { return one.agrees; });
    for (std::size_t i = 0; i < alike.size(); ++i) {
      Candidate& candidate = findings_.candidates[alike[i]];
      candidate.identity = said[i].identity;
      if (said[i].contradiction.empty()) continue;
      if (known) {
        candidate.unit = nullptr;
      } else if (i == 0) {
        findings_.notes.push_back(fmt::format("{}: {}", candidate.unit->id, said[i].contradiction));
      }
    }
  }

  Introduction introduce(const Candidate& candidate) {
    if (search_.now() >= deadline_) throw OutOfTime{};
    if (candidate.unit->link == LinkKind::can) return introduce_on<CanFrame>(candidate);
    return introduce_on<std::uint8_t>(candidate);
  }
  // Opens the port and reads the identity. If the port cannot be opened or is lost, adds a note; the candidates found
  // so far remain.
  template <class Item>
  Introduction introduce_on(const Candidate& candidate) {
    try {
      Attempt<Item> one(search_, *candidate.unit, all_settings(candidate), thorough, deadline_, findings_);
      one.open();
      return one.introduce(candidate.hypothesis.options);
    } catch (const os::Failure& failure) {
      findings_.notes.push_back(fmt::format("not asked who it is: {}: {}", candidate.unit->id, failure.what()));
      return {};
    }
  }

  void try_rates(const Unit& unit) {
    if (has_setting(search_.settings, rate_setting) || medium_of(search_) != Medium::serial) return;
    std::vector<std::string> rates;
    const Option* rate = find_role(unit.options, Role::rate);
    if (rate != nullptr) {
      for (std::size_t i = 0; i < rate->choices.size(); ++i) {
        if (static_cast<std::int64_t>(i) != rate->default_value) rates.emplace_back(rate->choices[i]);
      }
    } else if (unit.line.rate == 0 && !os::is_pseudo_terminal(search_.place)) {
      for (const std::uint32_t one : common_rates) rates.push_back(fmt::format("{}", one));
    }
    for (const std::string& value : rates) {
      // Skips the remaining rates once an encoder of any unit is found beyond doubt, or an encoder of this unit replies
      // and all its replies are explained.
      if (is_beyond_doubt() || is_explained(unit)) return;
      SettingTexts settings = search_.settings;
      settings.push_back(fmt::format("{}={}", rate_setting, value));
      attempt(unit, settings, quick);
    }
  }

  void attempt(const Unit& unit, const SettingTexts& settings, const Effort& effort) {
    if (!takes_rate(unit)) return;
    if (unit.link == LinkKind::can) return attempt_on<CanFrame>(unit, settings, effort);
    attempt_on<std::uint8_t>(unit, settings, effort);
  }

  // Returns whether the unit supports the rate that the user set; true if the user set none, or if the unit has no list
  // of rates.
  [[nodiscard]] bool takes_rate(const Unit& unit) const {
    const Option* rate = find_role(unit.options, Role::rate);
    if (rate == nullptr || rate->choices.empty()) return true;
    return std::all_of(search_.settings.begin(), search_.settings.end(), [&](const std::string& setting) {
      const OptionText one = split_setting(setting);
      return one.name != rate_setting ||
             std::find(rate->choices.begin(), rate->choices.end(), one.value) != rate->choices.end();
    });
  }

  template <class Item>
  void attempt_on(const Unit& unit, const SettingTexts& settings, const Effort& effort) {
    if (search_.now() >= deadline_) throw OutOfTime{};
    Attempt<Item> one(search_, unit, settings, effort, deadline_, findings_);
    // skips a unit without a usual baud rate now; the search tries it at other rates later
    if (one.line().rate == 0 && medium_of(search_) == Medium::serial) return;
    const std::string line = line_of(unit.link, one.line());
    if (search_.progress) {
      search_.progress(fmt::format("{}, {}: {} found so far", unit.id, line, findings_.candidates.size()));
    }
    try {
      one.open();
      opened_ = true;
    } catch (const os::Failure& failure) {
      if (!failure_) failure_ = failure;
      if (failure.kind() != os::Failure::Kind::bad_rate && failure.kind() != os::Failure::Kind::unsupported) throw;
      findings_.notes.push_back(fmt::format("not tried: {}: {}", unit.id, failure.what()));
      return;
    }
    findings_.lines.insert(line);
    const bool clocks = medium_of(search_) == Medium::spi || medium_of(search_) == Medium::ftdi;
    if (clocks || !listen(one, unit)) one.ask();
    if (one.silent() && settings == search_.settings) silent_.push_back(&unit);
  }

  // Listens once for all units with these line settings. Returns whether at least `busy_line` bytes were received, so
  // that no request must be sent; false on CAN.
  template <class Item>
  bool listen(Attempt<Item>& attempt, const Unit& unit) {
    const LineSettings& line = attempt.line();
    const auto key = std::tuple(line.rate, line.parity, line.stop_bits);
    const auto known =
        std::find_if(listened_.begin(), listened_.end(), [&](const auto& one) { return one.first == key; });
    if (known != listened_.end()) return known->second;
    const std::size_t before = findings_.candidates.size();
    const std::vector<Item> items = attempt.listen();
    findings_.unsolicited += items.size();
    if constexpr (std::is_same_v<Item, CanFrame>) {
      explain_frames(items, line_of(unit.link, line));
    } else {
      explain_bytes(items, line, unit.link);
    }
    const bool busy = !std::is_same_v<Item, CanFrame> && items.size() >= busy_line;
    if (busy && findings_.candidates.size() == before) {
      const std::string where = line.rate != 0 ? fmt::format(" at {} baud", line.rate) : std::string();
      findings_.notes.push_back(fmt::format("nothing was sent{}: somebody sends all the time", where));
    }
    listened_.emplace_back(key, busy);
    return busy;
  }

  void explain_frames(std::span<const CanFrame> frames, const std::string& line) {
    for (const Unit* unit : all_units()) {
      if (!fits(*unit, search_)) continue;
      for (const Sender& sender : senders(*unit, frames)) {
        ++findings_.searches;
        std::vector<OptionText> settings;
        if (sender.option != nullptr) settings.push_back({sender.option->name, sender.number});
        for (Hypothesis& one : capture::find_hypotheses(*unit, settings, sender.exchanges)) {
          findings_.candidates.push_back({unit, std::move(one), search_.settings, true, line, sender.name()});
        }
      }
    }
  }

  void explain_bytes(Bytes bytes, const LineSettings& line, LinkKind link) {
    for (const Unit* other : all_units()) {
      const bool same_line = fits(*other, search_) && can_receive(*other, line.rate, search_) &&
                             other->line.parity == line.parity && other->line.stop_bits == line.stop_bits;
      if (!same_line || bytes.empty()) continue;
      ++findings_.searches;
      for (Hypothesis& one : capture::find_stream_hypotheses(*other, bytes, listening)) {
        SettingTexts settings = search_.settings;
        const bool needs_rate = other->line.rate != line.rate && medium_of(search_) == Medium::serial &&
                                !has_setting(settings, rate_setting) && !os::is_pseudo_terminal(search_.place);
        if (needs_rate) settings.push_back(fmt::format("{}={}", rate_setting, line.rate));
        findings_.candidates.push_back({other, std::move(one), settings, true, line_of(link, line)});
      }
    }
  }

  // Removes candidates with the same unit and options as a likelier one, and candidates from unsolicited frames if an
  // encoder of the same unit replies to requests and all its replies are explained.
  void drop_repeated() {
    std::vector<Candidate> kept;
    for (const Candidate& one : findings_.candidates) {
      const bool repeated = std::any_of(kept.begin(), kept.end(), [&](const Candidate& other) {
        return other.unit == one.unit && other.hypothesis.options.values == one.hypothesis.options.values;
      });
      if (!repeated && !(one.unsolicited && is_explained(*one.unit))) kept.push_back(one);
    }
    findings_.candidates = std::move(kept);
  }

  // Returns whether an encoder of this unit replies and all its replies are explained.
  [[nodiscard]] bool is_explained(const Unit& unit) const {
    return std::any_of(findings_.candidates.begin(), findings_.candidates.end(), [&](const Candidate& one) {
      return one.unit == &unit && !one.unsolicited && one.hypothesis.evidence.explains_all();
    });
  }

  [[nodiscard]] bool is_beyond_doubt() const {
    return std::any_of(findings_.candidates.begin(), findings_.candidates.end(), [](const Candidate& one) {
      return one.hypothesis.evidence.explains_all() && one.hypothesis.chance() <= beyond_doubt;
    });
  }

  const LineSearch& search_;
  Time deadline_;
  LineFindings findings_;
  std::vector<std::pair<std::tuple<std::uint32_t, Parity, std::uint8_t>, bool>> listened_;
  std::set<std::pair<const Unit*, std::string>> asked_;  // the encoders that were asked for their identities
  std::vector<const Unit*> silent_;  // units whose first requests got no reply; they are tried again later
  std::optional<os::Failure> failure_;
  bool opened_ = false;
};

}  // namespace

LineSearch parse_search(std::string_view text) {
  LineSearch search;
  const std::size_t question = std::min(text.find('?'), text.size());
  search.place = text.substr(0, question);
  std::string_view rest = text.substr(std::min(question + 1, text.size()));
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('&'), rest.size());
    search.settings.emplace_back(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  for (const std::string& setting : search.settings) {
    if (find_link_parameter(split_setting(setting).name) != nullptr) continue;
    throw UsageError(
        fmt::format("\"{}\" is no setting of a port: the options of the protocol are what is searched for", setting));
  }
  const std::string first = search.place.substr(0, search.place.find(':'));
  if (first != "sim" && find_unit(first) == nullptr) return search;
  throw UsageError(
      fmt::format("\"{}\" says which protocol: `absenc read {}` reads it; to identify, give the port "
                  "alone, as {}, tcp:HOST:PORT, spi:/dev/spidev0.0 or ftdi",
                  search.place, search.place, os::example_port()));
}

LineFindings search_line(const LineSearch& search) { return Search(search).run(); }

}  // namespace absenc::client
