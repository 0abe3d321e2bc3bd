// SPDX-License-Identifier: Apache-2.0
// One attempt to find encoders of a unit on a line, at given port settings, with several sets of options.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <type_traits>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/client/identify/line.hpp"
#include "absenc/client/identify/patience.hpp"
#include "absenc/client/identify/probe_settings.hpp"
#include "absenc/client/port/diagnosis.hpp"
#include "absenc/client/port/link.hpp"
#include "absenc/client/port/runner.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::client {

using namespace std::chrono_literals;
using capture::Hypothesis;
using capture::ObservedExchange;

/// Limits of the search for an encoder that may not answer: duration and repetitions.
struct Effort {
  Time scan{};  // a scan of the line ends after this time without any reply
  // whether an encoder without a reply gets further requests, and a scan without any reply is repeated
  bool asks_again = false;
};
inline constexpr Effort quick{.scan = 150ms};
inline constexpr Effort thorough{.scan = 5s, .asks_again = true};

// number of answered readings after which an encoder that replies is read no more
inline constexpr unsigned reads = 6;
inline constexpr Time listening = 100ms;  // time for which the attempt listens before its first request
// number of unsolicited bytes or frames after which the attempt stops listening
inline constexpr std::size_t stream_size = 2048;
inline constexpr unsigned most_unanswered = 3;  // number of unanswered readings after which an encoder is read no more
inline constexpr Time settled = 5ms;  // duration of silence after which no reply to an earlier request is expected
inline constexpr Time longest_settling = 200ms;  // limit of the wait for silence, on a line that is never silent
// time after an unanswered request in which a late reply to it may still arrive
inline constexpr Time late_window = 100ms;
inline constexpr Time most_allowance = 400ms;  // greatest time by which timeouts are extended if replies come late

/// Collects the addresses of encoders that a scan finds, without those that two encoders share.
struct ScannedAddresses final : FieldSink {
  void put(const FieldValue& value) override {
    if (value.info->role == Role::encoder) all.push_back(value.number);
    if (value.info->role == Role::clash && value.number != 0 && !all.empty()) all.pop_back();
  }
  std::vector<std::int64_t> all;
};

/// Reason why a conversation was aborted.
enum class TryEnd : std::uint8_t {
  silent,   // no valid reply arrived within the limits of `Patience`
  harmful,  // the next request might change an encoder, or the next pulse of the wire `clear` would set its zero
};

/// Result of reading an encoder's identity, and whether the identity agrees with the assumed options.
struct Introduction {
  Answer identity{};
  bool agrees = false;          // whether the encoder reported an identity that does not contradict the options
  std::string contradiction{};  // the unit's explanation of the contradiction between identity and options; "": none
  std::vector<std::string> unread{};  // the commands that failed, each with its error in words
};

/// Collects the identity fields of a reply.
struct IdentitySink final : FieldSink {
  void put(const FieldValue& value) override {
    if (value.info->role == Role::identity) all.put(value);
  }
  AnswerSink all;
};

/// One attempt to find encoders of one unit on the line at given port settings. Adds what it finds to `LineFindings`.
template <class Item>
class Attempt {
 public:
  Attempt(const LineSearch& search, const Unit& unit, SettingTexts settings, const Effort& effort, Time deadline,
          LineFindings& findings)
      : search_(search),
        unit_(unit),
        settings_(std::move(settings)),
        effort_(effort),
        findings_(findings),
        address_(parse_address(fmt::format("{}:{}", unit.id, search.place), settings_)),
        runner_(address_) {
    if constexpr (!is_can) harmful_ = harmful_to_others(unit, address_.line.rate, search);
    runner_.port().deadline = deadline;
    runner_.port().over = search.over;
    runner_.on_event = [this](const Event<Item>& event) {
      if (talk_ != nullptr) talk_->patience.see(event);
    };
    runner_.on_step = [this](Step<Item>& step, Time now) {
      if (talk_ != nullptr) look_at(step, now, *talk_);
    };
    runner_.on_exchange = [this](const LineExchange<Item>& exchange) {
      if (talk_ != nullptr) keep_exchange(exchange, *talk_);
    };
  }
  Attempt(const Attempt&) = delete;
  Attempt& operator=(const Attempt&) = delete;

  [[nodiscard]] const LineSettings& line() const { return address_.line; }
  /// Returns whether nothing was received after any request.
  [[nodiscard]] bool silent() const { return silent_; }
  void open() {
    link_ = search_.open(address_);
    if constexpr (is_can) {
      runner_.attach(*link_.frames, link_.latency);
    } else {
      runner_.attach(*link_.bytes, link_.latency);
    }
  }

