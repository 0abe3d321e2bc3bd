// SPDX-License-Identifier: Apache-2.0
// Host side of the E201-9S: each class is one conversation in ASCII, a machine without port, clock or heap.
// README.md describes the procedures; link/step.hpp how to run a machine.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "absenc/protocol/e201/explain.hpp"
#include "absenc/protocol/e201/frame.hpp"
#include "absenc/protocol/e201/timing.hpp"
#include "absenc/protocol/request_reply.hpp"

namespace absenc::e201 {

/// One request and its reply at a time; a subclass decides what comes next.
class Procedure : public RequestReply {
 public:
  Step<std::uint8_t> next(Time now) final;
  [[nodiscard]] Error error() const final { return error_; }
  [[nodiscard]] std::string_view detail() const final { return explanation_.found; }
  [[nodiscard]] std::string_view advice() const final { return explanation_.advice; }
  [[nodiscard]] Exchange<std::uint8_t> exchange() const final;

 protected:
  enum class Answer : std::uint8_t {
    samples,  // 16 characters and CR
    line,     // up to CR
    unknown,  // no document says whether there is one: whatever comes until it is silent
  };

  Procedure() : RequestReply(reply_limit) {}
  ~Procedure() = default;

  /// Sends `request`, not before `earliest`.
  void ask(const RequestText& request, Answer answer, Time earliest = {});
  void finish(Error error = Error::none, const Explanation& explanation = {});
  /// Hands out an intermediate result before what was asked last is sent.
  void emit() { emitting_ = true; }

  /// A reply of the right shape came, with its CR; with Answer::unknown anything that has an end, also nothing. Calls
  /// `ask` or `finish`.
  virtual void answered(Bytes reply) = 0;
  /// No such reply came. Calls `ask` or `finish`; by default the procedure ends with this error.
  virtual void failed(Error error) { finish(error, explain_reply(error)); }

  /// The error of what came last in reply.
  [[nodiscard]] Explanation explain_reply(Error error, const Format& format = {}) const {
    const Explanation explanation = explain(format, error, request_[0], reply_);
    return is_noisy() ? Explanation{noise_explanation().found, explanation.advice} : explanation;
  }

 private:
  void received(Bytes bytes) final;
  void conclude() final;

  Answer answer_{};
  bool emitting_ = false;
  RequestText request_;
  ReplyText reply_;  // what no longer fits changes nothing
  Time earliest_{};
  Error error_ = Error::none;
  Explanation explanation_{};
};

/// `4`. When nothing usable comes, the firmware is asked: before 1.16 it is `unsupported`, otherwise `4` is sent once
/// more.
class ReadPosition final : public Procedure {
 public:
  explicit ReadPosition(const Format& format);

  [[nodiscard]] const Reading* reading() const override;
  void report(FieldSink& sink) const override;
  [[nodiscard]] const Position& position() const { return position_; }

 private:
  enum class Phase : std::uint8_t { first, version, again };
  void answered(Bytes reply) override;
  void failed(Error error) override;

  Format format_;
  Phase phase_ = Phase::first;
  Error failure_ = Error::none;  // of the first `4`
  bool good_ = false;
  Position position_{};
  Reading reading_{};
};

/// One command that is answered by a line: v s e m b ? >.
class Query final : public Procedure {
 public:
  explicit Query(std::uint8_t letter);
  void report(FieldSink& sink) const override;

 private:
  void answered(Bytes reply) override;

  std::uint8_t letter_;
  ReplyText line_;
};

/// Version, serial number, supply and clock. Only the version must be answered.
class Info final : public Procedure {
 public:
  Info();
  void report(FieldSink& sink) const override;

 private:
  void answered(Bytes reply) override;
  void failed(Error error) override;
  void go_on();

  std::array<ReplyText, 4> lines_{};
  std::size_t index_ = 0;
};

/// A command without a reply to rely on, and the query that shows what became of it: Mn and m, Bnn and b.
class Set final : public Procedure {
 public:
  /// `letter`: command::set_clock (value 1 to 8) or command::set_width (1 to 64). Error: cross_check_failed.
  Set(std::uint8_t letter, unsigned value);
  void report(FieldSink& sink) const override;

 private:
  void answered(Bytes reply) override;

  std::uint8_t letter_;
  unsigned value_;
  bool verifying_ = false;
};

/// `n` or `f`, then `e` after the supply had its time. Error: cross_check_failed (where the voltage can be read).
class SwitchSupply final : public Procedure {
 public:
  explicit SwitchSupply(bool on);
  void report(FieldSink& sink) const override;

 private:
  void answered(Bytes reply) override;

  bool on_;
  bool verifying_ = false;
  ReplyText line_;
};

/// `z`: what ? and > give counts from here. The encoder must stand still (invalid_argument); read back
/// (cross_check_failed).
class Zero final : public Procedure {
 public:
  explicit Zero(const Format& format);
  void report(FieldSink& sink) const override;

 private:
  enum class Phase : std::uint8_t { first_look, second_look, zero, verify };
  void answered(Bytes reply) override;
  [[nodiscard]] bool is_near(std::int64_t counts) const { return counts <= noise_ && counts >= -noise_; }

  Phase phase_ = Phase::first_look;
  std::int64_t noise_;
  std::int64_t counts_ = 0;
};

/// A command whose effect cannot be read back: a (clear zero), 0 (stream off).
class Tell final : public Procedure {
 public:
  explicit Tell(std::uint8_t letter);
  void report(FieldSink& sink) const override;

 private:
  void answered(Bytes) override { finish(); }

  RequestText request_;
};

/// Reads `frames` frames at each clock, emits after each clock what was found so far, and sets the clock back, also
/// after an error and after `abort`. It recommends the middle of the longest run of clocks at which all were good.
class ClockSweep final : public Procedure {
 public:
  ClockSweep(const Format& format, unsigned frames);
  void report(FieldSink& sink) const override;
  bool abort() override {
    aborted_ = true;
    return true;
  }
  void report_left(FieldSink& sink) const override;

  /// 1 to 8; 0: no clock gave good frames only.
  [[nodiscard]] unsigned recommended() const;

 private:
  enum class Phase : std::uint8_t { version, previous, set, check, frames, restore, verify };
  void answered(Bytes reply) override;
  void failed(Error error) override;
  void next_clock();
  void count(Error error);
  void restore(Error error, const Explanation& explanation);

  Format format_;
  unsigned frames_;
  bool aborted_ = false;
  Phase phase_ = Phase::version;
  unsigned previous_ = 0;  // clock before the sweep; 0: not known yet
  unsigned clock_ = 0;
  unsigned read_ = 0;      // frames at this clock
  unsigned measured_ = 0;  // clocks that are done
  std::array<unsigned, clocks_khz.size()> valid_{};
  Error last_error_ = Error::none;  // of a frame
  std::string_view last_advice_{};
  Error outcome_ = Error::none;  // what the sweep ends with when the clock is restored
  Explanation outcome_explanation_{};
};

}  // namespace absenc::e201
