// SPDX-License-Identifier: Apache-2.0
// The verbs `memory dump`, `memory load` and `memory verify`.
#include <fmt/format.h>

#include <array>

#include "absenc/client/memory.hpp"
#include "absenc/client/memory/dump.hpp"
#include "absenc/client/text/text_file.hpp"
#include "absenc/os/process.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/text/encoder_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/verbs/memory_change.hpp"

namespace absenc::tool {

namespace {

int run_dump(const Invocation& invocation) {
  os::catch_interrupts();
  const EncoderAddress uri = parse_address(invocation.text("encoder"), invocation.texts("--option"));
  require_memory(*uri.unit, MemoryAccess::read);
  const bool to_file = invocation.has("--output");
  const std::string path = to_file ? link_target(std::string(invocation.text("--output"))) : "";
  if (to_file) require_replaceable(path);

  Encoder encoder = open_encoder(uri);
  Memory memory = encoder.memory();
  memory.check_model();
  const MemoryImage image = read_memory(memory, dump_addresses(*uri.unit));
  const std::string text = to_dump(*uri.unit, uri.options, image);
  if (!to_file) {
    print_line(text);
    return exit_good;
  }
  os::replace_file(path, text, os::Durable::yes);
  print_line(fmt::format("{} {} are in {}", image.size(), word_noun(*uri.unit, 2), path));
  return exit_good;
}

MemoryImage read_dump(const Invocation& invocation, const EncoderAddress& uri, MemoryAccess access) {
  const std::string path(invocation.text("file"));
  const std::string text = read_text_file("the dump", path);
  const Dump dump = parse_dump(path, text, *uri.unit, uri.options, access);
  if (dump.checked) return dump.image;
  const std::string what = fmt::format("{} has no checksum, which is its last line: was it cut off?", path);
  if (!invocation.has("--force")) {
    throw Failure(
        fmt::format("{} If you edited it and it is whole, end it with the line \"checksum: edited\"; "
                    "--force takes it as it is",
                    what));
  }
  print_message(fmt::format("note: {} {} bytes of it are taken", what, dump.image.size()));
  return dump.image;
}

int run_load(const Invocation& invocation) {
  os::catch_interrupts();
  const EncoderAddress uri = parse_address(invocation.text("encoder"), invocation.texts("--option"));
  const MemoryAccess access = write_access(invocation);
  require_memory(*uri.unit, access);
  return change_memory(invocation, uri, read_dump(invocation, uri, access), access);
}

int run_verify(const Invocation& invocation) {
  os::catch_interrupts();
  const EncoderAddress uri = parse_address(invocation.text("encoder"), invocation.texts("--option"));
  require_memory(*uri.unit, MemoryAccess::read);
  const MemoryImage wanted = read_dump(invocation, uri, MemoryAccess::read);
  Encoder encoder = open_encoder(uri);
  Memory memory = encoder.memory();
  memory.check_model();
  const MemoryImage found = read_memory(memory, wanted);
  const MemoryImage wrong = differing(wanted, found);
  if (invocation.has("--json")) {
    print_line(Json::object()
                   .set("ok", true)
                   .set("same", wrong.empty())
                   .set("compared", wanted.size())
                   .set("differences", differences_json(wrong, found))
                   .line());
  } else {
    if (!wrong.empty()) print_line(difference_table(*uri.unit, "FILE", wrong, found));
    const std::string_view noun = word_noun(*uri.unit, 2);
    print_line(wrong.empty() ? fmt::format("all {} {} are the same", wanted.size(), noun)
                             : fmt::format("{} of {} {} differ", wrong.size(), wanted.size(), noun));
  }
  return wrong.empty() ? exit_good : exit_failed;
}

constexpr Parameter dump_file{"file", "", "made by `absenc memory dump`, edited or not", "", true};

constexpr std::array<Parameter, 3> dump_parameters{{
    parameter::encoder,
    {"--output", "FILE", "where to write it; a file that is there is replaced", "standard output"},
    parameter::option,
}};
constexpr std::array<Example, 2> dump_examples{{
    {"absenc memory dump tformat:/dev/ttyUSB0 --output motor7.dump", "keep what is in an encoder"},
    {"absenc memory dump sim:tformat", "try it without hardware"},
}};

constexpr std::array<Parameter, 7> load_parameters{{
    parameter::encoder,
    dump_file,
    {"--dry-run", "", "only show what differs"},
    {"--force", "", "write also what the protocol protects, as calibration, and take a file without a checksum"},
    parameter::yes,
    parameter::json,
    parameter::option,
}};
constexpr std::array<Example, 2> load_examples{{
    {"absenc memory load tformat:/dev/ttyUSB0 motor7.dump", "make an encoder that replaces another the same"},
    {"absenc memory load tformat:/dev/ttyUSB0 motor7.dump --dry-run", "what would be written"},
}};

constexpr std::array<Parameter, 5> verify_parameters{{
    parameter::encoder,
    dump_file,
    {"--force", "", "take a file without a checksum"},
    parameter::json,
    parameter::option,
}};
constexpr std::array<Example, 2> verify_examples{{
    {"absenc memory verify tformat:/dev/ttyUSB0 motor7.dump", "is it what was written?"},
    {"absenc memory verify tformat:/dev/ttyUSB0 motor7.dump --json", "the same for programs"},
}};

}  // namespace

const Subcommand memory_dump_subcommand{
    "memory dump",
    "copy the memory into a file that can be edited",
    "Lines of page, address and bytes in hexadecimal. After editing, write \"checksum: edited\" in the place of the\n"
    "last line: a file whose checksum is wrong or missing was damaged or cut off, and is refused. What is not in the\n"
    "file is left alone.",
    dump_parameters,
    dump_examples,
    run_dump};
const Subcommand memory_load_subcommand{
    "memory load",
    "write the bytes of such a file that differ",
    "The whole file is checked first; then the differences are shown, and it asks. Without a terminal it needs\n"
    "--yes. Each byte is read back. After an interruption the same command goes on where it stopped.",
    load_parameters,
    load_examples,
    run_load};
const Subcommand memory_verify_subcommand{"memory verify",
                                          "compare the memory with such a file",
                                          "Exit status 1 when they differ.",
                                          verify_parameters,
                                          verify_examples,
                                          run_verify};

}  // namespace absenc::tool
