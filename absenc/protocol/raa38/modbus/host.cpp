// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/modbus/host.hpp"

#include "absenc/protocol/raa38/modbus/explain.hpp"
#include "absenc/protocol/raa38/modbus/fields.hpp"

namespace absenc::raa38::rtu {

namespace {

constexpr unsigned most_damaged_answers = 3;

constexpr Explanation too_few_registers{"one register has 16 bits, and the position has more",
                                        "set registers=2, or leave it to bits (registers=auto); check bits"};

}  // namespace

void Procedure::ask(const Request& request, Time pause) {
  request_ = request;
  const bool reads = request.function == function::read || request.function == function::ask_address;
  attempts_left_ = reads ? read_attempts_ : 1;
  doubtful_length_ = 0;
  if (request.function == function::read && request.registers == 1 && format_.bits > 16) {
    return finish(Error::invalid_argument, too_few_registers);
  }
  send(pause);
}

void Procedure::ask_position(std::uint8_t address, Time pause) {
  Request request = read_request(format_);
  request.address = address;
  ask(request, pause);
}

void Procedure::send(Time pause) {
  --attempts_left_;
  Client::ask(encode_request(request_), pause);
}

void Procedure::answered(Bytes reply) {
  if (length_is_doubtful(reply)) {
    if (doubtful_length_ == 0) {
      doubtful_length_ = reply.size();
      return Client::ask(encode_request(request_));
    }
    if (doubtful_length_ != reply.size()) return failed(Error::wrong_length, reply);
  }
  replied(*decode_reply(format_, request_, reply));
}

void Procedure::failed(Error error, Bytes reply) {
  doubtful_length_ = 0;
  reason_ = is_noisy() ? noise_explanation() : explain(request_, error, reply);
  if (attempts_left_ > 0 && error != Error::request_rejected && !is_noisy()) return send({});
  missed(error);
}

Reading Procedure::reading_of(const Reply& reply) const {
  Reading reading;
  reading.singleturn = reply.singleturn;
  reading.singleturn_bits = reading.singleturn_valid_bits = format_.bits;
  // The document does not say when the position is taken; the end of the request is the earliest it can be known.
  reading.latched = sent_at();
  reading.received = received_at();
  return reading;
}

// ---- ReadPosition, ReadDirection

ReadPosition::ReadPosition(const Format& format) : Procedure(format, 1) { ask_position(); }

void ReadPosition::replied(const Reply& reply) {
  reply_ = reply;
  reading_ = reading_of(reply);
  finish();
}

void ReadPosition::report(FieldSink& sink) const {
  if (error() == Error::none) put_fields(sink, format(), reply_);
}

void ReadDirection::replied(const Reply& reply) {
  singleturn_ = reply.singleturn;
  finish();
}

void ReadDirection::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put_text(sink, field_direction, "the encoder does not tell: turn the shaft and see");
  put(sink, field_singleturn, singleturn_);
}

// ---- ReadAddress

ReadAddress::ReadAddress(const Format& format) : Procedure(format, 2) {
  ask({.function = function::ask_address, .address = any_address});
}

void ReadAddress::replied(const Reply& reply) {
  address_ = reply.address;
  finish();
}

void ReadAddress::missed(Error error) {
  if (!asked_all_) return finish(error, reason());
  asked_all_ = false;
  ask_position();
}

void ReadAddress::report(FieldSink& sink) const {
  if (error() == Error::none) put(sink, field_address, address_);
}

// ---- FindBaud

FindBaud::FindBaud(const Format& format) : Procedure(format, 2), found_(format.baud) { ask_position(); }

void FindBaud::replied(const Reply&) { conclude_with(Error::none); }

void FindBaud::missed(Error error) {
  if (is_noisy()) return conclude_with(error, reason());
  if (error == Error::request_rejected) return conclude_with(Error::none);  // it is understood
  if (first_error_ == Error::none) {
    first_error_ = error;
    first_reason_ = reason();
  }
  if (tried_ == format().baud) ++tried_;
  if (tried_ == bauds.size()) {
    if (first_error_ != Error::timeout) return conclude_with(first_error_, first_reason_);
    return conclude_with(Error::timeout, {"nobody answers at this address at any of the five baud rates",
                                          "`absenc scan` asks every address; then check supply and A/B"});
  }
  found_ = tried_++;
  set_rate(bauds[found_]);
  ask_position();
}

void FindBaud::conclude_with(Error error, const Explanation& explanation) {
  if (line().rate != format().line().rate) set_rate(format().line().rate);
  finish(error, explanation);
}

void FindBaud::report(FieldSink& sink) const {
  if (error() == Error::none) put(sink, field_baud, bauds[found_]);
}

// ---- Scan

Scan::Scan(const Format& format, std::uint8_t first, std::uint8_t last)
    : Procedure(format, 1), first_(first), last_(last) {
  if (first > last) {
    finish(Error::invalid_argument, {"the last address is before the first", {}});
    return;
  }
  ask({.function = function::ask_address, .address = any_address});
}

void Scan::add(Addresses& addresses, std::uint8_t address) { addresses[address / 32] |= 1u << address % 32; }

bool Scan::has(const Addresses& addresses, std::uint8_t address) {
  return (addresses[address / 32] >> address % 32 & 1) != 0;
}

void Scan::replied(const Reply& reply) {
  if (phase_ == Phase::ask_all) {
    phase_ = Phase::ask_found;
    address_ = reply.address;
    return ask_position(address_);
  }
  found_any_ = true;
  add(answering_, address_);
  if (phase_ == Phase::ask_found) return finish();
  go_on();
}

void Scan::missed(Error error) {
  if (is_noisy()) return finish(error, reason());
  if (phase_ == Phase::walk && error != Error::timeout) {
    const bool refuses = error == Error::request_rejected;
    if (!refuses && ++damaged_answers_ < most_damaged_answers) return ask_position(address_);
    found_any_ = true;
    add(refuses ? refusing_ : disturbed_, address_);
  }
  go_on();
}

void Scan::go_on() {
  damaged_answers_ = 0;
  if (phase_ != Phase::walk) {
    phase_ = Phase::walk;
    address_ = first_;
  } else if (address_++ == last_) {
    return finish(found_any_ ? Error::none : Error::timeout, {"no address was answered at this baud rate", {}});
  }
  ask_position(address_);
}

void Scan::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  for (unsigned i = modbus::first_address; i <= modbus::last_address; ++i) {
    const auto address = static_cast<std::uint8_t>(i);
    const bool clash = has(disturbed_, address);
    if (!clash && !has(answering_, address) && !has(refusing_, address)) continue;
    put(sink, field_encoder_address, address);
    put(sink, field_clash, clash ? 1 : 0);
    if (has(refusing_, address)) put(sink, field_refuses, 1);
  }
}

}  // namespace absenc::raa38::rtu
