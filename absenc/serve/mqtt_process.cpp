// SPDX-License-Identifier: Apache-2.0
// MQTT client process. Only this file includes libmosquitto's headers.
#include "absenc/serve/mqtt_process.hpp"

#include <fmt/format.h>
#include <mosquitto.h>
#include <mqtt_protocol.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/os/child_process.hpp"
#include "absenc/os/network.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/serve/mqtt_client.hpp"
#include "absenc/serve/mqtt_wire.hpp"
#include "absenc/serve/secret_file.hpp"

namespace absenc::serve {

using namespace client;

namespace {

using namespace std::chrono_literals;

constexpr int keepalive_s = 15;
// Greatest number of messages that the broker has not acknowledged; the broker may set a lower limit.
constexpr int most_in_flight = 1000;
constexpr const char* system_certificates = "/etc/ssl/certs";
// Greatest memory of the MQTT client process in bytes; a single MQTT packet may have 256 MB.
constexpr std::size_t most_memory = 128'000'000;
// greatest size in bytes of a frame from `absenc serve`, the parent process
constexpr std::size_t most_frame = 256'000'000;
// Number of unsent bytes for the parent process at which this process stops reading from the broker.
constexpr std::size_t outgoing_limit = 100'000;
constexpr Time sign_of_life_interval = 1s;

void require(int error, const std::string& what) {
  if (error == MOSQ_ERR_SUCCESS) return;
  throw Failure(what + ": " + (error == MOSQ_ERR_ERRNO ? os::socket_error_text(errno) : ::mosquitto_strerror(error)));
}

/// The MQTT client process, with one connection to a broker.
class MqttProcess {
 public:
  explicit MqttProcess(os::Channel parent) : parent_(std::move(parent)) {}
  ~MqttProcess() { ::mosquitto_destroy(client_); }
  MqttProcess(const MqttProcess&) = delete;
  MqttProcess& operator=(const MqttProcess&) = delete;

  void run() {
    while (!over_ || !outgoing_.empty()) {
      if (!wait_and_exchange()) return;  // this process ends with its parent
      if (!over_) run_library();
      if (os::now() < next_sign_of_life_) continue;
      next_sign_of_life_ = os::now() + sign_of_life_interval;
      outgoing_ += WireFrame(Wire::alive).bytes();
    }
  }

 private:
  // Waits for the parent and the broker, and exchanges data with both. Returns false when the parent has ended.
  bool wait_and_exchange() {
    broker_socket_.watch(client_ == nullptr || over_ ? -1 : ::mosquitto_socket(client_));
    const int broker = broker_socket_.descriptor();
    const bool reads = outgoing_.size() < outgoing_limit;
    const bool writes = broker >= 0 && ::mosquitto_want_write(client_);
    std::array<os::Watched, 2> watched{
        {{.descriptor = parent_.get(), .wanted = {.to_read = true, .to_write = !outgoing_.empty()}},
         {.descriptor = broker, .wanted = {.to_read = reads, .to_write = writes}}}};
    os::wait_for(watched, std::min(next_sign_of_life_, os::now() + sign_of_life_interval));
    broker_ready_ = watched[1].ready;
    if (!parent_.receive(incoming_.bytes)) return false;
    while (std::optional<WireFields> frame = incoming_.next()) take(*frame);
    return parent_.send(outgoing_);
  }

  void take(WireFields& frame) {
    switch (frame.kind) {
      case Wire::begin:
        begin(frame);
        break;
      case Wire::connect: {
        const std::string host = frame.text();
        // mosquitto_connect tries each IP address of a host name, and blocks; mosquitto_connect_async tries only one
        // address.
        const auto connect = frame.number() != 0 ? &::mosquitto_connect : &::mosquitto_connect_async;
        if (client_ != nullptr) note(connect(client_, host.c_str(), broker_.port, keepalive_s));
        break;
      }
      case Wire::publish:
        publish(frame);
        break;
      case Wire::leave:
        if (client_ != nullptr) ::mosquitto_disconnect(client_);
        break;
      default:
        throw Failure("the parent sends a frame of its child");
    }
  }

