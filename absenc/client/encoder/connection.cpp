// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/encoder/connection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "absenc/client/doctor/observations.hpp"
#include "absenc/client/encoder/change_record.hpp"
#include "absenc/client/encoder/latch_times.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/port/diagnosis.hpp"
#include "absenc/client/port/runner.hpp"
#include "absenc/client/port/shared_link.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"

namespace absenc::client {

namespace {

Frame to_frame(Bytes bytes, std::size_t bits = 0) { return {.bytes = bytes, .bits = std::min(bits, bytes.size() * 8)}; }
Frame to_frame(std::span<const CanFrame> frames, std::size_t = 0) {
  return {.can = frames.empty() ? nullptr : &frames.front()};
}

// Returns a sentence about the options with which the encoder is reached after the command; "" if they are unchanged.
std::string new_way(const EncoderAddress& before, const Command& command, Arguments arguments) {
  if (command.changes_option.empty()) return {};
  const Options behind = options_behind(*before.unit, before.options, command, arguments.front());
  if (behind.values == before.options.values) return {};
  return fmt::format("it is reached with {} now", option_text(*before.unit, behind, command.changes_option));
}

/// Compares the life counters of each good reading with those of the good reading before.
class LifeCounters final : public FieldSink {
 public:
  void clear() { before_.clear(); }
  /// Begins the comparison of the next reading; `put` then receives the fields of that reading.
  void begin() { stand_ = false; }
  void put(const FieldValue& field) override {
    if (field.info->role != Role::life_counter) return;
    const auto [known, is_first] = before_.try_emplace(field.info, field.number);
    stand_ = stand_ || (!is_first && known->second == field.number);
    known->second = field.number;
  }
  /// Returns whether a life counter has the same value as in the reading before.
  [[nodiscard]] bool stand() const { return stand_; }

 private:
  std::map<const FieldInfo*, std::int64_t> before_;
  bool stand_ = false;
};

template <class Item>
class ConnectionOn final : public Connection {
 public:
  ConnectionOn(const EncoderAddress& uri, OpenLink open)
      : Connection(uri),
        is_journaled_(!open && uri.port_kind != PortKind::sim),
        is_exact_(!open && uri.port_kind == PortKind::sim),
        open_(open ? std::move(open) : open_link),
        runner_(uri, attempts) {
    session_.set_speed_limit(speed_limit(uri));
    session_.observe(&statistics_);
  }

  void connect() override {
    link_ = connect_link(uri(), open_);
    if constexpr (std::is_same_v<Item, CanFrame>) {
      runner_.attach(*link_->link().frames, link_->link().latency);
    } else {
      runner_.attach(*link_->link().bytes, link_->link().latency);
    }
    session_.share(link_->guard<Item>());
    session_.doubt();
    life_counters_.clear();
    arrivals_.restart();
  }

  void disconnect() override { link_.reset(); }
  bool connected() const override { return link_ != nullptr; }
  const std::vector<std::string>& notes() const override {
    static const std::vector<std::string> none;
    return link_ != nullptr ? link_->link().notes : none;
  }

  std::uint32_t clock_rate() const override {
    return link_ != nullptr && link_->link().clock_rate ? link_->link().clock_rate() : 0;
  }

  Outcome read(host::Take take) override {
    const Command* command = uri().reads != nullptr ? uri().reads : find_command(unit(), Verb::read);
    if (command == nullptr) throw UsageError(fmt::format("{} has no command that reads the position", unit().id));
    Outcome ended = read_once(*command, take);
    // Reads again, because another host may have read so many frames that the counter wrapped to the same value.
    if (life_counters_.stand()) ended = read_once(*command, take);
    if (!life_counters_.stand()) return ended;
    session_.refuse_last(Error::sequence_mismatch);
    return {.error = Error::sequence_mismatch,
            .detail = "the life counter stands still from one reading to the next: the encoder repeats an old frame",
            .advice = "do not use the position; switch the encoder off and on, and ask its maker if it comes again",
            .aborted = ended.aborted};
  }