  /// Listens before the first request of the attempt and returns the unsolicited bytes or frames.
  std::vector<Item> listen() {
    std::vector<Item> items;
    runner_.listen(listening, [&items](std::span<const Item> more) {
      items.insert(items.end(), more.begin(), more.end());
      return items.size() < stream_size;
    });
    return items;
  }

  /// Polls with each set of options that `settings_to_try` returns and stores the candidates. Ends after the first set
  /// with which an encoder replies, except on clocked lines.
  void ask() {
    const Command* read = find_command(unit_, Verb::read);
    if (read == nullptr || read->changes_encoder) return;
    for (const SettingTexts& way : settings_to_try(unit_, settings_, *read)) {
      SettingTexts settings = settings_;
      settings.insert(settings.end(), way.begin(), way.end());
      const Options options = require_options(unit_, {}, option_settings(unit_, settings, true));
      bool nobody = false;
      std::vector<SettingTexts> targets = scanned(settings, options, nobody);
      if (nobody && !effort_.asks_again) continue;
      if (targets.empty()) targets.push_back(settings);
      bool answered = false;
      for (const SettingTexts& target : targets) {
        const std::string encoder = target.size() > settings.size() ? target.back() : std::string();
        answered = ask_one(*read, target, encoder) || answered;
      }
      if (answered && unit_.link != LinkKind::clocked) return;
    }
  }

  /// Runs, with these options, the unit's commands of the verb `info` that change nothing and need no argument, and
  /// returns the identity that the encoder reports.
  Introduction introduce(const Options& options) {
    Introduction all;
    IdentitySink identity;
    for (const Command& command : unit_.commands) {
      const bool needs_argument = std::any_of(command.arguments.begin(), command.arguments.end(),
                                              [](const Argument& argument) { return argument.required; });
      if (command.verb != Verb::info || command.changes_encoder || needs_argument) continue;
      std::vector<ObservedExchange> ignored;
      Conversed one = converse(command, options, ignored, &identity);
      // Tries again, because an access that consists of many frames may fail once on a busy computer.
      if (one.error == Error::timeout || is_damage(one.error)) one = converse(command, options, ignored, &identity);
      all.agrees = all.agrees || one.error == Error::none;
      if (one.error == Error::none || !one.was_sent) continue;
      const bool contradicts = one.error == Error::unexpected_reply || one.error == Error::out_of_range;
      if (contradicts) {
        all.contradiction = fmt::format("{}: {}", command.name, one.detail);
      } else {
        const std::string reason = describe(unit_.link, Subject::reply, one.error, one.detail);
        all.unread.push_back(fmt::format("{} could not be read: {}", command.name, reason));
      }
    }
    all.agrees = all.agrees && all.contradiction.empty();
    all.identity = std::move(identity.all.answer);
    return all;
  }

 private:
  static constexpr bool is_can = std::is_same_v<Item, CanFrame>;

  struct Talk {
    const Options& options;
    std::vector<ObservedExchange> exchanges{};
    Patience<Item> patience;
    bool understood = false;  // whether a good reply has been received in this conversation
  };

  // Checks a step of the conversation: throws TryEnd to abort the conversation, and extends the step's timeout if
  // replies were late.
  void look_at(Step<Item>& step, Time now, Talk& talk) {
    using Kind = typename Step<Item>::Kind;
    if (step.kind == Kind::pulse && step.wire == ExtraWire::clear) throw TryEnd::harmful;
    if (step.kind != Kind::done && talk.patience.is_over(step, now) && !talk.understood) {
      talk.understood = is_good(observed_exchange(runner_.last()), talk.options);
      if (!talk.understood) throw TryEnd::silent;
    }
    if (step.answer != Time{}) step.answer += allowance_;
    talk.patience.see(step, now);
    if constexpr (!is_can) {  // CAN needs no check for harmful requests: identifiers distinguish nodes
      if (step.kind == Kind::transfer && begins_harmful(step.out)) throw TryEnd::harmful;
    }
  }
  [[nodiscard]] bool begins_harmful(Bytes request) const {
    return std::any_of(harmful_.begin(), harmful_.end(), [&](const std::vector<std::uint8_t>& one) {
      return request.size() >= one.size() && std::equal(one.begin(), one.end(), request.begin());
    });
  }
  void keep_exchange(const LineExchange<Item>& line, Talk& talk) {
    talk.exchanges.push_back(observed_exchange(line));
    talk.understood = talk.understood || is_good(talk.exchanges.back(), talk.options);
  }
  [[nodiscard]] bool is_good(const ObservedExchange& one, const Options& options) const {
    return !one.reply.frame().empty() && capture::explains(unit_, options, one);
  }

