// SPDX-License-Identifier: Apache-2.0
// Runs a unit's commands on a port: repeats what may be repeated, removes echo, validates the first position, counts.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "absenc/host/drive.hpp"
#include "absenc/host/echo.hpp"
#include "absenc/host/first_reading.hpp"
#include "absenc/host/reply_guard.hpp"
#include "absenc/host/statistics.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::host {

struct Counters {
  std::uint64_t good = 0;                                  // conversations that ended well
  std::uint64_t repeated = 0;                              // attempts after an error
  std::uint64_t late = 0;                                  // replies that came after their time and were dropped
  std::array<std::uint64_t, error_texts.size()> errors{};  // of each kind, repeated ones included

  [[nodiscard]] constexpr std::uint64_t bad() const {
    std::uint64_t sum = 0;
    for (const std::uint64_t count : errors) sum += count;
    return sum;
  }
};

/// Of an encoder that transmits by itself. Whoever reads at a rate of his own wants the newest: what waits in the port
/// would be shown as of now.
enum class Take : std::uint8_t {
  newest,  // the first that comes from now on
  every,   // the one after the last, however long ago it came
};

template <class Item>
class Session {
 public:
  /// `storage` takes one conversation at a time: unit.host_storage bytes, aligned for any type.
  Session(const Unit& unit, const Options& options, Port<Item>& port, std::span<std::byte> storage,
          EchoMode echo = EchoMode::off, unsigned attempts = 3)
      : unit_(&unit),
        options_(options),
        port_(&port),
        storage_(storage),
        echo_(echo),
        attempts_(attempts),
        first_(options.model != nullptr ? options.model->maximum_rpm : 0) {}

  /// One command to its end, repeatable ones up to `attempts` times. `on_emit(conversation)` is called for each
  /// result but the last and returns whether to go on. The conversation returned tells how it ended; it is null when
  /// the unit cannot run the command, and valid until the next call.
  template <class OnEmit>
  const Conversation<Item>* run(const Command& command, Arguments arguments, OnEmit&& on_emit) {
    streaming_ = false;
    return attempt(command, arguments, on_emit);
  }
  const Conversation<Item>* run(const Command& command, Arguments arguments = {}) {
    return run(command, arguments, [](const Conversation<Item>&) { return true; });
  }

  /// The position. After opening and after silence it is read until two readings in a row agree; when none of ten
  /// does, the last one is returned and `confirmed` is false.
  /// A conversation that streams goes on where it stopped, because to find the frames anew costs two of them; `take`
  /// says whether with what came meanwhile.
  const Conversation<Item>* read(const Command& command, Take take = Take::newest) {
    if (streaming_ && take == Take::newest) catch_up(machine(), *port_);
    const Conversation<Item>* conversation = read_once(command);
    if (confirmed_ || conversation == nullptr) return conversation;
    first_.start_again();
    for (unsigned i = 0; i < 10; ++i) {
      if (conversation->error() != Error::none || conversation->reading() == nullptr) return conversation;
      confirmed_ = first_.confirms(*conversation->reading());
      if (confirmed_) return conversation;
      conversation = read_once(command);
    }
    return conversation;
  }

  /// The same for who knows the shaft: a position for which `is_possible(reading)` is false is read again until two in
  /// a row agree, because no check sees all damage. If these are possible, the first was damaged and counts as an
  /// error, cross_check_failed; if not, the position did jump.
  template <class IsPossible>
  const Conversation<Item>* read(const Command& command, Take take, IsPossible&& is_possible) {
    const auto shows = [&](const Conversation<Item>* conversation) {
      return confirmed_ && conversation->error() == Error::none && conversation->reading() != nullptr;
    };
    const Conversation<Item>* conversation = read(command, take);
    if (!shows(conversation) || is_possible(*conversation->reading())) return conversation;
    const BadExchange<Item> suspect(Error::cross_check_failed, conversation->exchange());
    doubt();
    conversation = read(command, take);
    if (!shows(conversation) || !is_possible(*conversation->reading())) return conversation;
    --counters_.good;
    ++counters_.repeated;
    ++counters_.errors[static_cast<std::size_t>(suspect.error)];
    if (statistics_ != nullptr) statistics_->add(suspect);
    return conversation;
  }

  /// Asks the conversation that is running to end early; see Conversation::abort.
  bool abort() { return current_ != nullptr && current_->abort(); }
  /// What the last conversation leaves changed when its port threw; see Conversation::report_left.
  void report_left(FieldSink& sink) const {
    if (current_ != nullptr) current_->report_left(sink);
  }

