// SPDX-License-Identifier: Apache-2.0
// Any bytes with pauses to the server, and as what the client receives: both end, and take nothing with a wrong CRC.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "absenc/protocol/modbus/client.hpp"
#include "absenc/protocol/modbus/server.hpp"
#include "tests/fuzz_toys.hpp"

namespace {

using namespace absenc;
using namespace absenc::modbus;
using namespace absenc::fuzz;
using Kind = Event<std::uint8_t>::Kind;

constexpr LineSettings line_settings{.rate = 19'200};

class Echoing final : public Server {
 public:
  Echoing() : Server(line_settings) {}
  void raise_alarms(std::uint32_t) override {}
  void lower_alarms(std::uint32_t) override {}
  MutableBytes memory() override { return {}; }
  std::uint32_t memory_version() const override { return 0; }

 private:
  void started() override {}
  void request(Bytes body, Time at, FrameBytes& reply) override {
    require(body.size() >= 2 && body.size() <= frame_capacity - crc_size);
    heed_line(at);
    reply.append(body);
    if ((body[1] & 1) != 0) set_rate(9600);
  }
};

class Reader final : public Client {
 public:
  explicit Reader(std::size_t expected) : Client(line_settings, 50ms), expected_(expected) { ask(hex_request); }
  void report(FieldSink&) const override {}
  bool taken = false;

 private:
  static constexpr std::array<std::uint8_t, 4> hex_request{0xFF, 0xA0, 0x40, 0x38};
  std::size_t expected(Bytes) const override { return expected_; }
  Error check(Bytes bytes) const override {
    return crc_order(bytes) == CrcOrder::low_first ? Error::none : Error::bad_checksum;
  }
  void answered(Bytes bytes) override {
    require(crc_order(bytes) == CrcOrder::low_first);
    taken = true;
    finish();
  }
  void failed(Error error, Bytes bytes) override {
    require(error != Error::none && bytes.size() <= frame_capacity);
    finish(error);
  }

  std::size_t expected_;
};

// 0xF0 to 0xFF after an odd byte stand for a pause.
void ask_server(Bytes input) {
  Echoing server;
  server.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  Time now{};
  for (std::size_t i = 0; i <= input.size(); ++i) {
    now += std::chrono::microseconds(520);
    const bool silence = i == input.size() || (input[i] >= 0xF0 && i > 0 && (input[i - 1] & 1) != 0);
    if (silence) {
      server.feed({.kind = Kind::silence, .at = now});
    } else {
      server.feed({.kind = Kind::received, .at = now, .items = input.subspan(i, 1)});
    }
    auto step = server.next(now);
    if (step.kind == Step<std::uint8_t>::Kind::configure) step = server.next(now);
    if (step.kind != Step<std::uint8_t>::Kind::transfer) continue;
    require(silence && crc_order(step.out) == CrcOrder::low_first);
    server.feed({.kind = Kind::sent, .at = now});
  }
  require(server.answered() <= input.size());
}

void converse(Bytes input, std::size_t piece) {
  Reader reader(5);
  Time now{};
  for (unsigned steps = 0; steps < 10'000; ++steps) {
    const auto step = reader.next(now);
    if (step.kind == Step<std::uint8_t>::Kind::done) {
      require(reader.taken == (reader.error() == Error::none));
      return;
    }
    now += std::chrono::milliseconds(1);
    if (step.kind == Step<std::uint8_t>::Kind::transfer) {
      reader.feed({.kind = Kind::sent, .at = now});
      continue;
    }
    const Bytes part = input.first(std::min(piece, input.size()));
    input = input.subspan(part.size());
    reader.feed({.kind = part.empty() ? Kind::silence : Kind::received, .at = now, .items = part});
  }
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes input(data, size);
  ask_server(input);
  converse(input, 1);
  converse(input, input.size() + 1);
  return 0;
}
