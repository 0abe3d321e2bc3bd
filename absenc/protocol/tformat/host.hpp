// SPDX-License-Identifier: Apache-2.0
// Reads positions of T-format encoders: a plain machine without port, clock, heap or texts, for drives that do it ten
// thousand times a second. link/step.hpp says how to run it; procedures.hpp has what takes several steps.
#pragma once

#include <optional>

#include "absenc/protocol/author/line.hpp"
#include "absenc/protocol/tformat/protocol.hpp"

namespace absenc::tformat {

/// Data IDs 0 to 3. ID 3 carries everything. SF hides over_speed, full_absolute_status and counter_overflow, so
/// unless `known_alarms` (the ALMC of an ID 3 reply since power on) is given, IDs 0 and 1 are preceded by an ID 3,
/// and an alarm that newly appears in their SF is followed by one, whose reply is the result then. Nothing is repeated.
class ReadPosition : public author::HostOf<Protocol> {
 public:
  explicit ReadPosition(const Format& format, DataId id = DataId::everything,
                        std::optional<std::uint8_t> known_alarms = std::nullopt);
  ReadPosition(const Format& format, const Request& request) : ReadPosition(format, request.id) {}

  [[nodiscard]] const Reading* reading() const final {
    return error() == Error::none && id_ != DataId::encoder_id ? &reading_ : nullptr;
  }
  /// Of the last good exchange.
  [[nodiscard]] const Reply& reply() const { return last(); }

 private:
  void answered(Error error) final;
  void ask_for(DataId id) { ask({id}, {.attempts = 1}); }

  DataId id_;
  bool part_read_ = false;  // ID 0 or 1 has been answered
  std::optional<std::uint8_t> known_alarms_;
  Reading reading_{};
};

}  // namespace absenc::tformat