  Outcome run(const Command& command, Arguments arguments, const std::function<void()>& on_emit) override {
    if (!command.changes_encoder) return carry_out(command, arguments, on_emit);
    change_ = {ChangeState::not_sent};
    const EncoderAddress way = uri();
    const std::optional<std::int64_t> known = take_known_before();
    std::optional<ChangeRecord> record;
    if (is_journaled_) before_change([&] { record.emplace(*this, command, arguments, known); });
    requests_before_ = port_.requests;
    const auto note = [&](bool good) {
      change_ = change_after(way, command, arguments, good);
      if (!record) return;
      const std::string without_journal = record->keep(way, change_);
      change_.note += (change_.note.empty() || without_journal.empty() ? "" : "; ") + without_journal;
    };
    try {
      Outcome ended = carry_out(command, arguments, on_emit);
      note(ended.error == Error::none);
      ended.change = change_;
      return ended;
    } catch (const std::exception&) {
      note(false);
      rethrow_with(change_);
    }
  }
  const Change& change() const override { return change_; }

  void set_options(const Options& options) override {
    Connection::set_options(options);
    runner_.set_options(options);
  }

  void end_when(std::function<bool()> over) override { port_.over = std::move(over); }
  void report(FieldSink& sink) const override {
    last_->report(sink);
    if (const Reading* reading = last_->reading()) sink.put_reading(*reading);
  }
  void report_left(FieldSink& sink) const override { session_.report_left(sink); }
  host::LatchTime latch_time() const override { return latch_time_; }
  bool confirmed() const override { return session_.confirmed(); }
  const host::Counters& counters() const override { return session_.counters(); }
  const host::Latencies& latencies() const override { return statistics_.latencies(); }

  std::vector<BadExchangeText> bad_exchanges() const override {
    std::vector<BadExchangeText> kept;
    for (std::size_t i = 0; i < statistics_.kept(); ++i) {
      const host::BadExchange<Item>& bad = statistics_.bad(i);
      kept.push_back({bad.error, bad.at, wire_text(bad.sent), wire_text(bad.received)});
    }
    return kept;
  }

  Link lend() const override {
    const Link& link = link_->link();
    return {.device = nullptr,
            .owner = link_,
            .bytes = link.bytes,
            .frames = link.frames,
            .latency = link.latency,
            .place = link.place,
            .notes = link.notes};
  }

  std::uint64_t items() const override { return port_.items_sent + port_.items_received; }
  Time now() override {
    return link_->take_turn([&] { return port_.now(); });
  }

  Trouble trouble(const Outcome& outcome) const override {
    Trouble trouble = explained(outcome);
    trouble.change = outcome.change;
    return trouble;
  }

 private:
  [[nodiscard]] Trouble explained(const Outcome& outcome) const {
    Trouble trouble{.error = outcome.error};
    const bool callers_fault = outcome.error <= Error::buffer_too_small;
    if (callers_fault) {
      trouble.message = describe(unit().link, Subject::reply, outcome.error, outcome.detail);
      trouble.advice = outcome.advice;
      return trouble;
    }
    if (line_.request.empty() && line_.clocks == 0) return unasked_trouble(outcome);
    trouble.finding = finding_text(outcome);
    const Diagnosis diagnosis = diagnose_last();
    trouble.message = describe(unit().link, Subject::reply, outcome.error, outcome.detail, diagnosis);
    trouble.sent = wire_text(line_.request);
    trouble.received = line_.clocks == 0 ? wire_text(line_.received) : clocked_text();
    trouble.exchange = exchange(trouble);
    const std::string_view advice = outcome.advice.empty() ? text_of(outcome.error).advice : outcome.advice;
    trouble.advice = diagnosis.advice.empty() ? std::string(advice) : diagnosis.advice;
    tell_lateness(trouble);
    return trouble;
  }

