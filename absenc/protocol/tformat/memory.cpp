// SPDX-License-Identifier: Apache-2.0
// The memory of T-format encoders: pages, EEPROM, temperature and its threshold.
#include "absenc/protocol/tformat/fields.hpp"
#include "absenc/protocol/tformat/host.hpp"

namespace absenc::tformat {

namespace {

constexpr unsigned attempts = 3;
constexpr Time busy_limit = 2 * memory_time;  // the document's maximum is memory_time

constexpr Request selection(std::uint8_t page) { return {DataId::write_memory, page_select_address, page}; }

}  // namespace

// ---- Pages

MemoryProcedure::MemoryProcedure(const Format& format, std::uint8_t page, Page before)
    : Procedure(format, attempts), page_(page), before_(before) {}

void MemoryProcedure::begin() {
  if (before_ == Page::stays) return select({});
  stage_ = Stage::asking;
  ask({DataId::read_memory, page_select_address});
}

void MemoryProcedure::select(Time earliest) {
  stage_ = Stage::working;
  give_up_ = Time{};
  ask(selection(page_), earliest);
}

void MemoryProcedure::end() {
  if (page_before_ < 0 || page_before_ == page_) {
    restored_ = page_before_ == page_;
    return finish();
  }
  stage_ = Stage::restoring;
  give_up_ = Time{};
  ask(selection(static_cast<std::uint8_t>(page_before_)));
}

void MemoryProcedure::answered(const Reply& reply) {
  if (give_up_ == Time{}) give_up_ = received_at() + busy_limit;
  if (reply.busy) {  // the request was not executed, so even a write may be sent again
    if (received_at() <= give_up_) return ask_again();
    return failed(Error::busy);
  }
  const Time settled = received_at() + memory_time;
  give_up_ = settled + busy_limit;
  switch (stage_) {
    case Stage::asking:
      return asked(reply);
    case Stage::working:
      return request().address == page_select_address ? selected(settled) : replied(reply);
    case Stage::restoring:  // reading it back after that time is what the encoder's next user finds
      stage_ = Stage::verifying;
      return ask({DataId::read_memory, page_select_address}, settled);
    case Stage::verifying:
      restored_ = reply.value == page_before_;
      return finish();
  }
}

void MemoryProcedure::asked(const Reply& reply) {
  if (reply.value < user_pages || reply.value == service_page) page_before_ = reply.value;
  select({});
}

void MemoryProcedure::failed(Error error) {
  switch (stage_) {
    case Stage::asking:  // it is one of those whose page cannot be read
      return select({});
    case Stage::working:
      if (error == Error::busy) return finish(error, "the encoder stays busy longer than a write may take", left());
      return lost(error);
    case Stage::restoring:
    case Stage::verifying:  // what was asked for is known all the same
      return finish();
  }
}

std::string_view MemoryProcedure::left() const {
  return before_ == Page::restored ? "page 7 may be left selected, where it was another before" : "";
}

void MemoryProcedure::report_page(FieldSink& sink) const {
  if (before_ == Page::restored && !restored_) put(sink, field_page_left, page_);
}

void MemoryProcedure::report_left(FieldSink& sink) const {
  if (stage_ != Stage::asking) put(sink, field_page_left, page_);
}

// ---- Read

ReadMemory::ReadMemory(const Format& format, std::uint8_t page, std::uint8_t address, std::uint8_t count, Page before)
    : MemoryProcedure(format, page, before), address_(address), count_(count) {
  for (unsigned i = address; i < unsigned{address} + count; ++i) {
    if (is_open(page, i)) continue;
    finish(Error::invalid_argument,
           "this area is closed: pages 0 to 5 have addresses 0 to 126, page 7 has 4 "
           "(over-heat threshold) and 5 (temperature)");
    return;
  }
  if (count == 0) {
    finish(Error::invalid_argument, "nothing to read");
    return;
  }
  begin();
}

void ReadMemory::ask_next(Time earliest) {
  ask({DataId::read_memory, static_cast<std::uint8_t>(address_ + data_.size())}, earliest);
}

void ReadMemory::replied(const Reply& reply) {
  data_.push_back(reply.value);
  if (data_.size() == count_) return end();
  ask_next();
}

void ReadMemory::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put(sink, field_page, page());
  put(sink, field_address, address_);
  put(sink, field_value, data_[0]);
  if (count_ > 1) sink.put({.info = &fields[field_data], .bytes = data_});
}

void ReadTemperature::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put(sink, field_temperature, static_cast<std::int8_t>(data()[0]));
  report_page(sink);
}

namespace {
void put_threshold(FieldSink& sink, std::uint8_t value) {
  put(sink, field_overheat_enabled, (value & 0x80) != 0 ? 1 : 0);
  if ((value & 0x80) != 0) put(sink, field_overheat_threshold, value & 0x7F);
}
}  // namespace

void ReadOverheatThreshold::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put_threshold(sink, data()[0]);
  report_page(sink);
}

// ---- Write

WriteMemory::WriteMemory(const Format& format, std::uint8_t page, std::uint8_t address, std::uint8_t value, Wear wear,
                         Page before)
    : MemoryProcedure(format, page, before), address_(address), value_(value), wear_(wear) {
  if (!is_open(page, address) || (page == service_page && address == temperature_address)) {
    finish(Error::invalid_argument,
           "this address cannot be written: pages 0 to 5 have addresses 0 to 126, page 7 has "
           "4 (over-heat threshold)");
    return;
  }
  begin();
}

void WriteMemory::selected(Time ready) {
  if (phase_ == Phase::write) phase_ = Phase::read_back;
  ask({DataId::read_memory, address_}, ready);
}

void WriteMemory::replied(const Reply& reply) {
  switch (phase_) {
    case Phase::compare:
      if (reply.value == value_ && wear_ == Wear::avoid) return end();
      phase_ = Phase::write;
      written_ = true;
      return ask({DataId::write_memory, address_, value_});
    case Phase::write:
      return select(received_at() + memory_time);
    case Phase::read_back:
      if (reply.value == value_) return end();
      return finish(Error::cross_check_failed, "reading back gave another value: the write has failed", left());
  }
}

void WriteMemory::lost(Error error) {
  // A lost reply does not tell whether the write was done: reading back does.
  const bool wrote = phase_ == Phase::write && request().address == address_;
  if (wrote) return select(received_at() + memory_time);
  finish(error, written_ ? "the byte was written, but could not be read back" : "nothing was written", left());
}

void WriteMemory::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put(sink, field_page, page());
  put(sink, field_address, address_);
  put(sink, field_value, value_);
  put(sink, field_written, written_ ? 1 : 0);
}

void WriteOverheatThreshold::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put_threshold(sink, value());
  put(sink, field_written, written() ? 1 : 0);
  report_page(sink);
}

}  // namespace absenc::tformat
