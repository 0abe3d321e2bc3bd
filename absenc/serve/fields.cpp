// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/fields.hpp"

#include <cstring>

#include "absenc/client/error.hpp"

namespace absenc::serve {

namespace {

template <class Number>
void append_number(std::string& bytes, Number number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

[[noreturn]] void refuse_fields() { throw client::Failure("a field is truncated, or bytes follow the last one"); }

}  // namespace

FieldWriter& FieldWriter::add(std::uint32_t number) {
  append_number(bytes_, number);
  return *this;
}

FieldWriter& FieldWriter::add_long(std::uint64_t number) {
  append_number(bytes_, number);
  return *this;
}

FieldWriter& FieldWriter::add(std::string_view text) {
  append_number(bytes_, static_cast<std::uint32_t>(text.size()));
  bytes_ += text;
  return *this;
}

void FieldReader::take(void* number, std::size_t size) {
  if (bytes_.size() - at_ < size) refuse_fields();
  std::memcpy(number, bytes_.data() + at_, size);
  at_ += size;
}

std::uint32_t FieldReader::number() {
  std::uint32_t number = 0;
  take(&number, sizeof number);
  return number;
}

std::uint64_t FieldReader::long_number() {
  std::uint64_t number = 0;
  take(&number, sizeof number);
  return number;
}

std::string FieldReader::text() {
  const std::size_t size = number();
  if (bytes_.size() - at_ < size) refuse_fields();
  std::string text = bytes_.substr(at_, size);
  at_ += size;
  return text;
}

void FieldReader::end() const {
  if (!at_end()) refuse_fields();
}

}  // namespace absenc::serve