  // On a simulated line the latch time of a requested reading is exact.
  void keep_latch_time(const Reading& reading, bool was_asked) {
    if (!was_asked) {
      arrivals_.add(reading.received, port_.nothing_until);
      latch_time_ = arrivals_.latch_time();
    } else if (is_exact_) {
      latch_time_ = {reading.latched, reading.latched};
    } else {
      latch_time_ = asked_latch_time(port_.last, reading.latched, link_->link().character);
    }
  }

  Outcome read_once(const Command& command, host::Take take) {
    const std::uint64_t requests = port_.requests;
    const Outcome ended = outcome(command, link_->take_turn([&] {
      return runner_.converse([&](host::Session<Item>& session) { return session.read(command, take); });
    }));
    life_counters_.begin();
    if (ended.error == Error::none && !ended.aborted) last_->report(life_counters_);
    if (ended.reading != nullptr) keep_latch_time(*ended.reading, port_.requests != requests);
    return ended;
  }

  Outcome carry_out(const Command& command, Arguments arguments, const std::function<void()>& on_emit) {
    if (link_.use_count() > 1) tell_of_company();
    const Outcome ended = outcome(command, link_->take_turn([&] {
      return runner_.converse([&](host::Session<Item>& session) {
        requests_before_ = port_.requests;
        return session.run(command, arguments, [&](const Conversation<Item>& conversation) {
          last_ = &conversation;
          if (on_emit) on_emit();
          return true;
        });
      });
    }));
    if (ended.error == Error::none && !ended.aborted && !command.changes_option.empty()) {
      set_options(options_behind(unit(), uri().options, command, arguments.front()));
    }
    return ended;
  }

  // Returns the state of a change after its command has ended. `before` is the encoder's address before the change.
  Change change_after(const EncoderAddress& before, const Command& command, Arguments arguments, bool good) const {
    const ChangeSent sent = port_.requests != requests_before_ ? session_.change_sent() : ChangeSent::no;
    if (sent == ChangeSent::no) return {ChangeState::not_sent};
    const std::string noted(session_.change_note());
    if (good && sent == ChangeSent::unproven) return {ChangeState::unknown, {}, noted};
    if (good) return {ChangeState::confirmed, new_way(before, command, arguments), noted};
    if (sent == ChangeSent::refused) return {ChangeState::refused};
    return {ChangeState::unknown, advice_to_look(before, command, arguments)};
  }

  // Tells the unit that other encoders share the line: then its conversations must not change the line's baud rate and
  // other line settings.
  void tell_of_company() {
    Options options = uri().options;
    tell_shared(unit(), options);
    set_options(options);
  }

  Outcome outcome(const Command& command, const Conversation<Item>* conversation) {
    if (conversation == nullptr) {
      throw UsageError(fmt::format("{} cannot run {} with these options", unit().id, command.name));
    }
    last_ = conversation;
    return {conversation->error(), conversation->detail(),  conversation->advice(),
            port_.take_aborted(),  conversation->reading(), {}};
  }

  // Adds a sentence to the error message if replies came after their timeout, because late replies have other causes
  // than missing ones.
  void tell_lateness(Trouble& trouble) const {
    const Time lateness = session_.lateness();
    if (trouble.error != Error::timeout || lateness == Time{}) return;
    trouble.message += fmt::format(": replies that came after its limit, at most {} after their requests, were dropped",
                                   to_text(lateness));
    if (uri().port_kind == PortKind::sim) return;
    trouble.advice = fmt::format(
        "allow the way so long with latency={} (milliseconds) behind the encoder, or find what "
        "holds replies up: a busy computer, a network, the latency timer of a USB adapter",
        std::chrono::ceil<std::chrono::milliseconds>(lateness * 3 / 2).count());
  }

