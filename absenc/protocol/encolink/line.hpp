// SPDX-License-Identifier: Apache-2.0
// What the procedures of EncoLink speak through: the stream, on whose frames one register access at a time rides.
#pragma once

#include <coroutine>
#include <cstdint>
#include <span>
#include <string_view>

#include "absenc/protocol/author/routine.hpp"
#include "absenc/protocol/encolink/host.hpp"
#include "absenc/protocol/encolink/registers.hpp"

namespace absenc::encolink {

inline constexpr std::string_view channels_disagree =
    "channel 2 has another position than channel 1: positions go on, but the detailed status cannot be trusted";

class Line : public Stream, public author::Routine {
 public:
  /// How a register access ended.
  struct Answer {
    enum class Fate : std::uint8_t {
      good,     // the encoder executed it
      refused,  // it did not
      lost,     // frames come, but not the answer: it may have been executed
      gone,     // not even frames come; `was_asked` tells whether it may have been executed
    } fate = Fate::good;
    author::Outcome why{};
  };

  /// What is `co_await`ed: `result` is what it gives, a member of the line.
  template <auto result>
  struct [[nodiscard]] Await {
    Line& line;
    [[nodiscard]] bool await_ready() const { return false; }
    void await_suspend(std::coroutine_handle<>) { line.wait(); }
    auto await_resume() const { return (line.*result)(); }
  };

  /// The next position. This and all that follows but the attempts ends the procedure when no good frame comes.
  [[nodiscard]] auto frame() { return until<&Line::latest>(Until::frame); }
  /// A whole cycle of channel 2, whose channels begin anew: Result<Cycle>.
  [[nodiscard]] auto cycle() { return until<&Line::latest_cycle>(Until::cycle); }
  /// The identity. With `trusted` it counts also against the options.
  [[nodiscard]] auto identity(bool trusted = false) {
    if (trusted) trust_identity();
    identify();
    return until<&Line::latest_identity>(Until::identity);
  }
  /// The bytes of a register, until the next access. Ends the procedure when there are none.
  [[nodiscard]] auto read(std::uint32_t address, std::uint16_t length) {
    access_.start(read_request(address, length));
    return until<&Line::data>(Until::data);
  }
  [[nodiscard]] auto read(const Register& one) { return read(one.address, one.size); }
  /// Accesses of which the procedure decides what their failure means: Answer. `size` of a write: 1 to 8 bytes.
  [[nodiscard]] auto attempt_read(std::uint32_t address, std::uint16_t length) {
    access_.start(read_request(address, length));
    return until<&Line::answer>(Until::answer);
  }
  [[nodiscard]] auto attempt_write(std::uint32_t address, std::uint16_t size, std::uint64_t value) {
    access_.start(write_request(address, size, value));
    return until<&Line::answer>(Until::answer);
  }
  /// Whether the encoder may have executed the last access.
  [[nodiscard]] bool was_asked() const { return access_.was_asked(); }
  /// What the last access read.
  [[nodiscard]] Bytes data() const { return access_.data(); }

  /// From here on every good frame is handed out.
  void emit_frames() { emits_frames_ = true; }
  /// Hands out what was found before anything else is sent.
  void emit() { Stream::emit(); }

 protected:
  Line(const Format& format, std::span<std::byte> arena);
  ~Line() = default;

 private:
  enum class Until : std::uint8_t { frame, cycle, identity, data, answer };

  template <auto result>
  Await<result> until(Until what) {
    until_ = what;
    return {*this};
  }
  [[nodiscard]] Position latest() const { return position(); }
  [[nodiscard]] Result<Cycle> latest_cycle() const { return last_cycle_; }
  [[nodiscard]] Identity latest_identity() const { return identity_; }
  [[nodiscard]] Answer answer() const { return answer_; }
  void wait();
  void submit();
  std::uint8_t next_ra() override { return access_.next_byte(received_at()); }
  void on_frame() override;
  void on_cycle(const Result<Cycle>& cycle) override;
  void on_identity(const Identity& identity) override;
  void on_damage(Error error) override;
  void on_failure(Error error) override;
  void ended(const author::Outcome& outcome) override { end(outcome); }
  void follow_access();
  void try_again(const author::Outcome& why);
  void end_access(Answer::Fate fate, const author::Outcome& why = {});

  Until until_ = Until::frame;
  bool emits_frames_ = false;
  unsigned attempts_left_ = 0;         // of the access
  std::uint8_t protocol_version_ = 0;  // 0: not asked yet
  RegisterAccess access_;
  Result<Cycle> last_cycle_ = Error::timeout;
  Identity identity_{};
  Answer answer_{};
};

}  // namespace absenc::encolink
