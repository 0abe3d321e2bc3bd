// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/modbus/settings.hpp"

#include "absenc/protocol/raa38/modbus/fields.hpp"

namespace absenc::raa38::rtu {

namespace {

constexpr unsigned attempts_in_procedures = 3;
constexpr Time memory_time = 20ms;    // for the encoder to keep a setting; the document gives none
constexpr Time between_looks = 20ms;  // two positions that far apart show whether the shaft turns

constexpr std::int64_t distance(std::uint32_t to, std::uint32_t from, unsigned bits) {
  const std::int64_t difference = wrapped_difference(to, from, bits);
  return difference < 0 ? -difference : difference;
}

// What a shaft at rest may tremble: 0.02 degrees, one count at least.
constexpr std::int64_t noise(unsigned bits) { return bits > 14 ? std::int64_t{1} << (bits - 14) : 1; }

// The document says nothing of how exact the zero is: 0.35 degrees.
constexpr std::int64_t zero_tolerance(unsigned bits) { return std::int64_t{1} << (bits - 10); }

constexpr Request setting(const Format& format, std::uint8_t value) {
  return {.function = function::set_parameter, .address = format.address, .value = value};
}

constexpr Explanation lost_encoder{
    "the setting was sent, and now the encoder answers neither as before nor as it should",
    "switch the encoder off and on, then find it: `absenc config get ... baud`, `absenc scan`; do not send it again "
    "blindly, its memory wears out"};

}  // namespace

// ---- SetAddress

SetAddress::SetAddress(const Format& format, std::uint8_t address, Wear wear)
    : Procedure(format, attempts_in_procedures), address_(address), wear_(wear) {
  ask_position();
}

void SetAddress::replied(const Reply&) {
  switch (phase_) {
    case Phase::look:
      if (address_ == format().address) return wear_ == Wear::avoid ? finish() : write();
      phase_ = Phase::is_free;
      return ask_position(address_);
    case Phase::is_free:
      return finish(Error::invalid_argument,
                    {"somebody answers at that address already, and two with one address cannot be told apart; nothing "
                     "was sent",
                     "choose another address: `absenc scan` shows those in use"});
    case Phase::write:
      return verify();
    case Phase::verify:
      return finish();
    case Phase::look_back:
      return finish(Error::cross_check_failed,
                    {"the encoder answers at its old address still: it did not take the new one",
                     "try once more, not often: each time may wear its memory"});
  }
}

void SetAddress::missed(Error error) {
  switch (phase_) {
    case Phase::look:
      return finish(error, reason());
    case Phase::is_free:
      if (error == Error::timeout) return write();
      return finish(Error::invalid_argument, {"something answers at that address, though not well; nothing was sent",
                                              "choose another address: `absenc scan` shows those in use"});
    case Phase::write:
      // A lost reply does not tell whether it was done: asking does.
      if (error == Error::request_rejected) return finish(error, reason());
      return verify();
    case Phase::verify:
      phase_ = Phase::look_back;
      return ask_position();
    case Phase::look_back:
      return finish(error, lost_encoder);
  }
}

void SetAddress::write() {
  phase_ = Phase::write;
  written_ = true;
  ask({.function = function::set_address, .address = format().address, .value = address_});
}

void SetAddress::verify() {
  phase_ = Phase::verify;
  ask_position(address_, memory_time);
}

void SetAddress::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put(sink, field_address, address_);
  put(sink, field_written, written_ ? 1 : 0);
}

// ---- SetBaud

SetBaud::SetBaud(const Format& format, std::uint32_t baud, Wear wear)
    : Procedure(format, attempts_in_procedures), baud_(baud_index(baud).value_or(bauds.size())), wear_(wear) {
  if (baud_ == bauds.size()) {
    finish(Error::invalid_argument,
           {"the encoder does not have this baud rate", "it has 2400, 4800, 9600, 19200 and 57600"});
    return;
  }
  set_rate(line().rate);  // a port that cannot change its rate must say so before the encoder has
  ask_position();
}

void SetBaud::replied(const Reply&) {
  switch (phase_) {
    case Phase::look:
      if (baud_ == format().baud && wear_ == Wear::avoid) return finish();
      phase_ = Phase::write;
      written_ = true;
      return ask(setting(format(), baud_parameters[baud_]));
    case Phase::write:
      return verify();
    case Phase::verify:
      return finish();
    case Phase::look_back:
      return finish(Error::cross_check_failed,
                    {"the encoder answers at its old baud rate still: it did not take the new one",
                     "try once more, not often: each time may wear its memory"});
  }
}

