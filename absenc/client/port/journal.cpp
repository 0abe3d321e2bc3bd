// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/port/journal.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "absenc/client/error.hpp"
#include "absenc/os/append.hpp"
#include "absenc/os/file_name.hpp"
#include "absenc/os/user_folders.hpp"

namespace absenc::client {

namespace {

constexpr std::array fields{&JournalEntry::time,  &JournalEntry::encoder, &JournalEntry::what,    &JournalEntry::before,
                            &JournalEntry::after, &JournalEntry::result,  &JournalEntry::put_back};

std::string calendar_time() {
  const auto now = std::chrono::floor<std::chrono::milliseconds>(std::chrono::system_clock::now());
  const auto seconds = std::chrono::floor<std::chrono::seconds>(now);
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(std::chrono::system_clock::to_time_t(seconds)),
                     (now - seconds).count());
}

std::string line_of(const JournalEntry& entry) {
  std::string line;
  for (const auto field : fields) {
    std::string text = entry.*field;
    std::ranges::replace_if(
        text, [](char one) { return static_cast<unsigned char>(one) < ' '; }, ' ');
    line += (field == fields.front() ? "" : "\t") + text;
  }
  return line + "\n";
}

}  // namespace

std::string journal_path() {
  if (std::string path = os::environment("ABSENC_CHANGES"); !path.empty()) return path == "none" ? "" : path;
  std::string folder = os::environment("STATE_DIRECTORY");  // a service of systemd has one
  if (folder.empty()) folder = os::state_folder();
  return folder.empty() ? "" : os::name_of(os::path_of(folder) / "changes.tsv");
}

std::string append_to_journal(const std::string& path, JournalEntry entry) {
  entry.time = calendar_time();
  const int error = os::append_line(path, line_of(entry));
  if (error == 0) return {};
  return fmt::format("the change is not in the journal {}: {}", path, std::strerror(error));
}

Journal read_journal(const std::string& path) {
  Journal journal;
  std::error_code error;
  if (path.empty() || !std::filesystem::exists(os::path_of(path), error)) return journal;
  std::ifstream file(os::path_of(path), std::ios::binary);
  if (!file) throw Failure(fmt::format("the journal {} cannot be read: {}", path, std::strerror(errno)));
  for (std::string line; std::getline(file, line);) {
    JournalEntry entry;
    std::size_t begin = 0;
    std::size_t count = 0;
    while (begin <= line.size() && count < fields.size()) {
      const std::size_t end = std::min(line.find('\t', begin), line.size());
      entry.*fields[count++] = line.substr(begin, end - begin);
      begin = end + 1;
    }
    if (count == fields.size() && begin > line.size() && !file.eof()) {
      journal.entries.push_back(std::move(entry));
    } else if (!line.empty()) {
      ++journal.damaged;
    }
  }
  return journal;
}

}  // namespace absenc::client
