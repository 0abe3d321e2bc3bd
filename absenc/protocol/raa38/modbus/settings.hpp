// SPDX-License-Identifier: Apache-2.0
// Host side of the RAA38S6 over Modbus RTU, what changes the encoder. A setting is sent once, and not at all where the
// encoder has it already: its memory wears out. What became of it is read back as far as anything can be read.
#pragma once

#include "absenc/protocol/raa38/modbus/host.hpp"

namespace absenc::raa38::rtu {

enum class Wear : std::uint8_t {
  avoid,   // what is so already is not sent
  accept,  // it is sent all the same
};

/// A1. Refuses (invalid_argument) an address at which somebody answers. Verified by asking the new address; errors:
/// cross_check_failed (it has its old one), timeout (it answers at neither).
class SetAddress final : public Procedure {
 public:
  SetAddress(const Format& format, std::uint8_t address, Wear wear = Wear::avoid);
  void report(FieldSink& sink) const override;
  [[nodiscard]] bool written() const { return written_; }

 private:
  enum class Phase : std::uint8_t { look, is_free, write, verify, look_back };
  void replied(const Reply& reply) override;
  void missed(Error error) override;
  void write();
  void verify();

  std::uint8_t address_;
  Wear wear_;
  Phase phase_ = Phase::look;
  bool written_ = false;
};

/// CC with a baud rate; verified at the new rate, to which the line is set. Errors: invalid_argument (the encoder does
/// not have it), cross_check_failed (it has its old one), timeout (it answers at neither); then the line is as before.
class SetBaud final : public Procedure {
 public:
  SetBaud(const Format& format, std::uint32_t baud, Wear wear = Wear::avoid);
  void report(FieldSink& sink) const override;
  [[nodiscard]] bool written() const { return written_; }

 private:
  enum class Phase : std::uint8_t { look, write, verify, look_back };
  void replied(const Reply& reply) override;
  void missed(Error error) override;
  void verify();

  std::size_t baud_;
  Wear wear_;
  Phase phase_ = Phase::look;
  bool written_ = false;
};

/// CC with a direction. Only its echo tells that it was taken; the position before and after is reported.
class SetDirection final : public Procedure {
 public:
  /// `value`: parameter::positive or parameter::negative.
  SetDirection(const Format& format, std::uint8_t value);
  void report(FieldSink& sink) const override;

 private:
  enum class Phase : std::uint8_t { look, write, look_again };
  void replied(const Reply& reply) override;
  void missed(Error error) override;

  std::uint8_t value_;
  Phase phase_ = Phase::look;
  std::uint32_t before_ = 0;
  std::uint32_t after_ = 0;
};

/// CC 00: the position becomes 0 here. The shaft must stand still (invalid_argument); read back (cross_check_failed).
class Zero final : public Procedure {
 public:
  explicit Zero(const Format& format, Wear wear = Wear::avoid);
  [[nodiscard]] const Reading* reading() const override { return error() == Error::none ? &reading_ : nullptr; }
  void report(FieldSink& sink) const override;
  [[nodiscard]] bool written() const { return written_; }

 private:
  enum class Phase : std::uint8_t { first_look, second_look, write, verify };
  void replied(const Reply& reply) override;
  void missed(Error error) override;
  void second_look(const Reply& reply);
  void verify();

  Wear wear_;
  Phase phase_ = Phase::first_look;
  bool written_ = false;
  std::uint32_t before_ = 0;
  Reading reading_{};
};

}  // namespace absenc::raa38::rtu
