// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/host.hpp"

#include <algorithm>

namespace absenc::encolink {

// ---- Frames

std::array<std::uint8_t, request_bytes> Frames::encode(const Format&, const Request& request) {
  // to read the identity, a position request follows the request that announced the identity
  Config config = Config::position;
  if (request.ask == Ask::reset) config = Config::reset_channels;
  if (request.ask == Ask::identify) config = Config::identify;
  return {static_cast<std::uint8_t>(config), request.ra};
}

// Returns 0, unknown, for an identity on a UART: one more byte may follow it, so only silence shows its end.
std::size_t Frames::expected(const Format& format, const Request& request, Bytes) {
  const bool identifies = request.ask == Ask::identify || request.ask == Ask::identity;
  if (!identifies) return format.frame_bytes();
  return format.interface == Interface::spi ? identity_bytes : 0;
}

Result<Position> Frames::decode(const Format& format, const Request& request, Bytes reply) {
  const bool flat = std::all_of(reply.begin(), reply.end(), [&](std::uint8_t byte) { return byte == reply[0]; });
  if (format.interface == Interface::spi && flat && (reply[0] == 0x00 || reply[0] == 0xFF)) return Error::line_stuck;
  if (request.ask == Ask::identify) return Position{};
  if (request.ask != Ask::identity) return decode_position(format, reply);
  const Error error = decode_identity(reply).error();
  return error == Error::none ? Result(Position{}) : error;
}

// ---- Channels

void Channels::take(const author::HostOf<Frames>& host) {
  const Format& format = host.format();
  const Position& position = host.last();
  ended.reset();
  // The channel 2 byte in the reply to a reset still belongs to the cycle before the reset.
  if (host.request().ask == Ask::reset) {
    bytes_.clear();
    in_step = true;
  } else if (in_step) {
    if (bytes_.empty()) first_ = position;
    bytes_.push_back(position.channel2);
    if (bytes_.size() == format.cycle_bytes()) {
      const Result<ChannelCycle> cycle = decode_cycle(format, bytes_);
      const Bytes all = bytes_;
      silent = std::all_of(all.begin(), all.end(), [](std::uint8_t byte) { return byte == 0; });
      ended = cycle && !same_place(cycle->position, first_) ? Error::cross_check_failed : cycle.error();
      bytes_.clear();
      in_step = ended == Error::none;
      if (in_step) {
        status = cycle->status;
        channel3 = cycle->channel3;
      }
    }
  }
  reading = to_reading(format, position, status);
  // The time of the position: on SPI when NCS falls; on a UART it is assumed to be the end of the request.
  reading.latched = format.interface == Interface::spi ? host.begun_at() : host.sent_at();
  reading.received = host.received_at();
}

// ---- ReadPosition

ReadPosition::ReadPosition(const Format& format) : HostOf(format) {
  ask({format.known() ? Ask::position : Ask::identify});
}

void ReadPosition::concluded(Error error) {
  if (error != Error::none) return finish(error);
  if (request().ask == Ask::identify) return go_on(Ask::identity);
  if (request().ask == Ask::identity) {
    const Result<Format> known = complete(format(), *decode_identity(reply()));
    if (!known) return finish(known.error());
    set_format(*known);
    return go_on(Ask::position);
  }
  channels_.take(*this);
  const Position& position = last();
  if (channels_.in_step && !channels_.ended) return go_on(Ask::position);
  const bool needs_alarms = position.error || position.warning || is_all_zero(position);
  if (format().has_ch2 && needs_alarms && !channels_.ended) return go_on(Ask::reset);
  if (channels_.silent && is_all_zero(position)) channels_.reading.ready = false;
  finish(Error::none);
}

}  // namespace absenc::encolink
