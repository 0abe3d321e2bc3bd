// SPDX-License-Identifier: Apache-2.0
// Runs a unit's commands on a port, with repetition, echo removal, confirmed positions and counters.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>

#include "absenc/host/apart.hpp"
#include "absenc/host/drive.hpp"
#include "absenc/host/echo.hpp"
#include "absenc/host/first_reading.hpp"
#include "absenc/host/reply_guard.hpp"
#include "absenc/host/speed_limit.hpp"
#include "absenc/host/statistics.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::host {

/// Counters of a session: conversations and errors.
struct Counters {
  /// conversations without an error whose position was not found wrong later; each result of a stream counts
  std::uint64_t good = 0;
  std::uint64_t repeated = 0;  ///< number of attempts that repeated a command after an error
  /// replies on the line that arrived after their timeout and were dropped, also those for other encoders
  std::uint64_t late = 0;
  std::uint64_t discarded = 0;  ///< damaged frames of streams, whether an error reported them or not
  /// Number of errors of each kind, also of repeated attempts; indexed by Error.
  std::array<std::uint64_t, error_texts.size()> errors{};

  /// Returns the number of errors of all kinds, also of attempts that were repeated.
  [[nodiscard]] constexpr std::uint64_t bad() const {
    std::uint64_t sum = 0;
    for (const std::uint64_t count : errors) sum += count;
    return sum;
  }
};

/// A filter between the echo filter and the reply guard, or, without a guard, between the echo filter and the
/// conversation.
template <class Item>
struct Filter : Machine<Item> {
  /// Sets the machine to which the filter passes events from now on.
  virtual void attach(Machine<Item>& inner) = 0;

 protected:
  ~Filter() = default;
};

/// Selects the reading that is returned for an encoder that transmits unsolicited.
enum class Take : std::uint8_t {
  newest,  ///< the first reading that is received after the call
  every,   ///< the reading that follows the last returned one, however long ago it was received
};

/// A session with one encoder: runs its commands over a port and counts their results.
template <class Item>
class Session {
 public:
  /// `unit`, `port` and `storage` must outlive the session. `storage`: unit.host_storage bytes, aligned for any type.
  /// `attempts`: how often a repeatable command is tried at most.
  Session(const Unit& unit, const Options& options, Port<Item>& port, std::span<std::byte> storage,
          EchoMode echo = EchoMode::off, unsigned attempts = 3)
      : unit_(&unit),
        options_(options),
        port_(&port),
        storage_(storage),
        echo_(echo),
        attempts_(attempts),
        limit_(speed_limit(options)),
        first_(reach()),
        apart_(times()) {}

  /// Runs one command; `on_emit(conversation)` returns whether to continue after a result. The returned conversation is
  /// valid until the next command; null: the command cannot be run.
  template <class OnEmit>
  const Conversation<Item>* run(const Command& command, Arguments arguments, OnEmit&& on_emit) {
    streaming_ = false;
    const Conversation<Item>* conversation = attempt(command, arguments, on_emit);
    streaming_ = false;  // each `run` begins a new conversation; only `next` and `read` continue a stream
    return conversation;
  }
  /// Runs `command` to its end and ignores results that it emits before.
  const Conversation<Item>* run(const Command& command, Arguments arguments = {}) {
    return run(command, arguments, [](const Conversation<Item>&) { return true; });
  }

  /// Runs `command` like `run`, but continues its stream if one is open; `arguments` are then ignored.
  const Conversation<Item>* next(const Command& command, Arguments arguments = {}) {
    if (command_ != &command) streaming_ = false;
    return attempt(command, arguments, [](const Conversation<Item>&) { return true; });
  }

