// SPDX-License-Identifier: Apache-2.0
// Host side of several encoders on one line: polling a list of addresses in cycles, and finding out who answers.
#pragma once

#include <array>
#include <span>

#include "absenc/protocol/esl/procedure.hpp"
#include "absenc/protocol/esl/safety.hpp"

namespace absenc::esl {

inline constexpr unsigned most_encoders = 8;  // 3 address bits

/// One encoder of a polled line: what came last, and how it behaved.
struct Polled {
  std::uint8_t address = 0;
  Error error = Error::timeout;            // of the last exchange; none: `reading` holds
  Check failed = Check::passed;            // why the last exchange made no safe position
  Reading reading{};                       // of the last good reply, safe or not
  std::optional<SafePosition> position{};  // of the last cycle; only IDs 1 and 2 make one
  std::uint64_t good = 0;
  std::uint64_t safe = 0;
  std::array<std::uint64_t, error_texts.size()> errors{};  // of each kind
  Time longest{};                                          // from the end of the request to the end of a good reply
};

/// Asks each address of a list once in a cycle and emits after the last. Every encoder has its own statistics and its
/// own safety monitor; one that is silent or sends too much costs its own turn and no other's. Ends after `cycles`.
class Poll final : public Procedure {
 public:
  /// 1 to 8 addresses; `id` 1, 2, 4 or 5; `cycles` 0: endless. With IDs 1 and 2 an encoder that is not trusted yet is
  /// asked for both in turn. `pause`: the line is left idle that long before each request.
  Poll(const Profile& profile, std::span<const std::uint8_t> addresses, DataId id = DataId::position,
       std::uint64_t cycles = 0, Time pause = request_pause);

  [[nodiscard]] std::span<const Polled> encoders() const { return {encoders_.data(), count_}; }
  [[nodiscard]] std::uint64_t cycles() const { return cycles_; }
  void report(FieldSink& sink) const override;

 private:
  void answered(const Reply& reply) override;
  void failed(Error error) override;
  void ask_current(Time earliest);
  void go_on();

  DataId id_;
  std::uint64_t last_cycle_;
  Time pause_;
  std::array<Polled, most_encoders> encoders_{};
  std::array<SafetyMonitor, most_encoders> monitors_;
  std::size_t count_ = 0;
  std::size_t current_ = 0;
  std::uint64_t cycles_ = 0;
};

/// Asks every address for ID 5, never for ID 8: eight of these in a row are "dynamic addressing". An answer that is
/// damaged every time tells of two encoders with one address, or of a bad line. Error: timeout when nobody answers.
class Scan final : public Procedure {
 public:
  explicit Scan(const Profile& profile);

  [[nodiscard]] std::uint8_t answering() const { return answering_; }  // bit n: address n
  [[nodiscard]] std::uint8_t disturbed() const { return disturbed_; }
  void report(FieldSink& sink) const override;

 private:
  void answered(const Reply& reply) override;
  void failed(Error error) override;
  void go_on();

  std::uint8_t address_ = 0;
  std::uint8_t answering_ = 0;
  std::uint8_t disturbed_ = 0;
  std::array<Reply, most_encoders> last_{};  // the last good reply of each
};

}  // namespace absenc::esl
