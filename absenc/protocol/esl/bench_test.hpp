// SPDX-License-Identifier: Apache-2.0
// For tests: virtual QS35 encoders and a host on one line in virtual time.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absenc/protocol/esl/bus.hpp"
#include "absenc/protocol/esl/device.hpp"
#include "absenc/protocol/esl/host.hpp"
#include "absenc/protocol/esl/memory.hpp"
#include "absenc/sim/bench_test.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::esl::testing {

using TestShaft = sim::testing::TestShaft<24>;

struct RawHost final : sim::testing::RawHost {
  explicit RawHost(std::vector<std::uint8_t> request, Time at = {})
      : sim::testing::RawHost(std::move(request), answer_limit, gap_limit, at) {}
};

/// Changes the n-th reply (from 0) of an encoder as a script wants, on its way to the line.
class Tampered final : public Machine<std::uint8_t> {
 public:
  using Tamper = std::function<void(unsigned index, std::vector<std::uint8_t>& reply)>;
  Tampered(VirtualEncoder& encoder, Tamper tamper) : encoder_(encoder), tamper_(std::move(tamper)) {}
  void feed(const Event<std::uint8_t>& event) override { encoder_.feed(event); }
  Step<std::uint8_t> next(Time now) override {
    Step<std::uint8_t> step = encoder_.next(now);
    if (step.kind == Step<std::uint8_t>::Kind::transfer) {
      out_.assign(step.out.begin(), step.out.end());
      if (tamper_) tamper_(replies_++, out_);
      step.out = out_;
    }
    return step;
  }

 private:
  VirtualEncoder& encoder_;
  Tamper tamper_;
  unsigned replies_ = 0;
  std::vector<std::uint8_t> out_;
};

/// One encoder on a line of its own.
struct Bench {
  explicit Bench(const Profile& bench_profile = {}, Tampered::Tamper tamper = {})
      : profile(bench_profile), encoder(bench_profile, shaft), device(encoder, std::move(tamper)) {
    encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    line.attach(sim::Role::device, device);
  }

  /// Runs a conversation to its end and returns it.
  template <class Conversation>
  Conversation& run(Conversation& conversation) {
    if (host == none) {
      host = line.attach(sim::Role::host, conversation);
    } else {
      line.replace(host, conversation);
    }
    finished = line.run(host, line.now() + std::chrono::seconds(10));
    return conversation;
  }
  std::vector<std::uint8_t> raw(std::vector<std::uint8_t> request) {
    RawHost raw_host(std::move(request), line.now());
    return run(raw_host).reply;
  }
  std::vector<std::uint8_t> raw(const Request& request) {
    const RequestBytes bytes = encode_request(profile, request);
    return raw(std::vector<std::uint8_t>(bytes.view().begin(), bytes.view().end()));
  }
  Reply read(DataId id = DataId::position) {
    Read conversation(profile, id);
    run(conversation);
    return conversation.reply();
  }
  void pass(Time time) { line.run_until(line.now() + time); }

  static constexpr std::size_t none = ~std::size_t{0};
  Profile profile;
  TestShaft shaft;
  VirtualEncoder encoder;
  Tampered device;
  sim::Line<std::uint8_t> line{LinkKind::half_duplex, line_settings};
  std::size_t host = none;
  bool finished = true;
};

inline std::map<std::string, std::int64_t> report(const Conversation<std::uint8_t>& conversation) {
  struct Collector final : FieldSink {
    void put(const FieldValue& value) override { fields[std::string(value.info->name)] = value.number; }
    std::map<std::string, std::int64_t> fields;
  } collector;
  conversation.report(collector);
  return collector.fields;
}

}  // namespace absenc::esl::testing