  /// Reads the position, and again up to ten times to confirm it. `on_reading` is called with each reading.
  template <class OnReading>
  const Conversation<Item>* read(const Command& command, Take take, OnReading&& on_reading) {
    if (streaming_ && take == Take::newest && !current_->asks()) catch_up(machine(), *port_);
    const FirstReading before = first_;
    std::optional<BadExchange<Item>> suspect;
    constexpr unsigned most = 11;
    const Time begun = port_->now();
    for (unsigned number = 1;; ++number) {
      confirmed_ = false;
      const Conversation<Item>* conversation = next(command);
      if (conversation == nullptr || conversation->error() != Error::none) return conversation;
      const Reading* reading = conversation->reading();
      if (reading == nullptr) return conversation;
      on_reading(*reading);
      if (number == 1 && contradicts(*reading)) suspect.emplace(Error::cross_check_failed, conversation->exchange());
      confirmed_ = confirms(*reading, number > 1);
      if (confirmed_) {
        if (suspect && before.is_near(*reading)) count_damaged(*suspect);
        known_ = true;
        return conversation;
      }
      // Without a valid position the encoder may be starting, so it is read again, unless one was confirmed before, or
      // readings are so slow that their user would wait for it.
      const bool has_waited = known_ || port_->now() - begun > invalid_limit;
      if (number == most || (has_waited && !FirstReading::has_position(*reading))) return conversation;
    }
  }
  /// Reads the position with `command`, without a callback for each reading.
  const Conversation<Item>* read(const Command& command, Take take = Take::newest) {
    return read(command, take, [](const Reading&) {});
  }

  /// Asks the running conversation to end early. Returns false if it may be abandoned instead.
  bool abort() { return current_ != nullptr && current_->abort(); }
  /// Puts into `sink` the settings that the last conversation left changed; see Conversation::report_left.
  void report_left(FieldSink& sink) const {
    if (current_ != nullptr) current_->report_left(sink);
  }

  /// Returns whether the last conversation sent a request that changes the encoder, and what is known of its result.
  [[nodiscard]] ChangeSent change_sent() const {
    return current_ != nullptr ? current_->change_sent() : ChangeSent::no;
  }

  /// Returns the note of the last conversation about its change; see Conversation::change_note.
  [[nodiscard]] std::string_view change_note() const {
    return current_ != nullptr ? current_->change_note() : std::string_view{};
  }

  /// Makes the session use `guard`, which must outlive it. All sessions on one line share one guard.
  void share(ReplyGuard<Item>& guard) { guard_ = &guard; }
  /// Sets the filter of later commands, which must outlive the session; null: none. Do not call it while a stream may
  /// continue.
  void set_filter(Filter<Item>* filter) { filter_ = filter; }
  /// Returns the longest estimated time between a request and its late reply on this line (ReplyGuard::lateness), as of
  /// the end of the last command.
  [[nodiscard]] Time lateness() const { return lateness_; }

  /// Sets the options from the next command on.
  void set_options(const Options& options) {
    options_ = options;
    follow_options();
  }
  /// Sets the speed limit of the encoder from the next reading on, and forgets all positions read before.
  void set_speed_limit(const SpeedLimit& limit) {
    limit_ = limit;
    follow_options();
  }

  /// Sets the statistics to which the results of later attempts are added; null: none.
  void observe(Statistics<Item>* statistics) { statistics_ = statistics; }

  /// Requires confirmation of the next position, because the encoder may have been exchanged.
  void doubt() {
    confirmed_ = false;
    known_ = false;
    streaming_ = false;
    learned_.reset();
    shortest_interval_ = never;
    first_.start_again();
  }
  /// Counts the last command, which ended well, as failed with `error`.
  void refuse_last(Error error) {
    --counters_.good;
    ++counters_.errors[static_cast<std::size_t>(error)];
  }
  /// Returns whether the last `read` confirmed its position; false after `doubt`.
  [[nodiscard]] bool confirmed() const { return confirmed_; }
  /// Returns the counters of this session.
  [[nodiscard]] const Counters& counters() const { return counters_; }
  /// Returns the echo filter of this session.
  [[nodiscard]] const EchoFilter& echo() const { return echo_; }

