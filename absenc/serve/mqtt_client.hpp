// SPDX-License-Identifier: Apache-2.0
// One connection to a broker, by MQTT 5 or 3.1.1, through a separate process (mqtt_process.hpp).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absenc/core/time.hpp"
#include "absenc/os/child_process.hpp"
#include "absenc/serve/mqtt_wire.hpp"

namespace absenc::serve {

/// Address and credentials of a broker. A file name is "" if the file is not used.
struct Broker {
  std::string host{};
  std::uint16_t port = 0;
  bool tls = false;
  std::string login_file{};  // file with one line: USER PASSWORD
  std::string ca_file{};     // file of the certificate authority; "": the authorities that this computer trusts
  std::string cert_file{};   // file of the client certificate, used with `key_file`
  std::string key_file{};

  bool operator==(const Broker&) const = default;
  /// Returns the address of the broker as a URL: "mqtts://host:8883".
  [[nodiscard]] std::string text() const;
};

enum class MqttVersion : std::uint8_t { v5, v3_1_1 };

/// Identity of an MQTT client, and its will, which is published with the retain flag.
struct MqttIdentity {
  std::string id;
  std::string will_topic;
  std::string will;
};

/// A connection to a broker through the MQTT client process. Not thread-safe.
class MqttClient {
 public:
  /// Starts the MQTT client process. Throws client::Failure or os::Failure if it cannot start or cannot use `broker`.
  MqttClient(const Broker& broker, const MqttIdentity& identity, MqttVersion version);
  MqttClient(const MqttClient&) = delete;
  MqttClient& operator=(const MqttClient&) = delete;

  enum class State : std::uint8_t { connecting, connected, lost };
  /// Queues a request to connect to `host`, a name or an address. With `try_all`, each IP address of the name is
  /// tried in turn; otherwise only one of them.
  void connect(const std::string& host, bool try_all);
  /// Waits until frames can be exchanged with the MQTT client process, at most for the time `longest`, and exchanges
  /// them. Returns the state of the connection to the broker.
  State work(Time longest);
  /// Returns why the connection to the broker is lost; "" if it is not lost.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  /// Returns whether the broker has refused the version of MQTT with which this client tried to connect.
  [[nodiscard]] bool wrong_version() const { return wrong_version_; }
  /// Returns whether the MQTT client process ended unexpectedly.
  [[nodiscard]] bool died() const { return died_; }

  /// Queues a message. Returns its number, which Acknowledgement::number repeats if the message is acknowledged.
  int publish(const std::string& topic, const std::string& payload, int qos, bool retain);

  struct Acknowledgement {
    int number = 0;
    std::string refused{};  // why the message was refused; "": the broker has accepted it
  };
  [[nodiscard]] std::vector<Acknowledgement> take_acknowledgements();

  /// Requests a DISCONNECT packet, so that the broker does not publish the will; waits at most 0.5 s for the end of
  /// the connection.
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
  Time last_frame_at_;  // time at which the MQTT client process last sent a frame
  int last_number_ = 0;
  std::vector<Acknowledgement> acknowledgements_;
};

}  // namespace absenc::serve
