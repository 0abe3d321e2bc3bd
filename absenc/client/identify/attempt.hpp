// SPDX-License-Identifier: Apache-2.0
// One attempt to find somebody on a line: a unit at the settings of a port, asked in each way in which it may have to
// be.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <type_traits>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/client/identify/line.hpp"
#include "absenc/client/identify/recorded_conversation.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/way/link.hpp"
#include "absenc/host/drive.hpp"
#include "absenc/host/echo.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {

using namespace std::chrono_literals;
using capture::HeardExchange;
using capture::Hypothesis;

inline constexpr unsigned reads = 6;              // of each encoder that answers
inline constexpr Time listening = 100ms;          // before anything is sent
inline constexpr std::size_t stream_size = 2048;  // bytes: as much of a stream as is judged
inline constexpr std::size_t most_ways = 8;       // in which a unit is asked
inline constexpr unsigned most_unanswered = 3;    // of them, until it is given up
inline constexpr Time settled = 5ms;              // without a byte: nothing of what was asked before is under way
inline constexpr Time longest_settling = 200ms;   // on a line that is never silent
inline constexpr Time late_window = 100ms;        // behind a request that was not answered: its reply may be late
inline constexpr Time most_allowance = 400ms;     // for replies that are

using Settings = std::vector<std::string>;

enum class Way : std::uint8_t { serial, tcp, spi, can };

inline Way way_of(const LineSearch& search) {
  const std::string& place = search.place;
  if (place.starts_with("spi:")) return Way::spi;
  if (place.starts_with("tcp:")) return Way::tcp;
  // Of what is no path, only a network interface can be meant.
  return place.starts_with("slcan:") || place.find('/') == std::string::npos ? Way::can : Way::serial;
}

inline bool fits(const Unit& unit, const LineSearch& search) {
  const Way way = way_of(search);
  if (way == Way::can) return unit.link == LinkKind::can;
  if (way == Way::spi) return unit.link == LinkKind::spi || unit.link == LinkKind::clocked;
  return unit.link == LinkKind::half_duplex || unit.link == LinkKind::full_duplex;
}

inline bool has_setting(const Settings& settings, std::string_view name) {
  return std::any_of(settings.begin(), settings.end(),
                     [&](const std::string& one) { return split_setting(one).name == name; });
}

/// Those of the settings that are options of the unit.
inline std::vector<OptionText> option_settings(const Unit& unit, const Settings& settings, bool with_model) {
  std::vector<OptionText> options;
  for (const std::string& setting : settings) {
    const OptionText one = split_setting(setting);
    if (const Option* option = find_option(unit, one.name)) {
      options.push_back({option->name, one.value});
    } else if (with_model && one.name == "model") {
      options.push_back(one);
    }
  }
  return options;
}

/// Who was found by a scan.
struct Addresses final : FieldSink {
  void put(const FieldValue& value) override {
    if (value.info->role == Role::encoder) all.push_back(value.number);
    if (value.info->role == Role::clash && value.number != 0 && !all.empty()) all.pop_back();
  }
  std::vector<std::int64_t> all;
};

/// Of what an encoder says only who it is.
struct IdentitySink final : FieldSink {
  void put(const FieldValue& value) override {
    if (value.info->role == Role::identity) all.put(value);
  }
  AnswerSink all;
};

inline std::vector<std::uint8_t> request_of(const Unit& unit, const Options& options, const Command& command) {
  std::vector<std::int64_t> arguments;
  for (const Argument& argument : command.arguments) arguments.push_back(argument.default_value);
  std::array<std::uint8_t, 256> bytes{};
  const Result<std::size_t> size = unit.encode(options, command, arguments, bytes);
  if (!size) return {};
  return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(*size)};
}

/// Whether both may listen to what is sent at a rate.
inline bool hears(const Unit& unit, std::uint32_t rate, const LineSearch& search) {
  const bool any_rate = unit.line.rate == 0 || find_role(unit.options, Role::rate) != nullptr;
  const bool users_rate = has_setting(search.settings, rate_setting);
  return any_rate || users_rate || way_of(search) == Way::tcp || unit.line.rate == rate;
}

/// One attempt: a unit at the settings of a port.
template <class Item>
class Attempt {
 public:
  Attempt(const LineSearch& search, const Unit& unit, Settings settings, Time patience, Time deadline,
          LineFindings& findings)
      : search_(search),
        unit_(unit),
        settings_(std::move(settings)),
        patience_(patience),
        deadline_(deadline),
        findings_(findings) {
    uri_ = parse_address(fmt::format("{}:{}", unit.id, search.place), settings_);
    for (const Unit* other : all_units()) {
      if (other != &unit && fits(*other, search) && hears(*other, uri_.line.rate, search)) add_harmful(*other);
    }
    storage_ = std::make_unique<std::byte[]>(unit.host_storage);
  }

