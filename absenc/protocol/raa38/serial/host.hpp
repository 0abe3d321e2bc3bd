// SPDX-License-Identifier: Apache-2.0
// Host side of an RAA38S6 on an asynchronous line, for everything that takes one position or a few: reading an encoder
// that is asked, setting the zero, finding out who is on a bus. Endless reading of a stream: listen.hpp.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/noise.hpp"
#include "absenc/protocol/raa38/serial/settings.hpp"
#include "absenc/protocol/raa38/serial/stream.hpp"

namespace absenc::raa38::serial {

/// Gets positions one after the other, whatever starts a frame, and sets the zero.
class Reader : public Conversation<std::uint8_t> {
 public:
  void feed(const Event<std::uint8_t>& event) final;
  Step<std::uint8_t> next(Time now) final;
  [[nodiscard]] Error error() const final { return error_; }
  [[nodiscard]] std::string_view detail() const final { return detail_; }
  [[nodiscard]] std::string_view advice() const final { return advice_; }
  [[nodiscard]] Exchange<std::uint8_t> exchange() const final {
    return {sent_.view(), frame_.view(), sent_at_, received_at_};
  }

 protected:
  explicit Reader(const Settings& settings);
  ~Reader() = default;

  /// The next position, not before `earliest`; of this unit on a bus.
  void ask(Time earliest, std::uint8_t unit);
  /// Leaves the line alone for so long before the next one is asked for.
  void wait_first(Time time) { wait_first_ = time; }
  /// Sets the zero by what the settings say; it is not told whether that worked.
  void clear();
  void finish(Error error = Error::none, std::string_view detail = {}, std::string_view advice = {});

  virtual void got(const Position& position) = 0;
  /// No position came; or the line `is_noisy`, when asking others is of no use.
  virtual void failed(Error error) = 0;
  virtual void cleared() {}
  /// Something came before it was asked for.
  virtual void unasked() {}

  [[nodiscard]] const Settings& settings() const { return settings_; }
  [[nodiscard]] bool is_noisy() const { return noise_.is_endless(); }
  /// When the encoder took the last position, at the earliest, and when it was there.
  [[nodiscard]] Time latched_at() const { return latched_at_; }
  [[nodiscard]] Time received_at() const { return received_at_; }

 private:
  enum class Doing : std::uint8_t { asking, sending, receiving, settling, listening, to_clear, clearing, done };

  [[nodiscard]] Step<std::uint8_t> ask_step(Time now);
  [[nodiscard]] Step<std::uint8_t> clear_step();
  [[nodiscard]] Step<std::uint8_t> wait_step() const;
  void sent(Time at);
  void received(Bytes bytes, Time at);
  void listen(Bytes bytes, Time at);
  void check_frame();
  void silence();
  void end_noise();
  void end_listening(Time now);

  Settings settings_;
  StreamDecoder decoder_;
  Doing doing_ = Doing::done;
  Time earliest_{};
  Time wait_first_{};
  std::uint8_t unit_ = 0;
  bool disturbed_ = false;  // a damaged character, or something came before it was asked for
  bool heard_ = false;      // anything since it was asked
  RequestBytes sent_;
  ByteBuffer<2 * frame_capacity> frame_;
  Noise noise_{patience};
  Error found_ = Error::none;  // settling: what is wrong
  Time deadline_{};
  Time sent_at_{};
  Time received_at_{};
  Time latched_at_{};
  Error error_ = Error::none;
  std::string_view detail_{};
  std::string_view advice_{};
};

/// One position of an encoder that is asked. With a maximum speed a second one, which must be near enough: otherwise
/// cross_check_failed.
class ReadPosition final : public Reader {
 public:
  explicit ReadPosition(const Settings& settings);

  [[nodiscard]] const Reading* reading() const override;
  void report(FieldSink& sink) const override;

 private:
  void got(const Position& position) override;
  void failed(Error error) override;

  bool has_first_ = false;
  Time first_at_{};
  Position position_{};
  Reading reading_{};
};

/// Reads, sets the zero, and reads until the position is zero within 1/1024 revolution. Errors: unsupported and
/// invalid_argument when the settings have no way to do it, cross_check_failed when it is not zero after half a second.
class Zero final : public Reader {
 public:
  explicit Zero(const Settings& settings);

  void report(FieldSink& sink) const override;

 private:
  void got(const Position& position) override;
  void failed(Error error) override;
  void cleared() override;
  [[nodiscard]] bool may_try_again() const { return received_at() < give_up_at_; }

  bool is_set_ = false;  // the zero, or so we told the encoder
  Time give_up_at_{};
  Position before_{};
  Position position_{};
};

/// Listens whether somebody transmits unasked, then asks every number of a bus. An answer that is damaged every time
/// tells of two encoders with one number, or of a bad line. Errors: timeout when nobody answers, unexpected_reply when
/// somebody transmits unasked.
class Scan final : public Reader {
 public:
  explicit Scan(const Settings& settings);

  [[nodiscard]] std::uint16_t answering() const { return answering_; }  // bit n: unit n
  [[nodiscard]] std::uint16_t disturbed() const { return disturbed_; }
  void report(FieldSink& sink) const override;

 private:
  void got(const Position& position) override;
  void failed(Error error) override;
  void unasked() override;
  void go_on();

  unsigned unit_ = 0;
  unsigned attempt_ = 1;
  std::uint16_t answering_ = 0;
  std::uint16_t disturbed_ = 0;
  std::array<Position, unit_count> positions_{};
};

}  // namespace absenc::raa38::serial
