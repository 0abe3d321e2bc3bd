// SPDX-License-Identifier: Apache-2.0
// Host side of the RAA38S6 over Modbus RTU, what only reads: each class is one conversation, a machine without port,
// clock or heap. README.md describes the procedures; settings.hpp has those that change the encoder.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "absenc/protocol/modbus/client.hpp"
#include "absenc/protocol/raa38/modbus/frame.hpp"

namespace absenc::raa38::rtu {

using namespace std::chrono_literals;

/// The document gives no time; slaves of this kind need a few milliseconds.
inline constexpr Time answer_limit = 50ms;

/// One request and its checked reply at a time; a subclass decides what comes next.
class Procedure : public modbus::Client {
 protected:
  /// How often a request that only reads is sent before its error counts. Settings are never repeated.
  Procedure(const Format& format, unsigned read_attempts)
      : Client(format.line(), answer_limit), format_(format), read_attempts_(read_attempts) {}
  ~Procedure() = default;

  /// After the line was silent for `pause`, 3.5 characters at least.
  void ask(const Request& request, Time pause = {});
  /// Asks the encoder at `address` for its position.
  void ask_position(std::uint8_t address, Time pause = {});
  void ask_position() { ask_position(format_.address); }

  /// The reply passed every check. Calls `ask` or `finish`.
  virtual void replied(const Reply& reply) = 0;
  /// No good reply came. Calls `ask` or `finish`; by default the procedure ends with this error.
  virtual void missed(Error error) { finish(error, reason_); }

  [[nodiscard]] const Format& format() const { return format_; }
  /// Of the last request that got no good reply.
  [[nodiscard]] const Explanation& reason() const { return reason_; }
  [[nodiscard]] Reading reading_of(const Reply& reply) const;

 private:
  [[nodiscard]] std::size_t expected(Bytes reply) const final { return reply_length(request_, reply); }
  [[nodiscard]] Error check(Bytes reply) const final { return decode_reply(format_, request_, reply).error(); }
  void answered(Bytes reply) final;
  void failed(Error error, Bytes reply) final;
  void send(Time pause);

  Format format_;
  unsigned read_attempts_;
  unsigned attempts_left_ = 0;
  Request request_{};
  std::size_t doubtful_length_ = 0;  // of the first reply, when that has to be confirmed
  Explanation reason_{};
};

/// Function 03. A reply whose length the CRC cannot vouch for is confirmed by a second one.
class ReadPosition final : public Procedure {
 public:
  explicit ReadPosition(const Format& format);

  [[nodiscard]] const Reading* reading() const override { return error() == Error::none ? &reading_ : nullptr; }
  void report(FieldSink& sink) const override;

 private:
  void replied(const Reply& reply) override;

  Reply reply_{};
  Reading reading_{};
};

/// A0. Where that gets no good answer, as with several encoders on the line, the one at the address of the format is
/// asked for its position.
class ReadAddress final : public Procedure {
 public:
  explicit ReadAddress(const Format& format);
  void report(FieldSink& sink) const override;

 private:
  void replied(const Reply& reply) override;
  void missed(Error error) override;

  bool asked_all_ = true;
  std::uint8_t address_ = 0;
};

/// Finds the baud rate at which the encoder answers: first that of the format, then the others. Leaves the line as it
/// was. Error: timeout, or what came at the rate of the format.
class FindBaud final : public Procedure {
 public:
  explicit FindBaud(const Format& format);
  void report(FieldSink& sink) const override;

 private:
  void replied(const Reply& reply) override;
  void missed(Error error) override;
  void conclude_with(Error error, const Explanation& explanation = {});

  std::size_t tried_ = 0;  // besides that of the format
  std::size_t found_;
  Error first_error_ = Error::none;
  Explanation first_reason_{};
};

/// No command reads the direction: the position is all there is to see of it.
class ReadDirection final : public Procedure {
 public:
  explicit ReadDirection(const Format& format) : Procedure(format, 1) { ask_position(); }
  void report(FieldSink& sink) const override;

 private:
  void replied(const Reply& reply) override;

  std::uint32_t singleturn_ = 0;
};

/// A0 first, which a single encoder answers; otherwise every address from `first` to `last`. An answer that is damaged
/// every time tells of two encoders with one address, or of a bad line. Error: timeout when nobody answers.
class Scan final : public Procedure {
 public:
  Scan(const Format& format, std::uint8_t first, std::uint8_t last);
  void report(FieldSink& sink) const override;

 private:
  void replied(const Reply& reply) override;
  void missed(Error error) override;
  void go_on();

  enum class Phase : std::uint8_t { ask_all, ask_found, walk };
  using Addresses = std::array<std::uint32_t, 8>;  // bit n: address n
  static void add(Addresses& addresses, std::uint8_t address);
  [[nodiscard]] static bool has(const Addresses& addresses, std::uint8_t address);

  std::uint8_t first_;
  std::uint8_t last_;
  Phase phase_ = Phase::ask_all;
  std::uint8_t address_ = 0;
  unsigned damaged_answers_ = 0;  // of this address
  bool found_any_ = false;
  Addresses answering_{};
  Addresses disturbed_{};
  Addresses refusing_{};
};

}  // namespace absenc::raa38::rtu
