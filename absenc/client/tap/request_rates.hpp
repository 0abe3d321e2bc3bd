// SPDX-License-Identifier: Apache-2.0
// Measures how often a host sends each kind of request, from the arrival times of the requests.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/client/captures/received_characters.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

class RequestRates final : public capture::AnnotationSink {
 public:
  struct RequestKind {
    std::string name{};                 // name of the command that sends such requests; "": no command of the unit does
    std::vector<std::uint8_t> first{};  // bytes of the first request of this kind
    std::uint64_t count = 0;
    std::uint64_t errors = 0;  // number of requests of this kind whose exchange has an error
    capture::Tick begin = 0;   // tick at which the first request of this kind began
    capture::Tick last = 0;    // tick at which the last request of this kind began

    /// Returns the mean number of requests of this kind per second; 0 for a single request, or if all of them arrived
    /// at the same time.
    [[nodiscard]] double per_second() const {
      return count > 1 && last > begin
                 ? static_cast<double>(count - 1) * static_cast<double>(arrival_ticks_per_second) /
                       static_cast<double>(last - begin)
                 : 0;
    }
  };

  RequestRates(const Unit& unit, const Options& options) {
    for (const Command& command : unit.commands) {
      std::vector<std::int64_t> arguments;
      for (const Argument& argument : command.arguments) arguments.push_back(argument.default_value);
      std::array<std::uint8_t, 64> bytes{};
      const Result<std::size_t> size = unit.encode(options, command, arguments, bytes);
      if (!size || *size == 0) continue;
      samples_.push_back(
          {command.name, {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(*size)}, !arguments.empty()});
    }
  }

  void put(const capture::Annotation& annotation) override {
    using AnnotationKind = capture::Annotation::Kind;
    const bool asks = annotation.kind == AnnotationKind::exchange || annotation.kind == AnnotationKind::request;
    if (!asks || annotation.composed) return;
    RequestKind& kind = kind_of(annotation.request.bytes);
    if (kind.count++ == 0) kind.begin = annotation.begin;
    kind.last = annotation.begin;
    kind.errors += annotation.error != Error::none ? 1 : 0;
  }

  /// Returns the kinds of requests, the most frequent first.
  [[nodiscard]] std::vector<RequestKind> kinds() const {
    std::vector<RequestKind> all = kinds_;
    std::stable_sort(all.begin(), all.end(),
                     [](const RequestKind& one, const RequestKind& other) { return one.count > other.count; });
    return all;
  }

 private:
  // greatest number of kinds of requests; requests of further kinds count as the last kind
  static constexpr std::size_t most_kinds = 64;

  struct SampleRequest {
    std::string_view command;
    std::vector<std::uint8_t> bytes;
    bool varies;  // whether the command has arguments, which may change its request
  };

  // Returns the name of the command with this request. Requests of a command with arguments are recognised by their
  // length and first bytes.
  [[nodiscard]] std::string_view command_of(Bytes request) const {
    for (const SampleRequest& one : samples_) {
      if (std::equal(one.bytes.begin(), one.bytes.end(), request.begin(), request.end())) return one.command;
    }
    for (const SampleRequest& one : samples_) {
      if (one.varies && one.bytes.size() == request.size() && one.bytes[0] == request[0]) return one.command;
    }
    return {};
  }

  RequestKind& kind_of(Bytes request) {
    const std::string_view name = command_of(request);
    for (RequestKind& kind : kinds_) {
      const bool same = std::equal(kind.first.begin(), kind.first.end(), request.begin(), request.end());
      if (name.empty() ? kind.name.empty() && same : kind.name == name) return kind;
    }
    if (kinds_.size() == most_kinds) return kinds_.back();
    return kinds_.emplace_back(RequestKind{std::string(name), {request.begin(), request.end()}});
  }

  std::vector<SampleRequest> samples_;
  std::vector<RequestKind> kinds_;
};

}  // namespace absenc::client
