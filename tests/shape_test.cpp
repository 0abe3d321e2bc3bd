// SPDX-License-Identifier: Apache-2.0
// Tests that `Step`, `Event` and `Machine` of link/step.hpp suit every kind of link.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absenc/sim/line.hpp"
#include "absenc/sim/rough_line.hpp"
#include "tests/shape_toys.hpp"

namespace absenc {
namespace {

using sim::NodeRole;
using std::chrono::microseconds;
using toy::Byte;
using ByteToy = toy::Toy<Byte>;
using CanToy = toy::Toy<CanFrame>;
using Kind = Event<Byte>::Kind;

// (a) Request and reply on half duplex; the reply begins 3 us after the request.
struct RequestReply : testing::Test {
  sim::Line<Byte> line{LinkKind::half_duplex, {.rate = 2'500'000}};
  std::vector<Byte> answer{0x1A, 0x00, 0x55};
  // number of bytes of the reply that are still missing after each event of the host, one digit each
  std::string expected_counts;
  std::size_t missing = 3;
  ByteToy device{[this](ByteToy& self, const Event<Byte>& event) {
    if (event.kind == Kind::received) self.send(answer, event.at + microseconds(3));
  }};
  ByteToy host{[this](ByteToy& self, const Event<Byte>& event) {
    if (event.kind == Kind::received) missing -= event.items.size();
    self.idle.expect = missing;
    expected_counts += std::to_string(missing);
    if (missing == 0 || event.kind == Kind::silence) self.finish();
  }};

  void begin(bool with_device) {
    if (with_device) line.attach(NodeRole::device, device);
    host.idle.answer = microseconds(10);
    host.idle.gap = microseconds(6);
    host.send({0x1A});
    EXPECT_TRUE(line.run(line.attach(NodeRole::host, host)));
    // processes the event `sent` of the device, which has the same time as the end of the host's conversation
    line.run_until(line.now());
  }
};

TEST_F(RequestReply, ReportsEachByteWithExactTime) {
  begin(true);
  EXPECT_EQ(host.log, "4000 sent, 11000 received 1A, 15000 received 00, 19000 received 55");
  EXPECT_EQ(device.log, "4000 received 1A, 19000 sent");
  EXPECT_EQ(expected_counts, "3210");
}

TEST_F(RequestReply, ReportsSilenceWithoutReply) {
  begin(false);
  EXPECT_EQ(host.log, "4000 sent, 14000 silence");
}

TEST_F(RequestReply, ReportsSilenceWhenReplyStops) {
  answer.resize(2);
  begin(true);
  EXPECT_EQ(host.log, "4000 sent, 11000 received 1A, 15000 received 00, 21000 silence");
}

TEST_F(RequestReply, WaitsForCharacterThatHasBegun) {
  host.idle.at = microseconds(9);  // the timer expires while a character is being received
  line.attach(NodeRole::device, device);
  host.idle.answer = microseconds(4);
  host.send({0x1A});
  EXPECT_TRUE(line.run(line.attach(NodeRole::host, host)));
  EXPECT_EQ(host.log, "4000 sent, 9000 timer, 11000 received 1A, 15000 received 00, 19000 received 55");
}

// (b) An endless stream: the device sends without requests.
TEST(Stream, EmitsResultsWithoutRequest) {
  sim::Line<Byte> line(LinkKind::full_duplex, {.rate = 1'000'000});
  Byte count = 0;
  ByteToy device([&](ByteToy& self, const Event<Byte>& event) {
    if (event.kind != Kind::sent) return;
    ++count;
    self.send({0xFF, count, 0x81}, microseconds(100) * (count + 1));
  });
  device.send({0xFF, 0, 0x81}, microseconds(100));
  std::vector<Byte> frame;
  ByteToy host([&](ByteToy& self, const Event<Byte>& event) {
    if (event.kind != Kind::received) return;
    frame.insert(frame.end(), event.items.begin(), event.items.end());
    if (frame.size() == 3) self.emit();
  });
  host.idle.gap = microseconds(50);
  std::vector<Byte> results;
  line.attach(NodeRole::device, device);
  const auto node = line.attach(NodeRole::host, host, [&] {
    results.push_back(frame[1]);
    frame.clear();
    return results.size() < 3;
  });
  EXPECT_TRUE(line.run(node));
  EXPECT_EQ(results, (std::vector<Byte>{0, 1, 2}));
  EXPECT_EQ(line.now(), microseconds(330));
  EXPECT_NE(host.log.find("130000 received 81, 180000 silence, 210000 received FF"), std::string::npos) << host.log;
}

// (c) Full-duplex SPI as in EncoLink: each frame carries a position and one register byte.
class SpiDevice final : public Machine<Byte> {
 public:
  void feed(const Event<Byte>& event) override {
    if (event.kind == Kind::selected) {
      // The position is the time in microseconds at which the chip was selected.
      const auto position = static_cast<Byte>(event.at / microseconds(1));
      frame_ = {position, static_cast<Byte>(~position), register_byte_};
      selected_ = true;
    } else if (event.kind == Kind::received) {
      receive_byte(event.items[1]);
    }
  }
  Step<Byte> next(Time) override {
    if (!std::exchange(selected_, false)) return {};
    return {.kind = Step<Byte>::Kind::transfer, .out = frame_};
  }

