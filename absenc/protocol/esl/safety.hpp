// SPDX-License-Identifier: Apache-2.0
// Safe positions. This is not a certified safety function (README.md).
#pragma once

#include <optional>

#include "absenc/protocol/esl/reply.hpp"

namespace absenc::esl {

class SafetyMonitor;

/// A position within the turn that passed all checks of a SafetyMonitor.
class SafePosition {
 public:
  /// Returns the position within the turn in counts, 0 to 2^24 - 1. The lowest 15 bits come from channel 1 alone.
  [[nodiscard]] constexpr std::uint32_t singleturn() const { return singleturn_; }
  /// Returns the address of the encoder on its line, 0 to 7.
  [[nodiscard]] constexpr std::uint8_t encoder_address() const { return encoder_address_; }
  /// Returns the time at which the encoder is taken to have latched the position: see `latch_time`.
  [[nodiscard]] constexpr Time latched() const { return latched_; }

 private:
  friend class SafetyMonitor;
  constexpr SafePosition(const Reply& reply, Time latched)
      : singleturn_(reply.singleturn), encoder_address_(reply.encoder_address), latched_(latched) {}

  std::uint32_t singleturn_;
  std::uint8_t encoder_address_;
  Time latched_;
};

/// Result of judging a reply: a safe position, or the check that failed.
struct SafetyVerdict {
  std::optional<SafePosition> position{};  ///< safe position; no value unless `failed` is Check::passed
  Check failed = Check::passed;            ///< First check that failed; Check::passed if none failed.
};

/// Decides from consecutive replies of one encoder which positions are safe. The first good reply after the start or
/// after an error gives no safe position yet.
class SafetyMonitor {
 public:
  /// Constructs a monitor for an encoder of this profile.
  constexpr explicit SafetyMonitor(const Profile& profile) : profile_(profile) {}

  /// Returns the data ID for the next request: `wanted` if the last replies were good, otherwise the data IDs 1 and 2
  /// in turn.
  [[nodiscard]] constexpr DataId next_id(DataId wanted = DataId::position) const {
    if (trust_ == Trust::full) return wanted;
    return last_id_ == DataId::position ? DataId::singleturn : DataId::position;
  }

  /// Judges the reply `bytes` to `request`; the request ended at `sent_at`.
  constexpr SafetyVerdict judge(const Request& request, Bytes bytes, Time sent_at) {
    Reply reply;
    Check check = check_reply(profile_, request, bytes, reply);
    if (check == Check::passed) check = check_content(reply);
    last_id_ = request.id;
    if (check == Check::passed) check = check_sequence(reply);
    if (check != Check::passed) {
      if (check != Check::sequence_unknown) trust_ = Trust::none;
      return {.failed = check};
    }
    trust_ = Trust::full;
    return {.position = SafePosition(reply, latch_time(profile_, sent_at))};
  }

  /// Notes that `request` got no reply. After that the next good reply gives no safe position.
  constexpr void missed(const Request& request) {
    trust_ = Trust::none;
    last_id_ = request.id;
  }

  /// Notes that the encoder answered a request with data ID `id` whose reply is not judged.
  constexpr void other_exchange(DataId id) {
    if (profile_.sequence_step == SequenceStep::request || has_sequence(id)) ++step_;
  }

 private:
  enum class Trust : std::uint8_t { none, one_reply, full };

  [[nodiscard]] constexpr Check check_content(const Reply& reply) const {
    if (!is_safety_position(reply.id)) return Check::not_a_safety_reply;
    if ((reply.one.status & status::ready) == 0) return Check::ch1_not_ready;
    if ((reply.two.status & status::ready) == 0) return Check::ch2_not_ready;
    const unsigned forced = reply.one.status & reply.two.status & status::forced_test_passed;
    if (profile_.require_forced_test && forced == 0) return Check::forced_test_missing;
    if (((reply.one.status | reply.two.status) & status::safety_error) != 0) return Check::safety_error;
    if (((reply.one.alarms | reply.two.alarms) & alarms::unsafe) != 0) return Check::alarm;
    return Check::passed;
  }

  constexpr Check check_sequence(const Reply& reply) {
    const auto moved = static_cast<std::uint8_t>(reply.one.sequence - last_sequence_);
    const std::uint8_t step = step_;
    const bool known = trust_ == Trust::full || (trust_ == Trust::one_reply && reply.id != baseline_id_);
    last_sequence_ = reply.one.sequence;
    step_ = 1;
    if (!known) {
      trust_ = Trust::one_reply;
      baseline_id_ = reply.id;
      return Check::sequence_unknown;
    }
    if (moved == 0) return Check::sequence_still;
    if (profile_.sequence_step != SequenceStep::change && moved != step) return Check::sequence_jumped;
    return Check::passed;
  }

  Profile profile_;
  Trust trust_ = Trust::none;
  DataId last_id_ = DataId::position;
  DataId baseline_id_ = DataId::position;
  std::uint8_t last_sequence_ = 0;
  std::uint8_t step_ = 1;  // number of steps by which the sequence counter must have moved at the next judged reply
};

}  // namespace absenc::esl
