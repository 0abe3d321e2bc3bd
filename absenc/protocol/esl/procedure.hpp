// SPDX-License-Identifier: Apache-2.0
// What every ESL conversation is made of: one request and its checked reply at a time.
#pragma once

#include <cstdint>
#include <string_view>

#include "absenc/protocol/esl/reply.hpp"
#include "absenc/protocol/esl/timing.hpp"
#include "absenc/protocol/request_reply.hpp"
#include "absenc/protocol/sentence.hpp"

namespace absenc::esl {

class Procedure : public RequestReply {
 public:
  Step<std::uint8_t> next(Time now) final;
  [[nodiscard]] Error error() const final { return error_; }
  [[nodiscard]] std::string_view detail() const final { return detail_.view(); }
  [[nodiscard]] std::string_view advice() const final { return noise_explanation().advice; }
  [[nodiscard]] Exchange<std::uint8_t> exchange() const final;

  [[nodiscard]] const Profile& profile() const { return profile_; }
  /// Which check of the last reply failed.
  [[nodiscard]] Check check() const { return check_; }

 protected:
  /// How often a request that reads or selects a page is sent before its error counts. Resets and writes are never
  /// repeated, nor is ID 8.
  explicit Procedure(const Profile& profile, unsigned read_attempts)
      : profile_(profile), read_attempts_(read_attempts) {}
  ~Procedure() = default;

  /// Sends `request`, not before `earliest`.
  void ask(const Request& request, Time earliest = {});
  void ask(DataId id, Time earliest = {}) { ask(Request{id, profile_.address}, earliest); }
  /// Hands out an `emit` before the next request.
  void emit() { emit_pending_ = true; }
  void finish(Error error = Error::none, std::string_view detail = {});
  /// Adds to the detail of the error it finishes with.
  Sentence& explanation() { return detail_; }

  /// The reply passed every check (`busy` may be set). Calls `ask` or `finish`.
  virtual void answered(const Reply& reply) = 0;
  /// No good reply came. Calls `ask` or `finish`; by default the procedure ends with this error.
  virtual void failed(Error error) { finish(error); }

  [[nodiscard]] const Request& request() const { return request_; }
  [[nodiscard]] Bytes reply_bytes() const { return reply_bytes_; }
  /// The reading of a reply that has just come, with its times.
  [[nodiscard]] Reading reading_of(const Reply& reply) const;

 private:
  void received(Bytes bytes) final;
  void conclude() final;
  void explain(Error error);
  void start(Time earliest);
  [[nodiscard]] bool selects_page() const;
  [[nodiscard]] Time pause_before_repeat() const;
  [[nodiscard]] std::size_t expected() const { return reply_length(request_.id); }

  Profile profile_;
  unsigned read_attempts_;
  unsigned attempts_left_ = 0;
  bool emit_pending_ = false;
  Request request_{};
  RequestBytes request_bytes_;
  // One character more than the longest reply tells "too long"; what no longer fits changes nothing.
  ByteBuffer<3 * reply_capacity> reply_bytes_;
  Check check_ = Check::passed;
  Time earliest_{};
  Error error_ = Error::none;
  Sentence detail_;
};

}  // namespace absenc::esl
