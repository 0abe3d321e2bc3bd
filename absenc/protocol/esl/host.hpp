// SPDX-License-Identifier: Apache-2.0
// Host side of ESL, what concerns position, id, temperature, alarms and resets: each class is one conversation, a
// machine without port, clock or heap. README.md describes the procedures; memory.hpp and bus.hpp have the others.
#pragma once

#include "absenc/protocol/esl/procedure.hpp"
#include "absenc/protocol/esl/safety.hpp"

namespace absenc::esl {

/// One reply of any ID that only reads: 1, 2, 4, 5, 6, 8, 9, A. ID 8 is preceded by an ID 5, so that eight of these
/// conversations in a row are not eight IDs 8 in a row.
class Read final : public Procedure {
 public:
  explicit Read(const Profile& profile, DataId id = DataId::position);

  /// Null for replies without a position. Not a safe position.
  [[nodiscard]] const Reading* reading() const override;
  void report(FieldSink& sink) const override;
  [[nodiscard]] const Reply& reply() const { return reply_; }

 private:
  void answered(const Reply& reply) override;

  DataId id_;
  Reply reply_{};
  Reading reading_{};
};

/// IDs 1 and 2 until the monitor trusts the line: two exchanges when all is well. Errors: those of the check that
/// failed, which `check` names.
class ReadSafePosition final : public Procedure {
 public:
  explicit ReadSafePosition(const Profile& profile);

  [[nodiscard]] const Reading* reading() const override;
  void report(FieldSink& sink) const override;
  /// Null unless every check passed.
  [[nodiscard]] const SafePosition* position() const;
  [[nodiscard]] Check failed_check() const { return failed_; }

 private:
  void answered(const Reply& reply) override;

  SafetyMonitor monitor_;
  std::optional<SafePosition> position_{};
  Check failed_ = Check::sequence_unknown;
  unsigned exchanges_ = 0;
  Reply reply_{};
  Reading reading_{};
};

/// IDs B (single-turn zero here), C (clear alarms) and D (turns): makes sure that the shaft stands still, sends eight
/// requests, reads back what became of it. Errors: invalid_argument (the shaft turns, the encoder is not ready),
/// cross_check_failed (the encoder did not do it; `detail` names what remains), or that of an exchange.
class Reset final : public Procedure {
 public:
  Reset(const Profile& profile, DataId id);

  [[nodiscard]] const Reading* reading() const override;  // after the reset
  void report(FieldSink& sink) const override;
  /// The alarms that are still set.
  [[nodiscard]] std::uint8_t remaining() const {
    return static_cast<std::uint8_t>(reply_.one.alarms | reply_.two.alarms);
  }

 private:
  enum class Phase : std::uint8_t { first_look, second_look, requests, verify };
  void answered(const Reply& reply) override;
  void failed(Error error) override;
  void second_look(const Reply& reply);
  void verify(const Reply& reply);
  void go_on();
  void name_what_remains();

  DataId id_;
  Phase phase_ = Phase::first_look;
  unsigned sent_requests_ = 0;
  std::uint32_t before_ = 0;  // single-turn position
  Reply reply_{};
  Reading reading_{};
};

}  // namespace absenc::esl