  struct Conversed {
    std::size_t heard = 0;  // number of bytes or frames that an encoder sent in this conversation
    Error error = Error::timeout;
    std::string detail{};  // the unit's explanation of `error`
    bool ended = false;    // whether the command ran to its end, instead of being aborted
    bool was_sent = true;  // false: it might be a command to another encoder; a note says so
  };

  // Runs one conversation and stores its exchanges in `exchanges`. On a line of characters it repeats the conversation
  // with a longer timeout while replies are late, until the timeout is extended by `most_allowance`.
  Conversed converse(const Command& command, const Options& options, std::vector<ObservedExchange>& exchanges,
                     FieldSink* sink = nullptr) {
    for (;;) {
      if (std::exchange(asked_, true)) runner_.settle(settled, longest_settling);
      const std::uint64_t late = runner_.late();
      const auto known = static_cast<std::ptrdiff_t>(exchanges.size());
      Conversed one = converse_once(command, options, exchanges, sink);
      if (is_can || host_clocks(unit_.link)) return one;
      // After a scan that was ended early, no late reply is awaited: the reading that follows shows whether replies are
      // late.
      const bool is_cut = command.verb == Verb::scan && !one.ended && !effort_.asks_again;
      if (is_unanswered_ && !is_cut) runner_.settle(late_window, longest_settling);
      if (runner_.late() == late || allowance_ == most_allowance) return one;
      allowance_ = std::min(most_allowance, 2 * std::max(runner_.lateness(), allowance_));
      exchanges.erase(exchanges.begin() + known, exchanges.end());
      runner_.settle(late_window, longest_settling);
    }
  }

  Conversed converse_once(const Command& command, const Options& options, std::vector<ObservedExchange>& exchanges,
                          FieldSink* sink) {
    const bool scans = command.verb == Verb::scan;
    const Time quiet = (scans ? effort_.scan : 500ms) + 5 * (link_.latency + allowance_);
    Talk talk{.options = options,
              .patience = Patience<Item>({.quiet = quiet,
                                          .nonsense = scans ? 2 * quiet : quiet,
                                          .is_one_request = !scans && !effort_.asks_again,
                                          .latency = link_.latency})};
    runner_.set_options(options);
    runner_.start_again();
    const std::vector<std::int64_t> arguments = require_arguments(command, {});
    Conversed one;
    try {
      talk_ = &talk;
      const Conversation<Item>* ended = runner_.run(command, arguments);
      talk_ = nullptr;
      if (runner_.port().take_aborted()) throw os::Interrupted{};
      if (ended == nullptr) return one;
      one.ended = true;
      one.error = ended->error();
      one.detail = ended->detail();
      if (sink != nullptr && one.error == Error::none) ended->report(*sink);
    } catch (const TryEnd& stop) {
      talk_ = nullptr;
      if (stop == TryEnd::harmful) {
        one.was_sent = false;
        findings_.notes.push_back(
            fmt::format("{} of {} was not sent: to another encoder it might be a command", command.name, unit_.id));
      }
    } catch (...) {
      talk_ = nullptr;
      take(talk, exchanges);
      throw;
    }
    if constexpr (!is_can) findings_.only_echo = findings_.only_echo || runner_.session().echo().only_echo();
    const auto alive = [this](const ObservedExchange& exchange) { return is_alive(exchange); };
    const bool answered = std::any_of(talk.exchanges.begin(), talk.exchanges.end(), alive);
    is_unanswered_ = !talk.exchanges.empty() && talk.exchanges.back().reply.frame().empty();
    one.heard = answered ? talk.patience.heard() : 0;
    take(talk, exchanges);
    return one;
  }
  void take(Talk& talk, std::vector<ObservedExchange>& exchanges) {
    findings_.requests += talk.exchanges.size();
    findings_.heard += talk.patience.heard();
    silent_ = silent_ && talk.patience.heard() == 0;
    exchanges.insert(exchanges.end(), talk.exchanges.begin(), talk.exchanges.end());
  }

  // Returns false if all bits of a reply on a clocked or SPI line are equal: a host receives such bits from an undriven
  // line too.
  [[nodiscard]] bool is_alive(const ObservedExchange& exchange) const {
    if (!host_clocks(unit_.link)) return true;
    const auto& bytes = exchange.reply.bytes;
    const auto same_as = [&](std::uint8_t value) {
      return std::all_of(bytes.begin(), bytes.end(), [value](std::uint8_t byte) { return byte == value; });
    };
    return !same_as(0x00) && !same_as(0xFF);
  }

