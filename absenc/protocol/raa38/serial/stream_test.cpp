// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/raa38/serial/bench_test.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::raa38::serial {
namespace {

using testing::Wire;

void append(Wire& wire, Bytes bytes) { wire.insert(wire.end(), bytes.begin(), bytes.end()); }

struct StreamResults {
  std::vector<std::uint32_t> positions;
  std::vector<Error> errors;
};

StreamResults decode_stream(StreamDecoder& decoder, Bytes bytes, std::size_t piece = SIZE_MAX) {
  StreamResults results;
  while (!bytes.empty()) {
    const Bytes now = bytes.first(std::min(piece, bytes.size()));
    bytes = bytes.subspan(now.size());
    decoder.feed(now, Time{}, [&](const StreamFrame& found) {
      if (found.error == Error::none) results.positions.push_back(found.singleturn);
      if (found.error != Error::none) results.errors.push_back(found.error);
    });
  }
  return results;
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

TEST(Raa38SerialStream, FindsEveryFrameInPiecesOfAnySize) {
  for (const unsigned bits : {14u, 17u, 21u}) {
    const Format format{.bits = bits};
    const Wire wire = stream(format, 100, 150);
    for (std::size_t piece = 1; piece <= wire.size(); ++piece) {
      StreamDecoder decoder(format);
      const StreamResults results = decode_stream(decoder, wire, piece);
      EXPECT_EQ(results.positions, range(100, 150)) << bits << " bits in pieces of " << piece;
      EXPECT_TRUE(results.errors.empty());
      EXPECT_EQ(decoder.skipped(), 0u);
    }
  }
}

TEST(Raa38SerialStream, DisturbanceCostsOnlyFramesItHits) {
  const Format format{.bits = 14};
  const std::size_t size = format.frame_bytes();
  for (std::size_t piece = 1; piece < 23; ++piece) {
    Wire flipped = stream(format, 100, 110);
    flipped[5 * size + 3] ^= 0x10;
    StreamDecoder decoder(format);
    StreamResults results = decode_stream(decoder, flipped, piece);
    std::vector<std::uint32_t> wanted = range(100, 110);
    wanted.erase(wanted.begin() + 5);
    EXPECT_EQ(results.positions, wanted);
    EXPECT_EQ(results.errors, std::vector{Error::bad_checksum});
    EXPECT_EQ(decoder.skipped(), size);

    Wire longer = stream(format, 100, 110);
    longer.insert(longer.begin() + 5 * static_cast<std::ptrdiff_t>(size), {0xFF, 0x81, 0x00});
    StreamDecoder other(format);
    results = decode_stream(other, longer, piece);
    EXPECT_EQ(results.positions, range(100, 110)) << "what came in between hit no frame";
    EXPECT_EQ(results.errors.size(), 1u);
    EXPECT_EQ(other.skipped(), 3u);
  }
}

TEST(Raa38SerialStream, AlignsInMiddleOfFrameWithHeaderInData) {
  const Format format{.bits = 14};
  Wire wire;
  // each frame is FF 81 3F 81 40, so it contains a second 81
  for (int i = 0; i < 5; ++i) append(wire, encode_position(format, {0x3F81}));
  for (std::size_t cut = 0; cut < 5; ++cut) {
    StreamDecoder decoder(format);
    const StreamResults results = decode_stream(decoder, Bytes(wire).subspan(cut));
    EXPECT_EQ(results.positions, std::vector<std::uint32_t>(cut == 0 ? 5 : 4, 0x3F81));
  }
}

TEST(Raa38SerialStream, IgnoresFramesOfOtherUnits) {
  for (const SecondByte form : {SecondByte::automatic, SecondByte::echo}) {
    const Format format{.second_byte = form, .unit = 1};
    Wire wire;
    for (std::uint32_t value = 1; value < 5; ++value) append(wire, encode_position(format, {value, 0xB2}));
    StreamDecoder decoder(format);
    EXPECT_TRUE(decode_stream(decoder, wire).positions.empty());
  }
}

// The bytes FF 81 02 FF 81 have a valid checksum, but are no frame: two bytes were lost after FF 81 02.
TEST(Raa38SerialStream, RejectsFrameWithHeaderInside) {
  const Format format{.bits = 10};
  for (std::size_t piece = 1; piece < 20; ++piece) {
    Wire wire = stream(format, 0x200, 0x203);
    append(wire, hex<"ff8102">);
    append(wire, stream(format, 0x209, 0x20C));
    StreamDecoder decoder(format);
    std::vector<std::uint32_t> wanted = range(0x200, 0x203);
    for (const std::uint32_t position : range(0x209, 0x20C)) wanted.push_back(position);
    EXPECT_EQ(decode_stream(decoder, wire, piece).positions, wanted) << piece;
  }
}

// The checksum of the frame FF 81 00 7F FF is FF.
TEST(Raa38SerialStream, FrameWithFFWaitsForNextHeader) {
  const Format format{.bits = 14};
  StreamDecoder decoder(format);
  Wire wire = stream(format, 0x7D, 0x7F);
  EXPECT_EQ(decode_stream(decoder, wire).positions, range(0x7D, 0x7E));
  EXPECT_EQ(decode_stream(decoder, hex<"ff81">).positions, range(0x7F, 0x7F));
  EXPECT_EQ(decode_stream(decoder, hex<"008000">).positions, range(0x80, 0x80));
}

TEST(Raa38SerialStream, ReportsEachLossOnce) {
  const Format format{.bits = 14};
  Wire wire = stream(format, 1, 2);
  append(wire, encode_position({.bits = 16}, {0x4001}));
  for (int i = 0; i < 20; ++i) wire.push_back(0x55);
  StreamDecoder decoder(format);
  EXPECT_EQ(decode_stream(decoder, wire).errors, std::vector{Error::out_of_range});
  EXPECT_TRUE(decoder.saw_larger_positions());
  EXPECT_FALSE(decoder.in_step());
  EXPECT_EQ(decoder.bad().size(), 5u);
}

TEST(Raa38SerialStream, DamagedCharacterEndsAlignment) {
  const Format format{.bits = 14};
  StreamDecoder decoder(format);
  const Wire wire = stream(format, 1, 4);
  EXPECT_EQ(decode_stream(decoder, Bytes(wire).first(17)).positions, range(1, 3));
  std::vector<Error> errors;
  decoder.disturbed([&](const StreamFrame& found) { errors.push_back(found.error); });
  EXPECT_EQ(errors, std::vector{Error::bad_framing});
  EXPECT_EQ(decode_stream(decoder, stream(format, 5, 7)).positions, range(5, 7));
}

// ---- Refresh rate: rejects frames that pass checksum and range

TEST(Raa38SerialStream, RejectsFramesCloserThanRefreshRate) {
  const Format format{.bits = 14};
  const Wire burst = stream(format, 1, 2);
  StreamDecoder strict({.bits = 14, .refresh_millihertz = 100'000});
  StreamDecoder plain(format);
  std::size_t accepted = 0;
  std::size_t accepted_without_rate = 0;
  for (std::size_t i = 0; i < burst.size(); ++i) {
    const Time at = 87us * static_cast<int>(i);
    strict.feed(Bytes(burst).subspan(i, 1), at, [&](const StreamFrame&) { ++accepted; });
    plain.feed(Bytes(burst).subspan(i, 1), at, [&](const StreamFrame&) { ++accepted_without_rate; });
  }
  EXPECT_EQ(accepted, 0u);
  EXPECT_EQ(accepted_without_rate, 2u);
}

// The operating system may deliver the bytes of a stream in parts that end inside frames.
TEST(Raa38SerialStream, AlignsWhenPiecesEndInsideFrames) {
  const Format format{.bits = 14};
  const Wire wire = stream(format, 1, 100);
  for (std::size_t cut = 1; cut < 5; ++cut) {
    StreamDecoder decoder({.bits = 14, .refresh_millihertz = 1'000'000});
    std::vector<std::uint32_t> positions;
    const auto keep = [&](const StreamFrame& found) { positions.push_back(found.singleturn); };
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
  std::uint64_t lost = 0;   // number of sent frames that were not received, although no disturbance hit them
  std::uint64_t wrong = 0;  // number of received positions that none of the next 12 sent frames carried
  std::uint64_t disturbances = 0;
};

struct Sent {
  std::uint32_t position;
  bool hit = false;
};

/// Disturbs the end of the stream in `wire`. Returns whether the last frame was hit.
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

// Compares sent and received positions in order, and counts lost and wrong ones.
void judge_option(Tally& tally, const std::vector<Sent>& sent, const std::vector<std::uint32_t>& results) {
  constexpr std::size_t most_missing = 12;  // number of sent frames among which a received position is searched
  std::size_t next = 0;
  for (const std::uint32_t position : results) {
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
    judge_option(tally, sent, decode_stream(decoder, wire, 1 + random.below(300)).positions);
  }
}

TEST(Raa38SerialStream, SurvivesMillionDisturbedFrames) {
  Tally all;
  for (const unsigned bits : {10u, 14u, 16u, 17u, 21u}) pollute(all, {.bits = bits}, 200'000);
  std::printf("%llu frames, %llu disturbances: %llu good frames lost, %llu positions wrong\n",
              static_cast<unsigned long long>(all.sent), static_cast<unsigned long long>(all.disturbances),
              static_cast<unsigned long long>(all.lost), static_cast<unsigned long long>(all.wrong));
  EXPECT_GE(all.sent, 1'000'000u);
  EXPECT_LE(all.lost * 20, all.disturbances) << "most cost no good frame at all";
  // A damaged frame, or parts of two frames, may pass an 8-bit checksum by chance.
  EXPECT_LE(all.wrong * 1000, all.disturbances);
}

}  // namespace
}  // namespace absenc::raa38::serial