  void begin(WireFields& frame) {
    broker_.host = frame.text();
    broker_.port = static_cast<std::uint16_t>(frame.number());
    broker_.tls = frame.number() != 0;
    for (auto* file : {&broker_.login_file, &broker_.ca_file, &broker_.cert_file, &broker_.key_file}) {
      *file = frame.text();
    }
    MqttIdentity identity;
    for (auto* text : {&identity.id, &identity.will_topic, &identity.will}) *text = frame.text();
    version_ = frame.number() == 0 ? MqttVersion::v5 : MqttVersion::v3_1_1;
    try {
      require(::mosquitto_lib_init(), "MQTT");
      client_ = ::mosquitto_new(identity.id.c_str(), true, this);
      if (client_ == nullptr) throw Failure("MQTT: no memory");
      set_up(identity);
      outgoing_ += WireFrame(Wire::ready).bytes();
    } catch (const Failure& failure) {
      outgoing_ += WireFrame(Wire::failed).add(std::string_view(failure.what())).bytes();
      over_ = true;
    }
  }

  void set_up(const MqttIdentity& identity) {
    ::mosquitto_int_option(client_, MOSQ_OPT_PROTOCOL_VERSION,
                           version_ == MqttVersion::v5 ? MQTT_PROTOCOL_V5 : MQTT_PROTOCOL_V311);
    ::mosquitto_int_option(client_, MOSQ_OPT_SEND_MAXIMUM, most_in_flight);
    ::mosquitto_int_option(client_, MOSQ_OPT_TCP_NODELAY, 1);
    ::mosquitto_connect_v5_callback_set(client_, &on_connect);
    ::mosquitto_disconnect_v5_callback_set(client_, &on_disconnect);
    ::mosquitto_publish_v5_callback_set(client_, &on_publish);
    if (!broker_.login_file.empty()) {
      const Secret login = read_secret(broker_.login_file);
      require(::mosquitto_username_pw_set(client_, login.name.c_str(), login.secret.c_str()), broker_.login_file);
    }
    if (broker_.tls) {
      const char* file = or_null(broker_.ca_file);
      const int error = ::mosquitto_tls_set(client_, file, file == nullptr ? system_certificates : nullptr,
                                            or_null(broker_.cert_file), or_null(broker_.key_file), nullptr);
      if (error == MOSQ_ERR_NOT_SUPPORTED) {
        throw Failure(broker_.text() +
                      " needs TLS, which is not in this build of absenc: use mqtt:// in a network that "
                      "you trust");
      }
      require(error, "the files for TLS to " + broker_.text());
    }
    const auto size = static_cast<int>(identity.will.size());
    require(::mosquitto_will_set(client_, identity.will_topic.c_str(), size, identity.will.data(), 1, true),
            identity.will_topic);
  }

  static const char* or_null(const std::string& text) { return text.empty() ? nullptr : text.c_str(); }

  void publish(WireFields& frame) {
    const std::uint32_t number = frame.number();
    const std::string topic = frame.text();
    const std::string payload = frame.text();
    const auto qos = static_cast<int>(frame.number());
    const bool retain = frame.number() != 0;
    if (client_ == nullptr || over_) return;
    int given = 0;
    const int error = ::mosquitto_publish(client_, &given, topic.c_str(), static_cast<int>(payload.size()),
                                          payload.data(), qos, retain);
    const bool only_this = error == MOSQ_ERR_OVERSIZE_PACKET || error == MOSQ_ERR_QOS_NOT_SUPPORTED ||
                           error == MOSQ_ERR_RETAIN_NOT_SUPPORTED;
    const bool connection_failed =
        error == MOSQ_ERR_ERRNO || error == MOSQ_ERR_CONN_LOST || error == MOSQ_ERR_NO_CONN || error == MOSQ_ERR_TLS;
    if (only_this) return acknowledge(number, ::mosquitto_strerror(error));
    if (error != MOSQ_ERR_SUCCESS && !connection_failed) {
      return lose(fmt::format("{}: {}", topic, ::mosquitto_strerror(error)));
    }
    if (qos != 0) numbers_[given] = number;
    // The broker may have sent a reason or acknowledgements before it closed the connection, so these are read.
    if (connection_failed) broker_ready_.to_read = true;
  }

