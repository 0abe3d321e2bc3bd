// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/udp.hpp"

#include "absenc/client/text/json.hpp"

namespace absenc::serve {

using namespace client;

namespace {

constexpr auto between_sendings = std::chrono::milliseconds(20);

// PlotJuggler takes the time of a point from the field "timestamp".
Json datagram(const std::string& encoder, const OutgoingReading& reading) {
  Json values = Json::object();
  if (reading.place) values.set("position", *reading.place);
  if (reading.speed) values.set("speed", reading.speed->value).set("speed_uncertainty", reading.speed->uncertainty);
  if (reading.joint) values.set("joint", *reading.joint);
  if (reading.joint_speed) {
    values.set("joint_speed", reading.joint_speed->value);
    values.set("joint_speed_uncertainty", reading.joint_speed->uncertainty);
  }
  if (reading.electrical_deg) values.set("electrical_deg", *reading.electrical_deg);
  if (reading.counts) values.set("counts", *reading.counts);
  if (reading.turns) values.set("turns", *reading.turns);
  return Json::object().set("timestamp", static_cast<double>(reading.at_us) / 1e6).set(encoder, values);
}

}  // namespace

UdpSender::UdpSender(const UdpSettings& settings, const Fleet& fleet)
    : socket_(settings.host, settings.port),
      fleet_(&fleet),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

UdpSender::~UdpSender() {
  thread_.request_stop();
  thread_.join();
}

void UdpSender::work(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    for (const auto& watch : fleet_->all()) {
      for (const OutgoingReading& one : watch->take_outgoing(Watch::Outlet::udp).readings) {
        static_cast<void>(socket_.send(datagram(watch->name(), one).line()));
      }
    }
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, stop, between_sendings, [] { return false; });
  }
}

}  // namespace absenc::serve
