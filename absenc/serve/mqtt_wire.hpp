// SPDX-License-Identifier: Apache-2.0
// Frames between `absenc serve` and its MQTT client, which is a process of its own: four bytes of size, one of kind,
// the fields. Each side checks what it reads as it would a stranger's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "absenc/serve/fields.hpp"

namespace absenc::serve {

enum class Wire : std::uint8_t {
  // To the client.
  begin,    // host, port, tls, login_file, ca_file, cert_file, key_file, id, will topic, will, version
  connect,  // host, whether to try all of its addresses
  publish,  // number, topic, payload, QoS, retain
  leave,    // says good-bye to the broker and ends
  // From it.
  ready,         // the settings are good
  failed,        // why they are not
  connected,     //
  lost,          // why, whether the broker does not know the version
  acknowledged,  // number, why it was refused or ""
  alive,         // every second
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

  /// The bytes to send.
  [[nodiscard]] std::string bytes() const;

 private:
  Wire kind_;
  FieldWriter fields_;
};

/// One frame that was received.
struct WireFields : FieldReader {
  WireFields(Wire what, FieldReader fields) : FieldReader(std::move(fields)), kind(what) {}

  Wire kind;
};

/// Puts received bytes together to frames.
class WireReader {
 public:
  /// `most`: bytes of the largest frame.
  explicit WireReader(std::size_t most) : most_(most) {}

  /// Received bytes are appended here.
  std::string bytes{};
  /// The next whole frame. Throws client::Failure: no frame begins like that.
  [[nodiscard]] std::optional<WireFields> next();

 private:
  std::size_t most_;
};

}  // namespace absenc::serve
