// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/endat/device.hpp"

#include <algorithm>
#include <utility>

namespace absenc::endat {

namespace {

constexpr author::DirectionRules directions{rules::collision, rules::early_supplement};

constexpr std::uint32_t signal_periods = 2048;  // of a turn
constexpr std::int64_t counts_of_linear_period = 16;
constexpr std::uint32_t other_warning = 1u << 7;  // a bit of the word of the warnings to which no source gives a name
constexpr std::uint16_t supported_errors = alarm::errors;
constexpr std::uint16_t supported_warnings = alarm::warnings >> alarm::warnings_shift;

}  // namespace

// A short latency of the format makes the encoder as fast; a long one is only the host's limit.
EncoderTimes VirtualEncoder::times_for(const Format& format) {
  EncoderTimes times;
  times.latency = std::min(format.latency, times.latency);
  return times;
}

VirtualEncoder::VirtualEncoder(const Format& format, const Shaft& shaft, const EncoderTimes& times)
    : BitDevice(500ms, directions),
      format_(with_resolution(format)),
      shaft_(&shaft),
      times_(times),
      info1_(format.info1),
      info2_(format.info2) {
  write_parameters();
}

// ---- Memory

std::size_t VirtualEncoder::place(WordPlace word) {
  std::size_t offset = 0;
  for (const MemoryArea& one : memory_areas) {
    if (one.has(word.mrs, word.address)) return 2 * (offset + word.address - one.first);
    offset += one.count;
  }
  return 0;
}

std::uint16_t VirtualEncoder::load(WordPlace word) const {
  if (word.mrs == area::status && word.address == error_word.address) return errors();
  if (word.mrs == area::status && word.address == warning_word.address) return warnings();
  return static_cast<std::uint16_t>(load_little_endian(Bytes(memory_).subspan(place(word), 2)));
}

void VirtualEncoder::store(WordPlace word, std::uint16_t value) {
  store_little_endian(MutableBytes(memory_).subspan(place(word), 2), value);
}

// Returns whether the word may be written; error messages and warnings are cleared by a 0.
bool VirtualEncoder::write(WordPlace word, std::uint16_t value) {
  if (word.mrs == area::status && word.address <= warning_word.address) {
    const std::uint32_t cleared =
        word.address == error_word.address ? alarm::errors | alarm::error : alarm::warnings | alarm::warning;
    if (value == 0) latched_ &= ~cleared;
    return true;
  }
  const MemoryArea* const area = find_word(word.mrs, word.address);
  if (area == nullptr || !area->writable) return false;
  store(word, value);
  change_memory();
  return true;
}

void VirtualEncoder::write_parameters() {
  const bool linear = format_.is_linear();
  const bool turns = format_.multiturn_bits != 0;
  store(clock_count_word, static_cast<std::uint16_t>(clock_count_marker | format_.bits()));
  store(type_word, linear ? 0x4000 : turns ? 0xE000 : 0xC000);
  // A linear encoder states lengths in nm.
  const std::uint64_t steps = linear ? format_.unit_pm() / 1000 : std::uint64_t{1} << format_.singleturn_bits;
  const std::uint64_t periods =
      linear ? steps * counts_of_linear_period
             : std::min<std::uint64_t>(signal_periods, std::uint64_t{1} << format_.singleturn_bits);
  const auto store_double = [this](WordPlace low, WordPlace high, std::uint64_t value) {
    store(low, static_cast<std::uint16_t>(value));
    store(high, static_cast<std::uint16_t>(value >> 16));
  };
  store_double(periods_word, periods_high_word, periods);
  // 2^32 steps do not fit into the two words: an encoder of that many bits states 0.
  store_double(steps_word, steps_high_word, steps >> 32 != 0 ? 0 : steps);
  store(revolutions_word, turns ? static_cast<std::uint16_t>(1u << std::min<unsigned>(format_.multiturn_bits, 15)) : 0);
  constexpr std::array<std::uint16_t, 6> identity{0x3030, 0x5678, 0x0012, 0x2041, 0x2345, 0x4101};
  for (std::uint8_t i = 0; i < 3; ++i) {
    store({id_words.mrs, static_cast<std::uint8_t>(id_words.address + i)}, identity[i]);
    store({serial_words.mrs, static_cast<std::uint8_t>(serial_words.address + i)}, identity[i + 3u]);
  }
  store(errors_supported_word, supported_errors);
  store(warnings_supported_word, supported_warnings);
  store(command_set_word, format_.version == CommandSet::v22 ? 1 : 0);
  store(initialisation_word, format_.recovery == Recovery::short_time ? short_recovery_bits : long_recovery_bits);
}

// ---- Position and alarms

std::uint16_t VirtualEncoder::errors() const { return static_cast<std::uint16_t>(latched_ & alarm::errors); }
std::uint16_t VirtualEncoder::warnings() const {
  // WRN alone stands for a warning that no source names.
  const std::uint32_t other = (latched_ & alarm::warning) != 0 ? other_warning : 0;
  return static_cast<std::uint16_t>((latched_ & alarm::warnings) >> alarm::warnings_shift | other);
}

std::int64_t VirtualEncoder::counts_of_period() const {
  if (format_.is_linear()) return counts_of_linear_period;
  return (std::int64_t{1} << format_.singleturn_bits) /
         std::min<std::int64_t>(signal_periods, std::int64_t{1} << format_.singleturn_bits);
}

std::int64_t VirtualEncoder::raw_counts(Time at) const {
  const std::int64_t place = shaft_->at(at).position;  // 2^-32 revolution
  const unsigned bits = format_.is_linear() ? format_.position_bits : format_.singleturn_bits;
  return bits > 32 ? static_cast<std::int64_t>(static_cast<std::uint64_t>(place) << (bits - 32)) : place >> (32 - bits);
}

std::uint64_t VirtualEncoder::position(Time at) const {
  const std::int64_t shift = std::int64_t{shift_} * counts_of_period();
  const std::int64_t counts =
      format_.datum_shift == DatumShift::subtracted ? raw_counts(at) - shift : raw_counts(at) + shift;
  return static_cast<std::uint64_t>(counts) & low_mask(format_.bits());
}

// ---- Exchanges

void VirtualEncoder::started(Time) {
  shift_ = static_cast<std::int32_t>(std::uint32_t{load(shift_high_word)} << 16 | load(shift_word));
  area_ = 0;
  access_ = {};
  free_at_ = {};
}

void VirtualEncoder::selected(Time at, Time period) {
  period_ = period == Time{} ? format_.period() : period;
  latched_at_ = at;
  needed_clocks_ = 0;
  const std::uint32_t fastest = format_.version == CommandSet::v21 ? fastest_21 : fastest_22;
  expect(period_ >= Time(1'000'000'000 / fastest), rules::fastest, at);
  expect(period_ <= Time(1'000'000'000 / slowest), rules::slowest, at);
  is_valid_ = expect(at >= free_at_, rules::recovery, at);
}

std::size_t VirtualEncoder::request_size(BitView begin) const {
  if (begin.size < command_bits) return command_bits;
  const auto code = static_cast<std::uint8_t>(begin.load(lead_bits, 6));
  return is_code(code) ? endat::request_size(static_cast<ModeCommand>(code)) : command_bits;
}

void VirtualEncoder::respond(BitView request, Time at, AnswerBits& bits) {
  now_ = at;
  request_ = {};
  const auto code = static_cast<std::uint8_t>(request.load(lead_bits, 6));
  is_valid_ =
      is_valid_ && is_code(code) && (format_.version == CommandSet::v22 || !is_22(static_cast<ModeCommand>(code)));
  // An encoder that does not understand its request drives nothing.
  if (!is_valid_) return;
  request_.code = static_cast<ModeCommand>(code);
  if (has_parameters(request_.code)) {
    request_ = *decode_request(request);
    respond_parameters(request_, at, bits);
  } else {
    respond_position(request_.code, bits);
  }
}

void VirtualEncoder::drive(std::size_t zeros, ModeCommand code, const Reply& reply, AnswerBits& bits) {
  const auto rate = static_cast<std::uint32_t>(1'000'000'000 / period_.count());
  std::size_t low = zeros + delay_clocks(format_.line_delay_ns, rate);
  low = std::min(low, AnswerBits::capacity() - 192);
  for (; low > 0; low -= std::min<std::size_t>(low, 64)) {
    static_cast<void>(bits.append(0, static_cast<unsigned>(std::min<std::size_t>(low, 64))));
  }
  encode_reply(format_, code, reply, bits);
  // A host that does not want the additional information may stop behind the position.
  needed_clocks_ = endat::request_size(code) + bits.size() - reply.info_count * info_bits;
  hosts_take(bits.size());
  count_answer();
}

void VirtualEncoder::respond_position(ModeCommand code, AnswerBits& bits) {
  const auto calculated = static_cast<std::size_t>((times_.latency + period_ - 1ns) / period_);
  const std::size_t zeros = std::max(command_bits + turn_bits, calculated) - command_bits;
  const bool error = (latched_ & (alarm::errors | alarm::error)) != 0;
  position_ = position(latched_at_);
  Reply reply{.position = position_, .f1 = error, .f2 = !error};
  if (code == ModeCommand::test_values) reply.position = 0;
  if (is_22(code)) {
    for (const std::uint8_t mrs : {info2_, info1_}) {
      if (mrs != 0) reply.infos[reply.info_count++] = info(mrs);
    }
  }
  drive(zeros, code, reply, bits);
}

void VirtualEncoder::respond_parameters(const Request& request, Time at, AnswerBits& bits) {
  expect(period_ >= Time(1'000'000'000 / fastest_21), rules::parameter_clock, at);
  Time takes = times_.read_time;
  // A refused access repeats another MRS code or address: the inverted one.
  Reply reply{.byte = request.byte, .word = request.word};
  const auto refuse = [&] { reply.byte = static_cast<std::uint8_t>(~request.byte); };
  const WordPlace word{area_, request.byte};
  switch (request.code) {
    case ModeCommand::select:
      author::has_page(memory_areas, request.byte) ? select(request.byte) : refuse();
      break;
    case ModeCommand::read:
      find_word(word.mrs, word.address) != nullptr ? void(reply.word = load(word)) : refuse();
      break;
    case ModeCommand::write:
      takes = times_.write_time;
      if (!write(word, request.word)) refuse();
      break;
    case ModeCommand::test:
      port_ = request.byte;
      break;
    default:
      break;
  }
  const auto zeros = static_cast<std::size_t>((takes + period_ - 1ns) / period_) + turn_bits;
  drive(zeros, request.code, reply, bits);
  if (request.code == ModeCommand::reset) {
    info1_ = info2_ = 0;
    latched_ = 0;
    is_valid_ = false;
    restart(at + times_.reset_time);
  }
}

void VirtualEncoder::supplemented(BitView bits, Time at) {
  if (!is_valid_ || !has_supplement(request_.code)) return;
  if (!take_supplement(bits, 0, request_)) return;
  now_ = at;
  execute(request_, at);
}

void VirtualEncoder::execute(const Request& request, Time at) {
  const bool is_access = request.code == ModeCommand::read_22 || request.code == ModeCommand::write_22;
  if (is_access && !expect(at >= access_.ready_at, rules::busy, at)) return;
  const WordPlace word{area_, request.byte};
  switch (request.code) {
    case ModeCommand::select_22:
      select(request.byte);
      break;
    case ModeCommand::read_22:
      if (find_word(word.mrs, word.address) != nullptr) {
        access_ = {request.byte, load(word), at + times_.read_time};
      }
      break;
    case ModeCommand::write_22:
      if (write(word, request.word)) access_ = {request.byte, request.word, at + times_.write_time};
      break;
    case ModeCommand::error_reset_22:
      latched_ &= ~(alarm::errors | alarm::error);
      info1_ = info2_ = 0;
      area_ = 0;
      break;
    case ModeCommand::test_22:
      port_ = request.byte;
      break;
    default:
      break;
  }
}

void VirtualEncoder::select(std::uint8_t mrs) {
  if (mrs >= mrs::nothing && mrs < mrs::stop_info_1) info1_ = mrs;
  if (mrs == mrs::stop_info_1) info1_ = 0;
  if (mrs >= mrs::nothing_2 && mrs <= mrs::timestamp && mrs != 0x5A) info2_ = mrs;
  if (mrs == mrs::stop_info_2) info2_ = 0;
  if (author::has_page(memory_areas, mrs)) area_ = mrs;
}

void VirtualEncoder::clocked(Time at, std::size_t clocks) {
  if (is_valid_) expect(clocks >= needed_clocks_, rules::few_clocks, at);
  const bool is_short = is_22(request_.code) && (load(initialisation_word) & recovery_mask) == short_recovery_bits;
  // The recovery time begins at the last rising edge.
  free_at_ = at - period_ / 2 + (is_short ? times_.short_recovery : times_.long_recovery);
}

// ---- Additional information

Info VirtualEncoder::info(std::uint8_t mrs) const {
  return {.warning = (latched_ & (alarm::warnings | alarm::warning)) != 0,
          .referenced = (latched_ & 0x1000) == 0,
          .busy = latched_at_ < access_.ready_at,
          .number = static_cast<std::uint8_t>(mrs & 0x1F),
          .content = content(mrs)};
}

// The layout of contents that no source describes is assumed; README.md lists them.
std::uint16_t VirtualEncoder::content(std::uint8_t mrs) const {
  const auto part = [](std::uint64_t value, unsigned index) { return static_cast<std::uint16_t>(value >> 16 * index); };
  switch (mrs) {
    case mrs::diagnosis:
      return 0x0100 | 100;
    case mrs::position_2:
    case mrs::position_2 + 1:
    case mrs::position_2 + 2:
      return part(position_, mrs - mrs::position_2);
    case mrs::memory_low:
      return static_cast<std::uint16_t>(access_.address << 8 | (access_.word & 0xFF));
    case mrs::memory_high:
      return static_cast<std::uint16_t>(access_.address << 8 | access_.word >> 8);
    case mrs::acknowledge_mrs:
      return static_cast<std::uint16_t>(area_ << 8);
    case mrs::acknowledge_test:
      return static_cast<std::uint16_t>(port_ << 8);
    case mrs::external_temperature:
      return 1117;  // resistance of a KTY sensor at about 30 degC, in ohm
    case mrs::internal_temperature:
      return static_cast<std::uint16_t>(temperature_ * 10 + 2732);
    case mrs::commutation: {
      const unsigned bits = format_.resolution().singleturn_bits;
      return static_cast<std::uint16_t>(bits >= 16 ? position_ >> (bits - 16) : position_ << (16 - bits));
    }
    case mrs::acceleration:
      return static_cast<std::uint16_t>(std::clamp<std::int32_t>(shaft_->at(latched_at_).acceleration, -32768, 32767));
    case mrs::asynchronous:
    case mrs::asynchronous + 1:
    case mrs::asynchronous + 2:
      return part(position_, mrs - mrs::asynchronous);
    case mrs::error_sources:
      return errors();
    case mrs::timestamp:
      return static_cast<std::uint16_t>(latched_at_ / 1us);
    default:
      return 0;
  }
}

}  // namespace absenc::endat
