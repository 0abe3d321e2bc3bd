// SPDX-License-Identifier: Apache-2.0
// Lines "protocol: tformat", "model: NAME", "size: BYTES" after a first one that says what it is, then the bytes in
// hexadecimal with the address of the first: "0010: 00 5A ...". Empty lines and those that begin with # do not count.
#include "tools/absenc/memory_file.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "absenc/core/hex.hpp"
#include "absenc/os/error.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/wire_text.hpp"

namespace absenc::tool {

namespace {

constexpr std::string_view first_line = "absenc memory 1";
constexpr std::size_t bytes_in_line = 16;

/// Hands out the lines that count.
class Lines {
 public:
  Lines(const std::string& path, std::string_view text) : path_(&path), rest_(text) {}

  bool next() {
    while (!rest_.empty()) {
      const std::size_t end = std::min(rest_.find('\n'), rest_.size());
      line = rest_.substr(0, end);
      rest_.remove_prefix(std::min(end + 1, rest_.size()));
      ++number_;
      while (line.ends_with('\r') || line.ends_with(' ')) line.remove_suffix(1);
      if (!line.empty() && !line.starts_with('#')) return true;
    }
    return false;
  }

  [[noreturn]] void refuse(std::string_view what) const {
    throw ToolFailure(fmt::format("the memory file {}, line {}: {}; it was left as it is", *path_, number_, what));
  }

  std::string_view line;

 private:
  const std::string* path_;
  std::string_view rest_;
  std::size_t number_ = 0;
};

void expect(Lines& lines, std::string_view name, std::string_view value) {
  const std::string wanted = fmt::format("{}: {}", name, value);
  if (!lines.next() || !lines.line.starts_with(fmt::format("{}: ", name))) {
    lines.refuse(fmt::format("there should be \"{}\"", wanted));
  }
  if (lines.line == wanted) return;
  lines.refuse(
      fmt::format("it is for the {} {}, but the virtual encoder has {}: use another file, or the encoder it "
                  "was made for",
                  name, lines.line.substr(name.size() + 2), value));
}

}  // namespace

MemoryFile::MemoryFile(const std::string& path, std::string_view protocol, std::string_view model)
    : protocol_(protocol), model_(model) {
  // A link is kept, and what it leads to replaced, even if that is not there yet.
  namespace fs = std::filesystem;
  std::error_code ignored;
  fs::path target = fs::absolute(path, ignored);
  for (int links = 0; links < 40 && fs::is_symlink(target, ignored); ++links) {
    target = target.parent_path() / fs::read_symlink(target, ignored);
  }
  path_ = target;
}

void MemoryFile::load(MutableBytes memory) const {
  std::ifstream file(path_, std::ios::binary);
  if (!file) {
    std::error_code error;
    if (std::filesystem::exists(path_, error) || error) {
      throw ToolFailure(fmt::format("the memory file {} cannot be read: {}", path_, std::strerror(errno)));
    }
    return save(memory, os::Durable::yes);
  }
  std::ostringstream text;
  if (!(text << file.rdbuf())) throw ToolFailure(fmt::format("{} is no memory file of a virtual encoder", path_));
  std::vector<std::uint8_t> bytes(memory.size());
  parse(text.str(), bytes);
  if (const int error = os::replaceable(path_); error != 0) {
    throw ToolFailure(fmt::format("the memory file {} cannot be written: {}", path_, std::strerror(error)));
  }
  std::copy(bytes.begin(), bytes.end(), memory.begin());
}

void MemoryFile::parse(std::string_view text, MutableBytes memory) const {
  Lines lines(path_, text);
  if (!lines.next() || lines.line != first_line) {
    throw ToolFailure(
        fmt::format("{} is no memory file of a virtual encoder (its first line is not \"{}\"); it was "
                    "left as it is",
                    path_, first_line));
  }
  expect(lines, "protocol", protocol_);
  expect(lines, "model", model_);
  expect(lines, "size", std::to_string(memory.size()));
  std::size_t filled = 0;
  while (lines.next()) {
    const std::string address = fmt::format("{:04X}: ", filled);
    if (!lines.line.starts_with(address)) lines.refuse(fmt::format("there should be the bytes from {:04X} on", filled));
    const Result<std::size_t> size = parse_hex(lines.line.substr(address.size()), memory.subspan(filled));
    if (size.error() == Error::buffer_too_small) lines.refuse(fmt::format("it has more than {} bytes", memory.size()));
    if (!size) lines.refuse("there is something else than bytes in hexadecimal");
    filled += *size;
  }
  if (filled != memory.size()) lines.refuse(fmt::format("it ends after {} of {} bytes", filled, memory.size()));
}

std::string MemoryFile::to_text(Bytes memory) const {
  std::string text =
      fmt::format("{}\nprotocol: {}\nmodel: {}\nsize: {}\n", first_line, protocol_, model_, memory.size());
  for (std::size_t i = 0; i < memory.size(); i += bytes_in_line) {
    text += fmt::format("{:04X}: {}\n", i, to_hex(memory.subspan(i, std::min(bytes_in_line, memory.size() - i))));
  }
  return text;
}

void MemoryFile::save(Bytes memory, os::Durable durable) const {
  try {
    os::replace_file(path_, to_text(memory), durable);
  } catch (const os::Failure& failure) {
    throw ToolFailure(fmt::format("the memory file cannot be written: {}", failure.what()));
  }
}

}  // namespace absenc::tool
