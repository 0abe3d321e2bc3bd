// SPDX-License-Identifier: Apache-2.0
// Frames between `absenc serve` and its MQTT client process: size (4 bytes), kind (1 byte), fields. Each side checks
// received frames like untrusted input.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "absenc/serve/fields.hpp"

namespace absenc::serve {

/// The kind of a frame, with its fields.
enum class Wire : std::uint8_t {
  // Frames to the client process:
  begin,    // host, port, tls, login_file, ca_file, cert_file, key_file, id, will topic, will, version
  connect,  // host, whether to try all of its addresses
  publish,  // number, topic, payload, QoS, retain
  leave,    // disconnects from the broker and ends the process
  // Frames from the client process:
  ready,         // the settings can be used
  failed,        // why the settings cannot be used
  connected,     // no fields
  lost,          // why, and whether the broker does not support the MQTT version
  acknowledged,  // number, reason of a refusal or ""
  alive,         // sign of life, every second
};

/// Builds one frame.
class WireFrame {
 public:
  explicit WireFrame(Wire kind) : kind_(kind) {}
  template <class Field>
  WireFrame& add(const Field& field) {
    fields_.add(field);
    return *this;
  }

  /// Returns the bytes to send.
  [[nodiscard]] std::string bytes() const;

 private:
  Wire kind_;
  FieldWriter fields_;
};

/// The fields of a received frame.
struct WireFields : FieldReader {
  WireFields(Wire what, FieldReader fields) : FieldReader(std::move(fields)), kind(what) {}

  Wire kind;
};

/// Assembles frames from received bytes.
class WireReader {
 public:
  /// `most`: largest size of a frame in bytes.
  explicit WireReader(std::size_t most) : most_(most) {}

  /// Received bytes are appended here.
  std::string bytes{};
  /// Returns the next whole frame. Throws client::Failure at an invalid size or kind.
  [[nodiscard]] std::optional<WireFields> next();

 private:
  std::size_t most_;
};

}  // namespace absenc::serve
