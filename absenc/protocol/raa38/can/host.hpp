// SPDX-License-Identifier: Apache-2.0
// Host side of the RAA38S6 on CAN: reading, and what changes a node while it goes on sending: each class is one
// conversation, a machine without port, clock or heap. survey.hpp has what concerns all nodes of the bus.
#pragma once

#include "absenc/protocol/raa38/can/procedure.hpp"

namespace absenc::raa38::can {

/// One position: asked for (80, 01), or the next that the node sends by itself.
class Read final : public Procedure {
 public:
  enum class Way : std::uint8_t { ask, start, listen };
  Read(const Format& format, Way way);

  [[nodiscard]] const Reading* reading() const override { return error() == Error::none ? &reading_ : nullptr; }
  void report(FieldSink& sink) const override;

 private:
  void heard(const CanFrame& frame, Time at) override;
  void over() override;

  Format format_;
  Way way_;
  bool only_extended_ = false;  // where the reply should have been
  Reading reading_{};
};

/// 31: so many readings a second, 0: none. Whether that came true is heard. Error: cross_check_failed.
class SetCyclic final : public Procedure {
 public:
  SetCyclic(const Format& format, std::uint8_t readings_per_s);
  void report(FieldSink& sink) const override;

 private:
  void heard(const CanFrame& frame, Time at) override;
  void over() override;

  Format format_;
  std::uint8_t wanted_;
  bool counting_ = false;
  bool answered_ = false;
  Cadence cadence_{};
};

/// A command whose answer looks like a position: the node is made to be silent first, and sends again afterwards as it
/// did before. No position counts until the time for the answer is over.
class Quietly : public Procedure {
 protected:
  explicit Quietly(const Format& format);
  ~Quietly() = default;

  /// The node is silent, as far as it can be made so. Calls `ask` or `conclude`, as do the other two.
  virtual void work() = 0;
  virtual void position(std::uint32_t counts) = 0;
  /// `answered`: whether the answer to the command came; it is told only when the time for it is over.
  virtual void command_over(bool answered) = 0;

  void ask_position(Time pause = {});
  void ask_command(std::uint8_t code, std::uint8_t value);
  /// Lets the node send again and ends.
  void conclude(Error error = Error::none, const Explanation& explanation = {});
  [[nodiscard]] const Format& format() const { return format_; }
  [[nodiscard]] std::int64_t distance(std::uint32_t to, std::uint32_t from) const;
  /// What a shaft at rest may tremble, in counts.
  [[nodiscard]] std::int64_t noise() const;

 private:
  enum class Phase : std::uint8_t { listening, stopping, checking, reading, commanding, resuming, resumed };
  void heard(const CanFrame& frame, Time at) final;
  void over() final;
  void position_missing(Error error);

  Format format_;
  Phase phase_ = Phase::listening;
  std::uint8_t code_ = 0;
  bool answered_ = false;
  bool sends_ = false;  // by itself, before
  bool heard_again_ = false;
  Cadence cadence_{};
  Error outcome_ = Error::none;
  Explanation explanation_{};
};

/// 20: the position is 0 here, as the document lets one guess: read before and after. Nothing is written when it is 0
/// already. Errors: invalid_argument (the shaft turns), cross_check_failed (it is not near 0 afterwards).
class Zero final : public Quietly {
 public:
  explicit Zero(const Format& format);
  void report(FieldSink& sink) const override;

 private:
  void work() override { ask_position(); }
  void position(std::uint32_t counts) override;
  void command_over(bool answered) override;

  unsigned looks_ = 0;
  bool written_ = false;
  bool answered_ = false;
  std::uint32_t before_ = 0;
  std::uint32_t after_ = 0;
};

/// 22: the counting direction, which no command reads. The position then is either the same or mirrored.
/// Errors: invalid_argument (the shaft turns), cross_check_failed (any other position, or neither answer nor effect).
class SetDirection final : public Quietly {
 public:
  SetDirection(const Format& format, bool negative);
  void report(FieldSink& sink) const override;

 private:
  void work() override { ask_position(); }
  void position(std::uint32_t counts) override;
  void command_over(bool answered) override;

  std::uint8_t value_;
  unsigned looks_ = 0;
  bool answered_ = false;
  bool mirrored_ = false;
  std::uint32_t before_ = 0;
  std::uint32_t after_ = 0;
};

}  // namespace absenc::raa38::can
