// SPDX-License-Identifier: Apache-2.0
// One connection to a broker, by MQTT 5 or 3.1.1, as far as a sender needs it. A process of its own speaks to the
// broker (mqtt_process.hpp): no packet of a broker can end the process that reads encoders.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absenc/core/time.hpp"
#include "absenc/os/child_process.hpp"
#include "absenc/serve/mqtt_wire.hpp"

namespace absenc::serve {

/// How to reach a broker. Files are "" where there is none.
struct Broker {
  std::string host{};
  std::uint16_t port = 0;
  bool tls = false;
  std::string login_file{};  // one line: USER PASSWORD
  std::string ca_file{};     // whom to trust; "": whom this computer trusts
  std::string cert_file{};   // by which the broker knows us, with its key
  std::string key_file{};

  bool operator==(const Broker&) const = default;
  /// "mqtts://host:8883"
  [[nodiscard]] std::string text() const;
};

enum class MqttVersion : std::uint8_t { v5, v3_1_1 };

/// The broker publishes `will`, retained, when the connection ends without a good-bye.
struct MqttIdentity {
  std::string id;
  std::string will_topic;
  std::string will;
};

/// For one thread, which makes and ends it.
class MqttClient {
 public:
  /// Starts the process. Throws Failure when the files cannot be used.
  MqttClient(const Broker& broker, const MqttIdentity& identity, MqttVersion version);
  MqttClient(const MqttClient&) = delete;
  MqttClient& operator=(const MqttClient&) = delete;

  enum class State : std::uint8_t { connecting, connected, lost };
  /// Begins to connect, to the broker's name or one of its addresses. `try_all`: tries all addresses of a name, one
  /// after the other, until one takes the connection.
  void connect(const std::string& host, bool try_all);
  /// Sends and receives for at most this long.
  State work(Time longest);
  /// Why it is lost.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  /// The broker does not know this version of the protocol.
  [[nodiscard]] bool wrong_version() const { return wrong_version_; }
  /// The process ended by itself, as it does at a packet that its library cannot stand.
  [[nodiscard]] bool died() const { return died_; }

  /// Returns the number by which it will be acknowledged.
  int publish(const std::string& topic, const std::string& payload, int qos, bool retain);

  struct Acknowledgement {
    int number = 0;
    std::string refused{};  // why; "": the broker has taken it
  };
  [[nodiscard]] std::vector<Acknowledgement> take_acknowledgements();

  /// Says good-bye, so that the will is not published.
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
  Time heard_;  // when the process last sent something
  int last_number_ = 0;
  std::vector<Acknowledgement> acknowledgements_;
};

}  // namespace absenc::serve
