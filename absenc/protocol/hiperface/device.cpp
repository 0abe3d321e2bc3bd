// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/hiperface/device.hpp"

#include <algorithm>
#include <utility>

#include "absenc/core/bits.hpp"

namespace absenc::hiperface {

namespace {
// Greatest number of bytes of a data field that the virtual encoder sends in one reply.
constexpr std::size_t most_read = 56;
// Serial number and program version of the virtual encoder. The format's lengths cut them or fill them with spaces.
constexpr std::string_view serial_number = "VIRTUAL01";
constexpr std::string_view version = "absenc HIPERFACE 1.0";

void append_text(FieldBytes& bytes, std::string_view text, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) bytes.push_back(static_cast<std::uint8_t>(i < text.size() ? text[i] : ' '));
}
}  // namespace

VirtualEncoder::VirtualEncoder(const Format& format, const Shaft& shaft)
    : Responder(Protocol::device_times(format)), format_(format), shaft_(&shaft) {}

// A memory from a file may hold an invalid address or baud rate; the format's values then replace them.
void VirtualEncoder::started(Time) {
  const bool has_address = address() >= first_address && address() <= last_address;
  const bool has_rate = (interface_setting() & rate_bits) < rates.size();
  if (!has_address) memory_[address_at] = 0;
  if (!has_rate) memory_[interface_at] = 0;
  if (!has_address || !has_rate) change_memory();
  const std::uint8_t rate = interface_setting() & rate_bits;
  if (rate != format_.rate) next_rate_ = rates[rate];
  sent_ = 0;
}

void VirtualEncoder::power_off(Time now) {
  Responder::power_off(now);
  refusal_ = 0;
  next_rate_ = 0;
}

ByteStep VirtualEncoder::next(Time now) {
  static_cast<void>(is_on(now));
  if (next_rate_ != 0 && !is_transmitting()) {
    return {.kind = ByteStep::Kind::configure, .rate = std::exchange(next_rate_, 0)};
  }
  return Responder::next(now);
}

// ---- Requests

std::size_t VirtualEncoder::others_reply_size(Bytes bytes) const {
  const Result<Request> request = decode_request(format_, bytes);
  return request ? reply_length(format_, *request) : 0;
}

author::Responder::Answer VirtualEncoder::respond(Bytes bytes, Time at, ByteBuffer<64>& reply) {
  if (!is_to_me(bytes[0])) return Answer::for_others;
  const Result<Request> request = decode_request(format_, bytes);
  if (!request) {
    refusal_ = request.error() == Error::bad_checksum ? refusal::checksum : refusal::argument;
    return Answer::refused;
  }
  if (request->command == CommandCode::reset) {
    lower_alarms(raised());
    restart(at + start_time);
    return Answer::none;
  }
  Reply made{.address = address()};
  const StatusCode refused = execute(*request, at, made);
  made.has_error = alarms_now() != 0;
  const ReplyBytes sent =
      refused != 0 ? encode_refusal(format_, made.address, refused) : encode_reply(format_, *request, made);
  if (refused == 0 && stores(request->command)) take_longer(store_time);
  reply.append(sent.view());
  return Answer::sent;
}

bool VirtualEncoder::is_refused(Flaw flaw, Bytes heard) {
  if (heard.empty() || !is_to_me(heard[0])) return false;
  if (flaw == Flaw::damaged) {
    refusal_ = refusal::parity;
  } else if (heard.size() < 2) {
    return false;  // a single byte is not refused, because it may be noise
  } else if (flaw == Flaw::cut_short) {
    refusal_ = refusal::length;
  } else {
    refusal_ = data_sizes(format_, heard[1]) ? refusal::argument : refusal::command;
  }
  return true;
}

void VirtualEncoder::refuse(Time, ByteBuffer<64>& reply) {
  reply.append(encode_refusal(format_, address(), refusal_).view());
}

