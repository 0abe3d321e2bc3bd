// SPDX-License-Identifier: Apache-2.0
// Control frames: decoding, and host and encoders against each other, frame by frame.
#include "absenc/protocol/biss/control.hpp"

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "absenc/sim/random.hpp"

namespace absenc::biss {
namespace {

using Operation = ControlRequest::Operation;

struct BitText {
  explicit BitText(std::string_view text) {
    for (const char c : text) bits.append(c == '1' ? 1 : 0, 1);
  }
  BitBuffer<1024> bits;
};

Result<ControlFrame> decoded(std::string_view cdm, std::string_view cds) {
  return decode_control(BitText(cdm).bits.view(), BitText(cds).bits.view());
}

// CDM and CDS bits of a register read, from a table of Texas Instruments (TI).
constexpr std::string_view read_44 = "0000000000000011000100010011011010000000000000000";
constexpr std::string_view read_44_answer = "0000000000000001000000000000000101000010100010000";

TEST(BissControl, DecodesRegisterRead) {
  const Result<ControlFrame> frame = decoded(read_44, read_44_answer);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->request, (ControlRequest{.operation = Operation::read, .slave = 0, .address = 0x44}));
  EXPECT_EQ(frame->slaves, 1);
  ASSERT_EQ(frame->data.size(), 1u);
  EXPECT_EQ(frame->data[0], 10);
  EXPECT_TRUE(frame->next_address_accepted);
}

std::string cdm_of(const ControlMaster& master) {
  BitBuffer<1024> bits;
  append_cdm(master, control_slaves, bits);
  std::string text;
  for (std::size_t i = 0; i < bits.size(); ++i) text += bits.view()[i] ? '1' : '0';
  return text;
}

// Compares the CDM bits that are sent with those drawn in the document, up to the last 1 drawn there. After it at least
// 14 zeros and no 1 must follow.
TEST(BissControl, EncodesRequestsOfTheDocument) {
  const auto expect = [](const ControlMaster& master, std::string_view drawn) {
    const std::string cdm = cdm_of(master);
    const std::size_t end = drawn.rfind('1') + 1;
    EXPECT_EQ(cdm.substr(0, end), drawn.substr(0, end));
    EXPECT_EQ(cdm.find('1', end), std::string::npos);
    EXPECT_GE(cdm.size(), end + control_pause);
  };
  ControlMaster master;
  master.read(0, 0x44, 1);
  expect(master, read_44);
  master.read(0, 0x44, 3);
  expect(master, "00000000000000110001000100110110100000000000001000000000000010000000000000000");
  master.write(0, 0x48, std::array<std::uint8_t, 1>{0x55});
  expect(master, "0000000000000011000100100010100110101010100100000");
  master.write(0, 0x48, std::array<std::uint8_t, 2>{1, 2});
  expect(master, "000000000000001100010010001010011000000011100010000001010010000");
  master.command(1, 3);
  expect(master, "0000000000000010100000001101111000000010");
  master.command(0, 0);
  expect(master, "0000000000000010000000000011111100");
}

TEST(BissControl, DecodesWrittenDataFromCdmAlone) {
  const auto written = [](std::string_view cdm) {
    const Result<ControlFrame> frame = decoded(cdm, "");
    const Bytes data = frame->data.view();
    return std::vector<unsigned>(data.begin(), data.end());
  };
  EXPECT_EQ(written("0000000000000011000100100010100110101010100100000"), (std::vector<unsigned>{0x55}));
  // The host sends the second start bit three times, because the encoder was late.
  EXPECT_EQ(written("00000000000000110001001000101001100000001110001110000001010010000"),
            (std::vector<unsigned>{1, 2}));
  EXPECT_TRUE(written(read_44).empty());
  EXPECT_EQ(decoded("0000000000000011000100100010100110101010", "").error(), Error::truncated);
  EXPECT_EQ(decoded("0000000000000011000100100010100110101011100100000", "").error(), Error::bad_checksum);
}

TEST(BissControl, DetectsEachFlippedBitOfAnAnswer) {
  // Flips one bit of CDS at a time, each from the encoder's answer to the bit R (read) to the CRC of the data byte.
  for (std::size_t i = 14 + 17; i < 14 + 32; ++i) {
    std::string cds(read_44_answer);
    cds[i] = cds[i] == '1' ? '0' : '1';
    const Result<ControlFrame> frame = decoded(read_44, cds);
    EXPECT_FALSE(frame && frame->data[0] == 10 && frame->start_delay[0] == 0) << i;
    EXPECT_FALSE(frame && frame->data[0] != 10) << i;
  }
  for (std::size_t i = 14 + 1; i < 14 + 18; ++i) {
    std::string cdm(read_44);
    cdm[i] = cdm[i] == '1' ? '0' : '1';
    EXPECT_FALSE(decoded(cdm, read_44_answer)) << i;
  }
  for (std::size_t size = 1; size < 14 + 33; ++size) {
    EXPECT_FALSE(decoded(read_44.substr(0, size), read_44_answer.substr(0, size))) << size;
  }
}

TEST(BissControl, RejectsBitsWithoutStartBit) {
  EXPECT_EQ(decoded("", "").error(), Error::wrong_length);
  EXPECT_EQ(decoded("00000000000000000000", "00000000000000000000").error(), Error::bad_framing);
  EXPECT_EQ(decoded(read_44.substr(1), read_44_answer.substr(1)).error(), Error::bad_framing);
}

// ---- Host and slaves against each other

/// Registers of three slaves. Addresses with bit 4 set are read only; none exist from 0x70 on.
struct Target : ControlTarget {
  [[nodiscard]] bool allows(unsigned slave, unsigned address, bool write) const override {
    return slave < 3 && address < 0x70 && !(write && (address & 0x10) != 0);
  }
  [[nodiscard]] std::uint8_t read(unsigned slave, unsigned address) override { return values[slave][address]; }
  void write(unsigned slave, unsigned address, std::uint8_t value) override {
    values[slave][address] = value;
    ++writes;
  }
  [[nodiscard]] bool is_ready() const override {
    if (wait > 0) --wait;
    return wait == 0;
  }
  [[nodiscard]] bool obeys(unsigned, unsigned command) const override { return command < 2; }
  void execute(std::uint8_t slaves, unsigned command) override { executed = slaves * 16 + static_cast<int>(command); }