 private:
  void receive_byte(Byte request) {
    if (register_byte_ == 0x88) {
      register_byte_ = static_cast<Byte>(address_ + 0x40);  // value of the register: its address plus 0x40
    } else if (previous_ == 0xCD) {
      address_ = request;
      register_byte_ = 0x88;  // code for "read ready"
    } else {
      register_byte_ = 0x33;  // code for "idle"
    }
    previous_ = register_byte_ == 0x33 ? request : Byte{0};
  }
  std::vector<Byte> frame_;
  bool selected_ = false;
  Byte register_byte_ = 0x33;
  Byte previous_ = 0;
  Byte address_ = 0;
};

class SpiHost final : public Machine<Byte> {
 public:
  void read_register(Byte address) { requests_ = {0xCD, address}; }
  void feed(const Event<Byte>& event) override {
    if (event.kind != Kind::received) return;
    position = event.items[0];
    good = event.items[1] == static_cast<Byte>(~position) && event.items.size() == 3;
    if (value_next_) value = event.items[2];
    value_next_ = event.items[2] == 0x88;
    result_ = true;
    frame_at_ += microseconds(50);
    due_ = true;
  }
  Step<Byte> next(Time) override {
    if (std::exchange(result_, false)) return {.kind = Step<Byte>::Kind::emit};
    if (!std::exchange(due_, false)) return {};
    out_ = {0x00, 0x00};
    if (!requests_.empty()) {
      out_[1] = requests_.front();
      requests_.pop_front();
    }
    return {.kind = Step<Byte>::Kind::transfer, .out = out_, .expect = 3, .at = frame_at_};
  }
  Byte position = 0;
  bool good = false;
  int value = -1;