// Executes a request: fills in the reply and returns 0, or returns the status code that refuses it.
VirtualEncoder::StatusCode VirtualEncoder::execute(const Request& request, Time at, Reply& reply) {
  switch (request.command) {
    case CommandCode::position:
      reply.value = position(at);
      return 0;
    case CommandCode::set_position:
      return set_position(request, at);
    case CommandCode::analog_value:
      if (request.subject == temperature_channel) reply.value = static_cast<std::uint16_t>(temperature_);
      return 0;
    case CommandCode::counter:
      reply.value = static_cast<std::uint32_t>(load_little_endian(Bytes(memory_).subspan(counter_at, 4)));
      return 0;
    case CommandCode::count_up: {
      const std::uint64_t next = load_little_endian(Bytes(memory_).subspan(counter_at, 4)) + 1;
      const std::uint64_t wrapped = next & low_mask(8u * format_.counter_bytes);
      if (wrapped == 0) raise_alarms(alarm_of(0x08));
      store_little_endian(MutableBytes(memory_).subspan(counter_at, 4), wrapped);
      change_memory();
      return 0;
    }
    case CommandCode::clear_counter:
      return clear_counter(request);
    case CommandCode::read_data:
      return read_data(request, reply);
    case CommandCode::store_data:
      return store_data(request);
    case CommandCode::field_status:
      reply.value = status_of(request.subject);
      return 0;
    case CommandCode::create_field:
      return create_field(request);
    case CommandCode::free_memory:
      reply.value = static_cast<std::uint32_t>(free_memory() / (format_.free_bytes == 1 ? block_size : 1));
      return 0;
    case CommandCode::access_code:
      return change_access_code(request);
    case CommandCode::status:
      reply.value = status_now();
      return 0;
    case CommandCode::type_label:
      reply.label = {interface_setting(), format_.type_in_label(), memory_blocks, 0x01};
      return 0;
    case CommandCode::set_address:
      return set_address(request);
    case CommandCode::serial_number:
      append_text(reply.data, serial_number, format_.serial_bytes);
      append_text(reply.data, version, format_.version_bytes);
      return 0;
    case CommandCode::interface:
      return set_interface(request);
    case CommandCode::reset:
      break;
  }
  return refusal::command;
}

// ---- Position and counter

std::uint32_t VirtualEncoder::position(Time at) const {
  const auto counts =
      static_cast<std::uint64_t>(shaft_->at(at).position >> (32 - format_.resolution().singleturn_bits));
  const std::uint64_t offset = load_little_endian(Bytes(memory_).subspan(offset_at, 4));
  return static_cast<std::uint32_t>((counts + offset) & low_mask(format_.position_bits()));
}

VirtualEncoder::StatusCode VirtualEncoder::set_position(const Request& request, Time at) {
  if (request.code != access_code(0)) return refusal::access_code;
  if (std::uint64_t{request.position} >> format_.position_bits() != 0) return refusal::argument;
  const std::uint64_t offset = load_little_endian(Bytes(memory_).subspan(offset_at, 4));
  store_little_endian(MutableBytes(memory_).subspan(offset_at, 4), offset + request.position - position(at));
  change_memory();
  return 0;
}

VirtualEncoder::StatusCode VirtualEncoder::clear_counter(const Request& request) {
  if (request.code != access_code(0)) return refusal::access_code;
  store_little_endian(MutableBytes(memory_).subspan(counter_at, 4), 0);
  change_memory();
  lower_alarms(alarm_of(0x08));
  return 0;
}

// ---- Data fields

std::uint8_t VirtualEncoder::status_of(std::uint8_t field) const {
  if (field == description_field) return field_status::exists;
  if (field >= user_fields) return 0;
  return static_cast<std::uint8_t>(memory_[fields_at + field * field_stride] ^
                                   (field < fields_at_shipping ? shipped_field : 0));
}

std::size_t VirtualEncoder::free_memory() const {
  std::size_t used = 0;
  for (std::uint8_t field = 0; field < user_fields; ++field) used += field_size(status_of(field));
  return user_fields * field_capacity - used;
}

// Returns the status code that refuses access to a data field with this status: it is missing, the access code is
// wrong, or the bytes are outside it. Returns 0 if the bytes may be read.
VirtualEncoder::StatusCode VirtualEncoder::access(const Request& request, std::uint8_t status) const {
  if (field_size(status) == 0) return refusal::no_field;
  const std::size_t size = request.subject == description_field ? description_size : field_size(status);
  const std::size_t number = (status & field_status::code_number) >> 4;
  if ((status & field_status::needs_code) != 0 && request.code != access_code(number)) return refusal::access_code;
  return std::size_t{request.first} + request.count > size ? refusal::outside : StatusCode{0};
}

