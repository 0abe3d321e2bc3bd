// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/spool_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/core/hash.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/file_name.hpp"
#include "absenc/serve/fields.hpp"

namespace absenc::serve {

namespace {

constexpr std::size_t head_bytes = 10;
constexpr std::size_t kind_at = 8, arrived_at = 9;
constexpr std::size_t largest_body = 100'000'000;
constexpr char kind_format = 'v', kind_message = 'm', kind_facts = 'f', kind_forget = 'x';
constexpr std::uint32_t newest_format = 1;
constexpr char is_waiting = 'w', has_arrived = 'a';

// Returns the checksum of a record: FNV-1a over its kind and body.
std::uint32_t checksum(char kind, std::string_view body) {
  const auto bytes_of = [](std::string_view text) {
    return Bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  };
  return fnv1a(bytes_of(body), fnv1a(bytes_of({&kind, 1})));
}

std::string record(char kind, const std::string& body) {
  return FieldWriter().add(checksum(kind, body)).add(static_cast<std::uint32_t>(body.size())).bytes() + kind +
         is_waiting + body;
}

void take_facts(FieldReader fields, SpoolFacts& facts) {
  const std::string source = fields.text();
  if (facts.source.empty()) facts.source = source;
  facts.next_id = std::max(facts.next_id, static_cast<std::int64_t>(fields.long_number()));
  while (!fields.at_end()) {
    std::uint64_t& next = facts.next_numbers[fields.text()];
    next = std::max(next, fields.long_number());
  }
}

}  // namespace

std::string spool_record(const Message& message) {
  return record(kind_message, FieldWriter()
                                  .add_long(static_cast<std::uint64_t>(message.id))
                                  .add_long(message.readings)
                                  .add(message.topic)
                                  .add(message.payload)
                                  .bytes());
}

std::string spool_record(const SpoolFacts& facts) {
  FieldWriter body;
  body.add(facts.source).add_long(static_cast<std::uint64_t>(facts.next_id));
  for (const auto& [name, next] : facts.next_numbers) body.add(name).add_long(next);
  return record(kind_facts, body.bytes());
}

std::string spool_head(const SpoolFacts& facts) {
  return record(kind_format, FieldWriter().add(newest_format).bytes()) + spool_record(facts);
}

std::string spool_record_without(std::string_view encoder) {
  return record(kind_forget, FieldWriter().add(encoder).bytes());
}

SpoolFile::SpoolFile(const std::string& path, const SpoolFacts& facts) : log_(path, os::LogFile::Open::fresh) {
  if (const int error = log_.append(spool_head(facts)); error != 0) {
    std::error_code ignored;
    std::filesystem::remove(os::path_of(path), ignored);
    throw os::system_failure("writing " + path, error);
  }
}

SpoolFile::SpoolFile(const std::string& path) : log_(path, os::LogFile::Open::existing) {
  const std::optional<StoredRecord> first = read_record(0);
  if (!first || first->kind != kind_format || first->body.size() != sizeof newest_format) return;
  const std::uint32_t format = FieldReader(first->body).number();
  if (format > newest_format) {
    throw os::Failure(os::Failure::Kind::unsupported,
                      fmt::format("{} has format {}, that of a newer absenc; this one knows formats up to {}: let the "
                                  "newer one send it, or choose another folder",
                                  path, format, newest_format));
  }
}

// Returns the record at `offset`; nothing at the end of the file or if the record is damaged.
std::optional<SpoolFile::StoredRecord> SpoolFile::read_record(std::size_t offset) const {
  const std::string head = log_.read(offset, head_bytes);
  if (head.size() < head_bytes) return {};
  FieldReader numbers(head.substr(0, kind_at));
  const std::uint32_t sum = numbers.number();
  const std::size_t size = numbers.number();
  if (size > largest_body) return {};
  std::string body = log_.read(offset + head_bytes, size);
  if (body.size() < size || checksum(head[kind_at], body) != sum) return {};
  return StoredRecord{head[kind_at], head[arrived_at] == has_arrived, std::move(body), offset + head_bytes + size};
}

std::optional<SpoolFile::StoredMessage> SpoolFile::next(std::size_t& offset, SpoolFacts* facts) const {
  try {
    while (std::optional<StoredRecord> record = read_record(offset)) {
      const std::size_t at = offset;
      FieldReader fields(std::move(record->body));
      if (record->kind == kind_message) {
        StoredMessage found{{}, at, record->arrived};
        found.message.id = static_cast<std::int64_t>(fields.long_number());
        found.message.readings = fields.long_number();
        found.message.topic = fields.text();
        found.message.payload = fields.text();
        offset = record->end;
        return found;
      }
      if (facts != nullptr && record->kind == kind_facts) take_facts(std::move(fields), *facts);
      if (facts != nullptr && record->kind == kind_forget) facts->next_numbers.erase(fields.text());
      offset = record->end;
    }
  } catch (const client::Failure&) {  // a record with an invalid body ends the file, like a damaged record
  }
  return {};
}

int SpoolFile::mark_arrived(std::size_t offset) const { return log_.replace(offset + arrived_at, has_arrived); }

}  // namespace absenc::serve
