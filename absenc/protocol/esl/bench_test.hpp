// SPDX-License-Identifier: Apache-2.0
// For tests: virtual QS35 encoders and a host on one line in virtual time.
#pragma once

#include "absenc/protocol/esl/device.hpp"
#include "absenc/protocol/esl/unit.hpp"
#include "tests/kit/bench.hpp"

namespace absenc::esl::testing {

using kit::Outcome;
using kit::PowerOn;
using kit::Tamper;
using kit::wire;
using kit::Wire;
using TestShaft = sim::testing::TestShaft<24>;

inline Wire wire(const Reply& reply) { return wire(encode_reply({}, reply).view()); }
inline Wire wire_of(const Request& request, const Profile& profile = {}) {
  return wire(encode_request(profile, request).view());
}

struct RawHost final : sim::testing::RawHost {
  explicit RawHost(Wire request, Time at = {})
      : sim::testing::RawHost(std::move(request), answer_limit, gap_limit, at) {}
};

inline Options options_of(const Profile& profile) {
  Options values;
  for (std::size_t i = 0; i < options.infos.size(); ++i) values.values[i] = options.get(profile, i);
  return values;
}

/// One encoder on a line of its own.
struct Bench : kit::Bench<VirtualEncoder, TestShaft> {
  explicit Bench(const Profile& bench_profile = {}, Tamper tamper = {})
      : kit::Bench<VirtualEncoder, TestShaft>(esl::unit, options_of(bench_profile), bench_profile, std::move(tamper)),
        profile(bench_profile) {}
  using kit::Bench<VirtualEncoder, TestShaft>::raw;
  Wire raw(Request request) {
    request.encoder_address = profile.address;
    return raw(wire_of(request, profile));
  }
  Reply read(DataId id = DataId::position) {
    const Wire bytes = raw(Request{id});
    return decode_reply(profile, {id, profile.address}, bytes).value();
  }

  Profile profile;
};

}  // namespace absenc::esl::testing
