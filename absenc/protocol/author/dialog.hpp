// SPDX-License-Identifier: Apache-2.0
// Combines the engine of a line of characters with a protocol.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <string_view>
#include <type_traits>

#include "absenc/protocol/author/engine.hpp"
#include "absenc/protocol/author/routine.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::author {

/// A conversation with encoded requests and decoded replies. The protocol must have these members:
///
///   struct Protocol {
///     using Format, Request, Reply;                                  // Format: made from the options
///     static constexpr std::size_t longest_reply;                    // bytes
///     static HostTimes host_times(const Format&);
///     static Manner manner(const Format&, const Request&);
///     static ByteBuffer<N> encode(const Format&, const Request&);
///     static std::size_t expected(const Format&, const Request&, Bytes reply);   // see Engine
///     static Result<Reply> decode(const Format&, const Request&, Bytes reply);   // of at least one byte
///     static bool is_whole(const Format&, Error);                    // see Engine
///     // only for `last_reading`:
///     static Reading reading(const Format&, const Request&, const Reply&);
///     static Time latched(const Format&, Time sent_at);              // when the encoder latches the position
///     // only if replies to most requests have the position: `reading` then gives it, or an empty one
///     static constexpr bool replies_carry_position;
///   };
template <class P>
class HostOf : public Engine {
 public:
  /// Format of the encoder: the values of its options.
  using Format = typename P::Format;
  /// C++ type of the protocol's requests.
  using Request = typename P::Request;
  /// C++ type of the protocol's replies.
  using Reply = typename P::Reply;

  /// Returns the format of the encoder.
  [[nodiscard]] const Format& format() const { return format_; }
  /// Returns the last request.
  [[nodiscard]] const Request& request() const { return request_; }
  /// Returns the last valid reply; an empty one if there was none.
  [[nodiscard]] const Reply& last() const { return last_; }
  /// Returns position and turns in the last valid reply, with the times of the last exchange.
  [[nodiscard]] Reading last_reading() const {
    Reading reading = P::reading(format_, request_, last_);
    reading.latched = P::latched(format_, sent_at());
    reading.received = received_at();
    return reading;
  }
  /// Returns false: the unit's explanation of the last reply is always added to the texts of an error.
  [[nodiscard]] static constexpr bool is_alone() { return false; }

 protected:
  /// Constructs a conversation with an encoder of this format.
  explicit HostOf(const Format& format) : Engine(P::host_times(format), storage_), format_(format) {}
  ~HostOf() = default;

  /// Sets the format, when the encoder has reported properties that the options left open.
  void set_format(const Format& format) { format_ = format; }
  /// Sets that `request` is sent next, as Protocol::manner states, not before `earliest`.
  void ask(const Request& request, Time earliest = {}) { ask(request, P::manner(format_, request), earliest); }
  /// Sets that `request` is sent next, as `manner` states, not before `earliest`.
  void ask(const Request& request, const Manner& manner, Time earliest = {}) {
    request_ = request;
    request_bytes_ = P::encode(format_, request);
    send(request_bytes_, manner, earliest);
  }

 private:
  [[nodiscard]] std::size_t expected() const final { return P::expected(format_, request_, reply()); }
  [[nodiscard]] Error check() final {
    const Result<Reply> result = P::decode(format_, request_, reply());
    if (result) last_ = *result;
    return result.error();
  }
  [[nodiscard]] bool is_whole(Error error) const final { return P::is_whole(format_, error); }

  Format format_;
  Request request_{};
  decltype(P::encode(Format{}, Request{})) request_bytes_{};
  Reply last_{};
  // More room than for the longest reply, so that a reply that is too long is detected.
  std::array<std::uint8_t, 3 * P::longest_reply> storage_;
};

/// Conversation that reads a position or another value with one request.
template <class P>
class ReadPosition : public HostOf<P> {
 public:
  /// Constructs a conversation that reads from an encoder of this format with `request`.
  ReadPosition(const typename P::Format& format, const typename P::Request& request) : HostOf<P>(format) {
    this->ask(request);
  }
  /// Returns the position or turns that are the result; null after an error, or if there are none.
  [[nodiscard]] const Reading* reading() const final {
    // `reading_` is set only if no error occurred.
    return reading_.singleturn_bits + reading_.multiturn_bits != 0 ? &reading_ : nullptr;
  }

 private:
  void concluded(Error error) final {
    // The reading is constructed in place, because a copy costs time.
    if (error == Error::none) new (&reading_) Reading(this->last_reading());
    this->finish(error, error == Error::none ? Time{} : this->manner().hold);
  }

  Reading reading_{};
};

/// A conversation that a procedure (a coroutine) controls, and that sends requests.
template <class P>
class AskingDialog : public HostOf<P>, public Routine {
  static constexpr bool carries_position = requires { P::replies_carry_position; };
  struct Nothing {};

 public:
  /// C++ type of the protocol's requests.
  using Request = typename P::Request;
  /// C++ type of the protocol's replies.
  using Reply = typename P::Reply;