  [[nodiscard]] const LineSettings& line() const { return uri_.line; }
  /// Whether a scan was ended before it had asked everybody.
  [[nodiscard]] bool cut() const { return cut_; }
  void open() {
    link_ = open_link(uri_);
    echo_ = host::EchoFilter(uri_.echo);
  }

  /// What comes without being asked for.
  std::vector<Item> listen() {
    std::vector<Item> items;
    const Step<Item> step{.at = port().now() + listening};
    while (items.size() < stream_size) {
      const Event<Item> event = port().wait(step);
      if (event.kind == Event<Item>::Kind::timer || event.at >= step.at) break;
      items.insert(items.end(), event.items.begin(), event.items.end());
    }
    return items;
  }

  /// In each way in which it may have to be asked, until somebody answers.
  void ask() {
    const Command* read = find_command(unit_, Verb::read);
    if (read == nullptr || read->changes_encoder) return;
    for (const Settings& way : ways(*read)) {
      Settings settings = settings_;
      settings.insert(settings.end(), way.begin(), way.end());
      const Options options = require_options(unit_, {}, option_settings(unit_, settings, true));
      std::vector<Settings> targets = scanned(settings, options);
      if (targets.empty()) targets.push_back(settings);
      bool answered = false;
      for (const Settings& target : targets) {
        const std::string encoder = target.size() > settings.size() ? target.back() : std::string();
        answered = ask_one(*read, target, encoder) || answered;
      }
      if (answered && unit_.link != LinkKind::clocked) return;
    }
  }

  /// Who the encoder with these options says it is: who was found may be asked more than who is looked for.
  Answer introduce(const Options& options) {
    IdentitySink identity;
    for (const Command& command : unit_.commands) {
      const bool needs_argument = std::any_of(command.arguments.begin(), command.arguments.end(),
                                              [](const Argument& argument) { return argument.required; });
      if (command.verb != Verb::info || command.changes_encoder || needs_argument) continue;
      std::vector<HeardExchange> ignored;
      converse(command, options, ignored, &identity);
    }
    return std::move(identity.all.answer);
  }

 private:
  [[nodiscard]] Port<Item>& port() {
    if constexpr (std::is_same_v<Item, CanFrame>) {
      return *link_.frames;
    } else {
      return *link_.bytes;
    }
  }

  void add_harmful(const Unit& other) {
    if constexpr (std::is_same_v<Item, CanFrame>) return;  // identifiers tell them apart
    Options defaults;
    for (std::size_t i = 0; i < other.options.size(); ++i) defaults.values[i] = other.options[i].default_value;
    for (const Command& command : other.commands) {
      if (!command.changes_encoder) continue;
      const std::vector<std::uint8_t> request = request_of(other, defaults, command);
      if constexpr (!std::is_same_v<Item, CanFrame>) {
        if (!request.empty()) harmful_.push_back(request);
      }
    }
  }

  // One conversation; what was exchanged goes to `exchanges`. Returns the items that came. A reply that comes after its
  // time would be taken for the answer to what is asked next: then all is asked once more, with more time for each
  // answer.
  std::size_t converse(const Command& command, const Options& options, std::vector<HeardExchange>& exchanges,
                       FieldSink* sink = nullptr) {
    for (;;) {
      const std::vector<HeardExchange>::size_type known = exchanges.size();
      Conversed one = converse_once(command, options, exchanges, sink);
      if (one.open) one.late = settle(late_window) ? std::max(port().now() - one.sent_at, Time{1}) : Time{};
      if (one.late == Time{} || allowance_ == most_allowance) return one.heard;
      allowance_ = std::min(most_allowance, 2 * std::max(one.late, allowance_));
      exchanges.resize(known);
      settle(late_window);
    }
  }

  struct Conversed {
    std::size_t heard = 0;  // items, when somebody sent them
    bool open = false;      // its last request was not answered
    Time sent_at{};         // when that had left
    Time late{};            // how long after its request a reply came that was given up
  };

