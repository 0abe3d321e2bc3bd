// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/e201/device.hpp"

#include <algorithm>

namespace absenc::e201 {

namespace {

using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;

constexpr std::string_view supply_text = "4.98V 62mA";
constexpr std::string_view no_supply_text = "0.02V 0mA";
constexpr std::string_view serial_text = "09S0417";

}  // namespace

VirtualAdapter::VirtualAdapter(const Format& format, const Shaft& shaft, const AdapterSettings& settings)
    : format_(format),
      shaft_(&shaft),
      encoder_(format.biss, shaft, settings.behaviour),
      firmware_(settings.firmware),
      clock_(settings.clock),
      width_(std::min(64u, format.word().bits_of(Meaning::position) + format.word().bits_of(Meaning::multiturn))) {}

void VirtualAdapter::power_on(Time, PowerOn) {
  on_ = true;
  encoder_.set_power(true);
}

void VirtualAdapter::power_off(Time) {
  on_ = streaming_ = reply_pending_ = transmitting_ = false;
  encoder_.set_power(false);
  input_.clear();
  letter_ = 0;
  zero_ = 0;
}

// ---- The line

ByteStep VirtualAdapter::next(Time now) {
  if (streaming_ && !reply_pending_ && !transmitting_ && now >= stream_at_) {
    stream_at_ = now + stream_period;
    reply_.clear();
    answer_position(command::decimal, now - usb_time);
  }
  if (reply_pending_) {
    reply_pending_ = false;
    transmitting_ = true;
    return {.kind = ByteStep::Kind::transfer, .out = reply_, .at = reply_at_};
  }
  return {.expect = 1, .at = streaming_ && !transmitting_ ? stream_at_ : never};
}

void VirtualAdapter::feed(const ByteEvent& event) {
  if (event.kind == ByteEvent::Kind::sent) {
    transmitting_ = false;
    work(event.at);
  } else if (event.kind == ByteEvent::Kind::received && on_) {
    input_.append(event.items);
    work(event.at);
  }
}

// Executes what has come, up to the first command that is answered.
void VirtualAdapter::work(Time at) {
  const ByteBuffer<64> input = input_;
  std::size_t used = 0;
  while (used < input.size() && !reply_pending_ && !transmitting_) parse(input[used++], at);
  input_.clear();
  input_.append(input.view().subspan(used));
}

void VirtualAdapter::parse(std::uint8_t byte, Time at) {
  if (letter_ != 0) {
    if (byte < '0' || byte > '9') {
      letter_ = 0;
      return violate("a command without its number", at);
    }
    value_ = value_ * 10 + (byte - '0');
    if (--digits_ > 0) return;
    const std::uint8_t letter = letter_;
    letter_ = 0;
    return execute(letter, value_, at);
  }
  if (byte == end_of_line || byte == '\n') return;
  if (byte == command::set_clock || byte == command::set_width) {
    letter_ = byte;
    digits_ = byte == command::set_clock ? 1 : 2;
    value_ = 0;
  } else {
    execute(byte, 0, at);
  }
}

// ---- Commands

void VirtualAdapter::execute(std::uint8_t letter, unsigned value, Time at) {
  if (!command::is_known(letter)) return violate("an unknown command", at);
  ++answered_;
  if (change(letter, value, at)) return;
  reply_.clear();
  switch (letter) {
    case command::samples:
      if (has_samples(firmware_)) answer_samples(at);
      break;
    case command::version:
      answer_version(at);
      break;
    case command::serial:
      answer(serial_text, at);
      break;
    case command::supply:
      answer(supplies() ? supply_text : no_supply_text, at);
      break;
    case command::clock:
    case command::width:
      append_number(letter == command::clock ? clock_ : width_, 10);
      end_line(at);
      break;
    default:
      answer_position(letter, at);
  }
}

// What has no reply. False for a question.
bool VirtualAdapter::change(std::uint8_t letter, unsigned value, Time at) {
  switch (letter) {
    case command::supply_on:
    case command::supply_off:
      encoder_.set_power(letter == command::supply_on);
      return true;
    case command::zero:
      zero_ = counts(at);
      return true;
    case command::clear_zero:
      zero_ = 0;
      return true;
    case command::stream_off:
    case command::stream_on:
      streaming_ = letter == command::stream_on;
      stream_at_ = at + stream_period;
      return true;
    case command::set_clock:
      if (value >= 1 && value <= clocks_khz.size()) clock_ = value;
      return true;
    case command::set_width:
      if (value >= 1 && value <= 64) width_ = value;
      return true;
    default:
      return false;
  }
}

void VirtualAdapter::answer_version(Time at) {
  for (const char c : std::string_view("E201-9S V")) reply_.push_back(static_cast<std::uint8_t>(c));
  append_number(firmware_.major, 10);
  reply_.push_back('.');
  if (firmware_.minor < 10) reply_.push_back('0');
  append_number(firmware_.minor, 10);
  end_line(at);
}

void VirtualAdapter::answer(std::string_view text, Time at) {
  for (const char c : text) reply_.push_back(static_cast<std::uint8_t>(c));
  end_line(at);
}

void VirtualAdapter::append_number(std::uint64_t number, unsigned base) {
  std::array<std::uint8_t, 20> digits{};
  std::size_t count = 0;
  do {
    digits[count++] = static_cast<std::uint8_t>("0123456789abcdef"[number % base]);
    number /= base;
  } while (number != 0);
  while (count > 0) reply_.push_back(digits[--count]);
}

void VirtualAdapter::end_line(Time at) {
  reply_.push_back(end_of_line);
  reply_at_ = at + usb_time;
  reply_pending_ = true;
}

void VirtualAdapter::answer_samples(Time at) {
  const Time period = clock_period(clock_);
  BitBuffer<biss::sample_capacity> samples;
  if (!supplies()) {
    samples.append(0, 64);
  } else if (format_.carries == Carries::biss) {
    encoder_.sample(at, period, samples);
  } else {
    samples.append(1, 1);
    ssi::encode(format_.ssi, word(at), sample_bits - 1, samples);
  }
  while (samples.size() < sample_bits) samples.append(0, 1);
  reply_ = encode_samples(samples.view().load(0, sample_bits));
  reply_at_ = at + usb_time + period * static_cast<std::int64_t>(sample_bits);
  reply_pending_ = true;
}

Word VirtualAdapter::word(Time at) const { return word_of(format_.word(), shaft_->at(at), encoder_.alarms()); }

// Turns and position as one number of `width_` bits; without supply the line is 0.
std::uint64_t VirtualAdapter::counts(Time at) const {
  if (!supplies()) return 0;
  const Word now = word(at);
  const unsigned bits = format_.word().bits_of(Meaning::position);
  return ((bits < 64 ? now.multiturn << bits : 0) | now.position) & low_mask(width_);
}

// Decimal with sign, hexadecimal as wide as set.
void VirtualAdapter::answer_position(std::uint8_t letter, Time at) {
  const std::uint64_t number = counts(at) - zero_;
  if (letter == command::hexadecimal) {
    append_number(number & low_mask(width_), 16);
  } else {
    const bool negative = zero_ != 0 && static_cast<std::int64_t>(number) < 0;
    if (negative) reply_.push_back('-');
    append_number(negative ? 0 - number : number, 10);
  }
  end_line(at);
}

void VirtualAdapter::violate(std::string_view rule, Time at) {
  violations_.push_back({rule, at});
  ++violation_count_;
}

}  // namespace absenc::e201