  std::array<std::array<std::uint8_t, 128>, 3> values{};
  mutable unsigned wait = 0;
  int writes = 0;
  int executed = -1;
};

/// The CDM and CDS bits of a simulated control frame, one per position frame.
struct Transcript {
  std::string cdm;
  std::string cds;
};

/// Runs host and encoders until the control frame ends. `flip`: CDS bit that is received wrong.
Transcript run(ControlMaster& master, ControlSlaves& slaves, Target& target, std::size_t flip = ~std::size_t{0}) {
  Transcript transcript;
  for (unsigned i = 0; !master.is_over() && i < 2'000; ++i) {
    const bool cds = slaves.cds() != (i == flip);
    const bool cdm = master.next(cds);
    transcript.cds += cds ? '1' : '0';
    transcript.cdm += cdm ? '1' : '0';
    slaves.take(cdm, target);
  }
  EXPECT_TRUE(master.is_over());
  return transcript;
}

TEST(BissControl, HostAndSlavesSendBitsOfTheTable) {
  Target target;
  target.values[0][0x44] = 10;
  ControlSlaves slaves(1);
  ControlMaster master;
  master.read(0, 0x44, 1);
  const Transcript transcript = run(master, slaves, target);
  ASSERT_EQ(master.error(), Error::none);
  EXPECT_EQ(transcript.cdm, read_44.substr(0, transcript.cdm.size()));
  EXPECT_EQ(transcript.cds, read_44_answer.substr(0, transcript.cds.size()));
  EXPECT_EQ(transcript.cdm.size(), 14u + 33u);
}

/// Encoders that send P = 1 (the next register is refused) after each register, but send the next register
/// nevertheless.
struct Stopping final : Target {
  [[nodiscard]] bool stop_bit(bool) const override { return true; }
};

TEST(BissControl, DecodesHostThatContinuesAfterStopBit) {
  Stopping target;
  target.values[0][0x44] = 10;
  target.values[0][0x45] = 11;
  ControlSlaves slaves(1);
  ControlMaster master;
  master.read(0, 0x44, 2);
  EXPECT_EQ((run(master, slaves, target), master.error()), Error::request_rejected);
  EXPECT_EQ(master.frame().data.size(), 1u);
  EXPECT_EQ(master.frame().data[0], 10);
  // A host that ignores the bit P, as hosts of LENZ do, reads the next register.
  BitBuffer<256> cdm;
  BitBuffer<256> cds;
  slaves.reset();
  for (const char c : std::string(14, '0') + std::string(read_44.substr(14, 19))) {
    cdm.append(c == '1' ? 1 : 0, 1);
    cds.append(slaves.cds() ? 1 : 0, 1);
    slaves.take(c == '1', target);
  }
  for (unsigned i = 0; i < 44; ++i) {
    const bool goes_on = i == 13;  // the host sends its start bit for the next register in the frame of the bit P
    cdm.append(goes_on ? 1 : 0, 1);
    cds.append(slaves.cds() ? 1 : 0, 1);
    slaves.take(goes_on, target);
  }
  const Result<ControlFrame> frame = decode_control(cdm.view(), cds.view());
  ASSERT_EQ(frame.error(), Error::none);
  ASSERT_EQ(frame->data.size(), 2u);
  EXPECT_EQ(frame->data[1], 11);
}

TEST(BissControl, RandomAccessesEndWithExpectedResult) {
  sim::Random random(3);
  Target target;
  for (auto& slave : target.values) {
    for (std::uint8_t& value : slave) value = static_cast<std::uint8_t>(random.next());
  }
  ControlSlaves slaves(3);
  ControlMaster master;
  for (int i = 0; i < 3'000; ++i) {
    const auto slave = static_cast<unsigned>(random.below(5));
    const auto address = static_cast<unsigned>(random.below(128));
    const std::size_t count = 1 + random.below(random.chance(0.3) ? 64 : 4);
    const bool write = random.chance(0.5);
    target.wait = static_cast<unsigned>(random.below(30));
    std::vector<std::uint8_t> bytes(count);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.next());
    const auto before = target.values;
    if (write) {
      target.wait = 0;
      master.write(slave, address, bytes);
    } else {
      master.read(slave, address, count);
    }
    const Transcript transcript = run(master, slaves, target);
    bool allowed = true;
    for (std::size_t k = 0; k < count; ++k) {
      allowed = allowed && address + k < 128 && target.allows(slave, address + static_cast<unsigned>(k), write);
    }
    const Error expected = slave >= 3 ? Error::timeout : allowed ? Error::none : Error::request_rejected;
    ASSERT_EQ(master.error(), expected) << i;
    for (std::size_t k = 0; k < master.frame().data.size(); ++k) {
      ASSERT_EQ(master.frame().data[k], write ? bytes[k] : before[slave][address + k]);
      ASSERT_EQ(target.values[slave][address + k], master.frame().data[k]);
    }
    const std::string quiet(14, '0');
    const Result<ControlFrame> seen = decoded(quiet + transcript.cdm + quiet, quiet + transcript.cds + quiet);
    // The decoder cannot know that the host wanted more registers than the encoder permits.
    const std::size_t size = master.frame().data.size();
    ASSERT_EQ(seen.error(), size > 0 ? Error::none : expected) << transcript.cdm << '\n' << transcript.cds;
    if (!seen) continue;
    EXPECT_EQ(seen->data.size(), size);
    EXPECT_TRUE(size == count || !seen->next_address_accepted);
    EXPECT_EQ(seen->start_delay[0], master.frame().start_delay[0]);
  }
}