 private:
  // No encoder is unplugged, and another one connected and started, in less time.
  static constexpr Time learned_limit = std::chrono::milliseconds(500);
  // Time after which a position that is not valid is no longer read again at once.
  static constexpr Time invalid_limit = std::chrono::milliseconds(50);

  // Forgets the stored positions, because those read with other options or another speed limit are not comparable.
  void follow_options() {
    learned_.reset();
    first_ = FirstReading(reach());
    apart_ = Apart(times());
  }
  [[nodiscard]] Reach reach() const { return Reach::of(limit_, unit_->resolution(options_)); }
  [[nodiscard]] Times times() const { return sends_unsolicited(*unit_, options_) ? Times::arrived : Times::latched; }

  // Returns whether the position of `reading` is known to be too far from the last one.
  [[nodiscard]] bool contradicts(const Reading& reading) const {
    const Time between = apart_.since_last(reading.latched);
    return first_.has_last() && first_.can_judge(reading, between) && !first_.is_near(reading, between);
  }

  // Stores the position of `reading`; returns whether it is confirmed. `follows`: it was read directly after the last
  // reading.
  bool confirms(const Reading& reading, bool follows) {
    const Time between = apart_.since_last(reading.latched);
    bool near = first_.is_near(reading, between);
    if (follows && first_.has_last()) shortest_interval_ = between < shortest_interval_ ? between : shortest_interval_;
    if (near && !follows && !first_.can_judge(reading, between)) near = !first_.can_judge(reading, shortest_interval_);
    first_.keep(reading);
    apart_.add(reading.latched);
    return near;
  }

  void count_damaged(const BadExchange<Item>& damaged) {
    --counters_.good;
    ++counters_.repeated;
    ++counters_.errors[static_cast<std::size_t>(damaged.error)];
    if (statistics_ != nullptr) statistics_->add(damaged);
  }

  template <class OnEmit>
  const Conversation<Item>* attempt(const Command& command, Arguments arguments, OnEmit&& on_emit) {
    const unsigned attempts = command.repeatable ? attempts_ : 1;
    command_ = &command;
    const std::uint64_t late_before = late();
    for (unsigned number = 1;; ++number) {
      Conversation<Item>* conversation = streaming_ ? current_ : make(command, arguments);
      if (conversation == nullptr) return nullptr;
      const bool again = streaming_;
      streaming_ = false;  // if `drive_one` throws, no stream can be continued
      streaming_ = !drive_one(command, *conversation, on_emit, again) && conversation->streams();
      const Error error = conversation->error();
      echo_.conclude(error == Error::none);
      count_discarded(*conversation);
      if (statistics_ != nullptr) statistics_->add(*conversation);
      if (error == Error::none) {
        ++counters_.good;
        learn(command, *conversation);
        return conversation;
      }
      learned_.reset();
      ++counters_.errors[static_cast<std::size_t>(error)];
      // after a timeout the first position must be confirmed anew, because the encoder may have been switched off
      if (error == Error::timeout) doubt();
      if (number >= attempts || error == Error::invalid_argument || error == Error::not_still) return conversation;
      // A reply arrived after the timeout. The command is not repeated, because the reply to another attempt would most
      // likely be late, too.
      if (error == Error::timeout && late() != late_before) return conversation;
      ++counters_.repeated;
    }
  }

  [[nodiscard]] std::uint64_t late() const { return guard_->late(); }

  void count_discarded(const Conversation<Item>& conversation) {
    const StreamCounts* stream = conversation.stream();
    if (stream == nullptr) return;
    counters_.discarded += stream->discarded - discarded_before_;
    discarded_before_ = stream->discarded;
  }

  Conversation<Item>* make(const Command& command, Arguments arguments) {
    discarded_before_ = 0;
    const bool knows = learned_ && command.verb == Verb::read && port_->now() - learned_at_ < learned_limit;
    return current_ = unit_->host(knows ? *learned_ : options_, command, arguments, storage_).template of<Item>();
  }

