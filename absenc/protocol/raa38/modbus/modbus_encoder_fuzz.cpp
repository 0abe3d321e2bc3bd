// SPDX-License-Identifier: Apache-2.0
// Any bytes as request and reply of the decoder, as what the host's conversations receive, and as what the encoder
// hears.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "absenc/protocol/raa38/modbus/explain.hpp"
#include "absenc/protocol/raa38/modbus/fields.hpp"
#include "absenc/protocol/raa38/modbus/options.hpp"
#include "absenc/protocol/raa38/modbus/probe.hpp"
#include "absenc/protocol/raa38/modbus/settings.hpp"
#include "tests/fuzz_toys.hpp"

namespace {

using namespace absenc;
using namespace absenc::raa38::rtu;
using namespace absenc::fuzz;
using Kind = Event<std::uint8_t>::Kind;

const Format formats[]{{}, {.bits = 21}, {.bits = 14, .registers = 2}};

// Every split of the input into request and reply; an error puts no field and has its words.
void decode_all_splits(const Format& format, Bytes input) {
  for (std::size_t split = 0; split <= input.size() && split <= RequestBytes::capacity(); ++split) {
    const Bytes request = input.first(split);
    const Bytes reply = input.subspan(split);
    Counting sink;
    const Error error = decode(format, request, reply, sink);
    require((error == Error::none) == (sink.count > 0));
    const Result<Request> asked = request.empty() ? assumed_request(format, reply) : decode_request(request);
    const bool of_reply = asked && !reply.empty();
    static_cast<void>(of_reply ? explain(*asked, error, reply) : explain_request(error, request));
  }
}

// What passes as a reply to a reading is within its bits.
void decode_reading(const Format& format, Bytes input) {
  const Result<Reply> reply = decode_reply(format, read_request(format), input);
  if (!reply) return;
  require(reply->singleturn >> format.bits == 0);
  require(modbus::crc_order(input) == CrcOrder::low_first);
}

// Whatever comes back, at once or byte by byte, a conversation ends, and with a result only without an error.
template <class Conversation>
void converse(Conversation conversation, Bytes input, std::size_t piece) {
  Time now{};
  Bytes left{};  // of the input, to the request that was sent last
  for (unsigned steps = 0; steps < 20'000; ++steps) {
    now += std::chrono::milliseconds(1);
    const auto step = conversation.next(now);
    if (step.kind == Step<std::uint8_t>::Kind::done) {
      Counting sink;
      conversation.report(sink);
      require(conversation.error() == Error::none || (sink.count == 0 && conversation.reading() == nullptr));
      return;
    }
    if (step.kind == Step<std::uint8_t>::Kind::transfer) {
      require(modbus::crc_order(step.out) == CrcOrder::low_first);
      conversation.feed({.kind = Kind::sent, .at = now});
      left = input;
    } else if (step.kind == Step<std::uint8_t>::Kind::wait) {
      const Bytes part = left.first(std::min(piece, left.size()));
      left = left.subspan(part.size());
      conversation.feed({.kind = part.empty() ? Kind::silence : Kind::received, .at = now, .items = part});
    }
  }
  std::abort();
}

// 0xF0 to 0xFF after an odd byte stand for a pause.
void ask_encoder(const Format& format, Data data, Bytes input) {
  const Still still;
  VirtualEncoder encoder(format, still, data);
  encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  Time now{};
  for (std::size_t i = 0; i <= input.size(); ++i) {
    now += std::chrono::microseconds(520);
    const bool silence = i == input.size() || (input[i] >= 0xF0 && i > 0 && (input[i - 1] & 1) != 0);
    if (silence) {
      encoder.feed({.kind = Kind::silence, .at = now});
    } else {
      encoder.feed({.kind = Kind::received, .at = now, .items = input.subspan(i, 1)});
    }
    auto step = encoder.next(now);
    if (step.kind == Step<std::uint8_t>::Kind::configure) step = encoder.next(now);
    require(encoder.address() >= 1 && encoder.address() <= 247 && baud_index(encoder.baud()).has_value());
    if (step.kind != Step<std::uint8_t>::Kind::transfer) continue;
    require(step.out.size() <= 9 && modbus::crc_order(step.out) == CrcOrder::low_first);
    encoder.feed({.kind = Kind::sent, .at = now});
  }
}

struct Nowhere final : EvidenceSink {
  void put(const OptionEvidence&) override {}
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes input(data, size);
  for (const Format& format : formats) {
    decode_all_splits(format, input);
    decode_reading(format, input);
    ask_encoder(format, Data::three_as_four, input);
    for (const std::size_t piece : {std::size_t{1}, size + 1}) {
      converse(ReadPosition(format), input, piece);
      converse(SetBaud(format, 9600), input, piece);
      converse(SetAddress(format, 2), input, piece);
      converse(Zero(format, Wear::accept), input, piece);
    }
  }
  converse(ReadAddress({}), input, 1);
  converse(FindBaud({}), input, 2);
  converse(Scan({}, 1, 20), input, size + 1);
  Options values;
  for (std::size_t i = 0; i < options.size(); ++i) values.values[i] = options[i].default_value;
  Nowhere nowhere;
  const Capture captures[]{{{}, input}, {input, {}}};
  probe(values, captures, nowhere);
  return 0;
}
