// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/connections.hpp"

#include <algorithm>
#include <utility>

namespace absenc::serve {

void Connections::end(Open& one) {
  one.ended = true;
  end_(one.socket);
}

std::size_t Connections::count(const std::function<bool(const Open&)>& matches) const {
  return static_cast<std::size_t>(std::count_if(
      open_.begin(), open_.end(), [&](const auto& one) { return !one.second.ended && matches(one.second); }));
}

void Connections::add(Id id, int socket, std::string peer, Time now) {
  Open& added = open_[id] = {socket, std::move(peer), now};
  const auto is_ordinary = [](const Open& one) { return !one.in_reserve; };
  const auto is_like_it = [&](const Open& one) { return is_ordinary(one) && one.peer == added.peer; };
  if (count(is_like_it) > most_of_address) {
    if (end_oldest_idle(id, is_like_it)) return;
  } else if (count(is_ordinary) <= most || end_oldest_idle_of_busiest(id)) {
    return;
  }
  added.in_reserve = true;
  const auto is_in_reserve = [](const Open& one) { return one.in_reserve; };
  if (count(is_in_reserve) > reserve && !end_oldest_idle(id, is_in_reserve)) end(added);
}

bool Connections::end_oldest_idle(Id excluded, const std::function<bool(const Open&)>& matches) {
  Open* oldest = nullptr;
  for (auto& [id, one] : open_) {
    if (id == excluded || one.ended || one.idle_since == never || !matches(one)) continue;
    if (oldest == nullptr || one.idle_since < oldest->idle_since) oldest = &one;
  }
  if (oldest == nullptr) return false;
  end(*oldest);
  return true;
}

// Closes the oldest idle connection of the IP address that has most idle connections; those of the reserve do not
// count. Returns false if none is idle.
bool Connections::end_oldest_idle_of_busiest(Id excluded) {
  std::unordered_map<std::string, std::size_t> idle;
  for (const auto& [id, one] : open_) {
    if (id != excluded && !one.ended && !one.in_reserve && one.idle_since != never) ++idle[one.peer];
  }
  const auto busiest =
      std::max_element(idle.begin(), idle.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (busiest == idle.end()) return false;
  return end_oldest_idle(excluded, [&](const Open& one) { return !one.in_reserve && one.peer == busiest->first; });
}

void Connections::begin_request(Id id) {
  if (const auto found = open_.find(id); found != open_.end()) found->second.idle_since = never;
}

void Connections::await_request(Id id, Time now) {
  if (const auto found = open_.find(id); found != open_.end()) found->second.idle_since = now;
}

bool Connections::is_in_reserve(Id id) const {
  const auto found = open_.find(id);
  return found != open_.end() && found->second.in_reserve;
}

void Connections::end_incomplete_requests(Time now) {
  for (auto& [id, one] : open_) {
    if (!one.ended && one.idle_since != never && now - one.idle_since > request_time) end(one);
  }
}

}  // namespace absenc::serve
