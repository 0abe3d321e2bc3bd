// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/endat/access.hpp"

#include <bit>

#include "absenc/protocol/endat/host.hpp"

namespace absenc::endat {

using namespace author;

namespace {

constexpr Outcome no_area{Error::unsupported, "the encoder does not have this memory area",
                          "take another area: encoders of EnDat 2.1 have fewer of them"};

std::uint8_t code_of(const Info* info) { return info == nullptr ? 0 : static_cast<std::uint8_t>(0x40 | info->number); }

// Returns the binary logarithm of a power of two; 0 for every other number.
unsigned bits_of_power(std::uint32_t number) {
  return std::has_single_bit(number) ? static_cast<unsigned>(std::countr_zero(number)) : 0;
}

}  // namespace

// ---- Words of the memory by commands of EnDat 2.1

Part<bool> select(Dialog& dialog, std::uint8_t& selected, std::uint8_t mrs, std::string_view step) {
  if (selected == mrs) co_return true;
  const Result<Reply> reply = co_await dialog.attempt({.code = ModeCommand::select, .byte = mrs});
  if (reply.error() == Error::request_rejected) {
    co_await dialog.stop(no_area);
  }
  if (!reply) co_await dialog.stop({reply.error(), step});
  selected = mrs;
  co_return true;
}

Part<std::uint16_t> read_word_21(Dialog& dialog, std::uint8_t& selected, WordPlace word, std::string_view step) {
  co_await select(dialog, selected, word.mrs, step);
  const Reply reply = co_await dialog.ask({.code = ModeCommand::read, .byte = word.address}).or_say(step);
  co_return reply.word;
}

Part<std::uint16_t> write_word_21(Dialog& dialog, std::uint8_t& selected, WordPlace word, std::uint16_t value,
                                  std::string_view step) {
  co_await select(dialog, selected, word.mrs, "nothing was changed");
  const Request request{.code = ModeCommand::write, .byte = word.address, .word = value};
  // The reply may be lost, and a refusal may be a damaged reply, which the checksum misses in one of 32: the word that
  // is read back shows whether it was written.
  static_cast<void>(co_await dialog.attempt(request).changes());
  dialog.changes();
  co_return co_await read_word_21(dialog, selected, word, step);
}

// ---- Words of the memory by commands of EnDat 2.2

// Two positions in a row must agree, because ones behind the position, as a damaged line gives them, mean none.
Part<SelectedInfos> find_selection(Dialog& dialog) {
  constexpr int most_positions = 20;
  SelectedInfos found;
  for (int positions = 1;; ++positions) {
    const Reply reply = co_await dialog.ask({.code = ModeCommand::position_22, .seeks_infos = true});
    const SelectedInfos now{code_of(reply.info(1)), code_of(reply.info(2))};
    if (positions > 1 && now == found) break;
    if (positions == most_positions) {
      co_await dialog.stop({Error::cross_check_failed, "the additional information changes from position to position",
                            "stop other hosts on this line; check wiring and shielding"});
    }
    found = now;
  }
  Format format = dialog.format();
  format.info1 = found.info1;
  format.info2 = found.info2;
  dialog.set_format(format);
  co_return found;
}

Part<bool> select_22(Dialog& dialog, std::uint8_t mrs, std::string_view step) {
  co_await dialog.ask({.code = ModeCommand::select_22, .byte = mrs}).or_say(step);
  Format format = dialog.format();
  constexpr std::uint8_t stop = 0x0F;
  if (mrs >> 4 == 4) format.info1 = (mrs & 0x0F) == stop ? 0 : mrs;
  if (mrs >> 4 == 5) format.info2 = (mrs & 0x0F) == stop ? 0 : mrs;
  dialog.set_format(format);
  co_return true;
}

Part<bool> restore(Dialog& dialog, SelectedInfos before) {
  constexpr std::string_view step = "it was done, but the additional information from before is not selected again";
  if (dialog.format().info1 != before.info1) {
    co_await select_22(dialog, before.info1 != 0 ? before.info1 : std::uint8_t{mrs::stop_info_1}, step);
  }
  if (dialog.format().info2 != before.info2) {
    co_await select_22(dialog, before.info2 != 0 ? before.info2 : std::uint8_t{mrs::stop_info_2}, step);
  }
  co_return true;
}

Part<Info> wait_until_ready(Dialog& dialog, std::string_view step) {
  const Time limit = dialog.received_at() + memory_access_time;
  for (;;) {
    const Reply reply = co_await dialog.ask({.code = ModeCommand::position_22}).or_say(step);
    const Info* const info = reply.info(1);
    if (info == nullptr) {
      co_await dialog.stop({Error::unexpected_reply, "the encoder sends no additional information",
                            "an encoder of EnDat 2.1 has none: set version=2.1"});
    }
    if (!info->busy) co_return *info;
    if (dialog.received_at() > limit) co_await dialog.stop({Error::busy, step});
  }
}

Part<std::uint16_t> read_info_1(Dialog& dialog, std::uint8_t wanted, std::string_view step) {
  co_await select_22(dialog, wanted, step);
  const Info info = co_await wait_until_ready(dialog, step);
  if (info.number != (wanted & 0x1F)) {
    co_await dialog.stop({Error::request_rejected, "the encoder does not have this additional information",
                          "take an MRS code that its data sheet names"});
  }
  co_return info.content;
}

namespace {

// Selects a memory area and verifies by the acknowledgement that the encoder has it.
Part<bool> select_area_22(Dialog& dialog, std::uint8_t area, std::string_view step) {
  co_await select_22(dialog, area, step);
  const std::uint16_t acknowledged = co_await read_info_1(dialog, mrs::acknowledge_mrs, step);
  if (acknowledged >> 8 != area) co_await dialog.stop(no_area);
  co_return true;
}

Part<std::uint16_t> read_word_22(Dialog& dialog, std::uint8_t address, std::string_view step) {
  co_await dialog.ask({.code = ModeCommand::read_22, .byte = address}).or_say(step);
  const std::uint16_t low = co_await read_info_1(dialog, mrs::memory_low, step);
  const std::uint16_t high = co_await read_info_1(dialog, mrs::memory_high, step);
  if (low >> 8 != address || high >> 8 != address) {
    co_await dialog.stop({Error::request_rejected, "the encoder acknowledged another address",
                          "try again; check that this encoder has the word"});
  }
  co_return static_cast<std::uint16_t>((high & 0xFF) << 8 | (low & 0xFF));
}

}  // namespace

Part<std::uint16_t> read_word(Dialog& dialog, std::uint8_t& selected, WordPlace word, std::string_view step) {
  if (dialog.format().version == CommandSet::v21) co_return co_await read_word_21(dialog, selected, word, step);
  if (selected != word.mrs) co_await select_area_22(dialog, word.mrs, step);
  selected = word.mrs;
  co_return co_await read_word_22(dialog, word.address, step);
}

Part<SelectedInfos> begin_access(Dialog& dialog) {
  if (dialog.format().version == CommandSet::v21) co_return SelectedInfos{};
  co_await know_resolution(dialog);
  co_return co_await find_selection(dialog);
}

Part<bool> end_access(Dialog& dialog, SelectedInfos before) {
  if (dialog.format().version == CommandSet::v21) co_return true;
  co_return co_await restore(dialog, before);
}

// ---- Resolution

Part<bool> know_resolution(Dialog& dialog) {
  if (dialog.format().is_known()) co_return true;
  constexpr std::string_view step = "the encoder's parameters could not be read";
  std::uint8_t selected = 0;
  const std::uint16_t count = co_await read_word_21(dialog, selected, clock_count_word, step);
  const std::uint16_t type = co_await read_word_21(dialog, selected, type_word, step);
  const std::uint16_t revolutions = co_await read_word_21(dialog, selected, revolutions_word, step);
  const std::uint16_t steps_low = co_await read_word_21(dialog, selected, steps_word, step);
  const std::uint16_t steps_high = co_await read_word_21(dialog, selected, steps_high_word, step);
  const std::uint32_t steps = double_word(steps_low, steps_high);
  Format format = dialog.format();
  const unsigned bits = count & 0x3F;
  if ((type & rotary_type) == 0) {
    format.position_bits = static_cast<std::uint8_t>(bits);
    format.unit_um = static_cast<double>(steps) / 1000;
  } else {
    format.multiturn_bits = static_cast<std::uint8_t>(bits_of_power(revolutions));
    format.singleturn_bits = static_cast<std::uint8_t>(bits_of_power(steps));
  }
  if (!format.is_known() || bits > most_bits) {
    co_await dialog.stop({Error::unsupported, "the encoder's measuring steps are no power of two",
                          "set the options singleturn_bits and multiturn_bits, or position_bits and unit_um"});
  }
  if (format.bits() != bits) {
    co_await dialog.stop({Error::cross_check_failed,
                          "the encoder's steps and revolutions do not give the number of bits that it states",
                          "set the options singleturn_bits and multiturn_bits"});
  }
  dialog.set_format(format);
  co_return true;
}

Part<Reading> look(Dialog& dialog, ProcedureResult& found) {
  Reply reply = co_await dialog.ask({.code = position_command(dialog.format())});
  found.reading = drop_unasked(dialog.format(), dialog.request().code, reply);
  found.reading.latched = dialog.begun_at();
  found.reading.received = dialog.received_at();
  static_cast<Values&>(found) = values_of(dialog.format(), dialog.request(), reply);
  co_return found.reading;
}

}  // namespace absenc::endat