// The four bits of a byte's CRC may miss a lost start bit, which then shows as a delay.
TEST(BissControl, FlippedCdsBitIsDetectedOrShowsAsDelay) {
  for (std::size_t flip = 0; flip < 14 + 33 + 14; ++flip) {
    for (const bool write : {false, true}) {
      Target target;
      target.values[0][0x20] = 0x5A;
      target.values[0][0x21] = 0xC3;
      ControlSlaves slaves(1);
      ControlMaster master;
      const std::array<std::uint8_t, 2> bytes{0x12, 0x34};
      if (write) {
        master.write(0, 0x20, bytes);
      } else {
        master.read(0, 0x20, 2);
      }
      run(master, slaves, target, flip);
      for (std::size_t k = 0; k < master.frame().data.size(); ++k) {
        if (master.frame().start_delay[k] != 0) continue;
        EXPECT_EQ(master.frame().data[k], target.values[0][0x20 + k]) << flip;
      }
    }
  }
}

TEST(BissControl, ExecutesCommandWhenAllSlavesAcknowledge) {
  Target target;
  ControlSlaves slaves(3);
  ControlMaster master;
  master.command(0b101, 1);
  Transcript transcript = run(master, slaves, target);
  EXPECT_EQ(master.error(), Error::none);
  EXPECT_EQ(target.executed, 0b101 * 16 + 1);
  EXPECT_EQ(decoded(transcript.cdm, transcript.cds)->acknowledged, 0b101);

  target.executed = -1;
  master.command(0b101, 3);
  run(master, slaves, target);
  EXPECT_EQ(master.error(), Error::request_rejected);
  EXPECT_EQ(target.executed, -1);

  master.command(0b1000, 1);
  run(master, slaves, target);
  EXPECT_EQ(master.error(), Error::timeout);

  master.command(0, 2);
  transcript = run(master, slaves, target);
  EXPECT_EQ(master.error(), Error::none);
  EXPECT_EQ(target.executed, 2);

  master.count_slaves();
  run(master, slaves, target);
  EXPECT_EQ(master.frame().slaves, 3);
}

