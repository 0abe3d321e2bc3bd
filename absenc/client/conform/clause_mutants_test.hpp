// SPDX-License-Identifier: Apache-2.0
// Makes encoders whose requests, replies or state are wrong, with which tests break clauses.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "absenc/client/conform/evidence.hpp"
#include "absenc/client/conform/mutant_test.hpp"

namespace absenc::client {

using namespace std::chrono_literals;

using ByteList = std::vector<std::uint8_t>;
using FrameList = std::vector<CanFrame>;
template <class Item>
using ReplyChanges = std::vector<ReplyChange<Item>>;

inline std::size_t bits_of(const ByteList& items) { return items.size() * 8; }
inline std::size_t bits_of(const FrameList& items) { return items.empty() ? 0 : 64; }
inline void flip_bit(ByteList& items, std::size_t bit) {
  if (bit < bits_of(items)) items[bit / 8] = static_cast<std::uint8_t>(items[bit / 8] ^ 1U << bit % 8);
}
inline void flip_bit(FrameList& items, std::size_t bit) {
  if (bit >= bits_of(items)) return;
  std::uint8_t& byte = items.front().data[bit / 8];
  byte = static_cast<std::uint8_t>(byte ^ 1U << bit % 8);
}

/// Lets the mutant flip a bit of its replies and try to repair their checksum; not on CAN.
template <class Item>
void flip_and_repair(Mutant<Item>& mutant, const EncoderAddress& address, std::size_t bit) {
  if constexpr (std::is_same_v<Item, std::uint8_t>) {
    mutant.change_reply = [&mutant, &address, bit](ByteList& reply_items, ByteStep&) {
      if (reply_items.size() < 4 || bit >= (reply_items.size() - 2) * 8) return;
      const ByteList before = reply_items;
      flip_bit(reply_items, bit);
      for (unsigned check = 0; check < 0x10000; ++check) {
        reply_items[reply_items.size() - 1] = static_cast<std::uint8_t>(check);
        reply_items[reply_items.size() - 2] = static_cast<std::uint8_t>(before[reply_items.size() - 2] + (check >> 8));
        const Error error =
            address.unit->check(address.options, {.bytes = mutant.last_request()}, {.bytes = reply_items});
        if (error != Error::bad_checksum) return;
      }
      reply_items = before;
    };
  }
}

/// Adds three mutants: one changes a single reply, one all replies from the third on, one all replies from the eighth
/// on.
template <class Item>
void add_reply_mutants(ReplyChanges<Item>& all, const std::function<void(Mutant<Item>&)>& change) {
  all.push_back({.change = change});
  for (const unsigned from : {3U, 8U}) {
    all.push_back({.change = [change, from](Mutant<Item>& m) {
      change(m);
      m.always = true;
      m.mutated = from;
    }});
  }
}
template <class Item>
void add_reply_mutants(ReplyChanges<Item>& all, void (*change_reply)(std::vector<Item>&, Step<Item>&)) {
  add_reply_mutants<Item>(all, [change_reply](Mutant<Item>& m) { m.change_reply = change_reply; });
}

/// Adds mutants that replace a reply, or a part of it, by an earlier reply; adds no mutants on CAN.
template <class Item>
void add_stale_mutants(ReplyChanges<Item>& all, const Clause& clause) {
  if constexpr (std::is_same_v<Item, std::uint8_t>) {
    const auto add = [&](std::size_t kept_bits) {
      add_reply_mutants<Item>(all, [kept_bits](Mutant<Item>& m) {
        const auto first = std::make_shared<ByteList>();
        m.mutated = 1;
        m.always = true;
        m.change_reply = [first, kept_bits](ByteList& reply_items, ByteStep&) {
          if (first->empty()) *first = reply_items;
          for (std::size_t bit = 0; bit < std::min(kept_bits, bits_of(reply_items)); ++bit) {
            const auto mask = static_cast<std::uint8_t>(0x80U >> bit % 8);
            reply_items[bit / 8] =
                static_cast<std::uint8_t>((reply_items[bit / 8] & ~mask) | ((*first)[bit / 8] & mask));
          }
        };
      });
    };
    if ((clause.errors & any_of(Error::sequence_mismatch)) != 0) add(SIZE_MAX);
    for (std::size_t bits = 1; bits < 160 && (clause.errors & any_of(Error::cross_check_failed)) != 0; ++bits)
      add(bits);
  }
}

template <class Item>
ReplyChanges<Item> frame_mutants(const EncoderAddress& address, const Clause& clause) {
  using List = std::vector<Item>;
  ReplyChanges<Item> all;
  add_stale_mutants(all, clause);
  if constexpr (std::is_same_v<Item, CanFrame>) {
    add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) { reply_items.front().extended = true; });
    add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) { reply_items.front().size = 7; });
    add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) { reply_items.front().size = 2; });
    add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) {
      reply_items.front().extended = true;
      reply_items.front().id |= 0x1000'0000;
    });
  } else {
    add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) { reply_items.pop_back(); });
    add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) { reply_items.push_back(0); });
    add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) { reply_items.assign(reply_items.size(), 0); });
    add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) { reply_items.assign(reply_items.size(), 0xFF); });
  }
  if (clause.demand == Demand::whole) return all;
  for (std::size_t bit = 0; bit < 160; ++bit) {
    add_reply_mutants<Item>(all, [=](Mutant<Item>& m) {
      m.change_reply = [bit](List& reply_items, Step<Item>&) { flip_bit(reply_items, bit); };
    });
  }
  if (clause.demand == Demand::as_drawn) {
    for (std::size_t bit = 160; bit-- > 0;) {
      all.push_back({.change = [=, &address](Mutant<Item>& m) { flip_and_repair(m, address, bit); }});
    }
  }
  for (std::size_t bit = 0; bit < 88; ++bit) {
    for (std::size_t other = bit + 1; other < 88; ++other) {
      add_reply_mutants<Item>(all, [=](Mutant<Item>& m) {
        m.change_reply = [=](List& reply_items, Step<Item>&) {
          flip_bit(reply_items, bit);
          flip_bit(reply_items, other);
        };
      });
    }
  }
  return all;
}

