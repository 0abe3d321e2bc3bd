// SPDX-License-Identifier: Apache-2.0
// One connection to a broker, by MQTT 5 or 3.1.1, with the functions that a sender needs. A separate process talks to
// the broker (mqtt_process.hpp), so no packet of a broker can end the process that reads encoders.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absenc/core/time.hpp"
#include "absenc/os/child_process.hpp"
#include "absenc/serve/mqtt_wire.hpp"

namespace absenc::serve {

/// Address and credentials of a broker. File names are "" if not used.
struct Broker {
  std::string host{};
  std::uint16_t port = 0;
  bool tls = false;
  std::string login_file{};  // file with one line: USER PASSWORD
  std::string ca_file{};     // certificate authority; "": those that this computer trusts
  std::string cert_file{};   // client certificate, used with `key_file`
  std::string key_file{};

  bool operator==(const Broker&) const = default;
  /// Returns the address as a URL: "mqtts://host:8883".
  [[nodiscard]] std::string text() const;
};

enum class MqttVersion : std::uint8_t { v5, v3_1_1 };

/// Identifies the client. The broker publishes `will`, retained, if the connection ends without a DISCONNECT packet.
struct MqttIdentity {
  std::string id;
  std::string will_topic;
  std::string will;
};

/// Not thread-safe: one thread creates, uses and destroys it.
class MqttClient {
 public:
  /// Starts the MQTT client process. Throws Failure when the files cannot be used.
  MqttClient(const Broker& broker, const MqttIdentity& identity, MqttVersion version);
  MqttClient(const MqttClient&) = delete;
  MqttClient& operator=(const MqttClient&) = delete;

  enum class State : std::uint8_t { connecting, connected, lost };
  /// Starts to connect to the broker's name or to one of its addresses. `try_all`: tries all addresses of the name one
  /// after the other until one accepts the connection.
  void connect(const std::string& host, bool try_all);
  /// Sends and receives for at most `longest`.
  State work(Time longest);
  /// Returns why the connection is lost.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  /// Returns whether the broker does not support this version of MQTT.
  [[nodiscard]] bool wrong_version() const { return wrong_version_; }
  /// Returns whether the process ended unexpectedly, as its library does at some malformed packets.
  [[nodiscard]] bool died() const { return died_; }

  /// Returns the number that the acknowledgement of this message will have.
  int publish(const std::string& topic, const std::string& payload, int qos, bool retain);

  struct Acknowledgement {
    int number = 0;
    std::string refused{};  // reason of the broker; "": the broker has accepted the message
  };
  [[nodiscard]] std::vector<Acknowledgement> take_acknowledgements();

  /// Sends a DISCONNECT packet, so that the will is not published.
  void end();

 private:
  void wait_until_ready();
  void receive();
  void take(WireFields frame);
  void lose(const std::string& why);
  void note_end();

  os::ChildProcess process_;
  std::string outgoing_;
  WireReader incoming_;
  State state_ = State::connecting;
  bool ready_ = false;
  bool wrong_version_ = false;
  bool died_ = false;
  std::string trouble_;
  Time last_frame_at_;  // when the process last sent a frame
  int last_number_ = 0;
  std::vector<Acknowledgement> acknowledgements_;
};

}  // namespace absenc::serve
