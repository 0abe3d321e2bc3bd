// SPDX-License-Identifier: Apache-2.0
// Procedures that read and write words of an EnDat encoder's memory.
#include "absenc/protocol/endat/access.hpp"

namespace absenc::endat {

using namespace author;

namespace {

constexpr Outcome no_such_word{Error::invalid_argument,
                               "the memory has no such word: `absenc list endat` shows the areas"};

}  // namespace

Procedure read_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  const auto mrs = static_cast<std::uint8_t>(arguments[0]);
  const auto first = static_cast<std::uint8_t>(arguments[1]);
  const std::int64_t count = arguments[2];
  const MemoryArea* const area = find_word(mrs, first);
  if (area == nullptr || arguments[1] + count > area->first + area->count) {
    co_return no_such_word;
  }
  const SelectedInfos before = co_await begin_access(dialog);
  std::uint8_t selected = 0;
  for (std::int64_t i = 0; i < count; ++i) {
    const WordPlace place{mrs, static_cast<std::uint8_t>(first + i)};
    const std::uint16_t word = co_await read_word(dialog, selected, place, "");
    static_cast<void>(found.words.push_back(static_cast<std::uint8_t>(word)));
    static_cast<void>(found.words.push_back(static_cast<std::uint8_t>(word >> 8)));
    if (i == 0) found.value = word;
  }
  co_await end_access(dialog, before);
  found.area = mrs;
  found.address = first;
  if (count > 1) found.data = found.words.view();
  co_return done;
}

namespace {

// Writes a word and verifies it by reading it back; does nothing if the encoder has the value already.
Part<bool> store(Dialog& dialog, std::uint8_t& selected, WordPlace place, std::uint16_t value) {
  const std::uint16_t before = co_await read_word(dialog, selected, place, "nothing was written");
  if (before == value) co_return false;
  const bool by_22 = dialog.format().version == CommandSet::v22;
  const Request request{
      .code = by_22 ? ModeCommand::write_22 : ModeCommand::write, .byte = place.address, .word = value};
  // If the reply to the write is lost, reading the word back shows whether it was written.
  const Result<Reply> written = co_await dialog.attempt(request).changes();
  // A refusal may be a damaged reply, too, which the checksum misses in one of 32.
  dialog.changes();
  if (by_22) co_await wait_until_ready(dialog, "the word was written, but could not be read back");
  const std::uint16_t now =
      co_await read_word(dialog, selected, place, "the word was written, but could not be read back");
  if (now == value) co_return true;
  if (now == before) dialog.refused();
  if (now == before && written.error() == Error::request_rejected) {
    co_await dialog.stop({Error::request_rejected, "the encoder refuses to write this word: it may be write-protected",
                          "look at the write protection, word 2 of area 0xB9, with `absenc memory read`"});
  }
  co_await dialog.stop({Error::cross_check_failed, "reading back gave another value: the write has failed",
                        "look at what is there with `absenc memory read` before you write it again"});
  co_return false;
}

}  // namespace

Procedure write_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  const WordPlace place{static_cast<std::uint8_t>(arguments[0]), static_cast<std::uint8_t>(arguments[1])};
  const MemoryArea* const area = find_word(place.mrs, static_cast<unsigned>(arguments[1]));
  if (area == nullptr) co_return no_such_word;
  if (!area->writable) {
    co_return {Error::invalid_argument, "this area belongs to the encoder's maker and is write-protected",
               "write to an area of the machine's maker, 0xA9 to 0xAF"};
  }
  found.area = place.mrs;
  found.address = place.address;
  found.value = static_cast<std::uint16_t>(arguments[2]);
  const SelectedInfos before = co_await begin_access(dialog);
  std::uint8_t selected = 0;
  found.written = co_await store(dialog, selected, place, *found.value);
  co_await end_access(dialog, before);
  co_return done;
}

}  // namespace absenc::endat