  // Scans the line; returns, for each address at which one encoder replies, `settings` with this address. `nobody`
  // becomes true if the whole line was scanned in silence.
  std::vector<SettingTexts> scanned(const SettingTexts& settings, const Options& options, bool& nobody) {
    std::vector<SettingTexts> targets;
    const Command* command = find_command(unit_, Verb::scan);
    if (command == nullptr || command->changes_encoder) return targets;
    if (!command->disturbs.empty()) {
      findings_.notes.push_back(fmt::format("{} of {} was not sent: {}", command->name, unit_.id, command->disturbs));
      return targets;
    }
    ScannedAddresses addresses;
    std::vector<ObservedExchange> ignored;
    const Conversed one = converse(*command, options, ignored, &addresses);
    nobody = one.ended && one.heard == 0;
    const Option* option = find_role(unit_.options, Role::encoder);
    for (const std::int64_t address : addresses.all) {
      targets.push_back(settings);
      if (option != nullptr) targets.back().push_back(fmt::format("{}={}", option->name, address));
    }
    return targets;
  }

  // Polls one encoder, stores the candidates for it, and returns whether it replied. `encoder` is the setting with the
  // encoder's address; "": the encoder has no address.
  bool ask_one(const Command& read, const SettingTexts& settings, const std::string& encoder) {
    const std::vector<OptionText> known = option_settings(unit_, settings, false);
    const Options options = require_options(unit_, {}, option_settings(unit_, settings, true));
    std::vector<ObservedExchange> exchanges;
    if (converse(read, options, exchanges).heard == 0) {
      if (!effort_.asks_again) return false;
      // asks once more: the reply may have been late, or the encoder may have missed the first request
      exchanges.clear();
      if (converse(read, options, exchanges).heard == 0) return false;
    }
    read_all(read, options, exchanges);
    if (exchanges.empty()) return false;
    ++findings_.searches;
    std::vector<Hypothesis> found = capture::find_hypotheses(unit_, known, exchanges);
    // Polls again with the likeliest options if they do not explain all replies and need another request, because that
    // request may get better replies.
    if (!found.empty() && !found.front().evidence.explains_all() &&
        request_of(unit_, found.front().options, read) != request_of(unit_, options, read)) {
      std::vector<ObservedExchange> again;
      read_all(read, found.front().options, again);
      ++findings_.searches;
      std::vector<Hypothesis> better = capture::find_hypotheses(unit_, known, again);
      if (!better.empty() && better.front().chance() < found.front().chance()) found = std::move(better);
    }
    keep(found, settings, encoder);
    return true;
  }

  void read_all(const Command& read, const Options& options, std::vector<ObservedExchange>& exchanges) {
    unsigned unanswered = 0;
    for (unsigned i = 1; i < reads + unanswered; ++i) {
      if (os::interrupted()) throw os::Interrupted{};
      if (converse(read, options, exchanges).heard == 0 && ++unanswered == most_unanswered) break;
    }
    // Removes two kinds of readings: those without a reply, which may have come too late on a busy computer, and those
    // with a reply of another encoder.
    std::erase_if(exchanges, [&](const ObservedExchange& one) {
      return one.reply.frame().empty() || is_of_another(one, options);
    });
  }

  // Returns whether the reply is from another encoder than the polled one: CAN nodes may also send unsolicited frames.
  [[nodiscard]] bool is_of_another(const ObservedExchange& exchange, const Options& options) const {
    const Option* asked = find_role(unit_.options, Role::encoder);
    ScannedAddresses who;
    if (asked == nullptr || unit_.decode(options, {}, exchange.reply.frame(), who) != Error::none) return false;
    const auto index = static_cast<std::size_t>(asked - unit_.options.data());
    return !who.all.empty() && who.all.front() != options.values[index];
  }

  void keep(const std::vector<Hypothesis>& found, const SettingTexts& settings, const std::string& encoder) {
    SettingTexts of_port;
    for (const std::string& setting : settings) {
      if (find_link_parameter(split_setting(setting).name) != nullptr) of_port.push_back(setting);
    }
    for (const Hypothesis& one : found) {
      findings_.candidates.push_back({&unit_, one, of_port, false, line_of(unit_.link, address_.line), encoder});
    }
  }

  const LineSearch& search_;
  const Unit& unit_;
  SettingTexts settings_;
  Effort effort_;
  LineFindings& findings_;
  EncoderAddress address_;
  Link link_;  // the open port, to which `runner_` refers
  Runner<Item> runner_;
  std::vector<std::vector<std::uint8_t>> harmful_;  // beginnings of requests that must not be sent; empty on CAN
  Talk* talk_ = nullptr;
  bool silent_ = true;          // whether no request was followed by any received byte or frame
  bool asked_ = false;          // whether a conversation was begun, so that a reply to it may still be on the line
  bool is_unanswered_ = false;  // whether no reply to the last request has arrived yet
  Time allowance_{};            // time by which each timeout is extended, because replies were late
};

}  // namespace absenc::client