  /// What is known of late replies belongs to the line: sessions of encoders on one line share it. It must outlive
  /// them.
  void share(ReplyGuard<Item>& guard) { guard_ = &guard; }
  /// How late a reply came on this line at the most, until the last command ended; 0: none did.
  [[nodiscard]] Time lateness() const { return lateness_; }

  /// From the next command on.
  void set_options(const Options& options) { options_ = options; }

  /// To be fed from now on; null: none. 5 kB, which firmware may not have.
  void observe(Statistics<Item>* statistics) { statistics_ = statistics; }

  /// The encoder may be another one now: what it says next has to be confirmed.
  void doubt() {
    confirmed_ = false;
    streaming_ = false;
  }
  [[nodiscard]] bool confirmed() const { return confirmed_; }
  [[nodiscard]] const Counters& counters() const { return counters_; }
  [[nodiscard]] const EchoFilter& echo() const { return echo_; }

 private:
  const Conversation<Item>* read_once(const Command& command) {
    return attempt(command, {}, [](const Conversation<Item>&) { return true; });
  }

  // Whole commands are repeated here. Within a procedure that is not repeatable (a reset, a write) its engine repeats
  // the single requests that only read.
  template <class OnEmit>
  const Conversation<Item>* attempt(const Command& command, Arguments arguments, OnEmit&& on_emit) {
    const unsigned attempts = command.repeatable ? attempts_ : 1;
    const std::uint64_t late_before = guard_->late();
    for (unsigned number = 1;; ++number) {
      Conversation<Item>* conversation = streaming_ ? current_ : make(command, arguments);
      if (conversation == nullptr) return nullptr;
      const bool again = streaming_;
      streaming_ = false;  // unless it comes to its next result
      streaming_ = !drive_one(command, *conversation, on_emit, again) && conversation->streams();
      const Error error = conversation->error();
      echo_.conclude(error == Error::none);
      if (statistics_ != nullptr) statistics_->add(*conversation);
      if (error == Error::none) {
        ++counters_.good;
        return conversation;
      }
      ++counters_.errors[static_cast<std::size_t>(error)];
      if (error == Error::timeout) doubt();  // it may have been switched off
      if (number >= attempts || error == Error::invalid_argument) return conversation;
      if (error == Error::timeout && guard_->late() != late_before) return conversation;  // it would be late again
      ++counters_.repeated;
    }
  }

  Conversation<Item>* make(const Command& command, Arguments arguments) {
    const Any<Conversation> made = unit_->host(options_, command, arguments, storage_);
    if constexpr (std::is_same_v<Item, CanFrame>) {
      current_ = made.frames;
    } else {
      current_ = made.bytes;
    }
    return current_;
  }

  // On a link whose clock is the host's nothing comes late. On a CAN bus others send too: what listens to all of them
  // hears everything.
  [[nodiscard]] bool guarded(const Command& command) const {
    if (unit_->link == LinkKind::can) return command.verb == Verb::read || command.verb == Verb::read_part;
    return unit_->link != LinkKind::spi && unit_->link != LinkKind::clocked;
  }

  // What the port carries: the conversation, behind what keeps replies with their requests and what removes echo.
  Machine<Item>& machine() {
    if constexpr (std::is_same_v<Item, std::uint8_t>) {
      if (echo_.mode() != EchoMode::off) return echo_;
    }
    return inner();
  }
  Machine<Item>& inner() {
    if (guarded_) return *guard_;
    return *current_;
  }

  // Whether it came to its end; a conversation that streams stops at its next result.
  template <class OnEmit>
  bool drive_one(const Command& command, Conversation<Item>& conversation, OnEmit&& on_emit, bool again) {
    if (!again) {
      guarded_ = guarded(command);
      if (guarded_) guard_->attach(conversation, *unit_, options_, !command.changes_encoder);
      if constexpr (std::is_same_v<Item, std::uint8_t>) echo_.attach(inner());
    }
    const bool ended = drive(machine(), *port_, [&] { return !conversation.streams() && on_emit(conversation); });
    // Copied: the guard may be others' by the time anybody asks.
    counters_.late = guard_->late();
    lateness_ = guard_->lateness();
    return ended;
  }

  const Unit* unit_;
  Options options_;
  Port<Item>* port_;
  std::span<std::byte> storage_;
  Conversation<Item>* current_ = nullptr;  // in `storage_`
  ReplyGuard<Item> own_guard_;
  ReplyGuard<Item>* guard_ = &own_guard_;
  bool guarded_ = false;  // the present conversation
  Time lateness_{};
  EchoFilter echo_;
  unsigned attempts_;
  FirstReading first_;
  bool confirmed_ = false;
  bool streaming_ = false;  // `current_` has stopped at a result and can go on
  Counters counters_;
  Statistics<Item>* statistics_ = nullptr;
};

}  // namespace absenc::host
