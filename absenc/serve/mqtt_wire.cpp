// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/mqtt_wire.hpp"

#include "absenc/client/error.hpp"

namespace absenc::serve {

namespace {

constexpr std::size_t size_bytes = 4;

[[noreturn]] void refuse_frame() { throw client::Failure("a frame between absenc and its MQTT client is broken"); }

}  // namespace

std::string WireFrame::bytes() const {
  const std::string& fields = fields_.bytes();
  return FieldWriter().add(static_cast<std::uint32_t>(1 + fields.size())).bytes() + static_cast<char>(kind_) + fields;
}

std::optional<WireFields> WireReader::next() {
  if (bytes.size() < size_bytes) return {};
  const std::size_t size = FieldReader(bytes.substr(0, size_bytes)).number();
  if (size == 0 || size > most_) refuse_frame();
  if (bytes.size() < size_bytes + size) return {};
  const auto kind = static_cast<unsigned char>(bytes[size_bytes]);
  if (kind > static_cast<unsigned char>(Wire::alive)) refuse_frame();
  WireFields frame{static_cast<Wire>(kind), FieldReader(bytes.substr(size_bytes + 1, size - 1))};
  bytes.erase(0, size_bytes + size);
  return frame;
}

}  // namespace absenc::serve