  // Returns the most likely finding of doctor for this failure alone, as "no_answer: CAUSE".
  [[nodiscard]] std::string finding_text(const Outcome& outcome) const {
    Attempted last{.error = outcome.error, .detail = std::string(outcome.detail)};
    runner_.keep_exchange(last);
    const host::Counters& counters = session_.counters();
    const bool usually_good = counters.good > counters.bad();
    const Finding found =
        finding_of(unit(), uri().options, uri().port_kind, last, usually_good, session_.lateness() != Time{});
    return fmt::format("{}: {}", found.id, found.cause);
  }

  // Describes a failure of a conversation that failed before it sent a request.
  [[nodiscard]] Trouble unasked_trouble(const Outcome& outcome) const {
    const std::span<const Item> damaged = last_->exchange().received;
    const std::span<const Item> received = damaged.empty() ? std::span<const Item>(line_.received) : damaged;
    Trouble trouble{.error = outcome.error,
                    .message = describe(unit().link, Subject::reply, outcome.error, outcome.detail)};
    trouble.received = wire_text(received);
    trouble.exchange = received.empty() ? fmt::format("nothing came from {}", link_->link().place)
                                        : fmt::format("received {} from {}", trouble.received, link_->link().place);
    trouble.advice = outcome.advice.empty() ? text_of(outcome.error).advice : outcome.advice;
    return trouble;
  }

  [[nodiscard]] Diagnosis diagnose_last() const {
    const Frame sent = to_frame(std::span<const Item>(line_.request));
    const auto diagnosed = [&](std::span<const Item> reply) {
      return diagnose(unit(), uri().options, sent, to_frame(reply, line_.clocks));
    };
    if (line_.echo == 0 || line_.reply().empty()) return diagnosed(line_.received);
    if (unit().check(uri().options, sent, to_frame(std::span<const Item>(line_.received))) == Error::none) {
      return {"it is a good reply if no echo is taken from it", "set echo=off or echo=auto"};
    }
    return diagnosed(line_.reply());
  }

  [[nodiscard]] std::string exchange(const Trouble& trouble) const {
    if (line_.clocks != 0) {
      const std::string came = line_.received.empty() ? "nothing" : trouble.received;
      const std::string sent = line_.request.empty() ? "" : fmt::format("{} and ", trouble.sent);
      return fmt::format("sent {}{} clocks to {}; received {}", sent, line_.clocks, link_->link().place, came);
    }
    const std::string sent = fmt::format("sent {} to {}", trouble.sent, link_->link().place);
    if (line_.received.empty()) {
      const std::string latency = link_->link().latency > Time{} ? fmt::format(", plus {} for the adapter or network",
                                                                               to_text(link_->link().latency))
                                                                 : "";
      return fmt::format("{}; nothing came back within {}{}", sent, to_text(line_.answer), latency);
    }
    const Time after = line_.marks.front().at - line_.sent_at;
    const std::string later = after > Time{} ? fmt::format(" {} later", to_text(after)) : "";
    return fmt::format("{}; received {}{}", sent, trouble.received, later);
  }

  // Returns the bits that the host clocked in during the last exchange, as text.
  [[nodiscard]] std::string clocked_text() const {
    return to_wire_text(unit().link, to_frame(std::span<const Item>(line_.received), line_.clocks));
  }

  [[nodiscard]] std::string wire_text(std::span<const Item> items) const {
    if constexpr (std::is_same_v<Item, CanFrame>) {
      std::string text;
      for (const CanFrame& frame : items) {
        text += (text.empty() ? "" : " ") + to_wire_text(unit().link, {.can = &frame});
      }
      return text;
    } else {
      constexpr std::size_t most_shown = 64;
      const std::string text = to_hex(items.first(std::min(items.size(), most_shown)));
      return items.size() <= most_shown ? text : fmt::format("{} ... ({} bytes)", text, items.size());
    }
  }

  static constexpr unsigned attempts = 3;

