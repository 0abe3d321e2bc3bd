// SPDX-License-Identifier: Apache-2.0
#include "absenc/core/crc.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace absenc {
namespace {

constexpr std::array<std::uint8_t, 9> check_input{'1', '2', '3', '4', '5', '6', '7', '8', '9'};

template <CrcParameters parameters>
constexpr bool checks(std::uint16_t expected) {
  return crc_bitwise(parameters, check_input) == expected && Crc<parameters>::of(check_input) == expected &&
         Crc<parameters, CrcTable::nibble>::of(check_input) == expected;
}

constexpr CrcParameters modbus{16, 0x8005, 0xFFFF, true, true, 0x0000};
constexpr CrcParameters biss{6, 0x03, 0x00, false, false, 0x3F};

// CRCs of supported encoders; "(msb)" marks polynomials of the ESL protocol without reflection.
static_assert(checks<CrcParameters{8, 0x01, 0x00, true, true, 0x00}>(0x31), "T-format");
static_assert(checks<CrcParameters{8, 0x97, 0x00, false, false, 0xFF}>(0x6B), "RLS EncoLink");
static_assert(checks<biss>(0x2E), "BiSS-C");
static_assert(checks<CrcParameters{8, 0x2F, 0x00, true, true, 0x00}>(0x43), "ESL 8-bit");
static_assert(checks<CrcParameters{8, 0x2F, 0x00, false, false, 0x00}>(0x3E), "ESL 8-bit (msb)");
static_assert(checks<CrcParameters{16, 0x5935, 0x0000, true, true, 0x00}>(0xFAD9), "ESL channel 1");
static_assert(checks<CrcParameters{16, 0x5935, 0xFFFF, true, true, 0x00}>(0x328D), "ESL channel 2");
static_assert(checks<CrcParameters{16, 0x5935, 0x0000, false, false, 0x00}>(0x5D38), "ESL channel 1 (msb)");
static_assert(checks<CrcParameters{16, 0x5935, 0xFFFF, false, false, 0x00}>(0x772B), "ESL channel 2 (msb)");
static_assert(checks<modbus>(0x4B37), "Modbus RTU");

// CRCs from the public catalogue of parametrised CRC algorithms.
static_assert(checks<CrcParameters{3, 0x3, 0x0, false, false, 0x7}>(0x4), "CRC-3/GSM");
static_assert(checks<CrcParameters{3, 0x3, 0x7, true, true, 0x0}>(0x6), "CRC-3/ROHC");
static_assert(checks<CrcParameters{5, 0x05, 0x1F, true, true, 0x1F}>(0x19), "CRC-5/USB");
static_assert(checks<CrcParameters{12, 0x80F, 0x000, false, true, 0x000}>(0xDAF), "CRC-12/UMTS");
static_assert(checks<CrcParameters{15, 0x4599, 0x0000, false, false, 0x0000}>(0x059E), "CRC-15/CAN");
static_assert(checks<CrcParameters{16, 0x1021, 0xFFFF, false, false, 0x0000}>(0x29B1), "CRC-16/IBM-3740");

static_assert(Crc<biss>::table_bytes == 256 && Crc<biss, CrcTable::nibble>::table_bytes == 16);
static_assert(Crc<modbus>::table_bytes == 512 && Crc<modbus, CrcTable::nibble>::table_bytes == 32);
static_assert(sizeof(Crc<biss>) == 1 && sizeof(Crc<modbus>) == 2, "the state is the remainder alone");

// Returns 64 pseudo-random bits for the number `x`, calculated as splitmix64 does.
constexpr std::uint64_t mixed(std::uint64_t x) {
  x += 0x9E37'79B9'7F4A'7C15;
  x = (x ^ (x >> 30)) * 0xBF58'476D'1CE4'E5B9;
  x = (x ^ (x >> 27)) * 0x94D0'49BB'1331'11EB;
  return x ^ (x >> 31);
}

constexpr auto noise = [] {
  std::array<std::uint8_t, 256> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(mixed(i));
  return bytes;
}();

// Returns the parameters of the CRC with the number `sample` among those that are tested: number 0 has the polynomial
// x^width + 1, the others have pseudo-random polynomials.
constexpr CrcParameters sampled(unsigned width, std::uint64_t sample, bool refin, bool refout) {
  const std::uint64_t bits = mixed(width * 64 + sample);
  const std::uint64_t mask = low_mask(width);
  return {width,
          sample == 0 ? std::uint16_t{1} : static_cast<std::uint16_t>((bits | 1) & mask),
          static_cast<std::uint16_t>(bits >> 16 & mask),
          refin,
          refout,
          static_cast<std::uint16_t>(bits >> 32 & mask)};
}

struct Engines {
  CrcParameters parameters;
  std::uint16_t (*byte)(Bytes);
  std::uint16_t (*nibble)(Bytes);
};

template <CrcParameters parameters>
constexpr Engines engines{parameters, [](Bytes bytes) -> std::uint16_t { return Crc<parameters>::of(bytes); },
                          [](Bytes bytes) -> std::uint16_t { return Crc<parameters, CrcTable::nibble>::of(bytes); }};

// If refout differs from refin, only the last step of the CRC changes, so one tested CRC is enough for each of the two
// combinations in which they differ.
template <unsigned width>
constexpr std::array engines_of_width{
    engines<sampled(width, 0, false, false)>, engines<sampled(width, 1, false, false)>,
    engines<sampled(width, 2, false, false)>, engines<sampled(width, 0, true, true)>,
    engines<sampled(width, 1, true, true)>,   engines<sampled(width, 2, true, true)>,
    engines<sampled(width, 3, false, true)>,  engines<sampled(width, 3, true, false)>,
};

void expect_equal_to_definition(const Engines& tested) {
  const CrcParameters& parameters = tested.parameters;
  SCOPED_TRACE(::testing::Message() << "width " << parameters.width << " poly " << parameters.poly << " refin "
                                    << parameters.refin << " refout " << parameters.refout);
  for (std::size_t length = 0; length <= 80; ++length) {
    const Bytes data = Bytes(noise).subspan(length, length);
    const std::uint16_t expected = crc_bitwise(parameters, data);
    ASSERT_EQ(tested.byte(data), expected) << "byte table, length " << length;
    ASSERT_EQ(tested.nibble(data), expected) << "nibble table, length " << length;
  }
}

TEST(Crc, EqualsTheDefinitionForEveryWidthAndLength) {
  []<unsigned... offsets>(std::integer_sequence<unsigned, offsets...>) {
    const auto test_all = [](const auto& all) {
      for (const Engines& tested : all) expect_equal_to_definition(tested);
    };
    (test_all(engines_of_width<3 + offsets>), ...);
  }
  (std::make_integer_sequence<unsigned, 14>());
}

TEST(Crc, UpdateInPartsEqualsUpdateInOne) {
  for (std::size_t split = 0; split <= noise.size(); ++split) {
    Crc<modbus> crc;
    crc.update(Bytes(noise).first(split));
    EXPECT_EQ(crc.value(), Crc<modbus>::of(Bytes(noise).first(split)));
    crc.update(Bytes(noise).subspan(split));
    ASSERT_EQ(crc.value(), crc_bitwise(modbus, noise));
  }
}

TEST(Crc, AnotherInitialValueSharesTheTable) {
  for (const std::uint16_t init : std::to_array<std::uint16_t>({0, 1, 0x1234, 0xFFFF})) {
    const auto expect_definition = [init](auto crc, CrcParameters parameters) {
      parameters.init = init;
      crc.update(noise);
      EXPECT_EQ(crc.value(), crc_bitwise(parameters, noise)) << init;
    };
    constexpr CrcParameters reflected{16, 0x5935, 0, true, true, 0};
    constexpr CrcParameters plain{14, 0x1935, 0, false, false, 0};
    expect_definition(Crc<reflected>(init), reflected);
    expect_definition(Crc<plain, CrcTable::nibble>(init), plain);
  }
}

}  // namespace
}  // namespace absenc