 private:
  std::deque<Byte> requests_;
  std::vector<Byte> out_;
  Time frame_at_{};
  bool due_ = true;
  bool result_ = false;
  bool value_next_ = false;
};

TEST(Spi, ReadsRegisterWithinPositionFrames) {
  sim::Line<Byte> line(LinkKind::spi, {.rate = 1'000'000, .spi_mode = 1});
  SpiDevice device;
  SpiHost host;
  std::string results;
  line.attach(NodeRole::device, device);
  const auto node = line.attach(NodeRole::host, host, [&] {
    if (host.position == 50) host.read_register(0x4C);  // requests a register, while the stream of positions continues
    results += std::to_string(line.now().count()) + (host.good ? " good " : " bad ") + std::to_string(host.position) +
               ' ' + std::to_string(host.value) + '\n';
    return host.value < 0;
  });
  EXPECT_TRUE(line.run(node));
  EXPECT_EQ(results,
            "24000 good 0 -1\n74000 good 50 -1\n124000 good 100 -1\n174000 good 150 -1\n224000 good 200 -1\n"
            "274000 good 250 140\n");
}

// (d) Clocked bits: SSI at 250 kHz with a word of 13 bits. 0x1234 left-aligned is 91 A0.
struct Clocked : testing::Test {
  sim::Line<Byte> line{LinkKind::clocked, {.rate = 250'000}};
  std::string notes;
  ByteToy device{[this](ByteToy& self, const Event<Byte>& event) {
    // bits that the device sends: its word of 13 bits, the word again, then ones
    if (event.kind == Kind::selected) self.send({0x91, 0xA4, 0x8D, 0x3F});
    if (event.kind == Kind::sent && event.bits < 13) notes += "too few clocks: " + std::to_string(event.bits);
  }};
  ByteToy host{[](ByteToy& self, const Event<Byte>& event) {
    if (event.kind == Kind::received) self.finish();
  }};

  void clock(std::size_t bits) {
    line.attach(NodeRole::device, device);
    host.send({}, microseconds(1), bits);
    EXPECT_TRUE(line.run(line.attach(NodeRole::host, host)));
  }
};

TEST_F(Clocked, PacksWordMsbFirstLeftAligned) {
  clock(13);
  EXPECT_EQ(host.log, "53000 sent, 53000 received 91 A0");
  EXPECT_EQ(device.log, "1000 selected 4000, 53000 sent 13");
  EXPECT_EQ(notes, "");
}

TEST_F(Clocked, RepeatsWordWithMoreClocks) {
  clock(26);
  EXPECT_EQ(host.log, "105000 sent, 105000 received 91 A4 8D 00");
}

TEST_F(Clocked, ReportsTooFewClocksToDevice) {
  clock(8);
  EXPECT_EQ(host.log, "33000 sent, 33000 received 91");
  EXPECT_EQ(notes, "too few clocks: 8");
}

// (e) A data line that turns, at 250 kHz: after the host's bits 0x2D the encoder sends its own.
struct ClockedBothWays : testing::Test {
  sim::Line<Byte> line{LinkKind::clocked_bidirectional, {.rate = 250'000}};
  ByteToy device{[](ByteToy& self, const Event<Byte>& event) {
    if (event.kind == Kind::received) self.send({event.items[0] == 0x2D ? Byte{0x91} : Byte{0x0F}, 0xA4});
  }};
  ByteToy host;

  void run() {
    line.attach(NodeRole::device, device);
    EXPECT_TRUE(line.run(line.attach(NodeRole::host, host)));
  }
  void finish_after(int received) {
    host = ByteToy([received, count = 0](ByteToy& self, const Event<Byte>& event) mutable {
      if (event.kind == Kind::received && ++count == received) self.finish();
    });
  }
};

TEST_F(ClockedBothWays, EncoderSendsInTheClocksThatTheHostLeaves) {
  finish_after(1);
  host.exchange({0x2D}, 8, 20, false, microseconds(1));
  run();
  EXPECT_EQ(device.log, "1000 selected 4000, 33000 received 2D 8, 81000 sent 20");
  EXPECT_EQ(host.log, "81000 sent, 81000 received 91 A0 12");
}

TEST_F(ClockedBothWays, LineIsHighWhereNobodyDrivesIt) {
  finish_after(1);
  host.exchange({0x2D}, 8, 26, false, microseconds(1));
  run();
  EXPECT_EQ(host.log, "105000 sent, 105000 received 91 A4 C0 18");
}

TEST_F(ClockedBothWays, ExchangeGoesOnWhileClockRestsLow) {
  host = ByteToy([count = 0](ByteToy& self, const Event<Byte>& event) mutable {
    if (event.kind != Kind::received) return;
    if (++count == 1) self.exchange({}, 0, 4, true, microseconds(100));
    if (count == 2) self.exchange({0xC0}, 3, 7);
    if (count == 3) self.finish();
  });
  host.exchange({0x2D}, 8, 12, true, microseconds(1));
  run();
  EXPECT_EQ(device.log, "1000 selected 4000, 33000 received 2D 8, 128000 received C0 3, 144000 sent 23");
  EXPECT_EQ(host.log,
            "49000 sent, 49000 received 90 4, 116000 sent, 116000 received 10 4, 144000 sent, 144000 received 00 4");
}

TEST_F(ClockedBothWays, RoughLineCarriesTheSame) {
  sim::RoughLine<Byte> rough(LinkKind::clocked_bidirectional, {.rate = 250'000}, device, 1);
  const std::vector<Byte> out{0x2D};
  const auto next_received = [&] {
    for (;;) {
      const Event<Byte> event = rough.wait({});
      if (event.kind == Kind::received) return toy::text_of(event.items[0]) + ' ' + std::to_string(event.bits);
    }
  };
  rough.begin({.kind = ByteStep::Kind::transfer, .goes_on = true, .out = out, .bits = 12, .out_bits = 8});
  EXPECT_EQ(next_received(), "90 4");
  rough.begin({.kind = ByteStep::Kind::transfer, .bits = 4});
  EXPECT_EQ(next_received(), "10 4");
  EXPECT_EQ(device.log, "0 selected 4000, 32000 received 2D 8, 64000 sent 16");
}

// (f) CAN at 250 kbit/s: 47 bits for a standard frame, 8 for each data byte, and stuff bits.
struct Can : testing::Test {
  sim::Line<CanFrame> line{LinkKind::can, {.rate = 250'000}};
  static CanFrame frame(std::uint32_t id, Byte data) { return {.id = id, .size = 1, .data = {data}}; }
  // A node that receives the command 01 and then sends a frame every millisecond.
  static CanToy::React cyclic(std::uint32_t id, Byte data) {
    return [=, at = Time{}](CanToy& self, const Event<CanFrame>& event) mutable {
      if (event.kind == CanToy::Kind::received && event.items[0].data[0] == 0x01) {
        at = event.at;
      } else if (event.kind != CanToy::Kind::sent) {
        return;
      }
      at += microseconds(1000);
      self.send({frame(id, data)}, at);
    };
  }
};

TEST_F(Can, ArbitratesCyclicFramesByIdentifier) {
  CanToy high(cyclic(0x121, 0xB0));
  // the frame of `low` begins at the same nanosecond as that of `high`, and wins the arbitration
  CanToy low(cyclic(0x120, 0xA0));
  CanToy host;
  host.send({frame(0x200, 0x01)});
  line.attach(NodeRole::device, high);
  line.attach(NodeRole::device, low);
  line.attach(NodeRole::host, host);
  line.run_until(microseconds(2500));
  EXPECT_EQ(host.log, "240000 sent, 1472000 received 120:A0, 1696000 received 121:B0, 2472000 received 120:A0");
  EXPECT_EQ(low.log, "240000 received 200:01, 1472000 sent, 1696000 received 121:B0, 2472000 sent");
  EXPECT_EQ(high.log, "240000 received 200:01, 1472000 received 120:A0, 1696000 sent, 2472000 received 120:A0");
}

TEST_F(Can, ReportsErrorForSameIdentifierWithOtherData) {
  CanToy one(cyclic(0x120, 0xA0));
  CanToy two(cyclic(0x120, 0xA1));
  CanToy host;
  host.send({frame(0x200, 0x01)});
  for (CanToy* device : {&one, &two}) line.attach(NodeRole::device, *device);
  line.attach(NodeRole::host, host);
  line.run_until(microseconds(2000));
  EXPECT_EQ(host.log, "240000 sent, 1472000 error");
  for (CanToy* device : {&one, &two}) EXPECT_EQ(device->log, "240000 received 200:01, 1472000 error, 1472000 sent");
}

TEST_F(Can, StandardFrameWinsOverExtendedFrameWithSamePrefix) {
  CanToy extended;
  extended.send({CanFrame{.id = 0x120u << 18, .extended = true}}, microseconds(10));
  CanToy standard;
  standard.send({frame(0x120, 0xA0)}, microseconds(10));
  line.attach(NodeRole::device, extended);
  line.attach(NodeRole::device, standard);
  line.run_until(microseconds(1000));
  EXPECT_EQ(standard.log, "242000 sent, 534000 received 04800000:");
}

// (g) A pulse on a separate wire requests each frame.
TEST(Trigger, RequestsEachFrameWithLongEnoughPulse) {
  sim::Line<Byte> line(LinkKind::half_duplex, {.rate = 1'000'000});
  ByteToy device([](ByteToy& self, const Event<Byte>& event) {
    if (event.kind == Kind::triggered && event.width >= microseconds(10))
      self.send({0xFF}, event.at + microseconds(30));
  });
  const auto pulse = [](ByteToy& toy, Time at, Time width) {
    toy.push({.kind = Step<Byte>::Kind::pulse, .wire = ExtraWire::trigger, .at = at, .width = width});
  };
  ByteToy host([&](ByteToy& self, const Event<Byte>& event) {
    // A pulse of 9 us, which is too short: the device needs 10 us.
    if (event.kind == Kind::received) pulse(self, event.at + microseconds(60), microseconds(9));
    if (event.kind == Kind::silence) self.finish();
  });
  host.idle.answer = microseconds(40);
  pulse(host, Time{}, microseconds(10));
  line.attach(NodeRole::device, device);
  EXPECT_TRUE(line.run(line.attach(NodeRole::host, host)));
  EXPECT_EQ(host.log, "10000 sent, 40000 received FF, 109000 sent, 149000 silence");
  EXPECT_EQ(device.log, "0 triggered 10000, 40000 sent, 100000 triggered 9000");
}

// (h) Change of the baud rate during the conversation, after the reply to command 19.
struct BaudChange : testing::Test {
  static constexpr LineSettings fast{.rate = 2'000'000};
  sim::Line<Byte> line{LinkKind::half_duplex, {.rate = 1'000'000}};
  bool changed = false;
  ByteToy device{[this](ByteToy& self, const Event<Byte>& event) {
    if (event.kind == Kind::received) self.send({event.items[0]}, event.at + microseconds(5));
    if (event.kind == Kind::line_error) self.send({0xEE}, event.at + microseconds(5));
    if (event.kind == Kind::sent && !std::exchange(changed, true)) configure(self);
  }};
  static void configure(ByteToy& toy) { toy.push({.kind = Step<Byte>::Kind::configure, .rate = fast.rate}); }

  std::string talk(bool host_follows) {
    ByteToy host([=](ByteToy& self, const Event<Byte>& event) {
      if (event.kind == Kind::sent) return;
      if (event.kind != Kind::received || event.items[0] != 0x19) return self.finish();
      if (host_follows) configure(self);
      self.send({0x01}, event.at + microseconds(5));
    });
    host.send({0x19});
    line.attach(NodeRole::device, device);
    EXPECT_TRUE(line.run(line.attach(NodeRole::host, host)));
    return host.log;
  }
};

TEST_F(BaudChange, ContinuesIfBothEndsFollow) {
  EXPECT_EQ(talk(true), "10000 sent, 25000 received 19, 35000 sent, 45000 received 01");
}

TEST_F(BaudChange, KeepsParityAndStopBits) {
  const LineSettings with_parity{.rate = 1'000'000, .parity = Parity::odd, .stop_bits = 2};
  sim::Line<Byte> parity_line{LinkKind::half_duplex, with_parity};
  ByteToy follows([this](ByteToy& self, const Event<Byte>& event) {
    if (event.kind != Kind::sent || std::exchange(changed, true)) return;
    configure(self);
    self.send({0x01}, event.at);
  });
  ByteToy listens([](ByteToy&, const Event<Byte>&) {});
  configure(listens);
  follows.send({0x19});
  parity_line.attach(NodeRole::device, listens);
  parity_line.attach(NodeRole::host, follows);
  parity_line.run_until(microseconds(100));
  EXPECT_EQ(listens.log, "12000 error, 18000 received 01");
}

TEST_F(BaudChange, ReportsLineErrorsIfHostDoesNotFollow) {
  EXPECT_EQ(talk(false), "10000 sent, 25000 received 19, 40000 sent, 50000 error");
  EXPECT_EQ(device.log, "10000 received 19, 25000 sent, 40000 error");
}

// (i) Collisions: the wire carries the AND of the bits of all senders.
struct Collision : testing::Test {
  sim::Line<Byte> line{LinkKind::half_duplex, {.rate = 1'000'000}};
  static ByteToy::React answer(std::vector<Byte> bytes, Time delay) {
    return [=](ByteToy& self, const Event<Byte>& event) {
      if (event.kind == Kind::received && event.items[0] == 0x1A) self.send(bytes, event.at + delay);
    };
  }
  std::string ask(ByteToy::React one, ByteToy::React two, bool echo) {
    ByteToy first(one);
    ByteToy second(two);
    ByteToy host;
    host.send({0x1A}, microseconds(1));
    line.attach(NodeRole::device, first);
    line.attach(NodeRole::device, second);
    line.set_echo(line.attach(NodeRole::host, host), echo);
    line.run_until(microseconds(100));
    return host.log;
  }
};

TEST_F(Collision, DeliversBitwiseAnd) {
  EXPECT_EQ(ask(answer({0xF3, 0x0F}, microseconds(3)), answer({0x35}, microseconds(3)), false),
            "11000 sent, 24000 received 31, 34000 received 0F");
}

TEST_F(Collision, DeliversAndOfPartlyOverlappingCharacters) {
  EXPECT_EQ(ask(answer({0xF3, 0x7E}, microseconds(3)), answer({0x3D}, microseconds(7)), false),
            "11000 sent, 24000 received 31, 34000 received 3C");
}

TEST_F(Collision, DeliversEchoBeforeSent) {
  EXPECT_EQ(ask(answer({0x07}, microseconds(3)), {}, true), "11000 received 1A, 11000 sent, 24000 received 07");
}

TEST_F(Collision, DeviceReceivesWhileSending) {
  ByteToy device(answer({0x01, 0x02, 0x03}, microseconds(3)));
  ByteToy host([](ByteToy& self, const Event<Byte>& event) {
    if (event.kind == Kind::received && event.items[0] == 0x01) self.send({0x77}, event.at + microseconds(4));
  });
  host.send({0x1A});
  line.attach(NodeRole::device, device);
  line.attach(NodeRole::host, host);
  line.run_until(microseconds(60));
  EXPECT_EQ(device.log, "10000 received 1A, 37000 received 02, 43000 sent");
}

TEST_F(Collision, RejectsTransferDuringTransfer) {
  ByteToy host;
  host.send({0x01});
  host.send({0x02});
  EXPECT_THROW(line.attach(NodeRole::host, host), std::logic_error);
}

}  // namespace
}  // namespace absenc