  /// A request that a procedure can await. With `must`, the procedure ends if no valid reply comes.
  template <bool must>
  class [[nodiscard]] Question {
   public:
    /// Constructs the question for the request that `dialog` has prepared.
    explicit Question(AskingDialog& dialog) : dialog_(dialog) {}
    /// Sets that the request is sent only after `pause` since the last received or sent character.
    Question& after(Time pause) {
      dialog_.earliest_ = dialog_.received_at() + pause;
      return *this;
    }
    /// Sets that an invalid or missing reply is not followed by a repetition.
    Question& once() {
      dialog_.asking_.repeats = 0;
      return *this;
    }
    /// Sets that the request is sent up to `attempts` times (1 or more) until its reply is valid.
    Question& repeated(unsigned attempts) {
      dialog_.asking_.repeats = attempts - 1;
      return *this;
    }
    /// Marks the request as one that changes the encoder if it is executed.
    Question& changes() {
      dialog_.changing_ = true;
      return *this;
    }
    /// Sets that the reply is accepted only when silence follows it.
    Question& until_silence() {
      dialog_.asking_.ends_by_silence = true;
      return *this;
    }
    /// Sets the detail of the error if the procedure ends at this request: the step that failed.
    Question& or_say(std::string_view words) {
      dialog_.words_ = words;
      return *this;
    }

    /// Returns false, so that co_await always suspends the procedure: a reply takes time.
    [[nodiscard]] bool await_ready() const { return false; }
    /// Sets that the request is sent next.
    void await_suspend(std::coroutine_handle<>) { dialog_.ask_it(must); }
    /// Returns the reply or, without `must`, the reply or the error of the exchange.
    auto await_resume() const {
      if constexpr (must) {
        return dialog_.last();
      } else {
        return dialog_.failure_ == Error::none ? Result<Reply>(dialog_.last()) : Result<Reply>(dialog_.failure_);
      }
    }

   private:
    AskingDialog& dialog_;
  };

  /// Returns an awaitable that sends `request` and gives the reply, or ends the procedure.
  [[nodiscard]] Question<true> ask(const Request& request) {
    prepare(request);
    return Question<true>(*this);
  }
  /// Returns an awaitable that sends `request` and gives the reply or the error.
  [[nodiscard]] Question<false> attempt(const Request& request) {
    prepare(request);
    return Question<false>(*this);
  }
  /// Returns an awaitable that waits until `pause` after the last received or sent character.
  [[nodiscard]] auto rest(Time pause) {
    struct Rest {
      AskingDialog& dialog;
      Time pause;
      [[nodiscard]] bool await_ready() const { return pause == Time{}; }
      void await_suspend(std::coroutine_handle<>) { dialog.sleep(dialog.received_at() + pause); }
      void await_resume() const {}
    };
    return Rest{*this, pause};
  }
  /// Sets whether the host keeps the line between further requests, so that no other machine's request comes in
  /// between.
  void hold_line(bool yes) { holds_line_ = yes; }
  /// Sets that the caller gets the present result (step `emit`).
  void emit() { HostOf<P>::emit(); }
  using HostOf<P>::set_format;
  [[nodiscard]] std::string_view detail() const override { return outcome_.detail; }
  [[nodiscard]] std::string_view advice() const override { return outcome_.advice; }
  /// Returns whether the texts of the outcome stand alone, without the unit's explanation of the last reply; see
  /// `only`.
  [[nodiscard]] bool is_alone() const { return outcome_.alone; }
  [[nodiscard]] ChangeSent change_sent() const final { return change(); }
  [[nodiscard]] std::string_view change_note() const final { return noted(); }
  [[nodiscard]] Reading carried() const final {
    if constexpr (carries_position) return carried_;
    return {};
  }
  /// Declares whether the procedure, when asked to end early, restores the encoder first: it must check `is_aborted`.
  void restores(bool yes = true) { restores_ = yes; }
  /// Returns whether the caller has asked the procedure to end early; false if `restores` was not called before.
  [[nodiscard]] bool is_aborted() const { return aborted_; }
  bool abort() final {
    aborted_ = aborted_ || restores_;
    return restores_;
  }

 protected:
  /// Constructs the conversation; the coroutine frames of its procedure are in `arena`.
  AskingDialog(const typename P::Format& format, std::span<std::byte> arena) : HostOf<P>(format), Routine(arena) {}
  ~AskingDialog() = default;

 private:
  void prepare(const Request& request) {
    next_ = request;
    asking_ = P::manner(this->format(), request);
    asking_.holds_line = asking_.holds_line || holds_line_;
    earliest_ = {};
    words_ = {};
    changing_ = false;
  }
  void ask_it(bool must) {
    must_ = must;
    if (changing_) Routine::changes();
    HostOf<P>::ask(next_, asking_, earliest_);
  }
  void concluded(Error error) final {
    failure_ = error;
    if constexpr (carries_position) carried_ = error == Error::none ? this->last_reading() : Reading{};
    if (changing_ && error == Error::request_rejected) refused();
    if (must_ && error != Error::none) return end_with({error, words_, {}, asking_.hold});
    resume();
  }
  void woken() override { resume(); }
  void ended(const Outcome& outcome) final {
    outcome_ = outcome;
    this->finish(outcome.error, outcome.hold);
  }

