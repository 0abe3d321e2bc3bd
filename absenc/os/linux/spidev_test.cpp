// SPDX-License-Identifier: Apache-2.0
// Tests the replies of Spidev, and which memory of the calling program it requests.
#include "absenc/os/spidev.hpp"

#include <gmock/gmock-more-matchers.h>
#include <gtest/gtest.h>
#include <linux/spi/spidev.h>
#include <sys/ioctl.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <initializer_list>

#include "absenc/os/linux/testing.hpp"
#include "tests/shape_toys.hpp"

namespace absenc::os {
namespace {

using namespace std::chrono_literals;
using namespace testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

template <class Value>
Data bytes_of(const Value& value) {
  Data bytes(sizeof value);
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

// The fields of spi_ioc_transfer; each is 0 by default.
struct TransferFields {
  std::uint64_t tx_buf = 0;
  std::uint64_t rx_buf = 0;
  std::uint32_t len = 0;
  std::uint32_t speed_hz = 0;
  std::uint16_t delay_usecs = 0;
  std::uint8_t bits_per_word = 0;
  std::uint8_t cs_change = 0;
  std::uint8_t tx_nbits = 0;
  std::uint8_t rx_nbits = 0;
  std::uint16_t rest = 0;
};
static_assert(sizeof(TransferFields) == sizeof(spi_ioc_transfer));

struct SpidevTest : ::testing::Test {
  template <class Value>
  int set(unsigned long request, Value value) {
    const SpidevReply reply = spidev.control(request, 0x1000, bytes_of(value), 0, 1ms);
    EXPECT_FALSE(reply.again);
    return -reply.result;
  }
  template <class Value>
  Value get(unsigned long request) {
    const SpidevReply reply = spidev.control(request, 0x1000, {}, sizeof(Value), 1ms);
    EXPECT_EQ(reply.result, 0);
    EXPECT_EQ(reply.bytes.size(), sizeof(Value));
    Value value{};
    std::memcpy(&value, reply.bytes.data(), sizeof value);
    return value;
  }
  SpidevReply message(const Data& list_and_bytes, std::size_t count, std::size_t room) {
    return spidev.control(_IOC(_IOC_WRITE, SPI_IOC_MAGIC, 0, count * sizeof(spi_ioc_transfer)), 0x1000, list_and_bytes,
                          room, 1ms);
  }
  // Returns the errno with which a message of one transfer is refused; 0 if it is not.
  int refused(const TransferFields& transfer) {
    const SpidevReply reply = message(bytes_of(transfer), 1, 0);
    return -reply.result;
  }

  toy::Toy<std::uint8_t> toy{[](auto& self, const ByteEvent& event) {
    if (event.kind == ByteEvent::Kind::selected) self.send({0x12, 0x34, 0x56});
  }};
  SpiDevice device{LinkKind::spi, {.rate = 1'000'000, .spi_mode = 1}, toy};
  Spidev spidev{device};
};

TEST_F(SpidevTest, IsAtFirstAsWithoutADeviceTree) {
  EXPECT_EQ(get<std::uint8_t>(SPI_IOC_RD_MODE), SPI_MODE_0);
  EXPECT_EQ(get<std::uint8_t>(SPI_IOC_RD_BITS_PER_WORD), 8);
  EXPECT_EQ(get<std::uint8_t>(SPI_IOC_RD_LSB_FIRST), 0);
  EXPECT_EQ(get<std::uint32_t>(SPI_IOC_RD_MAX_SPEED_HZ), 1'000'000u);
}

TEST_F(SpidevTest, StoresSettings) {
  EXPECT_EQ(set<std::uint32_t>(SPI_IOC_WR_MODE32, SPI_MODE_2 | SPI_LSB_FIRST), 0);
  EXPECT_EQ(get<std::uint32_t>(SPI_IOC_RD_MODE32), static_cast<std::uint32_t>(SPI_MODE_2 | SPI_LSB_FIRST));
  EXPECT_EQ(get<std::uint8_t>(SPI_IOC_RD_LSB_FIRST), 1);
  EXPECT_EQ(set<std::uint8_t>(SPI_IOC_WR_LSB_FIRST, 0), 0);
  EXPECT_EQ(get<std::uint8_t>(SPI_IOC_RD_MODE), SPI_MODE_2);
  EXPECT_EQ(set<std::uint8_t>(SPI_IOC_WR_LSB_FIRST, 7), 0);
  EXPECT_EQ(set<std::uint8_t>(SPI_IOC_WR_MODE, SPI_MODE_3), 0);
  EXPECT_EQ(get<std::uint32_t>(SPI_IOC_RD_MODE32), static_cast<std::uint32_t>(SPI_MODE_3));
  EXPECT_EQ(set<std::uint32_t>(SPI_IOC_WR_MAX_SPEED_HZ, 4'000'000), 0);
  EXPECT_EQ(get<std::uint32_t>(SPI_IOC_RD_MAX_SPEED_HZ), 4'000'000u);
  EXPECT_EQ(set<std::uint8_t>(SPI_IOC_WR_BITS_PER_WORD, 0), 0);
  EXPECT_EQ(get<std::uint8_t>(SPI_IOC_RD_BITS_PER_WORD), 8);
}

TEST_F(SpidevTest, RefusesUnsupportedSettings) {
  EXPECT_EQ(set<std::uint8_t>(SPI_IOC_WR_MODE, SPI_CS_HIGH), EINVAL);
  EXPECT_EQ(set<std::uint32_t>(SPI_IOC_WR_MODE32, SPI_TX_QUAD), EINVAL);
  EXPECT_EQ(set<std::uint8_t>(SPI_IOC_WR_BITS_PER_WORD, 16), EINVAL);
  EXPECT_EQ(set<std::uint32_t>(SPI_IOC_WR_MAX_SPEED_HZ, 0), EINVAL);
  EXPECT_EQ(refused({.len = 1, .bits_per_word = 9}), EINVAL);
  EXPECT_EQ(refused({.len = 1, .tx_nbits = 2}), EINVAL);
  EXPECT_EQ(refused({.len = 1, .rx_nbits = 4}), EINVAL);
  EXPECT_EQ(refused({.rx_buf = 1, .len = 1, .bits_per_word = 8, .tx_nbits = 1, .rx_nbits = 1}), 0);
}

TEST_F(SpidevTest, RefusesUnknownRequests) {
  for (const unsigned long request : std::initializer_list<unsigned long>{
           _IOW(SPI_IOC_MAGIC, 6, std::uint8_t), _IOR(SPI_IOC_MAGIC, 0, std::uint32_t), _IOW('j', 1, std::uint8_t),
           _IOW(SPI_IOC_MAGIC, 1, std::uint32_t), 0x5401}) {
    const SpidevReply reply = spidev.control(request, 0x1000, {}, 0, 1ms);
    EXPECT_FALSE(reply.again) << request;
    EXPECT_EQ(reply.result, -ENOTTY) << request;
  }
  EXPECT_EQ(spidev.control(_IOC(_IOC_WRITE, SPI_IOC_MAGIC, 0, 33), 0x1000, {}, 0, 1ms).result, -EINVAL);
  EXPECT_EQ(toy.log, "");
}

TEST_F(SpidevTest, RequestsMemoryOfASetting) {
  const SpidevReply write = spidev.control(SPI_IOC_WR_MAX_SPEED_HZ, 0x1234, {}, 0, 1ms);
  EXPECT_TRUE(write.again);
  EXPECT_THAT(write.in, ElementsAre(UserMemory{0x1234, 4}));
  EXPECT_THAT(write.out, IsEmpty());
  const SpidevReply read = spidev.control(SPI_IOC_RD_MODE, 0x1234, {}, 0, 1ms);
  EXPECT_TRUE(read.again);
  EXPECT_THAT(read.in, IsEmpty());
  EXPECT_THAT(read.out, ElementsAre(UserMemory{0x1234, 1}));
}

TEST_F(SpidevTest, RequestsTransfersThenTheirBuffers) {
  const SpidevReply first = message({}, 3, 0);
  EXPECT_TRUE(first.again);
  EXPECT_THAT(first.in, ElementsAre(UserMemory{0x1000, 96}));
  EXPECT_THAT(first.out, IsEmpty());

  const std::array<TransferFields, 3> list{{{.tx_buf = 0x2000, .len = 1},
                                            {.tx_buf = 0x3000, .rx_buf = 0x4000, .len = 2},
                                            {.tx_buf = 0x5000, .rx_buf = 0x6000}}};
  Data in = bytes_of(list);
  const SpidevReply second = message(in, 3, 0);
  EXPECT_TRUE(second.again);
  EXPECT_THAT(second.in, ElementsAre(UserMemory{0x1000, 96}, UserMemory{0x2000, 1}, UserMemory{0x3000, 2}));
  EXPECT_THAT(second.out, ElementsAre(UserMemory{0x4000, 2}));
  EXPECT_EQ(toy.log, "");

  EXPECT_EQ(set<std::uint8_t>(SPI_IOC_WR_MODE, SPI_MODE_1), 0);
  in.insert(in.end(), {0xA1, 0xB2, 0xC3});
  const SpidevReply third = message(in, 3, 2);
  EXPECT_FALSE(third.again);
  EXPECT_EQ(third.result, 3);
  EXPECT_EQ(third.bytes, (Data{0x34, 0x56}));
  EXPECT_EQ(third.at, 1ms + 24us);
  EXPECT_THAT(toy.log, HasSubstr("received A1 B2 C3,"));
}

TEST_F(SpidevTest, RequestsChangedListAgain) {
  Data in = bytes_of(TransferFields{.tx_buf = 0x2000, .len = 5});
  // CUSE has fetched two bytes from the buffer that the list of transfers named before; the list now names a buffer of
  // five bytes.
  in.insert(in.end(), {1, 2});
  const SpidevReply reply = message(in, 1, 0);
  EXPECT_TRUE(reply.again);
  EXPECT_THAT(reply.in, ElementsAre(UserMemory{0x1000, 32}, UserMemory{0x2000, 5}));
  EXPECT_EQ(toy.log, "");
}

TEST_F(SpidevTest, EveryTransferMayHaveItsOwnSpeedAndDelay) {
  const std::array<TransferFields, 2> list{
      {{.tx_buf = 1, .len = 1, .speed_hz = 500'000, .delay_usecs = 3, .cs_change = 1}, {.tx_buf = 1, .len = 1}}};
  Data in = bytes_of(list);
  in.resize(in.size() + 2);
  EXPECT_EQ(message(in, 2, 0).at, 1ms + 16us + 3us + 10us + 8us);
}

TEST_F(SpidevTest, LimitsSizeOfMessage) {
  EXPECT_EQ(refused({.tx_buf = 1, .len = 4097}), EMSGSIZE);
  EXPECT_EQ(refused({.rx_buf = 1, .len = 4097}), EMSGSIZE);
  EXPECT_EQ(refused({.rx_buf = 1, .len = 4096}), 0);
  EXPECT_EQ(refused({.len = 0x8000'0000}), EMSGSIZE);
  const auto refused_all = [this](std::size_t count, const TransferFields& transfer) {
    Data in;
    for (std::size_t i = 0; i < count; ++i) {
      const Data one = bytes_of(transfer);
      in.insert(in.end(), one.begin(), one.end());
    }
    return -message(in, count, 0).result;
  };
  EXPECT_EQ(refused_all(2, {.tx_buf = 1, .rx_buf = 1, .len = 2048}), 0);
  EXPECT_EQ(refused_all(2, {.tx_buf = 1, .len = 2049}), EMSGSIZE);
  EXPECT_EQ(refused_all(2, {.len = 0x4000'0000}), EMSGSIZE);
  EXPECT_EQ(refused_all(127, {.tx_buf = 1, .rx_buf = 1, .len = 1}), 0);
  EXPECT_EQ(refused_all(128, {.tx_buf = 1, .rx_buf = 1, .len = 1}), EMSGSIZE);
}

TEST_F(SpidevTest, AcceptsEmptyMessages) {
  const SpidevReply reply = message({}, 0, 0);
  EXPECT_FALSE(reply.again);
  EXPECT_EQ(reply.result, 0);
  EXPECT_EQ(toy.log, "");
}

TEST_F(SpidevTest, ReadsAndWritesWithoutAList) {
  EXPECT_EQ(set<std::uint8_t>(SPI_IOC_WR_MODE, SPI_MODE_1), 0);
  const SpidevReply read = spidev.read(3, 1ms);
  EXPECT_EQ(read.result, 3);
  EXPECT_EQ(read.bytes, (Data{0x12, 0x34, 0x56}));
  EXPECT_EQ(read.at, 1ms + 24us);
  const SpidevReply write = spidev.write(Data{0xA1, 0xB2}, 1ms);
  EXPECT_EQ(write.result, 2);
  EXPECT_THAT(toy.log, HasSubstr("received A1 B2,"));
  EXPECT_EQ(spidev.read(4097, 1ms).result, -EMSGSIZE);
  EXPECT_EQ(spidev.write(Data(4097), 1ms).result, -EMSGSIZE);
}

TEST_F(SpidevTest, LastCloseResetsSpeed) {
  spidev.open();
  spidev.open();
  EXPECT_EQ(set<std::uint32_t>(SPI_IOC_WR_MAX_SPEED_HZ, 4'000'000), 0);
  EXPECT_EQ(set<std::uint8_t>(SPI_IOC_WR_MODE, SPI_MODE_1), 0);
  spidev.close();
  EXPECT_EQ(get<std::uint32_t>(SPI_IOC_RD_MAX_SPEED_HZ), 4'000'000u);
  spidev.close();
  EXPECT_EQ(get<std::uint32_t>(SPI_IOC_RD_MAX_SPEED_HZ), 1'000'000u);
  EXPECT_EQ(get<std::uint8_t>(SPI_IOC_RD_MODE), SPI_MODE_1);
}

}  // namespace
}  // namespace absenc::os
