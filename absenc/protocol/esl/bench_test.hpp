// SPDX-License-Identifier: Apache-2.0
// For the tests of ESL: virtual QS35 encoders and a host on one line in virtual time.
#pragma once

#include <gtest/gtest.h>

#include "absenc/protocol/author/unit_bench_test.hpp"
#include "absenc/protocol/esl/device.hpp"
#include "absenc/protocol/esl/unit.hpp"

namespace absenc::esl::testing {

using author::testing::HostedLine;
using author::testing::PowerOn;
using author::testing::RunResult;
using author::testing::Tamper;
using author::testing::wire;
using author::testing::Wire;
using Talk = author::testing::Talk<std::uint8_t>;
using TestShaft = sim::testing::TestShaft<24>;

inline Wire wire(const Reply& reply) { return wire(encode_reply({}, reply).view()); }
inline Wire wire_of(const Request& request, const Profile& profile = {}) {
  return wire(encode_request(profile, request).view());
}

struct RawHost final : sim::testing::RawHost {
  explicit RawHost(Wire request, Time at = {})
      : sim::testing::RawHost(std::move(request), answer_limit, gap_limit, at) {}
};

inline Options options_of(const Profile& profile) { return author::testing::options_of(options, profile); }

/// One virtual encoder, alone on its line.
struct Bench : author::testing::UnitBench<24> {
  explicit Bench(const Profile& bench_profile = {}, Tamper tamper = {})
      : UnitBench(esl::unit, options_of(bench_profile)), profile(bench_profile) {
    tampered.replies(std::move(tamper));
  }
  Wire raw(Wire request) { return UnitBench::raw(std::move(request), 100us, 12us).reply; }
  Wire raw(Request request) {
    request.encoder_address = profile.address;
    return raw(wire_of(request, profile));
  }
  Reply read(DataId id = DataId::position) {
    const Wire bytes = raw(Request{id});
    return decode_reply(profile, {id, profile.address}, bytes).value();
  }
  /// Sends the request of a reset `times` times, as often as the encoder needs by default.
  void reset(DataId id, unsigned times = reset_requests) {
    for (unsigned i = 0; i < times; ++i) {
      EXPECT_EQ(raw(Request{id}).size(), reply_length(id));
      pass(reset_interval);
    }
  }

  Profile profile;
  VirtualEncoder& encoder = static_cast<VirtualEncoder&>(device);
};

}  // namespace absenc::esl::testing