/// Returns mutants of two kinds: virtual encoders with another value of a condition, such as the temperature, and
/// encoders that receive each request, or send each reply, with a flipped bit.
template <class Item>
ReplyChanges<Item> command_mutants(const EncoderAddress& address) {
  ReplyChanges<Item> all;
  for (const Condition& one : address.unit->conditions) {
    for (const std::int64_t value : {one.maximum, one.minimum, one.normal + 5}) {
      if (value == one.normal || value < one.minimum || value > one.maximum) continue;
      all.push_back({.condition = fmt::format("{}={}", one.name, value)});
    }
  }
  for (std::size_t bit = 0; bit < 96; ++bit) {
    all.push_back({.change = [=](Mutant<Item>& m) {
      m.always = true;
      m.mutated = 1;
      m.change_reply = [bit](std::vector<Item>& reply_items, Step<Item>&) { flip_bit(reply_items, bit); };
    }});
    all.push_back({.change = [=](Mutant<Item>& m) {
      m.change_request = [bit](std::vector<Item>& last_request) { flip_bit(last_request, bit); };
    }});
  }
  return all;
}

template <class Item>
ReplyChanges<Item> special_request_mutants(const Clause& clause) {
  using M = Mutant<Item>;
  using List = std::vector<Item>;
  ReplyChanges<Item> all;
  const auto hears_good = [](M& m) {
    m.change_request = [&m](List& last_request) {
      if (m.is_special) last_request = m.good;
    };
    m.on_damage = true;
  };
  all.push_back({.change = hears_good});
  all.push_back({.change = [](M& m) {
    m.change_request = [&m](List& last_request) {
      if (m.is_special) last_request.clear();
    };
  }});
  if constexpr (std::is_same_v<Item, std::uint8_t>) {
    // A mutant whose reply has the right length but wrong content.
    all.push_back({.change = [hears_good](M& m) {
      hears_good(m);
      m.changes_special = true;
      m.change_reply = [](List& reply_items, Step<Item>&) {
        for (std::size_t i = 0; i < reply_items.size(); ++i) reply_items[i] = static_cast<std::uint8_t>(0x30 + i);
      };
    }});
    if (clause.reaction == Reaction::silent) return all;
    for (std::size_t bit = 0; bit < 88; ++bit) {
      for (std::size_t other = bit + 8; other < 88; other += 8) {
        all.push_back({.change = [=](M& m) {
          m.changes_special = true;
          m.change_reply = [=](List& reply_items, Step<Item>&) {
            flip_bit(reply_items, bit);
            flip_bit(reply_items, other);
          };
        }});
      }
    }
  } else {
    // Adds a mutant whose reply is changed by `change`, which gets the id of the request.
    const auto with_request_id = [&all](void (*change)(Item & reply, std::uint32_t id)) {
      all.push_back({.change = [change](M& m) {
        const auto requested = std::make_shared<std::uint32_t>(0);
        m.change_request = [&m, requested](List& last_request) {
          *requested = last_request.front().id;
          if (m.is_special) last_request = m.good;
        };
        m.changes_special = true;
        m.change_reply = [change, requested](List& reply_items, Step<Item>&) {
          change(reply_items.front(), *requested);
        };
      }});
    };
    // Two mutants change the identifier of the reply. In both, the low 8 bits of the new identifier are those of the
    // request: the node number.
    with_request_id([](Item& reply, std::uint32_t id) { reply.id = (reply.id & ~0xFFU) | (id & 0xFF); });
    with_request_id(
        [](Item& reply, std::uint32_t id) { reply = {.id = 0x100 | (id & 0xFF), .size = 8, .data = {0x11}}; });
  }
  return all;
}

