// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/esl/memory.hpp"

#include "absenc/protocol/esl/fields.hpp"

namespace absenc::esl {

namespace {

constexpr unsigned attempts = 3;
constexpr Time read_pause = eeprom_read_time + 20us;   // "more than 200 us"
constexpr Time write_pause = eeprom_write_time + 1ms;  // "6~10ms" (Figure 15)
constexpr Time busy_limit = 2 * page_time;             // the document gives no maximum

constexpr std::string_view unknown_area = "Table 11 lists no such page and address; nothing was sent";

}  // namespace

MemoryProcedure::MemoryProcedure(const Profile& profile, std::uint8_t page, Page before)
    : Procedure(profile, attempts), page_(page), before_(before) {}

void MemoryProcedure::begin() {
  if (profile().bus) {
    return finish(
        Error::unsupported,
        "memory cannot be reached by broadcast or with several encoders on the line (Figure 18): connect this one "
        "alone and say bus=false; nothing was sent");
  }
  if (before_ == Page::stays) return select(page_);
  stage_ = Stage::asking;
  ask({DataId::read_memory, profile().address, page_select_address});
}

void MemoryProcedure::asked(const Reply& reply) {
  if (is_page(reply.value)) page_before_ = reply.value;
  stage_ = Stage::working;
  select(page_);
}

void MemoryProcedure::end() {
  restored_ = page_before_ == page_;
  if (!page_before_ || restored_) return finish();
  stage_ = Stage::restoring;
  give_up_ = Time{};
  select(*page_before_);
}

void MemoryProcedure::failed(Error error) {
  switch (stage_) {
    case Stage::asking:  // its page cannot be read
      stage_ = Stage::working;
      return select(page_);
    case Stage::working:
      return finish(error, before_ == Page::restored ? "page 8 may be left selected, where it was another before" : "");
    case Stage::restoring:
    case Stage::verifying:  // what was asked for is known all the same
      return finish();
  }
}

void MemoryProcedure::report_page(FieldSink& sink) const {
  if (before_ == Page::restored && !restored_) put(sink, field_page_left, page_);
}

bool MemoryProcedure::immediate(std::uint8_t address) const {
  if (address == page_select_address) return true;
  const MemoryArea* area = find_area(page_, address);
  return area != nullptr && area->kind == MemoryArea::Kind::registers;
}

void MemoryProcedure::read_byte(std::uint8_t address, Time earliest) {
  busy_seen_ = immediate(address);
  give_up_ = Time{};
  ask({DataId::read_memory, profile().address, address}, earliest);
}

// A busy encoder has not executed the request, so even a write may be sent again.
void MemoryProcedure::ask_while_busy(Time pause) {
  if (give_up_ == Time{}) give_up_ = received_at() + busy_limit;
  if (received_at() > give_up_) {
    return finish(Error::busy, "the memory stays busy longer than a write may take; the last request was not executed");
  }
  ask(request(), received_at() + pause);
}

void MemoryProcedure::answered(const Reply& reply) {
  if (stage_ == Stage::asking && !reply.busy) return asked(reply);
  if (stage_ == Stage::verifying && !reply.busy) {
    restored_ = reply.value == page_before_;
    return finish();
  }
  if (request().id == DataId::write_memory && request().memory_address == page_select_address) {
    if (reply.busy) return ask_while_busy(page_time);
    if (stage_ == Stage::working) return page_selected(received_at() + page_time);
    stage_ = Stage::verifying;  // reading it back after that time is what the encoder's next user finds
    return read_byte(page_select_address, received_at() + page_time);
  }
  if (request().id == DataId::write_memory) {
    if (reply.busy) return ask_while_busy(read_pause);
    return byte_written();
  }
  if (reply.busy || !busy_seen_) {
    busy_seen_ = busy_seen_ || reply.busy;
    return ask_while_busy(read_pause);
  }
  byte_read(reply.value);
}

// ---- Read

ReadMemory::ReadMemory(const Profile& profile, std::uint8_t page, std::uint8_t address, std::uint8_t count, Page before)
    : MemoryProcedure(profile, page, before), address_(address), count_(count) {
  for (unsigned i = address; i < unsigned{address} + count; ++i) {
    if (find_area(page, i) != nullptr) continue;
    finish(Error::invalid_argument, unknown_area);
    return;
  }
  if (count == 0) finish(Error::invalid_argument, "nothing to read");
  if (error() == Error::none) begin();
}

void ReadMemory::byte_read(std::uint8_t value) {
  data_.push_back(value);
  if (data_.size() == count_) return end();
  read_byte(static_cast<std::uint8_t>(address_ + data_.size()));
}

void ReadMemory::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put(sink, field_page, page());
  put(sink, field_memory_address, address_);
  put(sink, field_value, data_[0]);
  if (count_ > 1) sink.put({.info = &fields[field_data], .bytes = data_});
}

void ReadErrorInfo::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put(sink, field_led_error, led_error() ? 1 : 0);
  put(sink, field_lissajous_error, lissajous_error() ? 1 : 0);
  report_page(sink);
}

// ---- Write

WriteMemory::WriteMemory(const Profile& profile, std::uint8_t page, std::uint8_t address, std::uint8_t value,
                         Force force, Wear wear)
    : MemoryProcedure(profile, page), address_(address), value_(value), wear_(wear) {
  const MemoryArea* area = find_area(page, address);
  if (area == nullptr) {
    finish(Error::invalid_argument, unknown_area);
  } else if (!area->user && force == Force::no) {
    explanation().add("this page is not for the user: it holds ").add(area->meaning);
    finish(Error::invalid_argument, "writing there can spoil the encoder and needs force; nothing was sent");
  } else {
    begin();
  }
}

void WriteMemory::read_back() { read_byte(address_, received_at() + (immediate(address_) ? Time{} : write_pause)); }

void WriteMemory::byte_read(std::uint8_t value) {
  if (!writing_) {
    if (value == value_ && wear_ == Wear::avoid) return finish();
    writing_ = written_ = true;
    return ask({DataId::write_memory, profile().address, address_, value_});
  }
  if (value == value_) return finish();
  finish(Error::cross_check_failed, "reading back gave another value: the write has failed");
}

void WriteMemory::failed(Error error) {
  // A lost reply does not tell whether the write was done: reading back does.
  if (request().id == DataId::write_memory && request().memory_address == address_) return read_back();
  finish(error, written_ ? "the byte was written, but could not be read back" : "nothing was written");
}

void WriteMemory::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put(sink, field_page, page());
  put(sink, field_memory_address, address_);
  put(sink, field_value, value_);
  put(sink, field_written, written_ ? 1 : 0);
}

// ---- Page

SelectPage::SelectPage(const Profile& profile, std::uint8_t page) : MemoryProcedure(profile, page) {
  if (is_page(page)) {
    begin();
  } else {
    finish(Error::invalid_argument, "Table 11 lists no such page; nothing was sent");
  }
}

void SelectPage::byte_read(std::uint8_t value) {
  if (value == page()) return finish();
  finish(Error::cross_check_failed, "another page is selected");
}

void SelectPage::report(FieldSink& sink) const {
  if (error() == Error::none) put(sink, field_page, page());
}

}  // namespace absenc::esl
