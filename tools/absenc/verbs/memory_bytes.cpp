// SPDX-License-Identifier: Apache-2.0
// The verbs `memory read` and `memory write`, for bytes from an address on, and for registers.
#include <fmt/format.h>

#include <array>

#include "absenc/client/memory.hpp"
#include "absenc/client/text/nearest.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/core/bits.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/text/encoder_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/verbs/memory_change.hpp"
#include "tools/absenc/verbs/run.hpp"

namespace absenc::tool {

namespace {

constexpr std::int64_t most_bytes = 65536;

MemoryAddress first_address(const Invocation& invocation) {
  return {static_cast<std::uint32_t>(invocation.number("--page", 0, 0, UINT16_MAX)),
          static_cast<std::uint32_t>(invocation.number("address", 0, 0, INT32_MAX))};
}

// Returns bytes of memory as lines "0x10  00 5A ...  .Z...".
std::string hex_dump(const Unit& unit, const MemoryImage& image) {
  std::vector<std::vector<std::string>> rows;
  for (const MemoryRun& run : runs(image, 16 / word_bytes(unit))) {
    std::string characters;
    for (const std::uint32_t word : run.words) {
      for (unsigned i = word_bytes(unit); i-- > 0;) {
        const std::uint32_t byte = word >> 8 * i & 0xFF;
        characters += byte > 0x20 && byte < 0x7F ? static_cast<char>(byte) : '.';
      }
    }
    rows.push_back({fmt::format("0x{:02X}", run.first.address), words_in_hex(unit, run.words), characters});
  }
  return table(rows);
}

// Returns the address of a register that the user gave by name or address. Throws UsageError.
std::int64_t register_address(const Invocation& invocation, const Unit& unit, bool for_writing) {
  const std::string_view written = invocation.text("address");
  const Result<std::int64_t> number = parse_number(written);
  std::vector<std::string_view> names;
  for (const RegisterInfo& one : unit.registers) {
    if (!(for_writing ? one.writable : one.readable)) continue;
    if (one.name == written) return one.address;
    names.push_back(one.name);
  }
  if (number && *number >= 0) return *number;
  throw UsageError(fmt::format("{} has no register \"{}\" to be {}{}", unit.id, written,
                               for_writing ? "written" : "read", suggestion(written, names)));
}

const Command& register_command(const Invocation& invocation, const Unit& unit, Verb verb) {
  for (const std::string_view option : {"--page", "--count", "--dry-run"}) {
    if (invocation.has(option)) throw UsageError(fmt::format("{} is for bytes, but {} has registers", option, unit.id));
  }
  return *find_command(unit, verb);
}

int read_register(const Invocation& invocation, const EncoderAddress& uri) {
  const Command& command = register_command(invocation, *uri.unit, Verb::memory_read);
  const std::int64_t address = register_address(invocation, *uri.unit, false);
  return run_command(invocation, uri, command, role_arguments(command, {{Role::address, address}}));
}

int write_register(const Invocation& invocation, const EncoderAddress& uri) {
  const Command& command = register_command(invocation, *uri.unit, Verb::memory_write);
  const std::int64_t address = register_address(invocation, *uri.unit, true);
  const std::span<const std::string> values = invocation.texts("values");
  const Result<std::int64_t> value = parse_number(values.front());
  if (values.size() > 1 || !value) throw UsageError("a register takes one number");
  return run_command(invocation, uri, command,
                     role_arguments(command, {{Role::address, address}, {Role::value, *value}}));
}

int run_memory_read(const Invocation& invocation) {
  os::catch_interrupts();
  const EncoderAddress uri = parse_address(invocation.text("encoder"), invocation.texts("--option"));
  if (!uri.unit->registers.empty()) return read_register(invocation, uri);
  require_memory(*uri.unit, MemoryAccess::read);
  const MemoryAddress first = first_address(invocation);
  const std::int64_t count = invocation.number("--count", 1, 1, most_bytes);
  MemoryImage image;
  for (std::uint32_t i = 0; i < count; ++i) image[{first.page, first.address + i}] = 0;
  require_open(*uri.unit, image, MemoryAccess::read);

  Encoder encoder = open_encoder(uri);
  Memory memory = encoder.memory();
  image = read_memory(memory, image);
  if (!invocation.has("--json")) {
    print_line(hex_dump(*uri.unit, image));
    return exit_good;
  }
  print_line(Json::object()
                 .set("ok", true)
                 .set("page", first.page)
                 .set("address", first.address)
                 .set("data", words_in_json(*uri.unit, runs(image).front().words))
                 .line());
  return exit_good;
}

int run_write(const Invocation& invocation) {
  os::catch_interrupts();
  const EncoderAddress uri = parse_address(invocation.text("encoder"), invocation.texts("--option"));
  if (!uri.unit->registers.empty()) return write_register(invocation, uri);
  const MemoryAccess access = write_access(invocation);
  require_memory(*uri.unit, access);
  MemoryAddress at = first_address(invocation);
  MemoryImage wanted;
  for (const std::string& written : invocation.texts("values")) {
    const Result<std::int64_t> value = parse_number(written);
    const auto most = static_cast<std::int64_t>(low_mask(8 * word_bytes(*uri.unit)));
    if (!value || *value < 0 || *value > most) {
      throw UsageError(fmt::format("the value \"{}\" is no {}: a number from 0 to {}, or 0x{:0{}X} to 0x{:X}", written,
                                   word_noun(*uri.unit, 1), most, 0, 2 * word_bytes(*uri.unit), most));
    }
    wanted[at] = static_cast<std::uint32_t>(*value);
    ++at.address;
  }
  require_open(*uri.unit, wanted, access);
  return change_memory(invocation, uri, wanted, access);
}

constexpr Parameter address{
    "address", "", "of the first byte: decimal, or hexadecimal with 0x; of a register also its name", "", true};
constexpr Parameter page{"--page", "P", "of the memory, where it has pages", "0"};

constexpr std::array<Parameter, 6> memory_read_parameters{{
    parameter::encoder,
    address,
    page,
    {"--count", "N", "how many bytes", "1"},
    parameter::json,
    parameter::option,
}};
constexpr std::array<Example, 2> memory_read_examples{{
    {"absenc memory read tformat:/dev/ttyUSB0 0x10 --count 16 --page 2", "16 bytes of page 2"},
    {"absenc memory read sim:encolink serial_number", "a register by its name; try it without hardware"},
}};

constexpr std::array<Parameter, 9> write_parameters{{
    parameter::encoder,
    address,
    {"values", "", "bytes, or the number for a register: decimal, or hexadecimal with 0x", "", true, true},
    page,
    {"--dry-run", "", "only show what differs"},
    parameter::force,
    parameter::yes,
    parameter::json,
    parameter::option,
}};
constexpr std::array<Example, 2> write_examples{{
    {"absenc memory write tformat:/dev/ttyUSB0 0x10 0x42 0x43 --page 2", "two bytes of page 2"},
    {"absenc memory write sim:tformat 0 0x5A", "try it without hardware"},
}};

}  // namespace

const Subcommand memory_read_subcommand{
    "memory read",  "read bytes of the encoder's memory", "", memory_read_parameters, memory_read_examples,
    run_memory_read};
const Subcommand memory_write_subcommand{
    "memory write",
    "write bytes of the encoder's memory",
    "Asks first; without a terminal it needs --yes. Only bytes that differ are written: memory wears. Each is\n"
    "read back.",
    write_parameters,
    write_examples,
    run_write};

}  // namespace absenc::tool