  // Stores what a reading shows of the encoder, so that the next reading need not ask for it. It is forgotten after an
  // error, after a change of the encoder, and if no reading follows before another encoder could have taken its place.
  void learn(const Command& command, const Conversation<Item>& conversation) {
    if (command.changes_encoder) learned_.reset();
    const Reading* const reading = conversation.reading();
    if (unit_->learned == nullptr || command.verb != Verb::read || reading == nullptr) return;
    learned_.emplace(unit_->learned(options_, *reading));
    learned_at_ = port_->now();
  }

  // Returns whether replies to this command pass the reply guard. Where the host drives the clock they do not, because
  // no reply is late. On CAN only replies to commands that read do, because a conversation that listens needs all
  // frames.
  [[nodiscard]] bool guarded(const Command& command) const {
    if (unit_->link == LinkKind::can) return command.verb == Verb::read || command.verb == Verb::read_part;
    return !host_clocks(unit_->link);
  }

  // Returns the outermost machine in use: echo filter, filter, reply guard or conversation.
  Machine<Item>& machine() {
    if constexpr (std::is_same_v<Item, std::uint8_t>) {
      if (echo_.mode() != EchoMode::off) return echo_;
    }
    return inside_echo();
  }
  Machine<Item>& inside_echo() {
    if (filter_ != nullptr) return *filter_;
    return inner();
  }
  Machine<Item>& inner() {
    if (guarded_) return *guard_;
    return *current_;
  }

  // Returns whether the conversation came to its end. One that streams stops at its next result.
  template <class OnEmit>
  bool drive_one(const Command& command, Conversation<Item>& conversation, OnEmit&& on_emit, bool again) {
    if (!again) guarded_ = guarded(command);
    // Since the last result of a stream the reply guard may have served another encoder on the line.
    if (guarded_ && !(again && guard_->serves(conversation))) {
      guard_->attach(conversation, *unit_, options_, !command.changes_encoder);
    }
    if (!again) {
      if (filter_ != nullptr) filter_->attach(inner());
      if constexpr (std::is_same_v<Item, std::uint8_t>) {
        echo_.use_unit(*unit_, options_);
        echo_.attach(inside_echo());
      }
    }
    const bool ended = drive(machine(), *port_, [&] { return !conversation.streams() && on_emit(conversation); });
    // The guard's values are copied, because it may serve another encoder when they are asked for.
    counters_.late = guard_->late();
    lateness_ = guard_->lateness();
    return ended;
  }

  const Unit* unit_;
  Options options_;
  Port<Item>* port_;
  std::span<std::byte> storage_;
  Conversation<Item>* current_ = nullptr;  // present conversation, which was constructed in the session's storage
  const Command* command_ = nullptr;       // command that the present conversation executes
  ReplyGuard<Item> own_guard_;
  ReplyGuard<Item>* guard_ = &own_guard_;
  bool guarded_ = false;  // whether the reply guard serves the present conversation
  Filter<Item>* filter_ = nullptr;
  Time lateness_{};
  EchoFilter echo_;
  unsigned attempts_;
  SpeedLimit limit_;
  FirstReading first_;
  Apart apart_;
  Time shortest_interval_ = never;      // shortest time between a reading and one that was read directly after it
  bool confirmed_ = false;              // true: the position of the last reading was confirmed
  bool known_ = false;                  // true: a position was confirmed since the last call of `doubt`
  bool streaming_ = false;              // the present conversation has stopped at a result and can continue
  std::optional<Options> learned_;      // options with what the last reading showed; nothing: the encoder is asked
  Time learned_at_{};                   // time of that reading
  std::uint64_t discarded_before_ = 0;  // number of discarded frames of the present stream that were already counted
  Counters counters_;
  Statistics<Item>* statistics_ = nullptr;
};

}  // namespace absenc::host
