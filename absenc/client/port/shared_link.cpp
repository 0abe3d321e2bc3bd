// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/port/shared_link.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <unordered_map>
#include <vector>

#include "absenc/client/error.hpp"

namespace absenc::client {

namespace {

namespace fs = std::filesystem;

// Returns the file to which symbolic links lead, such as those of udev; `path` if that fails.
fs::path device(const std::string& path) {
  std::error_code error;
  const fs::path canonical = fs::weakly_canonical(path, error);
  return error ? fs::path(path) : canonical;
}

// Returns a text that is equal for all encoders on the same port; "" for a virtual encoder, which has no port.
std::string place_key(const EncoderAddress& one) {
  const std::string_view place = port_kind_names[static_cast<std::size_t>(one.port_kind)];
  switch (one.port_kind) {
    case PortKind::serial:
    case PortKind::slcan:
      return fmt::format("{}:{}", place, device(one.path).string());
    case PortKind::can:
    case PortKind::spi:
    case PortKind::ftdi:
      return fmt::format("{}:{}", place, one.path);
    case PortKind::tcp:
      return fmt::format("{}:{}:{}", place, one.host, one.port);
    case PortKind::sim:
      break;
  }
  return {};
}

bool same_place(const EncoderAddress& one, const EncoderAddress& other) {
  const bool shared =
      one.port_kind != PortKind::spi && one.port_kind != PortKind::ftdi && one.port_kind != PortKind::sim;
  return one.port_kind == other.port_kind && shared && place_key(one) == place_key(other);
}

std::string latency_text(const std::optional<Time>& latency) {
  if (!latency) return "automatic";
  return fmt::format("{} ms", std::chrono::duration_cast<std::chrono::milliseconds>(*latency).count());
}

struct Opened {
  EncoderAddress uri;
  std::weak_ptr<SharedLink> link;
};

/// The links that `connect_link` has opened, with their addresses.
struct Registry {
  std::mutex mutex;
  std::vector<Opened> opened;
};

Registry& registry() {
  static Registry all;
  return all;
}

}  // namespace

bool SharedLink::lost() const {
  const std::lock_guard lock(mutex_);
  return loss_.has_value();
}

void SharedLink::lose(const os::Failure& failure) {
  const std::lock_guard lock(mutex_);
  loss_ = {failure.kind(), failure.what()};
  // closes the lost port at once, because an exclusive port can be opened again only after it was closed
  link_.owner.reset();
}

bool share_line(const EncoderAddress& one, const EncoderAddress& other) {
  if (!same_place(one, other)) return false;
  const auto refuse = [&](const std::string& why) {
    throw UsageError(fmt::format("{} and {} are on one line, so {}", address_of(one), address_of(other), why));
  };
  if (one.line.rate != other.line.rate) {
    refuse(fmt::format("they must have the same {}, not {} and {}",
                       one.unit->link == LinkKind::can ? "bitrate" : "baud", one.line.rate, other.line.rate));
  }
  if (one.line != other.line) refuse("their protocols must have the same characters");
  if (one.adapter_rate != other.adapter_rate) refuse("they must have the same baud");
  if (one.log != other.log) refuse("they must have the same log");
  if (one.realtime != other.realtime) refuse("they must have the same realtime");
  if (one.rs485 != other.rs485) refuse("they must have the same rs485");
  if (one.latency != other.latency) {
    refuse(fmt::format("they must have the same latency, not {} and {}", latency_text(one.latency),
                       latency_text(other.latency)));
  }
  return true;
}

void require_different(std::span<const EncoderAddress> encoders, std::span<const std::string> names) {
  std::unordered_map<std::string, std::vector<std::size_t>> at_place;
  for (std::size_t i = 0; i < encoders.size(); ++i) {
    const std::string key = place_key(encoders[i]);
    if (key.empty()) continue;
    for (const std::size_t other : at_place[key]) {
      const EncoderAddress& one = encoders[i];
      const EncoderAddress& before = encoders[other];
      if (one.port_kind == PortKind::spi && before.port_kind == PortKind::spi && one.path == before.path) {
        throw UsageError(fmt::format("{} and {} are the same SPI device", names[other], names[i]));
      }
      if (one.port_kind == PortKind::ftdi && before.port_kind == PortKind::ftdi) {
        throw UsageError(fmt::format("{} and {} are on the same channel of an FTDI chip", names[other], names[i]));
      }
      if (!share_line(one, before)) continue;
      const bool same = one.unit == before.unit && one.options.values == before.options.values;
      if (same) throw UsageError(fmt::format("{} and {} are the same encoder", names[other], names[i]));
    }
    at_place[key].push_back(i);
  }
}

// Holds the lock while a port is opened, so that two threads do not open a shared port at the same time.
std::shared_ptr<SharedLink> connect_link(const EncoderAddress& uri, const OpenLink& open) {
  Registry& all = registry();
  const std::lock_guard lock(all.mutex);
  std::erase_if(all.opened, [](const Opened& opened) { return opened.link.expired(); });
  for (const Opened& opened : all.opened) {
    std::shared_ptr<SharedLink> link = opened.link.lock();
    if (link != nullptr && !link->lost() && share_line(opened.uri, uri)) return link;
  }
  auto link = std::make_shared<SharedLink>(open(uri));
  all.opened.push_back({uri, link});
  return link;
}

}  // namespace absenc::client
