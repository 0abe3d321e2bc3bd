// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/e201/device.hpp"

#include <algorithm>

namespace absenc::e201 {

namespace {

constexpr Time usb_time = 200us;

void append_text(ByteBuffer<64>& reply, std::string_view text) {
  for (const char c : text) reply.push_back(static_cast<std::uint8_t>(c));
}

void append_number(ByteBuffer<64>& reply, std::uint64_t number) {
  std::array<char, 20> digits{};
  std::size_t first = digits.size();
  do {
    digits[--first] = static_cast<char>('0' + number % 10);
    number /= 10;
  } while (number != 0);
  append_text(reply, {digits.data() + first, digits.size() - first});
}

// Appends a number as hexadecimal text with as many digits as `width` bits need.
void append_hexadecimal(ByteBuffer<64>& reply, std::uint64_t number, unsigned width) {
  for (unsigned digit = (width + 3) / 4; digit-- > 0;) {
    reply.push_back(static_cast<std::uint8_t>("0123456789ABCDEF"[number >> (4 * digit) & 0xF]));
  }
}

}  // namespace

VirtualInterface::VirtualInterface(const Format& format, const Shaft& shaft)
    : Responder({.answer_time = usb_time, .keeps_requests = true}),
      format_(format),
      shaft_(&shaft),
      encoder_(format.biss(), shaft, {.latency = format.latency, .line_delay = format.line_delay}),
      width_(std::min(64u, format.word.bits_of(Meaning::position) + format.word.bits_of(Meaning::multiturn))) {}

void VirtualInterface::stopped(Time) {
  encoder_.set_power(false);
  zero_ = 0;
}

// Returns the length of a command without a CR, because it is unknown whether the commands `M` and `B` need one.
std::size_t VirtualInterface::request_size(Bytes begin) const {
  return begin[0] == letter::set_clock ? 2 : begin[0] == letter::set_width ? 3 : 1;
}

author::Responder::Answer VirtualInterface::respond(Bytes bytes, Time at, ByteBuffer<64>& reply) {
  if (trimmed(bytes).empty()) return Answer::for_others;
  const Result<Request> request = Protocol::decode_request(format_, bytes);
  const bool is_about_number =
      request_size(bytes) > 1 && (request.has_value() || request.error() == Error::wrong_length);
  const std::string_view rule = is_about_number ? "a command without its number" : "an unknown command";
  if (!expect(request.has_value(), rule, at)) return Answer::for_others;
  if (change(*request, at)) return Answer::none;
  switch (request->letter) {
    case letter::samples:
      if (!has_samples(format_.firmware)) return Answer::none;
      return answer_samples(at, reply);
    case letter::version:
      append_text(reply, "E201-9S V");
      append_number(reply, format_.firmware.major);
      append_text(reply, format_.firmware.minor < 10 ? ".0" : ".");
      append_number(reply, format_.firmware.minor);
      break;
    case letter::serial:
      append_text(reply, "09S0417");
      break;
    case letter::supply:
      append_text(reply, encoder_.is_powered() ? "4.98V 62mA" : "0.02V 0mA");
      break;
    case letter::clock:
      append_number(reply, clock_);
      break;
    case letter::width:
      append_number(reply, width_);
      break;
    case letter::hexadecimal:
      append_hexadecimal(reply, (counts(at) - zero_) & low_mask(width_), width_);
      break;
    default: {  // the reply to the commands `?` and `1` is the position, which is signed if a zero is set
      const std::uint64_t number = counts(at) - zero_;
      const bool negative = zero_ != 0 && static_cast<std::int64_t>(number) < 0;
      append_text(reply, negative ? "-" : "");
      append_number(reply, negative ? 0 - number : number);
    }
  }
  reply.push_back(end_of_line);
  return Answer::sent;
}

// Executes a command that has no reply. Returns false for any other command.
bool VirtualInterface::change(const Request& request, Time at) {
  switch (request.letter) {
    case letter::supply_on:
    case letter::supply_off:
      encoder_.set_power(request.letter == letter::supply_on);
      return true;
    case letter::zero:
      zero_ = counts(at);
      return true;
    case letter::clear_zero:
      zero_ = 0;
      return true;
    case letter::set_clock:
      clock_ = request.clock;
      return true;
    case letter::set_width:
      width_ = request.width;
      return true;
    default:
      return request.letter == letter::stream_off;  // the virtual interface never streams, so `stream_off` does nothing
  }
}

author::Responder::Answer VirtualInterface::answer_samples(Time at, ByteBuffer<64>& reply) {
  const Time period = clock_period(clock_);
  const std::uint64_t number = samples(at, period);
  for (unsigned i = sample_bits; i > 0; i -= 4) {
    reply.push_back(static_cast<std::uint8_t>("0123456789abcdef"[number >> (i - 4) & 0xF]));
  }
  reply.push_back(end_of_line);
  take_longer(period * static_cast<std::int64_t>(sample_bits));
  return Answer::sent;
}

std::uint64_t VirtualInterface::samples(Time at, Time period) {
  if (!encoder_.is_powered()) return 0;
  biss::Samples samples;
  if (format_.carries == Carries::biss) {
    encoder_.set_alarms(raised());
    encoder_.sample(at, period, samples);
  } else {
    samples.append(1, 1);
    ssi::encode(format_.ssi(), word_of(format_.word, shaft_->at(at), raised()), sample_bits - 1, samples);
  }
  while (samples.size() < sample_bits) samples.append(0, 1);
  return samples.view().load(0, sample_bits);
}

// Returns turns and position as one number of `width_` bits; 0 if the encoder has no supply.
std::uint64_t VirtualInterface::counts(Time at) const {
  if (!encoder_.is_powered()) return 0;
  const Word now = word_of(format_.word, shaft_->at(at), 0);
  const unsigned bits = format_.word.bits_of(Meaning::position);
  return ((bits < 64 ? now.multiturn << bits : 0) | now.position) & low_mask(width_);
}

}  // namespace absenc::e201