template <class Item>
ReplyChanges<Item> mutants_of(const EncoderAddress& address, const Clause& clause) {
  using List = std::vector<Item>;
  ReplyChanges<Item> all;
  switch (clause.demand) {
    case Demand::answered:
    case Demand::streamed:
      add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) { reply_items.clear(); });
      if constexpr (std::is_same_v<Item, std::uint8_t>) {
        add_reply_mutants<Item>(all,
                                [](List& reply_items, Step<Item>&) { reply_items.assign(reply_items.size(), 0xFF); });
      } else {
        add_reply_mutants<Item>(all, [](List& reply_items, Step<Item>&) { ++reply_items.front().id; });
      }
      return all;
    case Demand::in_time:
      add_reply_mutants<Item>(all, [](List&, Step<Item>& step) { step.at += 15ms; });
      add_reply_mutants<Item>(all, [](List&, Step<Item>& step) { step.at += 60ms; });
      // On a slow line a delay of 60 ms may still be in time, because a host may wait longer than the timeout by the
      // duration of some characters. So the last mutant delays replies by 8 characters more.
      add_reply_mutants<Item>(all, [late = 60ms + 8 * address.line.with_some_rate().character()](Mutant<Item>& m) {
        m.change_reply = [late](List&, Step<Item>& step) { step.at += late; };
      });
      return all;
    case Demand::whole:
    case Demand::checked:
    case Demand::as_drawn:
      return frame_mutants<Item>(address, clause);
    case Demand::does:
      return command_mutants<Item>(address);
    default:
      break;
  }
  // The changes of the mutants apply only to valid requests that address another encoder or none; on CAN, to all
  // requests.
  if (clause.demand == Demand::foreign_silent) {
    for (const ReplyChange<Item>& change : special_request_mutants<Item>(clause)) {
      all.push_back({.change = [change = change.change, &address](Mutant<Item>& m) {
        change(m);
        m.is_meant = [&](const List& request) {
          if constexpr (std::is_same_v<Item, CanFrame>) {
            return true;
          } else {
            const auto asks = [&](const List& requested) {
              return encoder_of(*address.unit, address.options, {.bytes = requested});
            };
            const bool is_request = address.unit->check(address.options, {.bytes = request}, {}) == Error::none;
            return is_request && (!asks(request) || asks(request) != asks(m.good));
          }
        };
      }});
    }
    return all;
  }
  constexpr int most_specials = 8;
  for (const ReplyChange<Item>& change : special_request_mutants<Item>(clause)) {
    for (int special = 0; special < most_specials; ++special) {
      all.push_back({.change = [change = change.change, special](Mutant<Item>& m) {
        change(m);
        m.special = special;
      }});
    }
  }
  return all;
}

}  // namespace absenc::client
