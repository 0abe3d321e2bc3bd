// SPDX-License-Identifier: Apache-2.0
// Host side of ESL memory: pages, EEPROM and registers (Tables 9 to 11, Figures 14 and 15). One-to-one only.
#pragma once

#include <optional>

#include "absenc/protocol/esl/procedure.hpp"

namespace absenc::esl {

/// What becomes of the page that the encoder had selected before.
enum class Page : std::uint8_t {
  stays,     // the one that was asked for stays selected
  restored,  // the one before is selected again, where the encoder says which that was
};

/// Selects pages and reads bytes, whichever way their area needs: a register at once, the EEPROM by two requests 200 us
/// apart, of which only an answer that follows a busy one is believed.
class MemoryProcedure : public Procedure {
 protected:
  MemoryProcedure(const Profile& profile, std::uint8_t page, Page before = Page::stays);
  ~MemoryProcedure() = default;

  /// Selects the page; finishes when the profile says that there are several encoders on the line.
  void begin();
  void read_byte(std::uint8_t address, Time earliest = {});
  [[nodiscard]] std::uint8_t page() const { return page_; }
  [[nodiscard]] bool immediate(std::uint8_t address) const;
  /// The page before is selected again first, where that is wanted and known.
  void end();
  /// Puts the page that stays selected although the one before should be.
  void report_page(FieldSink& sink) const;

  virtual void page_selected(Time ready) = 0;
  virtual void byte_read(std::uint8_t value) = 0;
  /// Only after a write that was accepted.
  virtual void byte_written() {}
  void failed(Error error) override;

 private:
  enum class Stage : std::uint8_t { asking, working, restoring, verifying };
  void answered(const Reply& reply) final;
  void asked(const Reply& reply);
  void select(std::uint8_t page) { ask({DataId::write_memory, profile().address, page_select_address, page}); }
  void ask_while_busy(Time pause);

  std::uint8_t page_;
  Page before_;
  Stage stage_ = Stage::working;
  std::optional<std::uint8_t> page_before_{};
  bool restored_ = false;
  bool busy_seen_ = false;  // of this byte
  Time give_up_{};
};

/// Errors: invalid_argument (not in Table 11), unsupported (several encoders on the line), busy.
class ReadMemory : public MemoryProcedure {
 public:
  /// Pages of `memory_map`; `count` from 1.
  ReadMemory(const Profile& profile, std::uint8_t page, std::uint8_t address, std::uint8_t count = 1,
             Page before = Page::stays);

  void report(FieldSink& sink) const override;
  [[nodiscard]] Bytes data() const { return data_; }

 private:
  void page_selected(Time ready) override { read_byte(address_, ready); }
  void byte_read(std::uint8_t value) override;

  std::uint8_t address_;
  std::uint8_t count_;
  ByteBuffer<last_address + 1> data_;
};

/// Page 8 address 1A: which of the two is behind led_or_lissajous_error.
class ReadErrorInfo final : public ReadMemory {
 public:
  explicit ReadErrorInfo(const Profile& profile)
      : ReadMemory(profile, register_page, error_info_address, 1, Page::restored) {}
  void report(FieldSink& sink) const override;
  [[nodiscard]] bool led_error() const { return (data()[0] & error_info_led) != 0; }
  [[nodiscard]] bool lissajous_error() const { return (data()[0] & error_info_lissajous) != 0; }
};

enum class Wear : std::uint8_t {
  avoid,   // a byte that already holds the value is not written (1 000 000 writes in a life, 100 000 of the MTP)
  accept,  // write it all the same
};
enum class Force : std::uint8_t {
  no,
  yes,  // also pages with calibration, lock bits and undescribed commands
};

/// Reads, writes what differs, waits, reads back. Errors: invalid_argument (not in Table 11, or not without force),
/// unsupported (several encoders on the line), busy, cross_check_failed (another value is there now).
class WriteMemory final : public MemoryProcedure {
 public:
  WriteMemory(const Profile& profile, std::uint8_t page, std::uint8_t address, std::uint8_t value,
              Force force = Force::no, Wear wear = Wear::avoid);

  void report(FieldSink& sink) const override;
  /// Whether a write was sent.
  [[nodiscard]] bool written() const { return written_; }

 private:
  void page_selected(Time ready) override { read_byte(address_, ready); }
  void byte_read(std::uint8_t value) override;
  void byte_written() override { read_back(); }
  void failed(Error error) override;
  void read_back();

  std::uint8_t address_;
  std::uint8_t value_;
  Wear wear_;
  bool written_ = false;
  bool writing_ = false;
};

/// Selects a page, for whoever reads or writes by himself.
class SelectPage final : public MemoryProcedure {
 public:
  SelectPage(const Profile& profile, std::uint8_t page);
  void report(FieldSink& sink) const override;

 private:
  void page_selected(Time ready) override { read_byte(page_select_address, ready); }
  void byte_read(std::uint8_t value) override;
};

}  // namespace absenc::esl
