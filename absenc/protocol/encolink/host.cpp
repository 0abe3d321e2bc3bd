// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/host.hpp"

#include <algorithm>

namespace absenc::encolink {

// Each frame is decided when it goes out: what was found in the one before is handed out first.
Stream::Stream(const Format& format, unsigned attempts)
    : Engine({.answer_limit = answer_limit, .gap_limit = gap_limit}, storage_),
      format_(format),
      attempts_(attempts),
      attempts_left_(attempts) {
  sleep({});
}

void Stream::reset_channels() {
  uses_channel2_ = reset_pending_ = true;
  lose_step();
}

void Stream::end(const author::Outcome& outcome) {
  over_ = true;
  finish(outcome);
}

// ---- Frames

void Stream::woken() {
  const Time earliest = begun_ && format_.wire == Wire::spi ? received_at() + spi_pause : Time{};
  begun_ = true;
  Config config = Config::position;
  std::uint8_t ra = 0;
  if (asked_ == Asked::identity) {  // its request is an ordinary one
  } else if (identify_pending_ || !format_.known()) {
    asked_ = Asked::to_identify;
    config = Config::identify;
  } else if (reset_pending_) {
    asked_ = Asked::reset;
    config = Config::reset_channels;
  } else {
    asked_ = Asked::position;
    ra = next_ra();
  }
  request_ = {static_cast<std::uint8_t>(config), ra};
  send(request_, {}, earliest);
}

// 0: silence ends it. What comes before the identity has a length that may be unknown, and behind both there may be
// more.
std::size_t Stream::expected(Bytes) const {
  if (asked_identity()) return format_.wire == Wire::spi ? identity_bytes : 0;
  return format_.frame_bytes();
}

Error Stream::check(Bytes reply) {
  if (reply.empty()) return Error::timeout;
  const bool flat = std::all_of(reply.begin(), reply.end(), [&](std::uint8_t byte) { return byte == reply[0]; });
  if (format_.wire == Wire::spi && flat && (reply[0] == 0x00 || reply[0] == 0xFF)) return Error::line_stuck;
  if (asked_ == Asked::identity) return decode_identity(reply).error();
  if (asked_ == Asked::to_identify) return Error::none;
  return decode_position(format_, reply).error();
}

void Stream::answered(Error error) {
  sleep({});
  if (error != Error::none) return bad_frame(error);
  if (asked_ == Asked::to_identify) {
    asked_ = Asked::identity;
    return;
  }
  attempts_left_ = attempts_;
  if (asked_ == Asked::identity) {
    good_identity();
  } else {
    good_position();
  }
}

void Stream::good_identity() {
  const Identity identity = *decode_identity(reply());
  identify_pending_ = false;
  lose_step();  // asking for it has reset the channels
  const Result<Format> known = trusts_identity_ ? as_identified(format_, identity) : complete(format_, identity);
  if (!known) return end({.error = known.error()});
  asked_ = Asked::position;
  format_ = *known;
  on_identity(identity);
}

void Stream::good_position() {
  position_ = *decode_position(format_, reply());
  ++frames_;
  reading_ = to_reading(format_, position_);
  if (detailed_status_) add_status(reading_, *detailed_status_);
  // On SPI the position is taken when NCS falls. The document does not say when it is on a UART: at the end of the
  // request at the latest.
  reading_.latched = format_.wire == Wire::spi ? begun_at() : sent_at();
  reading_.received = received_at();
  if (asked_ == Asked::reset) {  // its byte of channel 2 is still one of before
    reset_pending_ = false;
    cycle_.restart();
  } else {
    follow_channel2();
  }
  if (!over_) on_frame();
}

void Stream::bad_frame(Error error) {
  lose_step();
  reset_pending_ = uses_channel2_;
  if (--attempts_left_ == 0 || is_noisy()) {
    attempts_left_ = attempts_;
    return on_failure(error);
  }
  if (asked_ == Asked::identity) asked_ = Asked::position, identify_pending_ = true;
  on_damage(error);
}

void Stream::follow_channel2() {
  const std::optional<Result<Cycle>> cycle = cycle_.feed(format_, position_);
  if (!cycle) return;
  if (*cycle) {
    detailed_status_ = (*cycle)->status;
    add_status(reading_, *detailed_status_);
  } else {
    reset_pending_ = true;
  }
  on_cycle(*cycle);
}

// ---- ReadPosition

void ReadPosition::on_frame() {
  if (looking_closer_) return;
  looking_closer_ = format().has_ch2 && (position().error || position().warning || is_all_zero(position()));
  if (looking_closer_) {
    reset_channels();
  } else {
    end({});
  }
}

void ReadPosition::on_cycle(const Result<Cycle>& cycle) {
  if (!cycle && is_all_zero(position())) mark_not_ready();
  end({});
}

}  // namespace absenc::encolink
