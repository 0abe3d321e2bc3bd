// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/raa38/serial/bench_test.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::raa38::serial {
namespace {

using testing::Wire;

void append(Wire& wire, Bytes bytes) { wire.insert(wire.end(), bytes.begin(), bytes.end()); }

struct Heard {
  std::vector<std::uint32_t> positions;
  std::vector<Error> errors;
};

Heard hear(StreamDecoder& decoder, Bytes bytes, std::size_t piece = SIZE_MAX) {
  Heard heard;
  while (!bytes.empty()) {
    const Bytes now = bytes.first(std::min(piece, bytes.size()));
    bytes = bytes.subspan(now.size());
    decoder.feed(now, Time{}, [&](const Found& found) {
      if (found.error == Error::none) heard.positions.push_back(found.singleturn);
      if (found.error != Error::none) heard.errors.push_back(found.error);
    });
  }
  return heard;
}

Wire stream(const Format& format, std::uint32_t first, std::uint32_t last) {
  Wire wire;
  for (std::uint32_t value = first; value <= last; ++value) append(wire, encode_position(format, {value}));
  return wire;
}

std::vector<std::uint32_t> range(std::uint32_t first, std::uint32_t last) {
  std::vector<std::uint32_t> values;
  for (std::uint32_t value = first; value <= last; ++value) values.push_back(value);
  return values;
}

TEST(RaaStream, EveryFrameInPiecesOfEverySize) {
  for (const unsigned bits : {14u, 17u, 21u}) {
    const Format format{.bits = bits};
    const Wire wire = stream(format, 100, 150);
    for (std::size_t piece = 1; piece <= wire.size(); ++piece) {
      StreamDecoder decoder(format);
      const Heard heard = hear(decoder, wire, piece);
      EXPECT_EQ(heard.positions, range(100, 150)) << bits << " bits in pieces of " << piece;
      EXPECT_TRUE(heard.errors.empty());
      EXPECT_EQ(decoder.skipped(), 0u);
    }
  }
}

TEST(RaaStream, ADisturbanceCostsWhatItHits) {
  const Format format{.bits = 14};
  const std::size_t size = format.frame_bytes();
  for (std::size_t piece = 1; piece < 23; ++piece) {
    Wire flipped = stream(format, 100, 110);
    flipped[5 * size + 3] ^= 0x10;
    StreamDecoder decoder(format);
    Heard heard = hear(decoder, flipped, piece);
    std::vector<std::uint32_t> wanted = range(100, 110);
    wanted.erase(wanted.begin() + 5);
    EXPECT_EQ(heard.positions, wanted);
    EXPECT_EQ(heard.errors, std::vector{Error::bad_checksum});
    EXPECT_EQ(decoder.skipped(), size);

    Wire longer = stream(format, 100, 110);
    longer.insert(longer.begin() + 5 * static_cast<std::ptrdiff_t>(size), {0xFF, 0x81, 0x00});
    StreamDecoder other(format);
    heard = hear(other, longer, piece);
    EXPECT_EQ(heard.positions, range(100, 110)) << "what came in between hit no frame";
    EXPECT_EQ(heard.errors.size(), 1u);
    EXPECT_EQ(other.skipped(), 3u);
  }
}

TEST(RaaStream, BeginsInTheMiddleOfAFrameWithTheHeaderInItsData) {
  const Format format{.bits = 14};
  Wire wire;
  for (int i = 0; i < 5; ++i) append(wire, encode_position(format, {0x3F81}));  // the frame is FF 81 3F 81 40
  for (std::size_t cut = 0; cut < 5; ++cut) {
    StreamDecoder decoder(format);
    const Heard heard = hear(decoder, Bytes(wire).subspan(cut));
    EXPECT_EQ(heard.positions, std::vector<std::uint32_t>(cut == 0 ? 5 : 4, 0x3F81));
  }
}

TEST(RaaStream, FramesOfAnotherNumberAreNone) {
  for (const SecondByte form : {SecondByte::automatic, SecondByte::echo}) {
    const Format format{.second_byte = form, .unit = 1};
    Wire wire;
    for (std::uint32_t value = 1; value < 5; ++value) append(wire, encode_position(format, {value, 0xB2}));
    StreamDecoder decoder(format);
    EXPECT_TRUE(hear(decoder, wire).positions.empty());
  }
}

// Two bytes are lost: FF 81 02 .. .. FF 81 02 09 8B. The first five bytes have a valid checksum and fit into 10 bits.
TEST(RaaStream, AHeaderThatSlippedIntoAFrameIsNoPosition) {
  const Format format{.bits = 10};
  for (std::size_t piece = 1; piece < 20; ++piece) {
    Wire wire = stream(format, 0x200, 0x203);
    append(wire, hex<"ff8102">);
    append(wire, stream(format, 0x209, 0x20C));
    StreamDecoder decoder(format);
    std::vector<std::uint32_t> wanted = range(0x200, 0x203);
    for (const std::uint32_t position : range(0x209, 0x20C)) wanted.push_back(position);
    EXPECT_EQ(hear(decoder, wire, piece).positions, wanted) << piece;
  }
}

// The checksum of FF 81 00 7F is FF: such a frame waits for the next header, but not longer.
TEST(RaaStream, AFrameWithFFInsideWaitsForTheNextHeader) {
  const Format format{.bits = 14};
  StreamDecoder decoder(format);
  Wire wire = stream(format, 0x7D, 0x7F);
  EXPECT_EQ(hear(decoder, wire).positions, range(0x7D, 0x7E));
  EXPECT_EQ(hear(decoder, hex<"ff81">).positions, range(0x7F, 0x7F));
  EXPECT_EQ(hear(decoder, hex<"008000">).positions, range(0x80, 0x80));
}

TEST(RaaStream, TellsEachLossOnceAndWhy) {
  const Format format{.bits = 14};
  Wire wire = stream(format, 1, 2);
  append(wire, encode_position({.bits = 16}, {0x4001}));
  for (int i = 0; i < 20; ++i) wire.push_back(0x55);
  StreamDecoder decoder(format);
  EXPECT_EQ(hear(decoder, wire).errors, std::vector{Error::out_of_range});
  EXPECT_TRUE(decoder.saw_larger_positions());
  EXPECT_FALSE(decoder.in_step());
  EXPECT_EQ(decoder.bad().size(), 5u);
}

TEST(RaaStream, ADamagedCharacterIsADisturbance) {
  const Format format{.bits = 14};
  StreamDecoder decoder(format);
  const Wire wire = stream(format, 1, 4);
  EXPECT_EQ(hear(decoder, Bytes(wire).first(17)).positions, range(1, 3));
  std::vector<Error> errors;
  decoder.disturbed([&](const Found& found) { errors.push_back(found.error); });
  EXPECT_EQ(errors, std::vector{Error::bad_framing});
  EXPECT_EQ(hear(decoder, stream(format, 5, 7)).positions, range(5, 7));
}

// ---- Refresh rate: rejects frames that pass checksum and range

TEST(RaaStream, FramesNearerThanTheRefreshRateAllowsAreNone) {
  const Format format{.bits = 14};
  const Wire burst = stream(format, 1, 2);
  StreamDecoder strict({.bits = 14, .refresh_millihertz = 100'000});
  StreamDecoder plain(format);
  std::size_t believed = 0;
  std::size_t believed_plainly = 0;
  for (std::size_t i = 0; i < burst.size(); ++i) {
    const Time at = 87us * static_cast<int>(i);
    strict.feed(Bytes(burst).subspan(i, 1), at, [&](const Found&) { ++believed; });
    plain.feed(Bytes(burst).subspan(i, 1), at, [&](const Found&) { ++believed_plainly; });
  }
  EXPECT_EQ(believed, 0u);
  EXPECT_EQ(believed_plainly, 2u);
}

// The operating system delivers bytes in pieces of any size; this must not prevent the alignment to a valid stream.
TEST(RaaStream, PiecesThatEndInsideEveryFrameOnlyDelay) {
  const Format format{.bits = 14};
  const Wire wire = stream(format, 1, 100);
  for (std::size_t cut = 1; cut < 5; ++cut) {
    StreamDecoder decoder({.bits = 14, .refresh_millihertz = 1'000'000});
    std::vector<std::uint32_t> positions;
    const auto keep = [&](const Found& found) { positions.push_back(found.singleturn); };
    decoder.feed(Bytes(wire).first(cut), Time{}, keep);
    for (std::size_t at = cut; at + 5 <= wire.size(); at += 5) {
      decoder.feed(Bytes(wire).subspan(at, 5), Time(1ms) * static_cast<int>(at / 5 + 1), keep);
    }
    EXPECT_EQ(positions, range(1, 99)) << cut;
  }
}

// ---- A million frames, cut, joined and disturbed

struct Tally {
  std::uint64_t sent = 0;
  std::uint64_t lost = 0;   // frames that were not received, although no disturbance hit them
  std::uint64_t wrong = 0;  // positions that were received, but never sent
  std::uint64_t disturbances = 0;
};

struct Sent {
  std::uint32_t position;
  bool hit = false;
};

/// Disturbs the end of the stream: adds random bytes with many headers, cuts the last frame, flips a bit, or removes a
/// byte. Returns whether the last frame was hit.
bool disturb(Wire& wire, std::size_t size, sim::Random& random) {
  switch (random.below(4)) {
    case 0:
      for (std::uint64_t i = 1 + random.below(20); i > 0; --i) {
        const std::uint64_t kind = random.below(4);
        const auto noise = static_cast<std::uint8_t>(random.below(256));
        wire.push_back(kind == 0 ? header : kind == 1 ? fixed_second_byte : noise);
      }
      return false;
    case 1:
      wire.resize(wire.size() - 1 - random.below(size - 1));
      return true;
    case 2:
      wire[wire.size() - 1 - random.below(size)] ^= static_cast<std::uint8_t>(1u << random.below(8));
      return true;
    default:
      wire.erase(wire.end() - 1 - static_cast<std::ptrdiff_t>(random.below(size)));
      return true;
  }
}

// Compares sent and received positions in order. A received position that was not sent next is wrong; a sent one that
// was not received is lost.
void judge(Tally& tally, const std::vector<Sent>& sent, const std::vector<std::uint32_t>& heard) {
  constexpr std::size_t most_missing = 12;  // most lost frames in a row
  std::size_t next = 0;
  for (const std::uint32_t position : heard) {
    const std::size_t end = std::min(sent.size(), next + most_missing);
    std::size_t found = next;
    while (found < end && sent[found].position != position) ++found;
    if (found == end) {
      ++tally.wrong;
      continue;
    }
    for (; next < found; ++next) tally.lost += sent[next].hit ? 0 : 1;
    ++next;
  }
  for (; next < sent.size(); ++next) tally.lost += sent[next].hit ? 0 : 1;
}

void pollute(Tally& tally, const Format& format, std::uint64_t frames) {
  sim::Random random(format.bits);
  StreamDecoder decoder(format);
  const auto masked = [&](std::uint64_t value) { return static_cast<std::uint32_t>(value & low_mask(format.bits)); };
  std::uint32_t place = 0;
  for (const std::uint64_t end = tally.sent + frames; tally.sent < end;) {
    Wire wire;
    std::vector<Sent> sent;
    for (int stretch = 0; stretch < 50; ++stretch) {
      for (std::uint64_t i = 1 + random.below(60); i > 0; --i) {
        place = masked(place + 1 + random.below(6));
        sent.push_back({random.chance(0.01) ? masked(0x3F81FF81) : place});
        append(wire, encode_position(format, {sent.back().position}));
      }
      sent.back().hit = disturb(wire, format.frame_bytes(), random);
    }
    tally.sent += sent.size();
    tally.disturbances += 50;
    judge(tally, sent, hear(decoder, wire, 1 + random.below(300)).positions);
  }
}

TEST(RaaStream, AMillionFramesCutJoinedAndPolluted) {
  Tally all;
  for (const unsigned bits : {10u, 14u, 16u, 17u, 21u}) pollute(all, {.bits = bits}, 200'000);
  std::printf("%llu frames, %llu disturbances: %llu good frames lost, %llu positions wrong\n",
              static_cast<unsigned long long>(all.sent), static_cast<unsigned long long>(all.disturbances),
              static_cast<unsigned long long>(all.lost), static_cast<unsigned long long>(all.wrong));
  EXPECT_GE(all.sent, 1'000'000u);
  EXPECT_LE(all.lost * 20, all.disturbances) << "most cost no good frame at all";
  // A damaged frame, or parts of two frames, pass an 8-bit checksum by chance.
  EXPECT_LE(all.wrong * 1000, all.disturbances);
}

}  // namespace
}  // namespace absenc::raa38::serial