  // Does the work of mosquitto_loop, which would wait for the broker only and not for the parent process.
  void run_library() {
    if (client_ == nullptr || !connects_) return;
    if (::mosquitto_socket(client_) < 0) return lose("the connection was lost");
    // mosquitto_loop_read is called even if the connection has ended, because it reports the reason.
    const auto [reads, writes] = broker_ready_;
    errno = 0;  // libmosquitto reads errno even after calls that do not set it, so an old value must not remain
    int error = MOSQ_ERR_SUCCESS;
    // A TLS handshake begins with a read, even when the library wants to write.
    const bool begins = broker_.tls && !connected_ && writes;
    if (reads || begins) error = ::mosquitto_loop_read(client_, 1);
    errno = 0;
    if (error == MOSQ_ERR_SUCCESS && writes) error = ::mosquitto_loop_write(client_, 1);
    if (error == MOSQ_ERR_SUCCESS) error = ::mosquitto_loop_misc(client_);
    note(error);
  }

  // Handles the answer of the broker to CONNECT. A `reason` below 128 is a return code of MQTT 3.1.1, for which
  // libmosquitto has other texts than for the reason codes of MQTT 5.
  void connect_answered(int reason) {
    if (reason == 0) {
      connected_ = true;
      outgoing_ += WireFrame(Wire::connected).bytes();
      return;
    }
    const bool wrong_version = version_ == MqttVersion::v5 && (reason == MQTT_RC_UNSUPPORTED_PROTOCOL_VERSION ||
                                                               reason == CONNACK_REFUSED_PROTOCOL_VERSION);
    lose(fmt::format("the broker refuses: {}",
                     reason >= 128 ? ::mosquitto_reason_string(reason) : ::mosquitto_connack_string(reason)),
         wrong_version);
  }

  void note(int error) {
    connects_ = true;
    if (error == MOSQ_ERR_SUCCESS) return;
    lose(error == MOSQ_ERR_ERRNO && errno != 0 ? os::socket_error_text(errno) : ::mosquitto_strerror(error));
  }

  void lose(const std::string& why, bool wrong_version = false) {
    if (std::exchange(over_, true)) return;
    outgoing_ += WireFrame(Wire::lost).add(std::string_view(why)).add(wrong_version ? 1U : 0U).bytes();
  }

  void acknowledge(std::uint32_t number, const char* refused) {
    outgoing_ += WireFrame(Wire::acknowledged).add(number).add(std::string_view(refused)).bytes();
  }

  static void on_connect(mosquitto*, void* self, int reason, int, const mosquitto_property*) {
    static_cast<MqttProcess*>(self)->connect_answered(reason);
  }
  static void on_disconnect(mosquitto*, void* self, int reason, const mosquitto_property*) {
    const bool has_reason = reason >= 128;
    static_cast<MqttProcess*>(self)->lose(
        has_reason ? fmt::format("the broker ended the connection: {}", ::mosquitto_reason_string(reason))
                   : "the connection was lost");
  }
  static void on_publish(mosquitto*, void* self, int given, int reason, const mosquitto_property*) {
    auto& process = *static_cast<MqttProcess*>(self);
    const auto number = process.numbers_.find(given);
    if (number == process.numbers_.end()) return;
    process.acknowledge(number->second, reason >= 128 ? ::mosquitto_reason_string(reason) : "");
    process.numbers_.erase(number);
  }

  os::Channel parent_;
  std::string outgoing_{};
  WireReader incoming_{most_frame};
  Broker broker_{};
  MqttVersion version_ = MqttVersion::v5;
  mosquitto* client_ = nullptr;
  // Numbers that the parent process has given to messages; the keys are libmosquitto's numbers of the messages.
  std::unordered_map<int, std::uint32_t> numbers_{};
  os::LibrarySocket broker_socket_{};
  os::Ready broker_ready_{};
  Time next_sign_of_life_{};
  bool connects_ = false;
  bool connected_ = false;
  bool over_ = false;
};

}  // namespace

int run_mqtt_process() {
  try {
    MqttProcess(os::become_child("absenc-mqtt", most_memory)).run();
    return 0;
  } catch (const std::exception&) {
    return 1;  // the error is not reported, because the parent process detects that this process has ended
  }
}

}  // namespace absenc::serve