  bool is_journaled_;
  bool is_exact_;  // whether the times of events on the line are exact, because the line is simulated
  OpenLink open_;
  std::shared_ptr<SharedLink> link_;
  Runner<Item> runner_;
  host::Session<Item>& session_ = runner_.session();
  WatchedPort<Item>& port_ = runner_.port();
  const LineExchange<Item>& line_ = runner_.last();
  host::Statistics<Item> statistics_;
  const Conversation<Item>* last_ = nullptr;
  LifeCounters life_counters_;
  ArrivalSpread arrivals_;
  host::LatchTime latch_time_{};  // bounds of the time at which the encoder latched the last position
  Change change_{};
  std::uint64_t requests_before_ = 0;  // number of requests that were sent before the last command began
};

}  // namespace

std::string advice_to_look(const EncoderAddress& before, const Command& command, Arguments arguments) {
  const Unit& unit = *before.unit;
  if (!command.changes_option.empty()) {
    const Options behind = options_behind(unit, before.options, command, arguments.front());
    return fmt::format("try `absenc read {0}` with {1}, then with {2} as before, and only if neither answers search",
                       address_of(before), option_text(unit, behind, command.changes_option),
                       option_text(unit, before.options, command.changes_option));
  }
  const std::string address = shell_text(before.written);
  if (!command.reads_back.empty()) {
    return fmt::format("`absenc config get {} {}` shows what it is now", address, command.reads_back);
  }
  if (command.verb == Verb::memory_write && find_command(unit, Verb::memory_read) != nullptr) {
    const std::int64_t page = role_value(command, arguments, Role::page);
    return fmt::format("`absenc memory read {} 0x{:02X}{}` shows what is there now", address,
                       role_value(command, arguments, Role::address), page != 0 ? fmt::format(" --page {}", page) : "");
  }
  return fmt::format("`absenc read {}` shows how the encoder is now; look before you send it again", address);
}

std::string Trouble::text() const {
  std::string lines = fmt::format("{}: {}", text_of(error).name, message);
  if (!exchange.empty()) lines += fmt::format("\n  {}", exchange);
  if (!advice.empty()) lines += fmt::format("\n  Try: {}", advice);
  return with_change(lines, change);
}

// The line settings that the user has set remain, except for the rate if the options change it.
void Connection::set_options(const Options& options) {
  const std::uint32_t rate = line_settings(unit(), options).rate;
  if (rate != line_settings(unit(), uri_.options).rate) uri_.line.rate = rate;
  uri_.options = options;
}

std::unique_ptr<Connection> Connection::make(const EncoderAddress& uri, OpenLink open) {
  if (uri.unit->link == LinkKind::can) return std::make_unique<ConnectionOn<CanFrame>>(uri, std::move(open));
  return std::make_unique<ConnectionOn<std::uint8_t>>(uri, std::move(open));
}

std::unique_ptr<Connection> Connection::open(const EncoderAddress& uri) {
  std::unique_ptr<Connection> encoder = make(uri);
  encoder->connect();
  return encoder;
}

Reading read_alarms(Connection& connection) {
  const Unit& unit = connection.unit();
  const auto taken = [&](const Outcome& outcome) {
    if (outcome.error != Error::none) throw EncoderFailure(connection.trouble(outcome));
    if (outcome.reading == nullptr) throw Failure("the encoder's reply carries no alarms");
    return *outcome.reading;
  };
  const bool can_be_asked = unit.streams == nullptr || !unit.streams(connection.uri().options);
  for (const Command& command : unit.commands) {
    if (!command.reads_alarms || !can_be_asked) continue;
    const Outcome outcome = connection.run(command, {});
    if (outcome.error != Error::unsupported) return taken(outcome);
  }
  return taken(connection.read());
}

void run_into(Connection& connection, const Command& command, Arguments arguments, FieldSink& sink) {
  const Outcome outcome = connection.run(command, arguments);
  if (outcome.error != Error::none) throw EncoderFailure(connection.trouble(outcome));
  connection.report(sink);
}

}  // namespace absenc::client
