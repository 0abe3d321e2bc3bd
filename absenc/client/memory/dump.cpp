// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/memory/dump.hpp"

#include <fmt/format.h>

#include <optional>

#include "absenc/client/error.hpp"
#include "absenc/client/text/text_file.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/core/crc.hpp"
#include "absenc/core/hex.hpp"

namespace absenc::client {

namespace {

constexpr std::string_view checksum_name = "checksum: ";
constexpr std::string_view edited = "edited";

/// CRC-16/IBM-3740 of the lines of a dump that its checksum covers, each with one line feed.
class Checksum {
 public:
  void add(std::string_view line) {
    for (const char c : line) crc_.update(static_cast<std::uint8_t>(c));
    crc_.update(std::uint8_t{'\n'});
  }
  [[nodiscard]] std::string text() const { return fmt::format("{:04X}", crc_.value()); }

 private:
  static constexpr CrcParameters parameters{
      .width = 16, .poly = 0x1021, .init = 0xFFFF, .refin = false, .refout = false, .xorout = 0};
  Crc<parameters> crc_;
};

std::string_view model_name(const Options& options) { return options.model != nullptr ? options.model->name : "none"; }

// Returns the lines at the beginning of a dump with protocol, model and options, which must be those of the encoder.
std::vector<std::string> header(const Unit& unit, const Options& options) {
  std::vector<std::string> lines{fmt::format("protocol: {}", unit.id), fmt::format("model: {}", model_name(options))};
  if (options.model != nullptr) return lines;
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    lines.push_back(fmt::format("option: {}={}", unit.options[i].name, to_text(unit.options[i], options[i])));
  }
  return lines;
}

class DumpParser {
 public:
  DumpParser(const std::string& name, std::string_view text, const Unit& unit, const Options& options,
             MemoryAccess access)
      : name_(name), lines_(text), unit_(unit), options_(options), access_(access) {}

  Dump parse() {
    read_title();
    for (const std::string& wanted : header(unit_, options_)) read_header(wanted);
    while (next()) {
      if (lines_.line.starts_with(checksum_name)) {
        read_checksum();
      } else {
        read_words();
      }
      sum_.add(lines_.line);
    }
    if (dump_.image.empty()) throw Failure(fmt::format("{} has no bytes", name_));
    return dump_;
  }

 private:
  [[noreturn]] void refuse(std::string_view what) const {
    throw Failure(fmt::format("{}, line {}: {}", name_, lines_.number, what));
  }

  bool next() {
    const bool more = lines_.next();
    if (more && dump_.checked) refuse("the checksum must be the last line");
    return more;
  }

  void read_title() {
    const std::string_view title = lines_.next() ? lines_.line : std::string_view();
    if (title == memory_file_title) {
      throw Failure(
          fmt::format("{} is the memory file of a virtual encoder, for `absenc emulate --memory`, and no dump: "
                      "`absenc memory dump` makes one of any encoder",
                      name_));
    }
    if (title != dump_title && title.starts_with("absenc dump ")) {
      throw Failure(fmt::format("{} begins with \"{}\", but this absenc reads \"{}\": use a newer absenc", name_, title,
                                dump_title));
    }
    if (title != dump_title) {
      throw Failure(fmt::format("{} is no dump (its first line is not \"{}\")", name_, dump_title));
    }
    sum_.add(title);
  }

  void read_header(const std::string& wanted) {
    const std::size_t value = wanted.find(' ') + 1;
    const std::string_view name = std::string_view(wanted).substr(0, value);
    if (!lines_.next() || !lines_.line.starts_with(name)) refuse(fmt::format("there should be \"{}...\"", name));
    if (lines_.line != wanted) {
      refuse(fmt::format("it was made from an encoder with {}, but this one has {}", lines_.line, wanted));
    }
    sum_.add(lines_.line);
  }

  static std::optional<std::uint32_t> take(std::string_view& text, std::string_view name, char behind) {
    if (!text.starts_with(name) || text.substr(name.size()).find(behind) == std::string_view::npos) return std::nullopt;
    const std::string_view number = text.substr(name.size(), text.find(behind, name.size()) - name.size());
    const Result<std::int64_t> value = parse_number(number);
    if (!value || *value < 0 || *value > UINT32_MAX) return std::nullopt;
    text.remove_prefix(name.size() + number.size() + 1);
    return static_cast<std::uint32_t>(*value);
  }

  void read_words() {
    std::string_view rest = lines_.line;
    MemoryAddress at;
    if (rest.starts_with("page ")) {
      const std::optional<std::uint32_t> page = take(rest, "page ", ' ');
      if (!page) refuse("behind page there should be its number");
      at.page = *page;
    }
    const std::optional<std::uint32_t> address = take(rest, "address ", ':');
    if (!address) {
      refuse(fmt::format("there should be \"{}: BYTES\" or \"{}CRC\"", to_text(unit_, {0, 0}), checksum_name));
    }
    at.address = *address;
    std::vector<std::uint8_t> bytes(rest.size());
    const Result<std::size_t> size = parse_hex(rest, bytes);
    const std::size_t word = word_bytes(unit_);
    if (!size || *size == 0 || *size % word != 0) {
      refuse(fmt::format("behind the address there should be {} of {} hexadecimal digits", word_noun(unit_, 2),
                         word == 1   ? "two"
                         : word == 2 ? "four"
                                     : "eight"));
    }
    for (std::size_t i = 0; i < *size; i += word) {
      std::uint32_t value = 0;
      for (std::size_t k = 0; k < word; ++k) value = value << 8 | bytes[i + k];
      put(at, value);
      ++at.address;
    }
  }

  void put(MemoryAddress at, std::uint32_t word) {
    if (const std::string why = closed(unit_, at, access_); !why.empty()) refuse(why);
    if (!dump_.image.emplace(at, word).second) {
      refuse(fmt::format("{} was already given in line {}", to_text(unit_, at), given_in_[at]));
    }
    given_in_[at] = lines_.number;
  }

  void read_checksum() {
    const std::string_view written = lines_.line.substr(checksum_name.size());
    if (written != edited && written != sum_.text()) {
      refuse(
          "the checksum is wrong: the file was damaged, or edited. If you edited it on purpose, write \"checksum: "
          "edited\" instead");
    }
    dump_.checked = true;
  }

  const std::string& name_;
  SignificantLines lines_;
  const Unit& unit_;
  const Options& options_;
  MemoryAccess access_;
  Checksum sum_;
  Dump dump_;
  // for each address, the number of the line of the dump that gives its content
  std::map<MemoryAddress, std::size_t> given_in_;
};

}  // namespace

std::string to_dump(const Unit& unit, const Options& options, const MemoryImage& image) {
  std::vector<std::string> lines{std::string(dump_title)};
  for (const std::string& line : header(unit, options)) lines.push_back(line);
  for (const MemoryRun& run : runs(image, bytes_in_line / word_bytes(unit))) {
    lines.push_back(fmt::format("{}: {}", to_text(unit, run.first), words_in_hex(unit, run.words)));
  }
  Checksum sum;
  std::string text;
  for (const std::string& line : lines) {
    sum.add(line);
    text += line + '\n';
  }
  text +=
      "# After editing: make the number in the next line \"edited\". Bytes that are not in this file are neither "
      "written nor compared.\n";
  return text + fmt::format("{}{}\n", checksum_name, sum.text());
}

Dump parse_dump(const std::string& name, std::string_view text, const Unit& unit, const Options& options,
                MemoryAccess access) {
  return DumpParser(name, text, unit, options, access).parse();
}

}  // namespace absenc::client