  Request next_{};
  Manner asking_{};
  Time earliest_{};
  std::string_view words_{};
  Outcome outcome_{};
  Error failure_ = Error::none;
  [[no_unique_address]] std::conditional_t<carries_position, Reading, Nothing> carried_{};
  bool must_ = false;
  bool changing_ = false;  // whether the present request changes the encoder if it is executed
  bool holds_line_ = false;
  bool restores_ = false;
  bool aborted_ = false;
};

/// A conversation that a procedure controls, and that sends requests or listens.
template <class P>
class DialogOf : public AskingDialog<P> {
 public:
  /// Sets that this end of the line changes to `rate` bits per second, and the time limits to `times`.
  void set_rate(std::uint32_t rate, const HostTimes& times) {
    HostOf<P>::set_rate(rate);
    this->set_times(times);
  }
  /// Sets that awaiting `heard` listens to the line for `duration`, without sending.
  void listen(Time duration) {
    heard_ = {};
    HostOf<P>::listen(duration);
  }
  /// Result of awaiting `heard`: bytes received while listening, or the end of the time.
  struct Heard {
    /// Received bytes, valid until the next await. Empty, with `over` false: a damaged character.
    Bytes bytes{};
    bool over = false;  ///< whether the time of `listen` is over
  };
  /// Returns an awaitable for the next received bytes, or the end of the time of `listen`.
  [[nodiscard]] auto heard() {
    struct Hear {
      DialogOf& dialog;
      [[nodiscard]] bool await_ready() const { return false; }
      void await_suspend(std::coroutine_handle<>) { dialog.listen_on(); }
      Heard await_resume() const { return dialog.heard_; }
    };
    return Hear{*this};
  }

 protected:
  using AskingDialog<P>::AskingDialog;
  ~DialogOf() = default;

 private:
  void woken() final {
    heard_ = {.over = true};
    this->resume();
  }
  void heard(Bytes bytes) final {
    heard_ = {bytes, false};
    this->resume();
  }

  Heard heard_{};
};

namespace detail {
template <class P>
struct ProcedureDialog {
  using Type = DialogOf<P>;
};
template <class P>
requires requires { typename P::Dialog; }
struct ProcedureDialog<P> {
  using Type = typename P::Dialog;
};
}  // namespace detail

/// Type of the dialog of a protocol's procedures: `P::Dialog`, or else DialogOf.
template <class P>
using ProcedureDialog = typename detail::ProcedureDialog<P>::Type;

/// A conversation that runs `procedure(dialog, found, bound..., arguments)`, or the same without `arguments` if the
/// procedure takes none. The result is `found`, of type `Found`.
template <class P, class Found, auto procedure, auto... bound>
class Run : public ProcedureDialog<P> {
 public:
  /// Begins the procedure with these arguments; the coroutine frames are in `arena`.
  Run(const typename P::Format& format, Arguments arguments, std::span<std::byte> arena)
      : ProcedureDialog<P>(format, arena) {
    for (const std::int64_t argument : arguments) static_cast<void>(arguments_.push_back(argument));
    if constexpr (std::is_invocable_v<decltype(procedure), ProcedureDialog<P>&, Found&, decltype(bound)...,
                                      Arguments>) {
      this->begin(procedure(*this, found_, bound..., arguments_.view()).handle);
    } else {
      this->begin(procedure(*this, found_, bound...).handle);
    }
  }
  /// Returns the result of the procedure, as far as it has been stored.
  [[nodiscard]] const Found& found() const { return found_; }
  /// Returns the counts of discarded frames, all zero, if the procedure streams; null if it ends by itself.
  [[nodiscard]] const StreamCounts* stream() const final { return goes_on ? &counts_ : ProcedureDialog<P>::stream(); }
  /// Returns whether the procedure streams, with a request for each result: `Found` then has a member `streams`.
  [[nodiscard]] bool asks() const final { return goes_on; }
  /// Returns `Found::reading` if it has a position or turns; null after an error, or if there is none.
  [[nodiscard]] const Reading* reading() const final {
    if constexpr (requires { found_.reading; }) {
      const bool is_there = found_.reading.singleturn_bits + found_.reading.multiturn_bits != 0;
      return this->error() == Error::none && is_there ? &found_.reading : nullptr;
    } else {
      return ProcedureDialog<P>::reading();
    }
  }

 private:
  static constexpr bool goes_on = requires { Found::streams; };

  // All counts are zero: the procedure sends a request for each result, so it discards no frames.
  static constexpr StreamCounts counts_{};

  Found found_{};
  Buffer<std::int64_t, 6> arguments_;
};

}  // namespace absenc::author
