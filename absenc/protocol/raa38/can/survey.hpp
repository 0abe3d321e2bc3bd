// SPDX-License-Identifier: Apache-2.0
// RAA38S6 on CAN, what concerns every node of the bus: finding them, and the configuration on 7E5, which reaches all.
#pragma once

#include <array>

#include "absenc/protocol/raa38/can/procedure.hpp"

namespace absenc::raa38::can {

/// What was heard of one number.
struct Heard {
  std::uint16_t unasked = 0;     // frames that it sent by itself
  std::uint16_t per_second = 0;  // those of the first second
  std::uint8_t answers = 0;      // to one request
  std::uint8_t damaged = 0;      // requests at which frames were destroyed
  bool readable = false;         // `counts` fits the format
  std::uint32_t counts = 0;      // of the last frame

  [[nodiscard]] constexpr bool is_there() const { return unasked != 0 || answers != 0 || damaged > 1; }
  /// Two answers to one request, or destroyed frames each time.
  [[nodiscard]] constexpr bool clash() const {
    return (unasked == 0 && answers > 1) || (damaged > 1 && answers == 0 && unasked == 0);
  }
};

/// Listens, because after power on nodes send unasked, then asks every number; a subclass goes on with what was found.
class Survey : public Procedure {
 protected:
  Survey(const Format& format, bool listen_first);
  ~Survey() = default;

  virtual void surveyed() = 0;
  virtual void heard_then(const CanFrame&, Time) {}
  virtual void over_then() {}

  [[nodiscard]] const Format& format() const { return format_; }
  [[nodiscard]] const std::array<Heard, 256>& nodes() const { return nodes_; }
  /// How many numbers somebody has.
  [[nodiscard]] unsigned count() const;
  /// The first number that somebody has; 0: none.
  [[nodiscard]] std::uint8_t first() const;

 private:
  enum class Phase : std::uint8_t { listening, asking, waiting, done };
  void heard(const CanFrame& frame, Time at) final;
  void over() final;
  void ask_next();

  Format format_;
  Phase phase_;
  Time listened_from_ = never;
  unsigned asked_ = 0;  // the number that is being asked
  std::array<Heard, 256> nodes_{};
};

/// Who is there. Error: timeout when nobody is.
class Scan final : public Survey {
 public:
  explicit Scan(const Format& format) : Survey(format, true) {}
  void report(FieldSink& sink) const override;

 private:
  void surveyed() override;
};

/// The number of the node: of the only one, or of the one that is meant. Errors: timeout, unexpected_reply (only others
/// are there).
class FindNode final : public Survey {
 public:
  explicit FindNode(const Format& format) : Survey(format, false) {}
  void report(FieldSink& sink) const override;

 private:
  void surveyed() override;
  std::uint8_t node_ = 0;
};

/// Changes a setting of the only node on the bus. Errors: invalid_argument (others are there, whom it would reach too),
/// timeout, request_rejected, cross_check_failed (the encoder did not do it).
class Configure : public Survey {
 public:
  void report_left(FieldSink& sink) const final;

 protected:
  Configure(const Format& format, std::uint8_t code, bool is_set);
  ~Configure() = default;

  /// What the command carries.
  [[nodiscard]] virtual CanFrame setting() const = 0;
  virtual void put_setting(FieldSink& sink) const = 0;
  /// The command was sent: makes sure of its effect.
  virtual void verify() = 0;
  [[nodiscard]] bool written() const { return written_; }
  [[nodiscard]] bool answered() const { return answered_; }
  void report_configured(FieldSink& sink) const;
  void finish_verified();
  /// Asks for the position under this number.
  void look_for(std::uint8_t node);

 private:
  enum class Phase : std::uint8_t { entering, setting, verifying };
  void surveyed() final;
  void heard_then(const CanFrame& frame, Time at) final;
  void over_then() final;
  /// A position of the number that was looked for, or none in time.
  virtual void heard_position() = 0;
  virtual void nothing_heard() = 0;

  Phase phase_ = Phase::entering;
  std::uint8_t code_;
  std::uint8_t looked_for_ = 0;
  bool is_set_;  // already
  bool written_ = false;
  bool answered_ = false;
  bool verified_ = false;
};

/// 11: another number. It must answer under the new one and no longer under the old one.
class SetNode final : public Configure {
 public:
  /// `force`: writes even the number that it has.
  SetNode(const Format& format, std::uint8_t node, bool force);
  void report(FieldSink& sink) const override;

 private:
  [[nodiscard]] CanFrame setting() const override { return encode_configuration(configuration::node, node_); }
  void put_setting(FieldSink& sink) const override { put(sink, field_node, node_); }
  void verify() override { look_for(node_); }
  void heard_position() override;
  void nothing_heard() override;

  std::uint8_t node_;
  bool old_ = false;  // it is asked under its old number
  bool found_ = false;
};

/// 13: another bit rate, to which this end of the line goes too; back when the node is not there.
class SetRate final : public Configure {
 public:
  /// Error: invalid_argument for a rate that the document does not have.
  SetRate(const Format& format, std::int64_t bits_per_second, bool force);
  void report(FieldSink& sink) const override;

 private:
  enum class Place : std::uint8_t { going, there, returning, back };
  [[nodiscard]] CanFrame setting() const override { return encode_configuration(configuration::rate, 0, rate_->index); }
  void put_setting(FieldSink& sink) const override { put(sink, field_bit_rate, rate_->bits_per_second); }
  void verify() override;
  void heard_position() override;
  void nothing_heard() override;

  const Rate* rate_;
  Place place_ = Place::going;
  unsigned attempts_ = 0;
};

}  // namespace absenc::raa38::can
