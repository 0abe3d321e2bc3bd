// SPDX-License-Identifier: Apache-2.0
// The only file that includes libmosquitto's header.
#include "absenc/serve/mqtt_client.hpp"

#include <fmt/format.h>
#include <mosquitto.h>
#include <mqtt_protocol.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/os/network.hpp"
#include "absenc/serve/secret_file.hpp"

namespace absenc::serve {

using namespace client;

namespace {

constexpr int keepalive_s = 15;
constexpr int most_in_flight = 1000;  // as far as the broker allows it
constexpr const char* trusted_here = "/etc/ssl/certs";

void require(int error, const std::string& what) {
  if (error == MOSQ_ERR_SUCCESS) return;
  throw Failure(what + ": " + (error == MOSQ_ERR_ERRNO ? std::strerror(errno) : ::mosquitto_strerror(error)));
}

}  // namespace

std::string Broker::text() const { return fmt::format("{}://{}:{}", tls ? "mqtts" : "mqtt", host, port); }

struct MqttClient::Library {
  Library(const Broker& to, const Identity& identity, Version spoken) : broker(to), version(spoken) {
    static const int ready = ::mosquitto_lib_init();
    require(ready, "MQTT");
    client = ::mosquitto_new(identity.id.c_str(), true, this);
    if (client == nullptr) throw Failure("MQTT: no memory");
    try {
      set_up(identity);
    } catch (...) {
      ::mosquitto_destroy(client);
      throw;
    }
  }
  ~Library() { ::mosquitto_destroy(client); }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

  void set_up(const Identity& identity) {
    ::mosquitto_int_option(client, MOSQ_OPT_PROTOCOL_VERSION,
                           version == Version::v5 ? MQTT_PROTOCOL_V5 : MQTT_PROTOCOL_V311);
    ::mosquitto_int_option(client, MOSQ_OPT_SEND_MAXIMUM, most_in_flight);
    ::mosquitto_int_option(client, MOSQ_OPT_TCP_NODELAY, 1);
    ::mosquitto_connect_v5_callback_set(client, &on_connect);
    ::mosquitto_disconnect_v5_callback_set(client, &on_disconnect);
    ::mosquitto_publish_v5_callback_set(client, &on_publish);
    if (!broker.login_file.empty()) {
      const Secret login = read_secret(broker.login_file);
      require(::mosquitto_username_pw_set(client, login.name.c_str(), login.secret.c_str()), broker.login_file);
    }
    if (broker.tls) {
      const char* file = broker.ca_file.empty() ? nullptr : broker.ca_file.c_str();
      require(::mosquitto_tls_set(client, file, file == nullptr ? trusted_here : nullptr, or_null(broker.cert_file),
                                  or_null(broker.key_file), nullptr),
              "the files for TLS to " + broker.text());
    }
    const auto size = static_cast<int>(identity.will.size());
    require(::mosquitto_will_set(client, identity.will_topic.c_str(), size, identity.will.data(), 1, true),
            identity.will_topic);
  }

  static const char* or_null(const std::string& text) { return text.empty() ? nullptr : text.c_str(); }

  // Reasons of version 3.1.1 have numbers of their own, below 128.
  void connect_answered(int reason) {
    if (reason == 0) {
      state = State::connected;
      return;
    }
    wrong_version = version == Version::v5 &&
                    (reason == MQTT_RC_UNSUPPORTED_PROTOCOL_VERSION || reason == CONNACK_REFUSED_PROTOCOL_VERSION);
    lose(fmt::format("the broker refuses: {}",
                     reason >= 128 ? ::mosquitto_reason_string(reason) : ::mosquitto_connack_string(reason)));
  }

  void note(int error) {
    if (error == MOSQ_ERR_SUCCESS) return;
    lose(error == MOSQ_ERR_ERRNO && errno != 0 ? std::strerror(errno) : ::mosquitto_strerror(error));
  }

  void lose(const std::string& why) {
    if (state == State::lost) return;
    state = State::lost;
    trouble = why;
  }

  static void on_connect(mosquitto*, void* self, int reason, int, const mosquitto_property*) {
    static_cast<Library*>(self)->connect_answered(reason);
  }
  static void on_disconnect(mosquitto*, void* self, int reason, const mosquitto_property*) {
    const bool told = reason >= 128;
    static_cast<Library*>(self)->lose(told ? fmt::format("the broker ended it: {}", ::mosquitto_reason_string(reason))
                                           : "the connection was lost");
  }
  static void on_publish(mosquitto*, void* self, int number, int reason, const mosquitto_property*) {
    const char* refused = reason >= 128 ? ::mosquitto_reason_string(reason) : "";
    static_cast<Library*>(self)->acknowledgements.push_back({number, refused});
  }

  Broker broker;
  Version version;
  mosquitto* client = nullptr;
  State state = State::connecting;
  std::string trouble{};
  bool wrong_version = false;
  std::vector<Acknowledgement> acknowledgements{};
};

MqttClient::MqttClient(const Broker& broker, const Identity& identity, Version version)
    : library_(std::make_unique<Library>(broker, identity, version)) {}
MqttClient::~MqttClient() = default;

void MqttClient::connect(const std::string& host, bool try_all) {
  Library& library = *library_;
  const auto begin = try_all ? &::mosquitto_connect : &::mosquitto_connect_async;
  library.note(begin(library.client, host.c_str(), library.broker.port, keepalive_s));
}

// mosquitto_loop would do the same with select(), which knows descriptors below 1024 only: many encoders have more.
MqttClient::State MqttClient::work(Time longest) {
  Library& library = *library_;
  if (library.state == State::lost) return library.state;
  const int socket = ::mosquitto_socket(library.client);
  if (socket < 0) {
    library.lose("the connection was lost");
    return library.state;
  }
  const os::Ready ready = os::wait_for_socket(socket, ::mosquitto_want_write(library.client), longest);
  errno = 0;  // the library looks at it after calls that do not set it
  int error = MOSQ_ERR_SUCCESS;
  // TLS begins by reading, also when it wants to write.
  const bool begins = library.broker.tls && library.state == State::connecting && ready.to_write;
  if (ready.to_read || begins) error = ::mosquitto_loop_read(library.client, 1);
  errno = 0;
  if (error == MOSQ_ERR_SUCCESS && ready.to_write) error = ::mosquitto_loop_write(library.client, 1);
  if (error == MOSQ_ERR_SUCCESS) error = ::mosquitto_loop_misc(library.client);
  library.note(error);
  return library.state;
}

const std::string& MqttClient::trouble() const { return library_->trouble; }
bool MqttClient::wrong_version() const { return library_->wrong_version; }

std::optional<int> MqttClient::publish(const std::string& topic, const std::string& payload, int qos, bool retain) {
  int number = 0;
  const int error = ::mosquitto_publish(library_->client, &number, topic.c_str(), static_cast<int>(payload.size()),
                                        payload.data(), qos, retain);
  if (error == MOSQ_ERR_SUCCESS) return number;
  library_->lose(fmt::format("{}: {}", topic, ::mosquitto_strerror(error)));
  return {};
}

std::vector<MqttClient::Acknowledgement> MqttClient::take_acknowledgements() {
  return std::exchange(library_->acknowledgements, {});
}

void MqttClient::end() { ::mosquitto_disconnect(library_->client); }

}  // namespace absenc::serve
