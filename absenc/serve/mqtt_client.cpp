// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/mqtt_client.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/os/network.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/serve/mqtt_process.hpp"

namespace absenc::serve {

using namespace client;

namespace {

using namespace std::chrono_literals;

// Greatest size in bytes of a frame from the MQTT client process.
constexpr std::size_t most_in_frame = 4096;
constexpr Time time_to_start = 10s;
// If the MQTT client process is silent for longer, it counts as dead: it sends a sign of life each second.
constexpr Time longest_silence = 10s;
constexpr Time time_to_end = 500ms;

// Replaces characters that are not printable ASCII: the text may come from the broker.
std::string printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c > 0x7E; }, '?');
  return text;
}

}  // namespace

std::string Broker::text() const { return fmt::format("{}://{}:{}", tls ? "mqtts" : "mqtt", host, port); }

MqttClient::MqttClient(const Broker& broker, const MqttIdentity& identity, MqttVersion version)
    : process_({"absenc", "serve", std::string(mqtt_process_word)}),
      incoming_(most_in_frame),
      last_frame_at_(os::now()) {
  WireFrame frame(Wire::begin);
  frame.add(broker.host).add(broker.port).add(broker.tls ? 1U : 0U);
  for (const auto* file : {&broker.login_file, &broker.ca_file, &broker.cert_file, &broker.key_file}) frame.add(*file);
  frame.add(identity.id).add(identity.will_topic).add(identity.will).add(static_cast<std::uint32_t>(version));
  outgoing_ = frame.bytes();
  wait_until_ready();
}

void MqttClient::wait_until_ready() {
  const Time deadline = os::now() + time_to_start;
  while (!ready_ && state_ != State::lost && os::now() < deadline) work(20ms);
  if (ready_) return;
  throw Failure(state_ == State::lost ? trouble_ : "the process of the MQTT client does not start");
}

void MqttClient::connect(const std::string& host, bool try_all) {
  outgoing_ += WireFrame(Wire::connect).add(host).add(try_all ? 1U : 0U).bytes();
}

MqttClient::State MqttClient::work(Time longest) {
  if (state_ == State::lost) return state_;
  const os::Ready ready = os::wait_for_socket(process_.channel().get(), !outgoing_.empty(), longest);
  if (ready.to_read) receive();
  // Frames from the MQTT client process are received before frames to it are sent: if the process has ended, its last
  // frames may give the reason.
  if (state_ != State::lost && !process_.channel().send(outgoing_)) note_end();
  if (state_ == State::connected && os::now() - last_frame_at_ > longest_silence) {
    process_.end({});
    lose("the process of the MQTT client does not respond");
  }
  return state_;
}

void MqttClient::receive() {
  const bool open = process_.channel().receive(incoming_.bytes);
  last_frame_at_ = os::now();
  try {
    while (std::optional<WireFields> frame = incoming_.next()) take(std::move(*frame));
  } catch (const Failure& failure) {
    process_.end({});
    return lose(failure.what());
  }
  if (!open) note_end();
}

void MqttClient::take(WireFields frame) {
  switch (frame.kind) {
    case Wire::ready:
      ready_ = true;
      break;
    case Wire::failed:
      lose(printable(frame.text()));
      break;
    case Wire::connected:
      if (state_ == State::connecting) state_ = State::connected;
      break;
    case Wire::lost: {
      const std::string why = frame.text();
      wrong_version_ = frame.number() != 0;
      lose(printable(why));
      break;
    }
    case Wire::acknowledged: {
      const std::uint32_t number = frame.number();
      if (number == 0 || number > static_cast<std::uint32_t>(last_number_)) {
        throw Failure("the process of the MQTT client acknowledges an unknown message");
      }
      acknowledgements_.push_back({static_cast<int>(number), printable(frame.text())});
      break;
    }
    case Wire::alive:
      break;
    default:
      throw Failure("the process of the MQTT client sends what only absenc sends");
  }
  frame.end();
}

void MqttClient::lose(const std::string& why) {
  if (state_ == State::lost) return;
  state_ = State::lost;
  trouble_ = why;
}

void MqttClient::note_end() {
  const std::string how = process_.end(time_to_end);
  if (state_ == State::lost) return;
  died_ = true;
  lose(how.empty() ? "the MQTT client ended"
                   : fmt::format("the MQTT client ended {} after a packet of the broker", how));
}

int MqttClient::publish(const std::string& topic, const std::string& payload, int qos, bool retain) {
  ++last_number_;
  outgoing_ += WireFrame(Wire::publish)
                   .add(static_cast<std::uint32_t>(last_number_))
                   .add(topic)
                   .add(payload)
                   .add(static_cast<std::uint32_t>(qos))
                   .add(retain ? 1U : 0U)
                   .bytes();
  return last_number_;
}

std::vector<MqttClient::Acknowledgement> MqttClient::take_acknowledgements() {
  return std::exchange(acknowledgements_, {});
}

void MqttClient::end() {
  outgoing_ += WireFrame(Wire::leave).bytes();
  const Time deadline = os::now() + time_to_end;
  while (work(20ms) != State::lost && os::now() < deadline) {
  }
}

}  // namespace absenc::serve
