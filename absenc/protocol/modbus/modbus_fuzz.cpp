// SPDX-License-Identifier: Apache-2.0
// Fuzz test of a Modbus server: sends any bytes with pauses.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

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
    check_line_rules(at);
    reply.append(body);
    if ((body[1] & 1) != 0) set_rate(9600);
  }
};

// Feeds the input, of which some bytes stand for pauses, to a server.
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
  require(server.answer_count() <= input.size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ask_server({data, size});
  return 0;
}
