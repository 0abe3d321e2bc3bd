// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/connections.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <set>

namespace absenc::serve {
namespace {

using namespace std::chrono_literals;

struct Trial {
  std::set<int> ended{};
  Connections connections{[this](int socket) { ended.insert(socket); }};
  Time now = 1s;

  static Connections::Id id(int socket) { return reinterpret_cast<Connections::Id>(std::intptr_t{socket}); }
  // Adds `count` connections at intervals of one millisecond; their sockets are numbered from `first` on.
  void add(const char* peer, int first, std::size_t count, bool busy = false) {
    for (int socket = first; socket < first + static_cast<int>(count); ++socket) {
      connections.add(id(socket), socket, peer, now += 1ms);
      if (busy) connections.begin_request(id(socket));
    }
  }
};

TEST(Connections, ClosesOldestIdleConnectionOfAddressBeyondItsLimit) {
  Trial trial;
  trial.add("b", 9000, 1);
  trial.add("a", 1, Connections::most_of_address);
  trial.connections.begin_request(Trial::id(1));
  EXPECT_TRUE(trial.ended.empty());
  trial.add("a", 1000, 2);
  EXPECT_EQ(trial.ended, (std::set{2, 3}));
}

TEST(Connections, ClosesConnectionOfBusiestAddressBeyondTotalLimit) {
  Trial trial;
  trial.add("b", 9000, 5);
  trial.add("a", 1, 300);
  trial.add("c", 1000, Connections::most - 305);
  EXPECT_TRUE(trial.ended.empty());
  trial.add("d", 5000, 1);
  EXPECT_EQ(trial.ended, (std::set{1}));
}

TEST(Connections, UsesReserveWhenNoConnectionIsIdle) {
  Trial trial;
  trial.add("a", 1, 240, true);
  trial.add("b", 1000, 240, true);
  trial.add("c", 5000, Connections::reserve, true);
  EXPECT_TRUE(trial.ended.empty());
  EXPECT_FALSE(trial.connections.is_in_reserve(Trial::id(1000)));
  EXPECT_TRUE(trial.connections.is_in_reserve(Trial::id(5000)));
  trial.add("c", 6000, 1);
  EXPECT_EQ(trial.ended, (std::set{6000}));
  trial.connections.await_request(Trial::id(1), trial.now);
  trial.add("c", 7000, 1);
  EXPECT_EQ(trial.ended, (std::set{1, 6000}));
  EXPECT_FALSE(trial.connections.is_in_reserve(Trial::id(7000)));
}

TEST(Connections, ClosesIncompleteRequestAfterItsTimeLimit) {
  Trial trial;
  trial.add("a", 1, 2);
  trial.connections.begin_request(Trial::id(1));
  trial.connections.end_incomplete_requests(trial.now + Connections::request_time);
  EXPECT_TRUE(trial.ended.empty());
  trial.connections.end_incomplete_requests(trial.now + Connections::request_time + 1ms);
  EXPECT_EQ(trial.ended, (std::set{2}));
}

}  // namespace
}  // namespace absenc::serve