// Bits are counted from the start bit, as in the table of Texas Instruments.
TEST(BissControl, DecoderChecksEachRuleOfAControlFrame) {
  const auto transcript_of = [](auto begin) {
    Target target;
    ControlSlaves slaves(3);
    ControlMaster master;
    begin(master);
    const Transcript transcript = run(master, slaves, target);
    return Transcript{transcript.cdm + std::string(14, '0'), transcript.cds + std::string(14, '0')};
  };
  const auto written = [](std::uint8_t byte) {
    return [byte](ControlMaster& master) { master.write(0, 0x20, std::array{byte}); };
  };
  const Transcript read = transcript_of([](ControlMaster& master) { master.read(0, 0x44, 1); });
  const Transcript write = transcript_of(written(0x5A));
  const Transcript command = transcript_of([](ControlMaster& master) { master.command(0b101, 1); });
  const auto flipped = [](std::string text, std::initializer_list<std::size_t> bits) {
    for (const std::size_t bit : bits) text[14 + bit] ^= 1;
    return text;
  };
  const auto begin = [](const std::string& text, std::size_t bits) { return text.substr(0, 14 + bits); };
  const auto late = [](std::string text, std::size_t bits) { return text.insert(14 + 19, std::string(bits, '0')); };
  const auto error = [](const std::string& cdm, const std::string& cds) { return decoded(cdm, cds).error(); };

  EXPECT_EQ(error(begin(read.cdm, 10), ""), Error::truncated);
  EXPECT_EQ(error(begin(read.cdm, 18), ""), Error::truncated);
  EXPECT_EQ(error(begin(read.cdm, 19), ""), Error::none);
  EXPECT_EQ(error(begin(command.cdm, 16), ""), Error::truncated);
  EXPECT_EQ(error(begin(command.cdm, 17), ""), Error::none);

  EXPECT_EQ(error(read.cdm, begin(read.cds, 5)), Error::truncated);
  EXPECT_EQ(error(read.cdm, begin(read.cds, 18)), Error::truncated);
  EXPECT_EQ(error(begin(read.cdm, 20), read.cds), Error::truncated);
  EXPECT_EQ(error(flipped(read.cdm, {18}), read.cds), Error::timeout);  // the host sends no start bit S
  // the encoder sends its start bit S late, by 13 frames
  EXPECT_EQ(error(late(read.cdm, 13), late(read.cds, 13)), Error::none);
  EXPECT_EQ(error(late(read.cdm, 14), late(read.cds, 14)), Error::timeout);  // 14 zeros of CDM end the control frame
  // The encoder refuses the next register by P = 1, but the host requests it.
  EXPECT_EQ(error(flipped(read.cdm, {32}), flipped(read.cds, {32})), Error::request_rejected);
  // a delay is not allowed for the first written byte
  EXPECT_EQ(error(write.cdm, late(write.cds, 1)), Error::bad_framing);
  EXPECT_EQ(error(write.cdm, flipped(write.cds, {20})), Error::bad_checksum);
  EXPECT_EQ(error(flipped(write.cdm, {19}), write.cds), Error::bad_checksum);
  EXPECT_EQ(error(transcript_of(written(0xA5)).cdm, write.cds), Error::unexpected_reply);

  EXPECT_EQ(error(command.cdm, begin(command.cds, 24)), Error::truncated);
  EXPECT_EQ(error(begin(command.cdm, 24), command.cds), Error::truncated);
  EXPECT_EQ(error(flipped(command.cdm, {16}), command.cds), Error::bad_framing);
  EXPECT_EQ(error(command.cdm, flipped(command.cds, {17})), Error::request_rejected);
  EXPECT_EQ(error(command.cdm, flipped(command.cds, {18})), Error::unexpected_reply);

  const auto answered = [](auto ask, const std::string& cds) {
    ControlMaster master;
    ask(master);
    for (const char c : cds) static_cast<void>(master.next(c == '1'));
    return master.error();
  };
  EXPECT_EQ(answered(written(0x5A), write.cds), Error::none);
  EXPECT_EQ(answered(written(0xA5), write.cds), Error::unexpected_reply);
  // the first CDS bit is 1, before the host has sent a request
  EXPECT_EQ(answered(written(0x5A), flipped(write.cds, {0})), Error::bad_framing);
}

TEST(BissControl, SlaveDoesNotStoreByteWithWrongCrc) {
  Target target;
  ControlSlaves slaves(1);
  // CDM of a write of 0x55 to the register 0x48, with one wrong data bit.
  for (const char c : std::string_view("0000000000000011000100100010100110101000100100000"))
    slaves.take(c == '1', target);
  EXPECT_EQ(target.writes, 0);
  for (const char c : std::string_view("0000000000000011000100100010100110101010100100000"))
    slaves.take(c == '1', target);
  EXPECT_EQ(target.writes, 1);
  EXPECT_EQ(target.values[0][0x48], 0x55);
}

}  // namespace
}  // namespace absenc::biss
