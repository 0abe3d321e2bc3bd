// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/open.hpp"

#include <algorithm>
#include <charconv>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absenc/capture/files/candump.hpp"
#include "absenc/capture/files/hex_text.hpp"
#include "absenc/capture/files/logic_csv.hpp"
#include "absenc/capture/files/raw.hpp"
#include "absenc/capture/files/saleae.hpp"
#include "absenc/capture/files/sigrok.hpp"
#include "absenc/capture/files/text_lines.hpp"
#include "absenc/capture/files/vcd.hpp"

namespace absenc::capture {

namespace {

constexpr std::size_t head_bytes = 1 << 16;

bool is_candump(std::string_view head) {
  std::size_t first = head.find_first_not_of("\r\n");
  if (first == std::string_view::npos) return false;
  CandumpLine line;
  return parse_candump(head.substr(first, head.find('\n', first) - first), line);
}

// Returns whether the first line of a file that begins with `head` is printable ASCII text.
bool is_text(std::string_view head) {
  const std::string_view line = head.substr(0, head.find_first_of("\r\n"));
  return std::all_of(line.begin(), line.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return c == '\t' || (byte >= ' ' && byte < 0x7F);
  });
}

// Opens a capture of levels. Returns nullptr, and does not take `source`, if it is no file of sigrok, Saleae, VCD or
// CSV.
std::unique_ptr<Reader> open_logic(std::unique_ptr<Source>& source, std::string_view head, std::string_view name,
                                   const OpenChoices& choices) {
  if (is_zip(head)) return read_sigrok(std::move(source), name, choices.samples_per_second);
  if (is_saleae(head)) {
    std::vector<SaleaeChannel> channels;
    channels.push_back({saleae_channel_name(std::filesystem::path(name).stem().string()), std::move(source)});
    return read_saleae(std::move(channels));
  }
  if (is_vcd(head)) return read_vcd(std::move(source), name);
  if (is_logic_csv(head)) return read_logic_csv(std::move(source), name, choices.samples_per_second);
  return nullptr;
}

std::unique_ptr<Reader> checked(std::unique_ptr<Reader> reader, std::string_view name, const OpenChoices& choices) {
  const std::size_t channels = reader->layout().channels.size();
  if (choices.channels != 0 && choices.channels != channels) {
    throw OpenError(std::string(name) + " holds " + std::to_string(channels) + " channels, not " +
                    std::to_string(choices.channels) + ": it tells by itself, so leave the number away");
  }
  return reader;
}

// Opens a folder of Logic 2's digital_0.bin, digital_1.bin ...; the numbers give the order.
std::unique_ptr<Reader> open_folder(const std::filesystem::path& folder, const OpenChoices& choices) {
  std::vector<std::pair<unsigned, std::filesystem::path>> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string stem = name_of(entry.path().stem());
    constexpr std::string_view prefix = "digital_";
    unsigned number = 0;
    if (!stem.starts_with(prefix) || entry.path().extension() != ".bin") continue;
    const char* end = stem.data() + stem.size();
    if (std::from_chars(stem.data() + prefix.size(), end, number).ptr != end) continue;
    files.emplace_back(number, entry.path());
  }
  if (files.empty()) {
    throw OpenError(name_of(folder) +
                    " is a folder without a binary export of Saleae Logic 2: there is no digital_0.bin");
  }
  std::sort(files.begin(), files.end());
  std::vector<SaleaeChannel> channels;
  for (const auto& [number, path] : files) {
    channels.push_back({saleae_channel_name(name_of(path.stem())), file_source(path)});
  }
  return checked(read_saleae(std::move(channels)), name_of(folder), choices);
}

}  // namespace

std::unique_ptr<Reader> open_capture(std::unique_ptr<Source> source, std::string_view name,
                                     const OpenChoices& choices) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(std::min<std::uint64_t>(source->size(), head_bytes)));
  bytes.resize(source->read(0, bytes));
  if (bytes.empty()) throw OpenError(std::string(name) + " is empty");
  const std::string_view head(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (std::unique_ptr<Reader> logic = open_logic(source, head, name, choices)) {
    return checked(std::move(logic), name, choices);
  }
  if (choices.channels != 0) return read_raw(std::move(source), name, choices.channels, choices.samples_per_second);
  if (is_candump(head)) return read_candump(std::move(source), name);
  if (is_hex_text(head)) return read_hex_text(std::move(source), name, choices.samples_per_second);
  if (is_text(head)) {
    if (const std::string problem = hex_text_problem(head); !problem.empty()) {
      throw OpenError(std::string(name) + " is no capture that is known, and no bytes as text, because " + problem);
    }
  }
  throw OpenError(
      std::string(name) +
      " is no capture that is known: neither a session of sigrok, VCD, CSV or binary export of Saleae Logic 2, "
      "log of candump nor bytes as text; of raw samples tell the number of channels and the sample rate");
}

std::unique_ptr<Reader> open_capture(const std::filesystem::path& path, const OpenChoices& choices) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return open_folder(path, choices);
  return open_capture(file_source(path), name_of(path), choices);
}

}  // namespace absenc::capture