  Conversed converse_once(const Command& command, const Options& options, std::vector<HeardExchange>& exchanges,
                          FieldSink* sink) {
    const std::vector<std::int64_t> arguments = require_arguments(command, {});
    const Any<Conversation> made = unit_.host(options, command, arguments, {storage_.get(), unit_.host_storage});
    Conversation<Item>* conversation = nullptr;
    if constexpr (std::is_same_v<Item, CanFrame>) {
      conversation = made.frames;
    } else {
      conversation = made.bytes;
    }
    if (conversation == nullptr) return {};
    if (std::exchange(asked_, true)) settle(settled);
    const bool scans = command.verb == Verb::scan;
    const Time quiet = (scans ? patience_ : 500ms) + 5 * (link_.latency + allowance_);
    RecordedConversation<Item> recorded(
        *conversation, harmful_,
        {.quiet = quiet,
         .nonsense = scans ? 2 * quiet : quiet,
         .deadline = deadline_,
         .latency = link_.latency,
         .allowance = allowance_},
        [&](const HeardExchange& one) { return capture::explains(unit_, options, one); });
    const auto keep = [&] {
      findings_.requests += recorded.exchanges.size();
      findings_.heard += recorded.heard;
      exchanges.insert(exchanges.end(), recorded.exchanges.begin(), recorded.exchanges.end());
    };
    try {
      drive(recorded, conversation->streams());
    } catch (const Stop& stop) {
      keep();
      if (stop == Stop::out_of_time) throw;
      cut_ = cut_ || (scans && stop == Stop::silent && recorded.heard == 0);
      if (stop == Stop::harmful) {
        findings_.notes.push_back(
            fmt::format("{} of {} was not sent: to another encoder it might be a command", command.name, unit_.id));
      }
      return {recorded.heard, recorded.is_unanswered(), recorded.sent_at(), recorded.lateness()};
    }
    findings_.only_echo = findings_.only_echo || echo_.only_echo();
    echo_.conclude(conversation->error() == Error::none);
    if (sink != nullptr && conversation->error() == Error::none) conversation->report(*sink);
    keep();
    const auto alive = [this](const HeardExchange& one) { return is_alive(one); };
    const bool answered = std::any_of(recorded.exchanges.begin(), recorded.exchanges.end(), alive);
    return {answered ? recorded.heard : 0, recorded.is_unanswered(), recorded.sent_at()};
  }

  // Until nothing has come for that time: what was asked before may be answered only now, which is no answer to what
  // will be asked. Returns whether anything came of which that may be said.
  bool settle(Time quiet) {
    if (unit_.link == LinkKind::clocked || unit_.link == LinkKind::spi) return false;
    bool heard = false;
    const Time end = port().now() + longest_settling;
    while (port().now() < std::min(end, deadline_)) {
      const Step<Item> step{.at = port().now() + quiet};
      const Event<Item> event = port().wait(step);
      if (event.kind == Event<Item>::Kind::timer || event.at >= step.at) break;
      heard = heard || event.kind == Event<Item>::Kind::received;
    }
    return heard && unit_.link != LinkKind::can;
  }

  // Of one that goes on for ever the first result is enough.
  void drive(Machine<Item>& machine, bool endless) {
    const auto go_on = [endless] { return !endless; };
    if constexpr (std::is_same_v<Item, CanFrame>) {
      host::drive(machine, port(), go_on);
    } else {
      echo_.attach(machine);
      host::drive(echo_, port(), go_on);
    }
  }

  // Whether anybody sent it: what nobody drives is clocked in all the same.
  [[nodiscard]] bool is_alive(const HeardExchange& exchange) const {
    if (unit_.link != LinkKind::clocked && unit_.link != LinkKind::spi) return true;
    const auto& bytes = exchange.reply.bytes;
    const auto same_as = [&](std::uint8_t value) {
      return std::all_of(bytes.begin(), bytes.end(), [value](std::uint8_t byte) { return byte == value; });
    };
    return !same_as(0x00) && !same_as(0xFF);
  }

  // The usual options, then single choices that change the request; on clocked links the models, which differ in the
  // number of bits. Without those by which nobody is asked.
  [[nodiscard]] std::vector<Settings> ways(const Command& read) const {
    std::vector<Settings> all;
    std::vector<std::vector<std::uint8_t>> requests;
    const Command* scan = find_command(unit_, Verb::scan);
    const auto add = [&](const Settings& way) {
      Settings settings = settings_;
      settings.insert(settings.end(), way.begin(), way.end());
      const Options options = require_options(unit_, {}, option_settings(unit_, settings, true));
      if (all.size() >= most_ways || (unit_.streams != nullptr && unit_.streams(options))) return;
      std::vector<std::uint8_t> request = request_of(unit_, options, read);
      if (scan != nullptr) {
        const std::vector<std::uint8_t> scanning = request_of(unit_, options, *scan);
        request.insert(request.end(), scanning.begin(), scanning.end());
      }
      const bool known = std::find(requests.begin(), requests.end(), request) != requests.end();
      if (known && unit_.link != LinkKind::clocked) return;
      requests.push_back(std::move(request));
      all.push_back(way);
    };
    add({});
    for (const Model& model : unit_.models) add({fmt::format("model={}", model.name)});
    for (const Option& option : unit_.options) {
      if (unit_.link == LinkKind::clocked || option.role == Role::rate || has_setting(settings_, option.name)) continue;
      for (const std::string_view choice : option.choices) add({fmt::format("{}={}", option.name, choice)});
    }
    return all;
  }

