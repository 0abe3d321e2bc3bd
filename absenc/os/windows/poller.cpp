// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/poller.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "absenc/os/windows/waitable.hpp"

namespace absenc::os {

struct Poller::State {
  std::vector<int> descriptors;
  std::vector<HANDLE> events;  // of `descriptors`
  std::array<int, most_ready> ready{};
};

Poller::Poller() : state_(std::make_unique<State>()) {}

Poller::~Poller() = default;

void Poller::add(int descriptor) {
  state_->descriptors.push_back(descriptor);
  state_->events.push_back(waitable_of(descriptor)->readable());
}

void Poller::remove(int descriptor) {
  const auto found = std::find(state_->descriptors.begin(), state_->descriptors.end(), descriptor);
  if (found == state_->descriptors.end()) return;
  state_->events.erase(state_->events.begin() + (found - state_->descriptors.begin()));
  state_->descriptors.erase(found);
}

std::span<const int> Poller::wait(Time deadline) {
  const std::optional<std::size_t> first = wait_any(state_->events, deadline);
  if (!first) return {};
  std::size_t count = 0;
  for (std::size_t i = *first; i < state_->events.size() && count < most_ready; ++i) {
    if (i == *first || is_set(state_->events[i])) state_->ready[count++] = state_->descriptors[i];
  }
  return {state_->ready.data(), count};
}

}  // namespace absenc::os
