// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/spidev.hpp"

#include <linux/spi/spidev.h>
#include <sys/ioctl.h>

#include <cerrno>
#include <cstring>

namespace absenc::os {

namespace {

// Greatest number of bytes of an SPI message in each direction: the kernel's default of its parameter bufsiz.
constexpr std::size_t most_bytes = 4096;
// Greatest number of buffers of an SPI message: a FUSE request may name 256 memory ranges, one of which is the list
// of transfers.
constexpr std::size_t most_buffers = 255;
constexpr std::uint8_t most_wires = 1;
constexpr std::uint32_t lsb_first = SPI_LSB_FIRST;

SpidevReply error_reply(int error) { return {.result = -error}; }

template <class Value>
SpidevReply value_reply(const Value& value) {
  SpidevReply reply;
  reply.bytes.resize(sizeof value);
  std::memcpy(reply.bytes.data(), &value, sizeof value);
  return reply;
}

template <class Value>
Value value_of(Bytes bytes) {
  Value value{};
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

bool is_message(unsigned long request) {
  return _IOC_TYPE(request) == SPI_IOC_MAGIC && _IOC_NR(request) == 0 && _IOC_DIR(request) == _IOC_WRITE;
}

// Memory ranges of an SPI message, and the number of bytes that the host sends (`in`) and receives (`out`).
struct Buffers {
  SpidevReply reply{.again = true};
  std::size_t in = 0;
  std::size_t out = 0;
};

Buffers buffers_of(UserMemory list, std::span<const spi_ioc_transfer> transfers) {
  Buffers buffers;
  buffers.reply.in.push_back(list);
  for (const spi_ioc_transfer& transfer : transfers) {
    if (transfer.len == 0) continue;
    if (transfer.tx_buf != 0) {
      buffers.reply.in.push_back({transfer.tx_buf, transfer.len});
      buffers.in += transfer.len;
    }
    if (transfer.rx_buf == 0) continue;
    buffers.reply.out.push_back({transfer.rx_buf, transfer.len});
    buffers.out += transfer.len;
  }
  return buffers;
}

int refused(std::span<const spi_ioc_transfer> transfers, const Buffers& buffers) {
  if (buffers.in > most_bytes || buffers.out > most_bytes) return EMSGSIZE;
  if (buffers.reply.in.size() - 1 + buffers.reply.out.size() > most_buffers) return EMSGSIZE;
  std::uint64_t all = 0;  // number of bytes of all transfers, including those without a buffer
  for (const spi_ioc_transfer& transfer : transfers) {
    all += transfer.len;
    if (all > INT32_MAX) return EMSGSIZE;
    if (transfer.bits_per_word != 0 && transfer.bits_per_word != 8) return EINVAL;
    if (transfer.tx_nbits > most_wires || transfer.rx_nbits > most_wires) return EINVAL;
  }
  return 0;
}

}  // namespace

Spidev::Spidev(SpiDevice& device)
    : device_(&device),
      settings_{.speed = device.settings().rate, .mode_bits = SPI_CPHA | SPI_CPOL | SPI_LSB_FIRST},
      board_speed_(device.settings().rate) {}

void Spidev::close() {
  if (users_ > 0 && --users_ == 0) settings_.speed = board_speed_;
}

SpidevReply Spidev::control(unsigned long request, std::uint64_t address, Bytes in, std::size_t room, Time now) {
  const std::size_t size = _IOC_SIZE(request);
  if (is_message(request)) return message(address, size, in, room, now);
  switch (request) {
    case SPI_IOC_WR_MODE:
    case SPI_IOC_WR_MODE32:
    case SPI_IOC_WR_LSB_FIRST:
    case SPI_IOC_WR_BITS_PER_WORD:
    case SPI_IOC_WR_MAX_SPEED_HZ:
      if (in.size() != size) return {.again = true, .in = {{address, size}}};
      return error_reply(set(request, in));
    case SPI_IOC_RD_MODE:
    case SPI_IOC_RD_MODE32:
    case SPI_IOC_RD_LSB_FIRST:
    case SPI_IOC_RD_BITS_PER_WORD:
    case SPI_IOC_RD_MAX_SPEED_HZ:
      if (room != size) return {.again = true, .out = {{address, size}}};
      return get(request);
    default:
      return error_reply(ENOTTY);
  }
}

SpidevReply Spidev::get(unsigned long request) const {
  switch (request) {
    case SPI_IOC_RD_MODE:
      return value_reply(static_cast<std::uint8_t>(settings_.mode));
    case SPI_IOC_RD_MODE32:
      return value_reply(settings_.mode);
    case SPI_IOC_RD_LSB_FIRST:
      return value_reply(static_cast<std::uint8_t>((settings_.mode & SPI_LSB_FIRST) != 0 ? 1 : 0));
    case SPI_IOC_RD_BITS_PER_WORD:
      return value_reply(settings_.word_bits);
    default:
      return value_reply(settings_.speed);
  }
}

// Changes a setting of the controller. Returns 0 or a value of errno.
int Spidev::set(unsigned long request, Bytes value) {
  switch (request) {
    case SPI_IOC_WR_MODE:
      return set_mode(value[0]);
    case SPI_IOC_WR_MODE32:
      return set_mode(value_of<std::uint32_t>(value));
    case SPI_IOC_WR_LSB_FIRST:
      return set_mode((settings_.mode & ~lsb_first) | (value[0] != 0 ? lsb_first : 0));
    case SPI_IOC_WR_BITS_PER_WORD:
      if (value[0] != 0 && value[0] != 8) return EINVAL;
      settings_.word_bits = 8;
      return 0;
    default:
      if (value_of<std::uint32_t>(value) == 0) return EINVAL;
      settings_.speed = value_of<std::uint32_t>(value);
      return 0;
  }
}

int Spidev::set_mode(std::uint32_t wanted) {
  if ((wanted & ~settings_.mode_bits) != 0) return EINVAL;
  settings_.mode = wanted;
  device_->rest(static_cast<std::uint8_t>(wanted & (SPI_CPHA | SPI_CPOL)));
  return 0;
}

// The list of transfers is checked in each call, because another thread of the calling program may change it between
// two calls.
SpidevReply Spidev::message(std::uint64_t address, std::size_t size, Bytes in, std::size_t room, Time now) {
  if (size % sizeof(spi_ioc_transfer) != 0) return error_reply(EINVAL);
  if (size == 0) return {};
  if (in.size() < size) return {.again = true, .in = {{address, size}}};
  std::vector<spi_ioc_transfer> list(size / sizeof(spi_ioc_transfer));
  std::memcpy(list.data(), in.data(), size);
  const Buffers buffers = buffers_of({address, size}, list);
  if (const int error = refused(list, buffers); error != 0) return error_reply(error);
  if (in.size() != size + buffers.in || room != buffers.out) return buffers.reply;

  std::vector<std::uint8_t> bytes(buffers.out);
  Bytes left_in = in.subspan(size);
  MutableBytes left_out = bytes;
  std::vector<SpiTransfer> transfers;
  for (const spi_ioc_transfer& one : list) {
    SpiTransfer& transfer = transfers.emplace_back(transfer_of(one.len, one.speed_hz));
    transfer.delay = std::chrono::microseconds(one.delay_usecs);
    transfer.deselect = one.cs_change != 0;
    if (one.tx_buf != 0) {
      transfer.out = left_in.first(one.len);
      left_in = left_in.subspan(one.len);
    }
    if (one.rx_buf != 0) {
      transfer.in = left_out.first(one.len);
      left_out = left_out.subspan(one.len);
    }
  }
  SpidevReply reply = run(transfers, now);
  reply.bytes = std::move(bytes);
  return reply;
}

SpidevReply Spidev::read(std::size_t size, Time now) {
  if (size > most_bytes) return error_reply(EMSGSIZE);
  std::vector<std::uint8_t> bytes(size);
  SpiTransfer transfer = transfer_of(size, 0);
  transfer.in = bytes;
  SpidevReply reply = run({&transfer, 1}, now);
  reply.bytes = std::move(bytes);
  return reply;
}

SpidevReply Spidev::write(Bytes bytes, Time now) {
  if (bytes.size() > most_bytes) return error_reply(EMSGSIZE);
  SpiTransfer transfer = transfer_of(bytes.size(), 0);
  transfer.out = bytes;
  return run({&transfer, 1}, now);
}

SpiTransfer Spidev::transfer_of(std::size_t size, std::uint32_t rate) const {
  return {.size = size,
          .rate = rate != 0 ? rate : settings_.speed,
          .mode = static_cast<std::uint8_t>(settings_.mode & SPI_MODE_X_MASK),
          .lsb_first = (settings_.mode & SPI_LSB_FIRST) != 0};
}

SpidevReply Spidev::run(std::span<SpiTransfer> transfers, Time now) {
  SpidevReply reply;
  for (const SpiTransfer& transfer : transfers) reply.result += static_cast<int>(transfer.size);
  reply.at = device_->message(transfers, now);
  return reply;
}

}  // namespace absenc::os
