// SPDX-License-Identifier: Apache-2.0
// One connection to a broker, by MQTT 5 or 3.1.1, as far as a sender needs it. The library behind it is seen by
// mqtt_client.cpp alone.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absenc/core/time.hpp"

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

/// One thread.
class MqttClient {
 public:
  enum class Version : std::uint8_t { v5, v3_1_1 };

  /// `will_topic` gets `will`, retained, from the broker when we are gone without a word.
  struct Identity {
    std::string id;
    std::string will_topic;
    std::string will;
  };

  /// Throws Failure when the files cannot be used.
  MqttClient(const Broker& broker, const Identity& identity, Version version);
  ~MqttClient();
  MqttClient(const MqttClient&) = delete;
  MqttClient& operator=(const MqttClient&) = delete;

  enum class State : std::uint8_t { connecting, connected, lost };
  /// Begins to connect, to the broker's name or one of its addresses. `try_all`: of a name, tries its addresses one
  /// after the other until one takes the connection, and waits for that.
  void connect(const std::string& host, bool try_all);
  /// Sends and receives for at most this long.
  State work(Time longest);
  /// Why it is lost.
  [[nodiscard]] const std::string& trouble() const;
  /// The broker does not know this version of the protocol.
  [[nodiscard]] bool wrong_version() const;

  /// Returns the number by which it will be acknowledged; none when it could not be sent: then it is lost.
  std::optional<int> publish(const std::string& topic, const std::string& payload, int qos, bool retain);

  struct Acknowledgement {
    int number = 0;
    std::string refused{};  // why; "": the broker has taken it
  };
  [[nodiscard]] std::vector<Acknowledgement> take_acknowledgements();

  /// Says good-bye, so that the will is not published.
  void end();

 private:
  struct Library;
  std::unique_ptr<Library> library_;
};

}  // namespace absenc::serve
