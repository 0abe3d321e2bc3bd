// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/spool_file.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/file_name.hpp"
#include "absenc/serve/fields.hpp"

namespace absenc::serve {

namespace {

constexpr std::size_t head_bytes = 10;
constexpr std::size_t kind_at = 8, arrived_at = 9;
constexpr std::size_t largest_body = 100'000'000;
constexpr char kind_message = 'm', kind_facts = 'f', kind_forget = 'x';
constexpr char is_waiting = 'w', has_arrived = 'a';

// Returns the checksum of a record: FNV-1a over its kind and body.
std::uint32_t checksum(char kind, std::string_view body) {
  std::uint32_t hash = 2166136261U;
  const auto take = [&](char one) { hash = (hash ^ static_cast<unsigned char>(one)) * 16777619U; };
  take(kind);
  for (const char one : body) take(one);
  return hash;
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

std::string spool_record_without(std::string_view encoder) {
  return record(kind_forget, FieldWriter().add(encoder).bytes());
}

SpoolFile::SpoolFile(const std::string& path, const SpoolFacts& facts) : log_(path, os::LogFile::Open::fresh) {
  if (const int error = log_.append(spool_record(facts)); error != 0) {
    std::error_code ignored;
    std::filesystem::remove(os::path_of(path), ignored);
    throw os::system_failure("writing " + path, error);
  }
}

SpoolFile::SpoolFile(const std::string& path) : log_(path, os::LogFile::Open::existing) {}

std::optional<SpoolFile::StoredMessage> SpoolFile::next(std::size_t& offset, SpoolFacts* facts) const {
  try {
    for (;;) {
      const std::string head = log_.read(offset, head_bytes);
      if (head.size() < head_bytes) return {};
      FieldReader numbers(head.substr(0, kind_at));
      const std::uint32_t sum = numbers.number();
      const std::size_t size = numbers.number();
      if (size > largest_body) return {};
      const std::string body = log_.read(offset + head_bytes, size);
      if (body.size() < size || checksum(head[kind_at], body) != sum) return {};
      const std::size_t at = offset;
      FieldReader fields(body);
      if (head[kind_at] == kind_message) {
        StoredMessage found{{}, at, head[arrived_at] == has_arrived};
        found.message.id = static_cast<std::int64_t>(fields.long_number());
        found.message.readings = fields.long_number();
        found.message.topic = fields.text();
        found.message.payload = fields.text();
        offset = at + head_bytes + size;
        return found;
      }
      if (facts != nullptr && head[kind_at] == kind_facts) take_facts(fields, *facts);
      if (facts != nullptr && head[kind_at] == kind_forget) facts->next_numbers.erase(fields.text());
      offset = at + head_bytes + size;
    }
  } catch (const client::Failure&) {  // a record with an invalid body ends the file, like a damaged record
    return {};
  }
}

int SpoolFile::mark_arrived(std::size_t offset) const { return log_.replace(offset + arrived_at, has_arrived); }

}  // namespace absenc::serve
