// SPDX-License-Identifier: Apache-2.0
// Instantiates templates of the freestanding layers, so that tests/freestanding.sh sees which library functions they
// need.
#include <array>
#include <cstdint>

#include "absenc/core/angle.hpp"
#include "absenc/core/bits.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/core/crc.hpp"
#include "absenc/core/gray.hpp"
#include "absenc/core/result.hpp"
#include "absenc/host/session.hpp"
#include "absenc/host/unwrap.hpp"
#include "absenc/host/velocity.hpp"
#include "absenc/link/can.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/protocol/word.hpp"

namespace absenc {

inline constexpr CrcParameters modbus{16, 0x8005, 0xFFFF, true, true, 0x0000};
inline constexpr CrcParameters biss_crc{6, 0x03, 0x00, false, false, 0x3F};

template class Buffer<std::uint8_t, 64>;
template class Buffer<CanFrame, 4>;
template class Crc<modbus, CrcTable::byte>;
template class Crc<modbus, CrcTable::nibble>;
template class Crc<biss_crc, CrcTable::byte>;
template class Crc<biss_crc, CrcTable::nibble>;
template class Result<std::uint64_t>;
template class Result<Reading>;
template class host::Statistics<std::uint8_t>;
template class host::Statistics<CanFrame>;
template class host::Session<std::uint8_t>;
template class host::Session<CanFrame>;

// drive_bytes and drive_frames are not static, because the compiler would drop unused static functions.
bool drive_bytes(Machine<std::uint8_t>& machine, Port<std::uint8_t>& port) {
  return host::drive(machine, port, [] { return true; });
}

bool drive_frames(Machine<CanFrame>& machine, Port<CanFrame>& port) {
  return host::drive(machine, port, [] { return true; });
}

host::MilliSpeed speed(const Reading& reading, host::Unwrapper& unwrapper, host::Velocity& velocity) {
  if (unwrapper.add(reading) != host::Unwrapper::Joined::continued) velocity.restart();
  velocity.add(unwrapper.position(), reading.latched);
  return velocity.speed();
}

std::uint64_t helpers(Bytes bytes, MutableBytes out) {
  store_big_endian(out, load_little_endian(bytes));
  store_little_endian(out, load_big_endian(bytes));
  return gray_decode(gray_encode(reflect(bytes.size(), 64))) + (odd_parity(bytes.size()) ? 1u : 0u) +
         static_cast<std::uint64_t>(wrapped_difference(1, 2, 17)) + static_cast<std::uint64_t>(degrees(1, 17));
}

// Parses a word format from a text that is known only at run time.
Result<Word> word_of_text(std::string_view text, BitView bits) {
  WordFormat format;
  if (!parse_word_format(text, format).reason.empty()) return Error::invalid_argument;
  return decode_word(format, bits);
}

// Uses the virtual tables and the list of units, so that the link contains them.
struct Idle final : Machine<std::uint8_t> {
  void feed(const Event<std::uint8_t>&) override {}
  Step<std::uint8_t> next(Time) override { return {.kind = Step<std::uint8_t>::Kind::done}; }
};

std::size_t run_idle(Port<std::uint8_t>& port) {
  static Idle idle;
  return drive_bytes(idle, port) ? all_units().size() : text_of(Error::timeout).name.size();
}

}  // namespace absenc
