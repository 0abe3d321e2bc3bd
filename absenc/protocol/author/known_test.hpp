// SPDX-License-Identifier: Apache-2.0
// Checks that a reader whose format is known at compile time behaves like any other reader.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "absenc/protocol/author/known.hpp"

namespace absenc::author::testing {

/// Runs `reader` and answers each of its requests with `reply`, in one piece if `whole`, else byte by byte. Returns the
/// bytes of the requests.
template <class Reader>
std::vector<std::vector<std::uint8_t>> talk(Reader& reader, const std::vector<std::uint8_t>& reply, bool whole) {
  using Kind = Event<std::uint8_t>::Kind;
  std::vector<std::vector<std::uint8_t>> sent;
  Time now{1000};
  for (unsigned steps = 0; steps < 100; ++steps) {
    const ByteStep step = reader.next(now);
    if (step.kind == ByteStep::Kind::done) return sent;
    if (step.kind == ByteStep::Kind::transfer) {
      sent.emplace_back(step.out.begin(), step.out.end());
      reader.feed({.kind = Kind::sent, .at = now += Time{4000}});
      for (std::size_t i = 0; i < reply.size(); i += whole ? reply.size() : 1) {
        const Bytes part = Bytes(reply).subspan(i, whole ? reply.size() : 1);
        reader.feed({.kind = Kind::received, .at = now += Time{100}, .items = part});
      }
      reader.feed({.kind = Kind::silence, .at = now += Time{100'000}});
    } else {
      now = step.at;
    }
  }
  ADD_FAILURE() << "it does not end";
  return sent;
}

/// Expects the same results of ReadKnownPosition and ReadPosition for `good` and damaged replies.
template <class P, const typename P::Format& format, const typename P::Request& request>
void expect_known_as_any(const std::vector<std::uint8_t>& good) {
  std::vector<std::vector<std::uint8_t>> replies{good};
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    replies.push_back(good);
    replies.back()[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
  }
  for (auto end = good.begin(); end != good.end(); ++end) replies.emplace_back(good.begin(), end);
  for (const std::vector<std::uint8_t>& reply : replies) {
    for (const bool whole : {true, false}) {
      ReadPosition<P> any(format, request);
      ReadKnownPosition<P, format, request> known;
      EXPECT_EQ(talk(known, reply, whole), talk(any, reply, whole));
      EXPECT_EQ(known.error(), any.error());
      EXPECT_EQ(any.error() == Error::none || &reply != &replies.front(), true) << "the good one";
      ASSERT_EQ(known.reading() != nullptr, any.reading() != nullptr);
      if (any.reading() == nullptr) continue;
      EXPECT_EQ(known.reading()->singleturn, any.reading()->singleturn);
      EXPECT_EQ(known.reading()->multiturn, any.reading()->multiturn);
      EXPECT_EQ(known.reading()->singleturn_bits, any.reading()->singleturn_bits);
      EXPECT_EQ(known.reading()->multiturn_bits, any.reading()->multiturn_bits);
      EXPECT_EQ(known.reading()->singleturn_valid_bits, any.reading()->singleturn_valid_bits);
      EXPECT_EQ(known.reading()->multiturn_valid, any.reading()->multiturn_valid);
      EXPECT_EQ(known.reading()->ready, any.reading()->ready);
      EXPECT_EQ(known.reading()->status, any.reading()->status);
      EXPECT_EQ(known.reading()->alarms, any.reading()->alarms);
      EXPECT_EQ(known.reading()->status_reported, any.reading()->status_reported);
      EXPECT_EQ(known.reading()->alarms_reported, any.reading()->alarms_reported);
      EXPECT_EQ(known.reading()->latched, any.reading()->latched);
      EXPECT_EQ(known.reading()->received, any.reading()->received);
    }
  }
}

}  // namespace absenc::author::testing