  // The settings of each encoder that answers to a scan.
  std::vector<Settings> scanned(const Settings& settings, const Options& options) {
    std::vector<Settings> targets;
    const Command* command = find_command(unit_, Verb::scan);
    if (command == nullptr || command->changes_encoder) return targets;
    if (!command->disturbs.empty()) {
      findings_.notes.push_back(fmt::format("{} of {} was not sent: {}", command->name, unit_.id, command->disturbs));
      return targets;
    }
    Addresses addresses;
    std::vector<HeardExchange> ignored;
    converse(*command, options, ignored, &addresses);
    const Option* option = find_role(unit_.options, Role::encoder);
    for (const std::int64_t address : addresses.all) {
      targets.push_back(settings);
      if (option != nullptr) targets.back().push_back(fmt::format("{}={}", option->name, address));
    }
    return targets;
  }

  // Returns whether anything came. `encoder`: which of those on the line is asked.
  bool ask_one(const Command& read, const Settings& settings, const std::string& encoder) {
    const std::vector<OptionText> known = option_settings(unit_, settings, false);
    const Options options = require_options(unit_, {}, option_settings(unit_, settings, true));
    std::vector<HeardExchange> exchanges;
    if (converse(read, options, exchanges) == 0) {
      exchanges.clear();  // it may have been late, or have missed the first request
      if (converse(read, options, exchanges) == 0) return false;
    }
    read_all(read, options, exchanges);
    if (exchanges.empty()) return false;
    ++findings_.searches;
    std::vector<Hypothesis> found = capture::find_hypotheses(unit_, known, exchanges);
    // What explains more than what was asked with may also ask better.
    if (!found.empty() && !found.front().evidence.explains_all() &&
        request_of(unit_, found.front().options, read) != request_of(unit_, options, read)) {
      std::vector<HeardExchange> again;
      read_all(read, found.front().options, again);
      ++findings_.searches;
      std::vector<Hypothesis> better = capture::find_hypotheses(unit_, known, again);
      if (!better.empty() && better.front().chance() < found.front().chance()) found = std::move(better);
    }
    keep(found, settings, encoder);
    return true;
  }

  void read_all(const Command& read, const Options& options, std::vector<HeardExchange>& exchanges) {
    unsigned unanswered = 0;
    for (unsigned i = 1; i < reads + unanswered; ++i) {
      if (os::interrupted()) throw os::Interrupted{};
      if (converse(read, options, exchanges) == 0 && ++unanswered == most_unanswered) break;
    }
    // On a busy machine an answer may come too late for one of them.
    std::erase_if(exchanges,
                  [&](const HeardExchange& one) { return one.reply.frame().empty() || is_of_another(one, options); });
  }

  // Whether it says that it is from another encoder than the one that was asked: one on a CAN bus sends by itself.
  [[nodiscard]] bool is_of_another(const HeardExchange& exchange, const Options& options) const {
    const Option* asked = find_role(unit_.options, Role::encoder);
    Addresses who;
    if (asked == nullptr || unit_.decode(options, {}, exchange.reply.frame(), who) != Error::none) return false;
    const auto index = static_cast<std::size_t>(asked - unit_.options.data());
    return !who.all.empty() && who.all.front() != options.values[index];
  }

  void keep(const std::vector<Hypothesis>& found, const Settings& settings, const std::string& encoder) {
    Settings of_port;
    for (const std::string& setting : settings) {
      if (find_link_parameter(split_setting(setting).name) != nullptr) of_port.push_back(setting);
    }
    for (const Hypothesis& one : found) {
      findings_.candidates.push_back({&unit_, one, of_port, false, line_of(unit_.link, uri_.line), encoder});
    }
  }

  const LineSearch& search_;
  const Unit& unit_;
  Settings settings_;
  Time patience_;
  Time deadline_;
  LineFindings& findings_;
  bool cut_ = false;
  bool asked_ = false;  // anything
  Time allowance_{};    // beside the limit of each answer, where replies are late
  EncoderAddress uri_;
  std::vector<std::vector<Item>> harmful_;
  std::unique_ptr<std::byte[]> storage_;
  Link link_;
  host::EchoFilter echo_{host::EchoMode::off};
};

}  // namespace absenc::client
