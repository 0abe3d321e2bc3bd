// SPDX-License-Identifier: Apache-2.0
// Format of the file: a line that names the kind of file; lines "protocol: tformat", "model: NAME", "size: BYTES"; then
// the content as lines "0010: 00 5A ...".
#include "absenc/client/memory/memory_file.hpp"

#include <fmt/format.h>

#include <cstring>
#include <filesystem>
#include <vector>

#include "absenc/client/error.hpp"
#include "absenc/client/text/text_file.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/core/hex.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/file_name.hpp"

namespace absenc::client {

namespace {

[[noreturn]] void refuse(const std::string& path, const SignificantLines& lines, std::string_view what) {
  throw Failure(fmt::format("the memory file {}, line {}: {}; it was left as it is", path, lines.number, what));
}

void expect(const std::string& path, SignificantLines& lines, std::string_view name, std::string_view value) {
  const std::string wanted = fmt::format("{}: {}", name, value);
  if (!lines.next() || !lines.line.starts_with(fmt::format("{}: ", name))) {
    refuse(path, lines, fmt::format("there should be \"{}\"", wanted));
  }
  if (lines.line == wanted) return;
  refuse(path, lines,
         fmt::format("it is for the {} {}, but the virtual encoder has {}: use another file, or the encoder it "
                     "was made for",
                     name, lines.line.substr(name.size() + 2), value));
}

}  // namespace

MemoryFile::MemoryFile(const std::string& path, std::string_view protocol, std::string_view model)
    : path_(link_target(path)), protocol_(protocol), model_(model) {}

void MemoryFile::load(MutableBytes memory) {
  const auto refuse_writing = [&](std::string_view why) {
    throw Failure(fmt::format("the memory file {} cannot be written: {}", path_, why));
  };
  try {
    file_.emplace(path_);
  } catch (const os::Failure& failure) {
    if (failure.kind() != os::Failure::Kind::in_use) refuse_writing(failure.what());
    throw Failure(
        fmt::format("another emulator keeps its memory in {}: end it, or give each a file of its own", path_));
  }
  if (file_->made()) {
    try {
      return save(memory, os::Durable::yes);
    } catch (const Failure&) {
      std::error_code ignored;
      std::filesystem::remove(os::path_of(path_), ignored);
      throw;
    }
  }
  const std::string text = read_text_file("the memory file", path_);
  std::vector<std::uint8_t> bytes(memory.size());
  parse(text, bytes);
  if (const int refusal = os::replaceable(path_); refusal != 0) refuse_writing(std::strerror(refusal));
  std::copy(bytes.begin(), bytes.end(), memory.begin());
}

void MemoryFile::parse(std::string_view text, MutableBytes memory) const {
  SignificantLines lines(text);
  lines.next();
  if (lines.line == dump_title) {
    throw Failure(
        fmt::format("{} is a dump, not the memory file of a virtual encoder: `absenc memory load` writes it into an "
                    "encoder; it was left as it is",
                    path_));
  }
  if (lines.line != memory_file_title) {
    throw Failure(
        fmt::format("{} is no memory file of a virtual encoder (its first line is not \"{}\"); it was "
                    "left as it is",
                    path_, memory_file_title));
  }
  expect(path_, lines, "protocol", protocol_);
  expect(path_, lines, "model", model_);
  expect(path_, lines, "size", std::to_string(memory.size()));
  std::size_t filled = 0;
  while (lines.next()) {
    const std::string address = fmt::format("{:04X}: ", filled);
    if (!lines.line.starts_with(address))
      refuse(path_, lines, fmt::format("there should be the bytes from {:04X} on", filled));
    const Result<std::size_t> size = parse_hex(lines.line.substr(address.size()), memory.subspan(filled));
    if (size.error() == Error::buffer_too_small)
      refuse(path_, lines, fmt::format("it has more than {} bytes", memory.size()));
    if (!size) refuse(path_, lines, "there is something else than bytes in hexadecimal");
    filled += *size;
  }
  if (filled != memory.size()) refuse(path_, lines, fmt::format("it ends after {} of {} bytes", filled, memory.size()));
}

std::string MemoryFile::to_text(Bytes memory) const {
  std::string text =
      fmt::format("{}\nprotocol: {}\nmodel: {}\nsize: {}\n", memory_file_title, protocol_, model_, memory.size());
  for (std::size_t i = 0; i < memory.size(); i += bytes_in_line) {
    text += fmt::format("{:04X}: {}\n", i, to_hex(memory.subspan(i, std::min(bytes_in_line, memory.size() - i))));
  }
  return text;
}

void MemoryFile::save(Bytes memory, os::Durable durable) {
  try {
    file_->replace(to_text(memory), durable);
  } catch (const os::Failure& failure) {
    throw Failure(fmt::format("the memory file cannot be written: {}", failure.what()));
  }
}

}  // namespace absenc::client