void SetBaud::missed(Error error) {
  switch (phase_) {
    case Phase::look:
      return finish(error, reason());
    case Phase::write:
      return verify();  // its reply may have come at the new rate
    case Phase::verify:
      phase_ = Phase::look_back;
      set_rate(format().line().rate);
      return ask_position();
    case Phase::look_back:
      return finish(error, lost_encoder);
  }
}

void SetBaud::verify() {
  phase_ = Phase::verify;
  set_rate(bauds[baud_]);
  ask_position(format().address, memory_time);
}

void SetBaud::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put(sink, field_baud, bauds[baud_]);
  put(sink, field_written, written_ ? 1 : 0);
}

// ---- SetDirection

SetDirection::SetDirection(const Format& format, std::uint8_t value)
    : Procedure(format, attempts_in_procedures), value_(value) {
  ask_position();
}

void SetDirection::replied(const Reply& reply) {
  switch (phase_) {
    case Phase::look:
      before_ = reply.singleturn;
      phase_ = Phase::write;
      return ask(setting(format(), value_));
    case Phase::write:
      phase_ = Phase::look_again;
      return ask_position(format().address, memory_time);
    case Phase::look_again:
      after_ = reply.singleturn;
      return finish();
  }
}

void SetDirection::missed(Error error) {
  if (phase_ == Phase::look) return finish(error, reason());
  if (phase_ == Phase::look_again) {
    return finish(error,
                  {"the encoder has taken the direction, but then its position could not be read", reason().advice});
  }
  finish(error, {"the direction was sent, but its echo did not come, and nothing else tells whether it was taken",
                 "turn the shaft and see how the position moves before you send it again: its memory wears out"});
}

void SetDirection::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  const unsigned bits = format().bits;
  const auto mirrored = static_cast<std::uint32_t>((0u - before_) & low_mask(bits));
  put_setting(sink, value_);
  put(sink, field_written, 1);
  if (distance(after_, before_, bits) <= noise(bits)) {
    put_text(sink, field_effect, "as before: it counted so already, or it stands at 0 or half a turn");
  } else if (distance(after_, mirrored, bits) <= noise(bits)) {
    put_text(sink, field_effect, "mirrored: the direction has changed");
  } else {
    put_text(sink, field_effect, "neither as before nor mirrored: was the shaft turning?");
  }
}

// ---- Zero

Zero::Zero(const Format& format, Wear wear) : Procedure(format, attempts_in_procedures), wear_(wear) { ask_position(); }

void Zero::replied(const Reply& reply) {
  reading_ = reading_of(reply);
  switch (phase_) {
    case Phase::first_look:
      before_ = reply.singleturn;
      phase_ = Phase::second_look;
      return ask_position(format().address, between_looks);
    case Phase::second_look:
      return second_look(reply);
    case Phase::write:
      return verify();
    case Phase::verify:
      if (distance(reply.singleturn, 0, format().bits) <= zero_tolerance(format().bits)) return finish();
      return finish(Error::cross_check_failed, {"the position is still not zero",
                                                "does the shaft turn? Try once more, not often: its memory wears"});
  }
}

void Zero::second_look(const Reply& reply) {
  if (distance(reply.singleturn, before_, format().bits) > noise(format().bits)) {
    return finish(
        Error::invalid_argument,
        {"the shaft is turning: setting the zero needs it standing still; nothing was sent", "stop the shaft"});
  }
  if (reply.singleturn == 0 && wear_ == Wear::avoid) return finish();
  phase_ = Phase::write;
  written_ = true;
  ask(setting(format(), parameter::zero));
}

void Zero::missed(Error error) {
  if (phase_ == Phase::write) return verify();  // it may have been done all the same
  if (phase_ == Phase::verify) {
    return finish(error, {"the zero was sent, but then the position could not be read", reason().advice});
  }
  finish(error, reason());
}

void Zero::verify() {
  phase_ = Phase::verify;
  ask_position(format().address, memory_time);
}

void Zero::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put_position(sink, format(), static_cast<std::uint32_t>(reading_.singleturn));
  put(sink, field_written, written_ ? 1 : 0);
}

}  // namespace absenc::raa38::rtu
