// SPDX-License-Identifier: Apache-2.0
// Host side of the T-format: each class is one conversation, a machine without port, clock or heap.
// README.md describes the procedures; link/step.hpp how to run a machine.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "absenc/protocol/request_reply.hpp"
#include "absenc/protocol/sentence.hpp"
#include "absenc/protocol/tformat/frame.hpp"
#include "absenc/protocol/tformat/timing.hpp"

namespace absenc::tformat {

/// One request and its checked reply at a time; a subclass decides what comes next.
class Procedure : public RequestReply {
 public:
  Step<std::uint8_t> next(Time now) final;
  [[nodiscard]] Error error() const final { return error_; }
  [[nodiscard]] std::string_view detail() const final {
    return detail_.empty() ? noise_explanation().found : detail_.view();
  }
  [[nodiscard]] std::string_view advice() const final { return advice_.empty() ? noise_explanation().advice : advice_; }
  [[nodiscard]] Exchange<std::uint8_t> exchange() const final;

  [[nodiscard]] const Format& format() const { return format_; }

 protected:
  /// How often a request that reads or selects a page is sent before its error counts. Resets and writes are never
  /// repeated.
  explicit Procedure(const Format& format, unsigned read_attempts) : format_(format), read_attempts_(read_attempts) {}
  ~Procedure() = default;

  /// Sends `request`, not before `earliest`.
  void ask(const Request& request, Time earliest = {});
  /// The same request, after the encoder said that it is busy.
  void ask_again();
  /// `more` goes behind the detail.
  void finish(Error error = Error::none, std::string_view detail = {}, std::string_view more = {});

  /// The reply passed every check (`busy` may be set). Calls `ask` or `finish`.
  virtual void answered(const Reply& reply) = 0;
  /// No good reply came. Calls `ask` or `finish`; by default the procedure ends with this error.
  virtual void failed(Error error) { finish(error); }

  [[nodiscard]] const Request& request() const { return request_; }

 private:
  void received(Bytes bytes) final;
  void conclude() final;
  void start(Time earliest);
  [[nodiscard]] bool selects_page() const;
  [[nodiscard]] std::size_t expected() const { return expected_length(request_.id, reply_bytes_); }

  Format format_;
  unsigned read_attempts_;
  unsigned attempts_left_ = 0;
  Request request_{};
  RequestBytes request_bytes_;
  // One character more than the longest reply tells "too long"; what no longer fits changes nothing.
  ByteBuffer<4 * reply_capacity> reply_bytes_;
  Time earliest_{};
  Error error_ = Error::none;
  Sentence detail_;
  std::string_view advice_{};
};

/// Data IDs 0 to 3. ID 3 carries everything. SF hides over_speed, full_absolute_status and counter_overflow, so
/// unless `known_alarms` (the ALMC of an ID 3 reply since power on) is given, IDs 0 and 1 are preceded by an ID 3,
/// and an alarm that newly appears in their SF is followed by one, whose reply is the result then.
class ReadPosition final : public Procedure {
 public:
  explicit ReadPosition(const Format& format, DataId id = DataId::everything,
                        std::optional<std::uint8_t> known_alarms = std::nullopt);

  [[nodiscard]] const Reading* reading() const override;
  void report(FieldSink& sink) const override;
  /// Of the last good exchange.
  [[nodiscard]] const Reply& reply() const { return reply_; }

 private:
  void answered(const Reply& reply) override;

  DataId id_;
  bool part_read_ = false;  // ID 0 or 1 has been answered
  std::optional<std::uint8_t> known_alarms_;
  Reply reply_{};
  Reading reading_{};
};

/// Data IDs 7 (latched alarms), 8 (single-turn zero here) and C (turns and latched alarms): makes sure that the shaft
/// stands still, sends ten requests, reads back what became of it. Errors: invalid_argument (the shaft turns, or ID 7
/// would hide a battery_error), cross_check_failed (the encoder did not do it), or that of an exchange.
class Reset final : public Procedure {
 public:
  Reset(const Format& format, DataId id);

  [[nodiscard]] const Reading* reading() const override;  // after the reset
  void report(FieldSink& sink) const override;

 private:
  enum class Phase : std::uint8_t { first_look, second_look, requests, verify };
  void answered(const Reply& reply) override;
  void failed(Error error) override;
  void second_look(const Reply& reply);
  void verify(const Reply& reply);
  void go_on();