VirtualEncoder::StatusCode VirtualEncoder::read_data(const Request& request, Reply& reply) const {
  if (const StatusCode refused = access(request, status_of(request.subject)); refused != 0) return refused;
  if (request.count > most_read) return refusal::argument;
  std::array<std::uint8_t, description_size> description{};
  store_big_endian(MutableBytes(description).subspan(2, 4),
                   std::uint64_t{1} << (format_.resolution().singleturn_bits - least_singleturn_bits));
  store_big_endian(MutableBytes(description).subspan(6, 4), std::uint64_t{1} << format_.resolution().multiturn_bits);
  const Bytes field = request.subject == description_field
                          ? Bytes(description)
                          : Bytes(memory_).subspan(fields_at + request.subject * field_stride + 1, field_capacity);
  reply.data.append(field.subspan(request.first, request.count));
  return 0;
}

VirtualEncoder::StatusCode VirtualEncoder::store_data(const Request& request) {
  const std::uint8_t status = status_of(request.subject);
  if (const StatusCode refused = access(request, status); refused != 0) return refused;
  if ((status & field_status::writable) == 0) return refusal::not_writable;
  const std::size_t first = fields_at + request.subject * field_stride + 1 + request.first;
  std::copy_n(request.data.view().begin(), request.count, memory_.begin() + static_cast<std::ptrdiff_t>(first));
  change_memory();
  return 0;
}

VirtualEncoder::StatusCode VirtualEncoder::create_field(const Request& request) {
  if (request.subject >= user_fields) return refusal::no_field;
  if ((request.new_value & field_status::exists) == 0) return refusal::argument;
  if (request.code != access_code((request.new_value & field_status::code_number) >> 4)) return refusal::access_code;
  const std::size_t before = field_size(status_of(request.subject));
  const std::size_t size = field_size(request.new_value);
  if (before != 0 && before != size) return refusal::size_is_fixed;
  if (before == 0 && size > free_memory()) return refusal::argument;
  change(fields_at + request.subject * field_stride,
         static_cast<std::uint8_t>(request.new_value ^ (request.subject < fields_at_shipping ? shipped_field : 0)));
  return 0;
}

// ---- Settings

std::uint8_t VirtualEncoder::access_code(std::size_t number) const {
  return memory_[codes_at + number] ^ (number == 0 ? format_.code0 : format_.access_code);
}

std::uint8_t VirtualEncoder::interface_setting() const {
  return static_cast<std::uint8_t>(memory_[interface_at] ^ ((interface_at_shipping & ~rate_bits) | format_.rate));
}

VirtualEncoder::StatusCode VirtualEncoder::change_access_code(const Request& request) {
  if (request.subject > 3) return refusal::argument;
  if (request.code != access_code(request.subject)) return refusal::access_code;
  const std::uint8_t at_shipping = access_code(request.subject) ^ memory_[codes_at + request.subject];
  change(codes_at + request.subject, request.new_value ^ at_shipping);
  return 0;
}

VirtualEncoder::StatusCode VirtualEncoder::set_address(const Request& request) {
  if (request.code != access_code(0)) return refusal::access_code;
  if (request.subject < first_address || request.subject > last_address) return refusal::argument;
  change(address_at, request.subject ^ format_.address);
  return 0;
}

VirtualEncoder::StatusCode VirtualEncoder::set_interface(const Request& request) {
  if (request.code != access_code(0)) return refusal::access_code;
  const std::uint8_t rate = request.subject & rate_bits;
  if (rate >= rates.size()) return refusal::argument;
  const std::uint8_t at_shipping = interface_setting() ^ memory_[interface_at];
  if (rate != (interface_setting() & rate_bits)) next_rate_ = rates[rate];
  change(interface_at, request.subject ^ at_shipping);
  return 0;
}

// ---- Alarms

std::uint32_t VirtualEncoder::alarms_now() const {
  return raised() | (temperature_ > critical_temperature ? alarm_of(0x1E) : 0);
}

// Returns the status code of one raised alarm; 0 if none is raised. Successive calls return the alarms one after the
// other, and then begin again.
VirtualEncoder::StatusCode VirtualEncoder::status_now() {
  const std::uint32_t now = alarms_now() & all_alarms;
  if (now == 0) return 0;
  if ((now & ~sent_) == 0) sent_ = 0;
  for (std::size_t i = 0; i < alarms.size(); ++i) {
    const std::uint32_t bit = 1u << i;
    if ((now & ~sent_ & bit) == 0) continue;
    sent_ |= bit;
    return alarms[i].code;
  }
  return 0;
}

}  // namespace absenc::hiperface
