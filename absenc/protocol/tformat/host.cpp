// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/tformat/host.hpp"

namespace absenc::tformat {

ReadPosition::ReadPosition(const Format& format, DataId id, std::optional<std::uint8_t> known_alarms)
    : HostOf(format), id_(id), known_alarms_(known_alarms) {
  const bool alarms_first = (id == DataId::singleturn || id == DataId::multiturn) && !known_alarms;
  ask_for(alarms_first ? DataId::everything : id);
}

void ReadPosition::answered(Error error) {
  if (error != Error::none) return finish({.error = error});
  if (reply().id == DataId::everything) {
    known_alarms_ = reply().alarms;
    if (id_ != DataId::everything && !part_read_) return ask_for(id_);
  } else if (id_ != DataId::encoder_id) {
    part_read_ = true;
    const int unknown = reply().status & ~status_for(known_alarms_.value_or(0));
    if (unknown != 0) return ask_for(DataId::everything);
  }
  reading_ = to_reading(format(), reply(), known_alarms_);
  // The document does not say when the position is taken; the end of the request is the latest it can be.
  reading_.latched = sent_at();
  reading_.received = received_at();
  finish({});
}

}  // namespace absenc::tformat