  DataId id_;
  Phase phase_ = Phase::first_look;
  unsigned sent_requests_ = 0;
  Reply reply_{};
  Reading reading_{};
};

/// What becomes of the page that the encoder had selected before.
enum class Page : std::uint8_t {
  stays,     // the one that was asked for stays selected
  restored,  // the one before is selected again, where the encoder says which that was
};

/// Selects a page, does something there. The document shows the page as the content of address 127, but does not say
/// that it can be read: what the encoder refuses is not known then, and `report_page` says which page stays selected.
class MemoryProcedure : public Procedure {
 public:
  /// The page that it was broken off with.
  void report_left(FieldSink& sink) const final;

 protected:
  MemoryProcedure(const Format& format, std::uint8_t page, Page before);
  ~MemoryProcedure() = default;

  /// Begins; `selected` comes when the page is.
  void begin();
  /// The page before is selected again first, where that is wanted and known.
  void end();
  void select(Time earliest);
  [[nodiscard]] std::uint8_t page() const { return page_; }
  /// Puts the page that stays selected although the one before should be.
  void report_page(FieldSink& sink) const;

  virtual void selected(Time ready) = 0;
  /// To another request than one that selects the page; never busy.
  virtual void replied(const Reply& reply) = 0;
  virtual void lost(Error error) { finish(error, left()); }
  /// What to say of the page when it fails.
  [[nodiscard]] std::string_view left() const;

 private:
  enum class Stage : std::uint8_t { asking, working, restoring, verifying };
  void answered(const Reply& reply) final;
  void failed(Error error) final;
  void asked(const Reply& reply);

  std::uint8_t page_;
  Page before_;
  Stage stage_ = Stage::working;
  int page_before_ = -1;  // not known
  bool restored_ = false;
  Time give_up_{};
};

/// Selects the page and reads `count` bytes. Errors: invalid_argument (closed area), busy.
class ReadMemory : public MemoryProcedure {
 public:
  /// Page 0 to 5 or 7, address 0 to 126, count 1 to 127 - address.
  ReadMemory(const Format& format, std::uint8_t page, std::uint8_t address, std::uint8_t count = 1,
             Page before = Page::stays);

  void report(FieldSink& sink) const override;
  [[nodiscard]] Bytes data() const { return data_; }

 private:
  void selected(Time ready) override { ask_next(ready); }
  void replied(const Reply& reply) override;
  void ask_next(Time earliest = {});

  std::uint8_t address_;
  std::uint8_t count_;
  ByteBuffer<page_addresses> data_;
};

/// Page 7 address 5: degrees Celsius, within 3 degC, accurate from 5 s after power on.
class ReadTemperature final : public ReadMemory {
 public:
  explicit ReadTemperature(const Format& format)
      : ReadMemory(format, service_page, temperature_address, 1, Page::restored) {}
  void report(FieldSink& sink) const override;
};

/// Page 7 address 4: degrees Celsius, or off.
class ReadOverheatThreshold final : public ReadMemory {
 public:
  explicit ReadOverheatThreshold(const Format& format)
      : ReadMemory(format, service_page, overheat_address, 1, Page::restored) {}
  void report(FieldSink& sink) const override;
};

enum class Wear : std::uint8_t {
  avoid,   // a byte that already holds the value is not written (100 000 writes in total)
  accept,  // write it all the same
};

/// Selects the page, reads, writes what differs, waits, selects the page again so that the EEPROM itself is read, and
/// compares. Errors: invalid_argument (closed area), busy, cross_check_failed (another value is there now).
class WriteMemory : public MemoryProcedure {
 public:
  WriteMemory(const Format& format, std::uint8_t page, std::uint8_t address, std::uint8_t value,
              Wear wear = Wear::avoid, Page before = Page::stays);

  void report(FieldSink& sink) const override;
  /// Whether a write was sent.
  [[nodiscard]] bool written() const { return written_; }
  [[nodiscard]] std::uint8_t value() const { return value_; }

 private:
  enum class Phase : std::uint8_t { compare, write, read_back };
  void selected(Time ready) override;
  void replied(const Reply& reply) override;
  void lost(Error error) override;

  std::uint8_t address_;
  std::uint8_t value_;
  Wear wear_;
  Phase phase_ = Phase::compare;
  bool written_ = false;
};

/// Page 7 address 4: over_heat above `degrees` (1 to 127), 0: never.
class WriteOverheatThreshold final : public WriteMemory {
 public:
  WriteOverheatThreshold(const Format& format, std::uint8_t degrees)
      : WriteMemory(format, service_page, overheat_address, encoded(degrees), Wear::avoid, Page::restored) {}
  /// The byte in memory (7.2).
  [[nodiscard]] static constexpr std::uint8_t encoded(std::uint8_t degrees) {
    return degrees == 0 ? std::uint8_t{0} : static_cast<std::uint8_t>(0x80 | degrees);
  }
  void report(FieldSink& sink) const override;
};

}  // namespace absenc::tformat
