// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/mqtt_wire.hpp"

#include <cstring>

#include "absenc/client/error.hpp"

namespace absenc::serve {

using namespace client;

namespace {

constexpr std::size_t size_bytes = 4;

[[noreturn]] void refuse() { throw Failure("a frame between absenc and its MQTT client is broken"); }

// Both ends are on one computer: its order of bytes is good.
std::uint32_t number_at(std::string_view bytes) {
  if (bytes.size() < size_bytes) refuse();
  std::uint32_t number = 0;
  std::memcpy(&number, bytes.data(), size_bytes);
  return number;
}

void put(std::string& bytes, std::size_t at, std::size_t number) {
  const auto short_number = static_cast<std::uint32_t>(number);
  std::memcpy(bytes.data() + at, &short_number, size_bytes);
}

}  // namespace

WireFrame::WireFrame(Wire kind) : bytes_(size_bytes, '\0') { bytes_ += static_cast<char>(kind); }

WireFrame& WireFrame::add(std::uint32_t number) {
  bytes_.resize(bytes_.size() + size_bytes);
  put(bytes_, bytes_.size() - size_bytes, number);
  return *this;
}

WireFrame& WireFrame::add(std::string_view text) {
  add(static_cast<std::uint32_t>(text.size()));
  bytes_ += text;
  return *this;
}

const std::string& WireFrame::bytes() {
  put(bytes_, 0, bytes_.size() - size_bytes);
  return bytes_;
}

std::uint32_t WireFields::number() {
  const std::uint32_t number = number_at(rest_);
  rest_.erase(0, size_bytes);
  return number;
}

std::string WireFields::text() {
  const std::size_t size = number();
  if (size > rest_.size()) refuse();
  std::string text = rest_.substr(0, size);
  rest_.erase(0, size);
  return text;
}

void WireFields::end() const {
  if (!rest_.empty()) refuse();
}

std::optional<WireFields> WireReader::next() {
  if (bytes.size() < size_bytes) return {};
  const std::size_t size = number_at(bytes);
  if (size == 0 || size > most_) refuse();
  if (bytes.size() < size_bytes + size) return {};
  const auto kind = static_cast<unsigned char>(bytes[size_bytes]);
  if (kind > static_cast<unsigned char>(Wire::alive)) refuse();
  WireFields fields(static_cast<Wire>(kind), std::string_view(bytes).substr(size_bytes + 1, size - 1));
  bytes.erase(0, size_bytes + size);
  return fields;
}

}  // namespace absenc::serve
