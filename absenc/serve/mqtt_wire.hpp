// SPDX-License-Identifier: Apache-2.0
// Frames between `absenc serve` and its MQTT client process: size (4 bytes), kind (1 byte), fields.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "absenc/serve/fields.hpp"

namespace absenc::serve {

/// The kind of a frame, with the fields that follow it.
enum class Wire : std::uint8_t {
  // Frames to the MQTT client process:
  begin,    // settings; fields: those of the struct Broker, those of MqttIdentity, then the MQTT version
  connect,  // connects to the broker; fields: host name or address, whether to try all IP addresses of the host
  publish,  // publishes a message; fields: number of the message, topic, payload, QoS, retain flag
  leave,    // the process disconnects from the broker and ends; no fields
  // Frames from the MQTT client process:
  ready,      // the process can use the settings of the frame `begin`; no fields
  failed,     // the process cannot use the settings of the frame `begin`; field: the reason
  connected,  // the broker has accepted the connection; no fields
  lost,       // the connection to the broker is lost; fields: reason, whether the broker refused the MQTT version
  // the broker has accepted or refused a message; fields: number of the message, reason of the refusal or ""
  acknowledged,
  alive,  // sign of life of the process, sent every second; no fields
};

/// A frame to be sent, which is built field by field.
class WireFrame {
 public:
  explicit WireFrame(Wire kind) : kind_(kind) {}
  template <class Field>
  WireFrame& add(const Field& field) {
    fields_.add(field);
    return *this;
  }

  /// Returns the bytes of the whole frame.
  [[nodiscard]] std::string bytes() const;

 private:
  Wire kind_;
  FieldWriter fields_;
};

/// The kind and the fields of a received frame.
struct WireFields : FieldReader {
  WireFields(Wire what, FieldReader fields) : FieldReader(std::move(fields)), kind(what) {}

  Wire kind;
};

/// An assembler of frames from received bytes.
class WireReader {
 public:
  /// `most`: largest allowed size of a frame in bytes.
  explicit WireReader(std::size_t most) : most_(most) {}

  /// Received bytes that `next` has not returned as a frame yet; the caller appends to them.
  std::string bytes{};
  /// Returns the next complete frame; nothing if there is none. Throws client::Failure.
  [[nodiscard]] std::optional<WireFields> next();

 private:
  std::size_t most_;
};

}  // namespace absenc::serve
