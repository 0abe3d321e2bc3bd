// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/server.hpp"

#include <fmt/format.h>

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "absenc/client/error.hpp"
#include "absenc/os/served_port.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/serve/api.hpp"
#include "absenc/serve/sending.hpp"
#include "absenc/serve/view.hpp"

namespace absenc::serve {

namespace {

using namespace std::chrono_literals;

constexpr Time between_points = 33ms;
constexpr Time between_states = 200ms;
// Time between two events `state` in the event stream, if there are more than `large` encoders.
constexpr Time between_large_states = 1s;
constexpr std::size_t large = 50;

std::string url_of(const std::string& host, std::uint16_t port) {
  const bool bare_v6 = host.find(':') != std::string::npos && host.front() != '[';
  return fmt::format("http://{}:{}/", bare_v6 ? "[" + host + "]" : host, port);
}

}  // namespace

// Parts of the server in order of dependency: a member uses only members above it.
struct Server::Parts {
  explicit Parts(const Choices& choices)
      : listener(os::listen_at(choices.host, choices.port)),
        url(url_of(choices.host, listener.port)),
        served_ports(url),
        access({choices.token_file, choices.public_url, listener.on_loopback}, server_events),
        fleet(choices.encoders, choices.rate, choices.realtime, server_events),
        sending(fleet, server_events) {
    sending.change_to(read_outlets(choices.outlets));
    if (!choices.history.empty()) chronicler.emplace(choices.history, choices.limits, fleet, server_events);
    Chronicler* history = chronicler ? &*chronicler : nullptr;
    api.emplace(fleet, access, streams, worker, server_events, history, sending);
    http.emplace(
        std::move(listener), [this](const Request& request, const Reply& reply) { api->answer(request, reply); },
        std::vector<std::string>{"/healthz", "/metrics"});
    publish_ports();
    publisher = std::jthread([this](const std::stop_token& stop) { publish(stop); });
  }

  ~Parts() {
    publisher.request_stop();
    publisher.join();
    http.reset();  // the HTTP server ends before the parts that its requests use
    // the reading threads end first, so that `distribute_events` also distributes the events of their last commands
    fleet.end();
    distribute_events();
    sending.change_to({});
  }

  // Publishes the paths of the ports that this server reads, so that a program that finds a port busy can name this
  // server.
  void publish_ports() {
    std::vector<std::string> ports;
    for (const std::shared_ptr<Watch>& watch : fleet.all()) {
      if (!watch->address().path.empty()) ports.push_back(watch->address().path);
    }
    served_ports.set(ports);
  }

  void publish(const std::stop_token& stop) {
    Time next_state{};
    Time next_second{};
    while (!stop.stop_requested()) {
      const Time now = os::now();
      distribute_events();
      send_points();
      if (now >= next_state) {
        next_state = now + (fleet.all().size() > large ? between_large_states : between_states);
        streams.tidy();
        if (streams.count() != 0) streams.send("state", state_json(fleet, chronicler ? &*chronicler : nullptr));
      }
      if (now >= next_second) {
        next_second = now + 1s;
        http->end_incomplete_requests();
      }
      std::unique_lock lock(mutex);
      changed.wait_for(lock, stop, between_points - std::min(os::now() - now, between_points), [] { return false; });
    }
  }

  void distribute_events() {
    std::uint64_t added = 0;
    const std::vector<ServerEvent> taken = server_events.take(added);
    if (taken.empty()) return;
    if (chronicler) chronicler->add(taken, added);
    sending.add(taken);
    for (const ServerEvent& one : taken) streams.send("happening", one.json());
  }

  void send_points() {
    const std::set<std::string> wanted = streams.traced();
    for (const std::string& name : traced) {
      const std::shared_ptr<Watch> watch = wanted.contains(name) ? nullptr : fleet.find(name);
      if (watch != nullptr) watch->trace(false);
    }
    traced = wanted;
    for (const std::string& name : wanted) {
      const std::shared_ptr<Watch> watch = fleet.find(name);
      if (watch == nullptr) continue;
      watch->trace(true);
      const std::vector<Point> taken = watch->take_points();
      if (!taken.empty()) streams.send_traced(name, "points", points(*watch, taken));
    }
  }

  ServerEvents server_events;
  os::Listener listener;
  std::string url;
  os::ServedPorts served_ports;
  Access access;
  Fleet fleet;
  Sending sending;
  std::optional<Chronicler> chronicler;
  Streams streams;
  Worker worker;
  std::optional<Api> api;
  std::optional<HttpServer> http;
  // names of the encoders whose plot points the event streams send; used by the publisher thread only
  std::set<std::string> traced;
  std::mutex mutex;
  std::condition_variable_any changed;
  std::jthread publisher;
};

Server::Server(const Choices& choices) : parts_(std::make_unique<Parts>(choices)), outlets_(choices.outlets) {}
Server::~Server() = default;

const std::string& Server::url() const { return parts_->url; }
std::string Server::history_trouble() const {
  return parts_->chronicler ? parts_->chronicler->health().trouble : std::string();
}
std::size_t Server::encoders() const { return parts_->fleet.all().size(); }

std::string Server::reload() {
  // absenc.toml is read before anything is changed, because reading it may throw
  const Outlets outlets = read_outlets(outlets_);
  try {
    parts_->access.reload();
  } catch (const client::Failure& failure) {
    throw client::UsageError(failure.what());
  }
  std::string changed = parts_->fleet.reload();
  parts_->publish_ports();
  changed += parts_->sending.change_to(outlets);
  parts_->server_events.add({calendar_ms(), "", "change", "absenc.toml was read again: " + changed});
  return changed;
}

}  // namespace absenc::serve
